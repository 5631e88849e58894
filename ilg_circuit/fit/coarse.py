"""Computes what a coarse resolution adds to the errors of a fit.

An instrument that rounds to steps larger than the noise reads one value while the quantity moves within a step: its
error is common to all readings of such a run. It lies within half a step, so that its standard deviation is at most
step/sqrt(12) if every error is as likely as any other; the residuals do not show it, since the fit follows it.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .result import FitResult

#: Least ratio of the step between readings to the residuals for which readings repeat: with more noise than half a step
#: errors of neighbours are independent.
_STEPS = 2.0
#: Most steps that are visible, as a part of the number of readings.
_FEW = 0.25


def coarse_step(data: Array, rms: float) -> float:
    """Return the step of readings ``data`` (m,) if it is coarse beside residuals of ``rms``, both in one unit, or 0."""
    steps = np.diff(np.unique(data))
    coarse = len(steps) and float(steps.min()) > _STEPS * rms and len(steps) < _FEW * len(data)
    return float(steps.min()) if coarse else 0.0


def steps_of(fit: FitResult) -> Array:
    """Return the `coarse_step` of each observation's readings (observations,) in its unit, 0 where few repeat."""
    found = np.zeros(len(fit.problem.observations))
    for k, (observation, part) in enumerate(zip(fit.problem.observations, fit.problem.slices, strict=True)):
        if np.count_nonzero(np.diff(observation.data)) < len(observation.data) / 2:  # most repeat the one before
            residuals = fit.residuals[part] * observation.sigma
            found[k] = coarse_step(observation.data, float(np.sqrt(np.mean(residuals**2))))
    return found


def rounding_covariance(fit: FitResult) -> Array:
    """Return the covariance (n, n) of the values by the rounding of readings; zero where no resolution is coarse.

    Neighbours of the same reading err alike, others independently.
    """
    n = len(fit.values)
    covariance = np.zeros((n, n))
    steps = steps_of(fit)
    if not steps.any():
        return covariance
    projection = fit.projection
    for observation, part, step in zip(fit.problem.observations, fit.problem.slices, steps, strict=True):
        if step:
            begins = np.flatnonzero(np.append(True, np.diff(observation.data) != 0))
            moved = np.add.reduceat(projection[:, part] / observation.sigma, begins, axis=1)
            covariance += step**2 / 12 * (moved @ moved.T)
    return covariance
