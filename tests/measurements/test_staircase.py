"""Jumps between levels as short as one reading are found, and curves are none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.arrays import Array
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import identify
from ilg_circuit.measurements.jumps import staircase, voltage_jumps
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER

SEEDS = st.integers(0, 10_000)


def binary(seed: int, readings: int, noise: float = 0.0) -> tuple[Array, Array]:
    """A random binary sequence of levels of some readings after rest, and where it jumps."""
    random = np.random.default_rng(seed)
    levels = np.append(np.zeros(10), np.repeat(random.choice([-2.0, 2.0], 60), readings))
    return levels + noise * random.standard_normal(len(levels)), np.flatnonzero(np.diff(levels))


@given(SEEDS, st.integers(1, 5), st.sampled_from([0.0, 1e-3, 0.01]))
def test_jumps_of_a_binary_sequence_are_found(seed: int, readings: int, noise: float) -> None:
    u, jumps = binary(seed, readings, noise)
    assert voltage_jumps(u).tolist() == jumps.tolist()


@given(SEEDS, st.integers(2, 5))
def test_jumps_between_levels_of_any_size_are_found(seed: int, readings: int) -> None:
    random = np.random.default_rng(seed)
    levels = np.repeat(random.uniform(-2.0, 2.0, 40), readings)
    change = np.abs(np.diff(levels))
    found = voltage_jumps(levels)
    assert set(found) <= set(np.flatnonzero(change))
    assert set(found) >= set(np.flatnonzero(change > 0.05))


@pytest.mark.parametrize("digit", [0.001, 0.01])
def test_levels_may_wobble_in_their_last_digit(digit: float) -> None:
    u, jumps = binary(3, 2, digit / 3)
    assert voltage_jumps(np.round(u / digit) * digit).tolist() == jumps.tolist()


@given(st.floats(5.0, 60.0), st.floats(0.0, 1.0), st.integers(0, 200))
def test_a_sine_is_no_staircase(readings: float, phase: float, rest: int) -> None:
    """From five readings a cycle on; four of them may be the levels of a square wave."""
    wave = np.sin(2 * np.pi * (np.arange(200) / readings + phase))
    assert not staircase(np.append(np.zeros(rest), wave))[0][rest:].any()  # it may begin with one


@given(st.floats(5.0, 60.0), st.floats(0.0, 1.0), st.integers(0, 200))
def test_a_triangle_is_no_staircase(readings: float, phase: float, rest: int) -> None:
    wave = 4 * np.abs((np.arange(200) / readings + phase) % 1.0 - 0.5) - 1
    assert not staircase(np.append(np.zeros(rest), wave))[0][rest:].any()  # it may begin with one


@given(SEEDS, st.integers(1, 6), st.integers(0, 200))
def test_noise_that_was_applied_is_no_staircase(seed: int, smooth: int, rest: int) -> None:
    noise = np.convolve(np.random.default_rng(seed).standard_normal(300), np.ones(smooth), "valid")
    assert not staircase(np.append(np.zeros(rest), noise))[0][rest:].any()


def test_without_two_changes_there_is_no_staircase() -> None:
    assert staircase(np.array([1.0]))[0].tolist() == []
    assert staircase(np.array([0.0, 1.0]))[0].tolist() == [False]


def test_intervals_under_levels_of_two_readings_hold_the_truth() -> None:
    """Their jumps were lines from reading to reading: Rd 2 to 3 % off, nine standard errors, and called a success."""
    held, late = 0, (0.1, 0.2, 0.3, 0.4)
    true = {"dc_resistance": 2000 / 3, "dynamic_resistance": 19.43635, "capacitance": 0.35}
    for seed, begin in enumerate(late):
        random = np.random.default_rng(seed)
        levels = random.choice([-2.0, 2.0], 100)
        drive = PiecewiseLinear(np.repeat(np.arange(101.0), 2)[1:-1], np.repeat(levels, 2))
        after = np.arange(begin, 100.0, 0.5)
        run = simulate(PAPER, drive, after, engine="exact", beam="static")
        noise = 1e-3 * np.abs(run.current).max() * random.standard_normal(20 + len(after))
        columns = {
            "time": 0.5 * np.arange(20 + len(after)),
            "voltage": np.append(np.zeros(20), run.voltage),
            "current": np.append(np.zeros(20), run.current) + noise,
        }
        record = prepare(Table(columns, "record.csv"))
        assert len(record.voltage.widths) == 1 + np.count_nonzero(np.diff(levels))
        found = identify(record, model="rc", engine="exact")
        for name, value in true.items():
            low, high = found.parameters[name].reported[1]
            held += low <= value <= high
    assert held >= 10  # of 12
