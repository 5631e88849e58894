"""A fit counts as one only where it stands at a minimum that the data determine; everything else is an error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.errors import SolveError
from ilg_circuit.fit import fitting
from ilg_circuit.fit.fitting import fit, fit_data, fit_near
from ilg_circuit.fit.observation import observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 200)


def decay(values: Array) -> Array:
    return values[:, :1] * np.exp(-values[:, 1:2] * T)


def noisy(wave: Array, size: float = 0.02, seed: int = 0) -> Array:
    return wave + size * np.random.default_rng(seed).standard_normal(len(T))


DATA = noisy(decay(np.array([[2.0, 0.7]]))[0])


def fitted(model: Callable[[Array], Array], start: list[float], data: Array = DATA) -> FitResult:
    return fit_data(model, data, ("first", "second")[: len(start)], np.array(start))


def test_a_fit_that_stands_at_its_minimum_says_how_well() -> None:
    found = fitted(decay, [1.0, 2.0])
    assert found.offset < 1e-3
    assert (np.abs(found.values - [2.0, 0.7]) < 4 * found.errors).all()


def test_data_without_noise_are_no_failure() -> None:
    found = fitted(decay, [1.0, 2.0], decay(np.array([[2.0, 0.7]]))[0])
    assert found.values == pytest.approx([2.0, 0.7], rel=1e-8)


def test_a_fit_cut_short_is_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fitting, "MOST_EVALUATIONS", 4)
    with pytest.raises(SolveError, match="did not converge"):
        fitted(decay, [0.1, 8.0])


def test_an_end_that_is_no_minimum_is_no_success() -> None:
    """Slopes that mislead: lmfit stops where no step helps, and calls it a success."""

    def kinked(values: Array) -> Array:
        wave = decay(values)
        # beyond a wall the misfit jumps up, so that the fit gets stuck at it, on a slope
        return np.asarray(np.where(values[:, 1:2] < 1.5, wave + 10.0, wave))

    with pytest.raises(SolveError, match="did not converge"):
        fitted(kinked, [2.0, 3.0])


def test_a_fit_that_ends_for_want_of_solutions_says_why() -> None:
    def walled(values: Array) -> Array:
        if (values[:, 1] < 1.5).any():
            raise SolveError("no solution below 1.5")
        return decay(values)

    with pytest.raises(SolveError, match=r"\d+ of \d+ evaluations could not be solved: no solution below 1.5"):
        fitted(walled, [2.0, 3.0])


def test_a_parameter_that_runs_away_is_named() -> None:
    with pytest.raises(SolveError, match=r"diverged.*\(second\)"):
        fitted(lambda v: v[:, :1] * np.exp(-T) + 1 / v[:, 1:2], [1.0, 1.0], noisy(2 * np.exp(-T) - 0.5, 1e-2))


def test_a_parameter_that_is_not_felt_is_named() -> None:
    with pytest.raises(SolveError, match="second has no effect"):
        fitted(lambda v: v[:, :1] * np.exp(-T), [1.0, 1.0])


def test_two_parameters_that_act_alike_are_named() -> None:
    with pytest.raises(SolveError, match=r"first and second have the same effect|diverged.*\(first, second\)"):
        fitted(lambda v: v[:, :1] * v[:, 1:2] * np.exp(-0.7 * T), [1.0, 1.0])


def test_a_limited_parameter_stays_below_and_its_interval_too() -> None:
    found = fit_data(
        lambda v: v[:, :1] * np.ones_like(T),
        noisy(0.97 * np.ones_like(T), 0.2),
        ("share",),
        np.array([0.5]),
        upper=np.ones(1),
    )
    low, high = found.intervals[0]
    assert 0 < low < found.values[0] < high < 1


def test_a_limited_parameter_whose_best_is_its_limit_is_no_success() -> None:
    with pytest.raises(SolveError):
        fit_data(
            lambda v: v[:, :1] * np.ones_like(T),
            noisy(1.2 * np.ones_like(T), 0.01),
            ("share",),
            np.array([0.5]),
            upper=np.ones(1),
        )


def test_intervals_are_student_s_about_the_logarithm() -> None:
    from scipy.stats import t as student

    found = fitted(decay, [1.0, 2.0])
    half = student.ppf(0.975, len(T) - 2) * found.errors / found.values
    assert np.log(found.intervals[:, 1] / found.values) == pytest.approx(half)
    assert np.log(found.values / found.intervals[:, 0]) == pytest.approx(half)


def test_a_fit_near_its_minimum_is_not_drawn_to_a_maximum() -> None:
    """Sine of 2 rad/s, begun at 1.68: accelerated steps led to the maximum at 1.534, whose offset is zero too."""
    t = np.linspace(0.0, 10.0, 200)
    data = np.sin(2 * t) + 0.3 * np.random.default_rng(0).standard_normal(200)
    one = observation(lambda values: np.sin(values[:, :1] * t), data, ["rate"])
    problem = Problem((one,), (Parameter("rate"),))
    found = fit_near(problem, np.array([1.68]))
    assert found.values[0] == pytest.approx(2.0, abs=4 * found.errors[0])


def test_steps_near_a_minimum_are_accelerated_where_residuals_are_large() -> None:
    """A decay fitted to two: each step leaves a part of the distance to go, and eight left 1e-3 of a standard error."""
    data = decay(np.array([[2.0, 0.7]]))[0] + 1.5 * np.exp(-6 * T)
    problem = Problem((observation(decay, data, ["first", "second"]),), (Parameter("first"), Parameter("second")))
    near, whole = fit_near(problem, np.array([2.6, 1.0])), fit(problem, np.array([2.6, 1.0]))
    assert near.offset < 1e-6
    assert near.evaluations <= 12
    assert near.values == pytest.approx(whole.values, abs=0.01 * whole.errors.min())


def test_steps_end_at_the_offset_that_is_asked_for() -> None:
    data = decay(np.array([[2.0, 0.7]]))[0] + 0.1 * np.random.default_rng(1).standard_normal(len(T))
    problem = Problem((observation(decay, data, ["first", "second"]),), (Parameter("first"), Parameter("second")))
    start = np.array([2.6, 1.0])
    rough, fine = fit_near(problem, start, offset=1e-2), fit_near(problem, start)
    assert rough.evaluations < fine.evaluations
    assert 1e-6 < rough.offset < 1e-2
    assert np.abs(rough.values - fine.values).max() < 0.03 * fine.errors.min()
