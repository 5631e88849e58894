"""Block bootstrap, to first order: uncertainty with autocorrelated residuals.

Blocks of residuals are drawn with replacement in place of the residuals. Their effect on the parameters is computed by
projection on the model's slopes at the fit, in the coordinates (logarithms), so that no draw needs a new fit. Blocks
preserve the correlation that independent draws, and the covariance s^2 (J^T J)^-1, neglect (Politis and Romano 1992).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..arrays import Array
from .criteria import autocorrelation
from .result import FitResult

DRAWS = 2000
SEED = 20190412


@dataclass(frozen=True)
class Bootstrap:
    """Bootstrap ``errors``, 95 % ``intervals`` (n, 2) and ``covariance`` of a fit's parameters (n,), in their units.

    ``block`` is the length of the blocks, the longest of several observations.
    """

    errors: Array
    intervals: Array
    covariance: Array
    block: int


def block_bootstrap(fit: FitResult, draws: int = DRAWS, seed: int = SEED) -> Bootstrap:
    """Return the circular block bootstrap of ``fit``; linear terms are included but not returned.

    Each observation is drawn from its own residuals.
    """
    n = len(fit.values)
    projection = fit.projection
    moves = np.zeros((draws, n))  # of the coordinates
    longest = 0
    for which, part in enumerate(fit.problem.slices):
        residuals = fit.residuals[part]
        length = len(residuals)
        # corrects for the degrees of freedom: a fit's residuals are smaller than the noise
        growth = np.sqrt(length / max(length - fit.leverage[which], 1))
        rng = np.random.default_rng([seed, which] if which else seed)
        centred = growth * (residuals - residuals.mean())
        block = block_length(residuals)
        longest = max(longest, block)
        blocks = -(-length // block)
        windows = sliding_window_view(np.append(centred, centred[: block - 1]), block)  # (length, block), circular
        for k in range(0, draws, 100):  # a hundred at a time: memory stays small for long records
            count = min(100, draws - k)
            starts = rng.integers(0, length, (count, blocks))
            drawn = windows[starts].reshape(count, -1)[:, :length]
            moves[k : k + count] += drawn @ projection[:, part].T / fit.units
    low, high = fit.problem.scales.values(fit.coordinates + np.quantile(moves, [0.025, 0.975], axis=0))
    return Bootstrap(
        errors=moves.std(axis=0, ddof=1) * fit.units,
        intervals=np.column_stack([low, high]),
        covariance=np.atleast_2d(np.cov(moves.T)) * np.outer(fit.units, fit.units),
        block=longest,
    )


def block_length(residuals: Array) -> int:
    """Return the length that balances the bootstrap's bias and variance for an AR(1) of this correlation.

    Source: Carlstein 1986.
    """
    samples = len(residuals)
    rho = min(max(autocorrelation(residuals), 0.0), 0.99)
    length = samples ** (1 / 3) * (2 * rho / (1 - rho**2)) ** (2 / 3)
    return int(np.clip(np.ceil(length), 1, max(samples // 5, 1)))
