"""How far a parameter may go with all others refitted, against the closed form of a linear model."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import f as fisher

import ilg_circuit.fit.problem as problem_module
from ilg_circuit.fit.fitting import fit
from ilg_circuit.fit.limits import limits
from ilg_circuit.fit.minimise import gauss_newton
from ilg_circuit.fit.observation import observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem

Array = NDArray[np.float64]
T = np.linspace(0.1, 4.0, 40)
BASIS = np.stack([np.ones_like(T), T])


def linear(noise: float) -> Problem:
    def predict(values: Array) -> Array:
        return np.asarray(values @ BASIS)

    data = np.array([2.0, 3.0]) @ BASIS + noise * np.random.default_rng(5).standard_normal(len(T))
    return Problem((observation(predict, data, ["a", "b"]),), (Parameter("a"), Parameter("b")))


@pytest.mark.parametrize("widening", [1.0, 1.7])
@pytest.mark.parametrize("k", [0, 1])
def test_limits_of_a_linear_model_are_those_of_the_f_test(k: int, widening: float) -> None:
    found = fit(linear(0.2), np.array([2.0, 3.0]))
    freedom = len(T) - 2
    variance = found.sum_of_squares / freedom * np.linalg.inv(BASIS @ BASIS.T)[k, k]
    reach = widening * np.sqrt(fisher.ppf(0.95, 1, freedom) * variance)
    ends = limits(found, k, widening)
    assert ends.low == pytest.approx(found.values[k] - reach, abs=0.01 * reach)
    assert ends.high == pytest.approx(found.values[k] + reach, abs=0.01 * reach)


def test_what_the_data_do_not_bound_has_no_upper_limit() -> None:
    """Of exp(-t/b) with b far longer than the record only the least b is known."""

    def predict(values: Array) -> Array:
        return np.asarray(np.exp(-T / values[:, :1]))

    data = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(len(T))
    found = fit(Problem((observation(predict, data, ["b"]),), (Parameter("b"),)), np.array([300.0]))
    ends = limits(found, 0)
    assert ends.low > 100.0
    assert np.isinf(ends.high)


def test_derivatives_one_parameter_at_a_time_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, x = linear(0.1), np.array([0.3, 0.7])
    prediction, slopes = problem.derivatives(x)
    monkeypatch.setattr(problem_module, "_LARGE", 0)
    one_by_one = problem.derivatives(x)
    assert one_by_one[0] == pytest.approx(prediction, rel=1e-14)
    assert one_by_one[1] == pytest.approx(slopes, rel=1e-12)


def test_a_small_step_has_an_offset_of_its_own() -> None:
    """The relative offset is the projected residual over the rest, whatever the residuals' unit."""
    residuals = np.array([1.0, -2.0, 1.5, 0.5])
    jacobian = np.array([[1.0], [1.0], [1.0], [1.0]])
    for unit in (1.0, 1e-3):
        step, offset, condition = gauss_newton(jacobian, unit * residuals)
        mean = residuals.mean()
        spread = np.sqrt(((residuals - mean) ** 2).sum() / 3)
        assert step == pytest.approx([-unit * mean])
        assert offset == pytest.approx(2 * mean / spread)
        assert condition == 1.0
