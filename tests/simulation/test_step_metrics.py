"""Figures of step answers: against closed forms, under changes of unit and sign, and where they are not defined."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ilg_circuit.errors import InputError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.step_metrics import StepMetrics, step_metrics
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]
TIMES = np.linspace(0.0, 300.0, 601)


def second_order(t: Array, zeta: float, wn: float = 1.0) -> Array:
    """Unit step answer of a second-order low-pass, zeta < 1."""
    wd = wn * np.sqrt(1 - zeta**2)
    return 1 - np.exp(-zeta * wn * t) * (np.cos(wd * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * t))


def values(found: StepMetrics) -> dict[str, Array]:
    return vars(found)


def test_the_papers_strip_at_4_volts() -> None:
    k = PAPER.coupling
    assert k is not None
    ratio = lumped_elements(PAPER).bending_ratio
    y = 4 * formulas.displacement_step(TIMES, k.gain, k.zero, k.damping_ratio, k.natural_frequency, ratio)
    found = step_metrics(TIMES, y)
    assert found.peak == pytest.approx(4.339e-3, abs=5e-7)
    assert found.peak_time == pytest.approx(48.1, abs=0.05)
    assert found.final == pytest.approx(3.9805e-3, abs=1e-7)
    assert found.overshoot == pytest.approx(4.339 / 3.9805 - 1, abs=2e-4)
    assert found.back_relaxation == pytest.approx((4.339 - 3.9805) * 1e-3, abs=1e-6)


@pytest.mark.parametrize("zeta", [0.2, 0.5, 0.7])
def test_overshoot_of_a_second_order_answer(zeta: float) -> None:
    t = np.linspace(0, 60, 3001)
    found = step_metrics(t, second_order(t, zeta))
    assert found.overshoot == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-4)
    assert found.peak_time == pytest.approx(np.pi / np.sqrt(1 - zeta**2), rel=1e-4)


def test_an_exponential_settles_after_four_time_constants_and_has_no_peak() -> None:
    t = np.linspace(0, 20, 2001)
    y = 1 - np.exp(-t)
    found = step_metrics(t, y)
    assert found.settling_time == pytest.approx(-np.log(0.02), abs=1e-3)
    assert np.isnan(found.peak_time)
    assert found.overshoot == 0
    assert found.back_relaxation == 0
    assert found.peak == found.final == y[-1]
    assert found.rms == pytest.approx(np.sqrt((20 - 2 + 0.5) / 20), rel=1e-4)


@pytest.mark.parametrize("y", [TIMES, 1 - np.exp(-TIMES / 100)])
def test_a_record_that_ends_on_the_way_has_not_settled(y: Array) -> None:
    assert np.isnan(step_metrics(TIMES, y, tail=0.05).settling_time)
    assert np.isnan(step_metrics(TIMES, y, tail=0.05).peak_time)


def test_what_relaxes_through_zero_has_no_overshoot_but_a_fall() -> None:
    y = np.exp(-TIMES / 50) - np.exp(-TIMES / 5) - 0.1 * (1 - np.exp(-TIMES / 50))
    found = step_metrics(TIMES, y)
    assert np.isnan(found.overshoot)
    assert found.back_relaxation == pytest.approx(found.peak - y[-1])


def test_a_bump_below_the_resolution_is_no_peak() -> None:
    y = 1 - np.exp(-TIMES / 10) + 1e-3 * np.exp(-(((TIMES - 100) / 10) ** 2))
    assert np.isfinite(step_metrics(TIMES, y).peak_time)
    assert np.isnan(step_metrics(TIMES, y, resolution=2e-3).peak_time)
    assert step_metrics(TIMES, y, resolution=2e-3).overshoot == 0


def test_many_curves_at_once_are_each_as_alone() -> None:
    curves = np.array([second_order(TIMES / 10, 0.3), -2 * second_order(TIMES / 10, 0.6), np.zeros_like(TIMES), TIMES])
    together = step_metrics(TIMES, curves, tail=0.05)
    for k, y in enumerate(curves):
        alone = step_metrics(TIMES, y, tail=0.05)
        for name, value in values(alone).items():
            assert values(together)[name][k] == pytest.approx(value, nan_ok=True, rel=1e-14), name
    assert np.isnan(together.settling_time[2])


def test_unknown_curves_stay_unknown() -> None:
    assert all(np.isnan(x) for x in values(step_metrics(TIMES, np.full_like(TIMES, np.nan))).values())


@given(
    zeta=st.floats(0.1, 0.9), wn=st.floats(0.05, 0.5), factor=st.floats(1e-6, 1e6), sign=st.sampled_from([-1.0, 1.0])
)
def test_figures_follow_the_unit_and_the_sign(zeta: float, wn: float, factor: float, sign: float) -> None:
    y = second_order(TIMES, zeta, wn)
    plain, changed = step_metrics(TIMES, y), step_metrics(TIMES, sign * factor * y)
    for name in ("final", "peak"):
        assert values(changed)[name] == pytest.approx(sign * factor * values(plain)[name], rel=1e-9)
    for name in ("back_relaxation", "rms"):
        assert values(changed)[name] == pytest.approx(factor * values(plain)[name], rel=1e-6)
    for name in ("overshoot", "settling_time", "peak_time"):
        assert values(changed)[name] == pytest.approx(values(plain)[name], rel=1e-6, nan_ok=True)


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=40))
def test_the_peak_is_near_the_largest_sample_and_the_last_sample_is_final(samples: list[float]) -> None:
    y = np.array(samples)
    found = step_metrics(np.arange(len(y)), y)
    assert found.final == y[-1]
    assert abs(found.peak) >= np.abs(y).max() * (1 - 1e-12)
    assert found.back_relaxation >= 0


@pytest.mark.parametrize(
    ("t", "y"), [([0, 1], [0, 1]), ([0, 1, 1], [0, 1, 2]), ([0, 1, 2], [0, 1]), ([[0, 1, 2]], [[0, 1, 2]])]
)
def test_what_is_no_curve_is_refused(t: list[float], y: list[float]) -> None:
    with pytest.raises(InputError):
        step_metrics(t, y)
