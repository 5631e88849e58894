"""Computes what a coarse resolution adds to the errors of a fit.

An instrument that rounds to steps larger than the noise reads one value while the quantity moves within a step: its
error is common to all readings of such a run. It lies within half a step, so that its standard deviation is at most
step/sqrt(12) if every error is as likely as any other; the residuals do not show it, since the fit follows it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .result import FitResult

#: Least ratio of the step between readings to the residuals for which readings repeat: with more noise than half a step
#: errors of neighbours are independent.
_STEPS = 2.0
#: Most steps that are visible, as a part of the number of readings.
_FEW = 0.25
#: Difference of readings, in units of their last digit, below which they are the same.
_SAME = 0.5


def coarse_step(data: Array, rms: float) -> float:
    """Return the step of readings ``data`` (m,) if it is coarse beside residuals of ``rms``, both in one unit, or 0."""
    steps = np.diff(np.unique(data))
    coarse = len(steps) and float(steps.min()) > _STEPS * rms and len(steps) < _FEW * len(data)
    return float(steps.min()) if coarse else 0.0


def steps_of(fit: FitResult) -> Array:
    """Return the coarse step of each observation's readings (observations,) in its unit, 0 where few repeat.

    It is the largest of readings in a row that are the same, where their last digits are known, else the `coarse_step`.
    """
    return np.array([coarse_runs(fit, k)[0].max(initial=0.0) for k in range(len(fit.problem.slices))])


def rounding_covariance(fit: FitResult) -> Array:
    """Return the covariance (n, n) of the values by the rounding of readings; zero where no resolution is coarse.

    Neighbours of the same reading err alike, others independently.
    """
    n = len(fit.values)
    covariance = np.zeros((n, n))
    runs = [coarse_runs(fit, k) for k in range(len(fit.problem.slices))]
    if not any(steps.any() for steps, _ in runs):
        return covariance
    projection = fit.projection
    for observation, part, (steps, begins) in zip(fit.problem.observations, fit.problem.slices, runs, strict=True):
        if steps.any():
            moved = np.add.reduceat(projection[:, part] * (steps / observation.sigma), begins, axis=1)
            covariance += moved @ moved.T / 12
    return covariance


def coarse_runs(fit: FitResult, k: int) -> tuple[Array, NDArray[np.intp]]:
    """Return the coarse step (m,) of the readings of observation ``k``, 0 where none is, and where runs of one begin.

    Steps are in the unit of the observation.
    """
    observation, residuals = fit.problem.observations[k], fit.residuals_of(k)
    rms = float(np.sqrt(np.mean(residuals**2)))
    if observation.digits is None:
        changes = np.diff(observation.data) != 0
        repeat = np.count_nonzero(changes) < len(residuals) / 2  # most repeat the one before
        steps = np.full(len(residuals), coarse_step(observation.data, rms) if repeat else 0.0)
        return steps, np.flatnonzero(np.append(True, changes))
    known = observation.digits > 0
    codes = np.divide(observation.data, observation.digits, out=np.zeros(len(known)), where=known)
    changes = np.abs(np.diff(codes)) > _SAME
    changes[len(codes) // observation.channels - 1 :: len(codes) // observation.channels] = True
    begins = np.flatnonzero(np.append(True, changes))
    length = np.diff(np.append(begins, len(codes)))
    # a reading that differs from its neighbours errs by itself, as its residual does
    repeats = np.repeat(length, length) > 1
    return np.where(repeats & (observation.digits > _STEPS * rms), observation.digits, 0.0), begins
