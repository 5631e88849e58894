"""Computes the misfit of a load test: residuals relative to the span of its stress, in windows of stretch."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..fit.misfit import FAIL, FAIL_WINDOW, WARN, Misfit
from ..measurements.load_test import LoadTest

#: Number of windows of the stretch, evenly spaced in its logarithm.
_WINDOWS = 6
#: Least number of readings from which their noise can be estimated, by second differences along the path.
_FEWEST = 8


def stress_misfit(test: LoadTest, residuals: Array) -> Misfit:
    """Return the misfit of one test from its ``residuals`` (n,) [Pa]; the ends of the worst window are stretches.

    Shares are root mean squares relative to the span of the stress, from zero. The limit for a warning applies to the
    misfit beyond the noise, the limit for failure to all residuals.
    """
    span = max(float(test.stress.max()), 0.0) - min(float(test.stress.min()), 0.0)
    share = float(np.sqrt(np.mean(residuals**2))) / span
    low, high = test.extent
    edges = np.geomspace(low, high, _WINDOWS + 1)
    which = np.clip(np.searchsorted(edges, test.stretch, side="right") - 1, 0, _WINDOWS - 1)
    each = {k: float(np.sqrt(np.mean(residuals[which == k] ** 2))) / span for k in np.unique(which).tolist()}
    k = max(each, key=lambda key: each[key])
    beyond = float(np.sqrt(max(share**2 - (_noise(residuals) / span) ** 2, 0.0)))
    return Misfit(
        share, each[k], float(edges[k]), float(edges[k + 1]),
        warn=beyond > WARN, fail=share > FAIL or each[k] > FAIL_WINDOW,
    )  # fmt: skip


def _noise(residuals: Array) -> float:
    """Return the standard deviation of white noise in ``residuals`` along the path; 0 if there are too few."""
    if len(residuals) < _FEWEST:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(residuals, 2) ** 2) / 6))
