"""Uncertainty where neighbouring residuals are alike: the circular block bootstrap, to first order.

Blocks of residuals are drawn with replacement and put in place of the residuals; what they do to the parameters is
their projection on the model's slopes at the fit, by the coordinates (logarithms), so that no draw needs a fit of its
own. Blocks keep the correlation that independent draws, and the covariance s^2 (J^T J)^-1, take no notice of (Politis
and Romano 1992).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .least_squares import Fit
from .residuals import autocorrelation, structured

Array = NDArray[np.float64]

DRAWS = 2000
_SEED = 20190412


@dataclass(frozen=True)
class Bootstrap:
    """Of a fit's parameters (n,), in their units: ``errors``, 95 % ``intervals`` (n, 2), and their ``covariance``."""

    errors: Array
    intervals: Array
    covariance: Array
    block: int


def block_bootstrap(fit: Fit, draws: int = DRAWS, seed: int = _SEED) -> Bootstrap:
    """The block bootstrap of ``fit``; its nuisance terms take part and are left out of the result."""
    residuals, n = fit.residuals, len(fit.values)
    samples, unknowns = fit.slopes.shape
    size = np.linalg.norm(fit.slopes, axis=0)
    projection = np.linalg.pinv(fit.slopes / size) / size[:, None]
    # a fit's residuals are smaller than the noise by the degrees of freedom that it took
    centred = (residuals - residuals.mean()) * np.sqrt(samples / max(samples - unknowns, 1))
    block = block_length(residuals)
    blocks = -(-samples // block)
    rng = np.random.default_rng(seed)
    moves = np.empty((draws, n))  # of the coordinates
    for k in range(0, draws, 100):  # a hundred at a time: memory stays small for long records
        count = min(100, draws - k)
        starts = rng.integers(0, samples, (count, blocks))
        index = (starts[:, :, None] + np.arange(block)).reshape(count, -1)[:, :samples] % samples
        moves[k : k + count] = centred[index] @ projection[:n].T / fit.units
    low, high = fit.problem.scales.values(fit.coordinates + np.quantile(moves, [0.025, 0.975], axis=0))
    return Bootstrap(
        errors=moves.std(axis=0, ddof=1) * fit.units,
        intervals=np.column_stack([low, high]),
        covariance=np.atleast_2d(np.cov(moves.T)) * np.outer(fit.units, fit.units),
        block=block,
    )


def widening(fit: Fit) -> Array:
    """By which factor (n,) the errors of alike residuals exceed those of independent ones; 1 where they are not alike.

    The root of the adjustment of the profile likelihood of Royall and Tsou (2003), the sandwich's variance by blocks.
    """
    if not structured(fit.residuals):
        return np.ones(len(fit.values))
    return np.asarray(block_bootstrap(fit).errors / fit.errors)


def block_length(residuals: Array) -> int:
    """Length that balances the bootstrap's bias and variance for an AR(1) of this correlation (Carlstein 1986)."""
    samples = len(residuals)
    rho = min(max(autocorrelation(residuals), 0.0), 0.99)
    length = samples ** (1 / 3) * (2 * rho / (1 - rho**2)) ** (2 / 3)
    return int(np.clip(np.ceil(length), 1, max(samples // 5, 1)))
