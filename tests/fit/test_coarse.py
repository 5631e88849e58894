"""Coarse readings: what rounding adds to the errors, from sets whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.fit.coarse import coarse_runs, coarse_step, rounding_covariance, steps_of
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.intervals import uncertainties
from ilg_circuit.fit.reported import reported_errors, widened
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(0.0, 40.0, 401)
STEP = 0.01


def decay(sets: Array) -> Array:
    """A level that a decay approaches, as the current after a step of the voltage."""
    return sets[:, :1] + sets[:, 1:2] * np.exp(-T / sets[:, 2:3])


def fitted(truth: Array, noise: float, seed: int, step: float = STEP) -> FitResult:
    clean = decay(truth[None])[0] + noise * np.random.default_rng(seed).standard_normal(len(T))
    return fit_data(decay, step * np.round(clean / step), ("level", "height", "time"), truth)


def drawn(seed: int) -> Array:
    """Levels anywhere within two steps of the instrument."""
    random = np.random.default_rng([7, seed])
    return np.array([random.uniform(1.0, 3.0) * STEP, 0.2, random.uniform(3.0, 5.0)])


def test_intervals_of_coarse_readings_hold_the_truth() -> None:
    """Without rounding a fit takes the level that is read for exact: it misses the true one in most of 60 sets."""
    held, plain, widths = np.zeros(3), np.zeros(3), []
    for seed in range(60):
        truth = drawn(seed)
        found = fitted(truth, 0.05 * STEP, seed)
        assert widened(found)
        every = uncertainties(found).estimates
        ends = np.array([every[label].interval for label in found.labels])
        held += (ends[:, 0] <= truth) & (truth <= ends[:, 1])
        plain += np.abs(found.values - truth) <= 1.96 * found.errors
        widths.append(ends[0, 1] - ends[0, 0])
    assert plain[0] < 30
    assert (held >= 54).all(), (
        held
    )  # 95 % of 60 is 57; fewer than 54 have a chance of 4 %, and these are no normal errors
    # no wider than a step that is as likely anywhere, and its part of the readings before
    assert np.median(widths) < 1.5 * 3.92 * STEP / np.sqrt(12)


def test_a_mean_of_readings_that_are_all_alike_is_uncertain_by_a_step() -> None:
    readings = np.where(np.arange(100) < 99, 3.0, 4.0)
    found = fit_data(lambda x: np.repeat(x, 100, axis=1), readings, ("level",), np.array([3.0]))
    assert steps_of(found).tolist() == [1.0]
    # 99 of 100 readings err alike, one by itself
    assert rounding_covariance(found)[0, 0] == pytest.approx((0.99**2 + 0.01**2) / 12)
    assert reported_errors(found)[0] == pytest.approx(np.sqrt(1 / 12), rel=0.05)


@pytest.mark.parametrize("noise", [0.7 * STEP, 3 * STEP])
def test_noise_larger_than_half_a_step_hides_it(noise: float) -> None:
    found = fitted(drawn(1), noise, 1)
    assert not steps_of(found).any()
    assert not rounding_covariance(found).any()


def test_fine_readings_have_no_coarse_step() -> None:
    found = fitted(drawn(2), 0.05 * STEP, 2, step=1e-6)
    assert not steps_of(found).any()
    assert coarse_step(np.array([1.0, 2.0]), 0.0) == 0.0  # two readings show no resolution
    assert coarse_step(np.repeat([1.0, 2.0, 4.0], 10), 0.1) == 1.0
    assert coarse_step(np.repeat([1.0, 2.0, 4.0], 10), 0.6) == 0.0


@pytest.mark.parametrize(("codes", "coarse"), [([4, 4, 5, 6, 6, 6], [1, 1, 0, 1, 1, 1]), ([4, 5, 4, 5, 4, 5], [0] * 6)])
def test_readings_of_known_digits_are_coarse_where_one_repeats_its_neighbour(
    codes: list[int], coarse: list[int]
) -> None:
    """One digit apart are two readings; a pair alike errs alike."""
    found = fit_data(lambda x: np.repeat(x, 6, axis=1), STEP * np.array(codes, dtype=float), ("level",), np.ones(1))
    (readings,) = found.problem.observations
    told = replace(readings, digits=np.full(6, 10 * STEP), data=10 * readings.data)
    known = replace(found, problem=replace(found.problem, observations=(told,)))
    steps, begins = coarse_runs(known, 0)
    assert (steps > 0).astype(int).tolist() == coarse
    assert begins.tolist() == np.flatnonzero(np.diff(codes, prepend=0)).tolist()
