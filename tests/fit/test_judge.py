"""The engine of record as judge: what it confirms stays, what it moves is fitted again, and how far it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.fit.fitting import fit, with_starts
from ilg_circuit.fit.judge import MOST, judged
from ilg_circuit.fit.multistart import StartSummary
from ilg_circuit.fit.observation import Predict, observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem

Array = NDArray[np.float64]

X = np.linspace(0.0, 4.0, 60)
NOISE = 0.01


def decay(values: Array) -> Array:
    return values[:, :1] * np.exp(-values[:, 1:] * X)


def lines(values: Array) -> Array:
    return values @ np.array([X, X**2])


def problem(predict: Predict, data: Array, lower: float = 0.0, nuisance: Array | None = None) -> Problem:
    upper = Parameter("a", lower=lower), Parameter("b", lower=lower)
    return Problem((observation(predict, data, ("a", "b"), nuisance=nuisance),), upper)


def decaying(noise: float = NOISE) -> Array:
    return decay(np.array([[2.0, 0.8]]))[0] + noise * np.random.default_rng(1).standard_normal(len(X))


def test_the_same_prediction_confirms_and_is_asked_once() -> None:
    asked: list[int] = []

    def record(values: Array) -> Array:
        asked.append(len(values))
        return decay(values)

    cheap = problem(decay, decaying())
    found = fit(cheap, np.array([1.0, 1.0]))
    kept, judgement = judged(found, replace(cheap, observations=problem(record, decaying()).observations))
    assert kept is found
    assert not judgement.refitted
    assert judgement.move < 1e-4
    assert asked == [1]


@given(share=st.floats(-3.0, 3.0), along=st.floats(0.0, 2 * np.pi))
def test_the_move_of_a_linear_model_is_how_far_the_answers_lie_apart(share: float, along: float) -> None:
    """The record's prediction differs by what a known change of the parameters makes."""
    data = lines(np.array([[1.0, -0.5]]))[0] + NOISE * np.random.default_rng(2).standard_normal(len(X))
    ones = np.ones((len(X), 1))
    found = fit(problem(lines, data, -np.inf, ones), np.array([0.5, 0.1]))
    shift = share * MOST * found.errors * np.array([np.cos(along), np.sin(along)])
    # a constant besides is the nuisance's affair
    other = problem(lambda v: lines(v + shift) + 5.0, data, -np.inf, ones)
    kept, judgement = judged(found, other)
    apart = float(np.abs(shift / found.errors).max())
    assert judgement.move == pytest.approx(apart, rel=1e-6, abs=1e-9)
    assert judgement.refitted == bool(((np.abs(shift) > MOST * found.errors) & (np.abs(shift) > 1e-6)).any())
    if judgement.refitted:
        assert kept.values == pytest.approx(found.values - shift, abs=1e-6 * float(found.errors.min()))


def test_a_refit_is_the_record_s_answer_with_the_cheap_predictions_and_starts() -> None:
    cheap = problem(decay, decaying())
    found = with_starts(fit(cheap, np.array([1.0, 1.0])), StartSummary(7, 5))
    record = problem(lambda v: 1.01 * decay(v), decaying())
    kept, judgement = judged(found, record)
    assert judgement.refitted
    assert judgement.move > MOST
    assert kept.values == pytest.approx(fit(record, np.array([1.0, 1.0])).values, rel=1e-6)
    assert kept.starts == StartSummary(7, 5)
    assert kept.problem is cheap


def test_without_noise_a_millionth_is_no_move() -> None:
    cheap = problem(decay, decaying(0.0))
    found = fit(cheap, np.array([1.0, 1.0]))
    assert not judged(found, problem(lambda v: (1 + 1e-7) * decay(v), decaying(0.0)))[1].refitted
    kept, judgement = judged(found, problem(lambda v: (1 + 1e-4) * decay(v), decaying(0.0)))
    assert judgement.refitted
    assert kept.values[0] == pytest.approx(2.0 / (1 + 1e-4), rel=1e-9)


def test_observations_that_share_nothing_are_judged_together() -> None:
    a, b = decaying(), decaying() * 1.5

    def both(second: float) -> Problem:
        first = observation(decay, a, ("a", "b"))
        other = observation(lambda v: second * decay(v), b, ("c", "d"))
        return Problem((first, other), tuple(Parameter(name) for name in "abcd"))

    found = fit(both(1.0), np.ones(4))
    kept, judgement = judged(found, both(1.02))
    assert judgement.refitted
    assert len(kept.parts) == 2
    assert kept.values[:2] == pytest.approx(found.values[:2], rel=1e-6)
    assert kept.values[2] == pytest.approx(found.values[2] / 1.02, rel=1e-6)


def test_another_problem_is_refused() -> None:
    found = fit(problem(decay, decaying()), np.array([1.0, 1.0]))
    with pytest.raises(InputError, match="same parameters and data"):
        judged(found, problem(decay, decaying(2 * NOISE)))


def test_a_record_that_cannot_be_predicted_is_an_error() -> None:
    def fails(values: Array) -> Array:
        raise SolveError("no convergence")

    found = fit(problem(decay, decaying()), np.array([1.0, 1.0]))
    with pytest.raises(SolveError, match="no convergence"):
        judged(found, problem(fails, decaying()))
