"""Passive ports under a measured voltage: the relaxations are those of their equations, in little memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from ilg_circuit.measurements.passive import PassivePort, relaxed

TIME = np.cumsum(np.random.default_rng(4).uniform(0.5, 1.5, 40_000)) * 0.01
VOLTAGE = np.where(TIME > 20.0, 2.0, 0.0) + 0.3 * np.sin(0.05 * TIME)
#: Of 500 ohm beside 50 ohm and 0.1 F in series.
CURRENT = VOLTAGE / 500 + relaxed(TIME, VOLTAGE, np.array([0.2]), np.zeros(1))[0] / 50


def test_high_passes_are_those_of_the_recursion_from_reading_to_reading() -> None:
    t, u, rates, value = TIME[:200], VOLTAGE[1900:2100], np.array([0.3, 40.0]), np.array([0.5, -0.2])
    found = relaxed(t, u, rates, value)
    for k in range(1, len(t)):
        x = rates * (t[k] - t[k - 1])
        value = value * np.exp(-x) + (u[k] - u[k - 1]) * (1 - np.exp(-x)) / x
        assert np.allclose(found[:, k], value, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("count", [10_000, 40_000])
def test_a_port_is_fitted_to_a_short_and_to_a_long_record(count: int) -> None:
    t, u, i = TIME[-count:], VOLTAGE[-count:], CURRENT[-count:]
    port = PassivePort(t, u, "rest" if count == len(TIME) else "run", offset=True)
    assert port.fit(i + 1e-3, np.ones(count, dtype=bool)).rms < 5e-3 * float(np.abs(i).max())


def test_a_long_record_is_fitted_in_less_memory_than_a_table_of_all_responses() -> None:
    tracemalloc.start()
    try:
        port = PassivePort(np.tile(TIME, 4) + np.repeat([0, 500, 1000, 1500], len(TIME)), np.tile(VOLTAGE, 4))
        port.fit(np.tile(CURRENT, 4), np.ones(4 * len(TIME), dtype=bool))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 0.8 * 30 * 8 * 4 * len(TIME)
