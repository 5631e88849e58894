"""Uncertainty where neighbouring residuals are alike: the circular block bootstrap, to first order.

Blocks of residuals are drawn with replacement and put in place of the residuals; what they do to the parameters is
their projection on the model's slopes at the fit, by the coordinates (logarithms), so that no draw needs a fit of its
own. Blocks keep the correlation that independent draws, and the covariance s^2 (J^T J)^-1, take no notice of (Politis
and Romano 1992).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .least_squares import Fit
from .residuals import autocorrelation, structured

Array = NDArray[np.float64]

DRAWS = 2000
_SEED = 20190412


@dataclass(frozen=True)
class Bootstrap:
    """Of a fit's parameters (n,), in their units: ``errors``, 95 % ``intervals`` (n, 2), and their ``covariance``.

    ``block`` is the length of the blocks, the longest where several data sets were fitted.
    """

    errors: Array
    intervals: Array
    covariance: Array
    block: int


def block_bootstrap(fit: Fit, draws: int = DRAWS, seed: int = _SEED) -> Bootstrap:
    """The block bootstrap of ``fit``; its nuisance terms take part and are left out of the result.

    Each data set of a joint fit is drawn from its own residuals.
    """
    n = len(fit.values)
    samples, unknowns = fit.slopes.shape
    size = np.linalg.norm(fit.slopes, axis=0)
    projection = (np.linalg.pinv(fit.slopes / size) / size[:, None])[:n]
    # a fit's residuals are smaller than the noise by the degrees of freedom that it took
    growth = np.sqrt(samples / max(samples - unknowns, 1))
    rng = np.random.default_rng(seed)
    moves = np.zeros((draws, n))  # of the coordinates
    longest = 0
    for part in data_sets(fit):
        residuals = fit.residuals[part]
        length = len(residuals)
        centred = growth * (residuals - residuals.mean())
        block = block_length(residuals)
        longest = max(longest, block)
        blocks = -(-length // block)
        for k in range(0, draws, 100):  # a hundred at a time: memory stays small for long records
            count = min(100, draws - k)
            starts = rng.integers(0, length, (count, blocks))
            index = (starts[:, :, None] + np.arange(block)).reshape(count, -1)[:, :length] % length
            moves[k : k + count] += centred[index] @ projection[:, part].T / fit.units
    low, high = fit.problem.scales.values(fit.coordinates + np.quantile(moves, [0.025, 0.975], axis=0))
    return Bootstrap(
        errors=moves.std(axis=0, ddof=1) * fit.units,
        intervals=np.column_stack([low, high]),
        covariance=np.atleast_2d(np.cov(moves.T)) * np.outer(fit.units, fit.units),
        block=longest,
    )


def widening(fit: Fit) -> Array:
    """By which factor (n,) the errors of alike residuals exceed those of independent ones; 1 where they are not alike.

    The root of the adjustment of the profile likelihood of Royall and Tsou (2003), the sandwich's variance by blocks.
    """
    if not correlated(fit):
        return np.ones(len(fit.values))
    return np.asarray(block_bootstrap(fit).errors / fit.errors)


def data_sets(fit: Fit) -> list[slice]:
    """Where the residuals of each data set of a fit stand; one of all for a fit of one."""
    ends = np.cumsum([0, *(fit.parts or (len(fit.residuals),))]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def correlated(fit: Fit) -> bool:
    """Whether neighbouring residuals of any of its data sets are alike."""
    return any(structured(fit.residuals[part]) for part in data_sets(fit))


def block_length(residuals: Array) -> int:
    """Length that balances the bootstrap's bias and variance for an AR(1) of this correlation (Carlstein 1986)."""
    samples = len(residuals)
    rho = min(max(autocorrelation(residuals), 0.0), 0.99)
    length = samples ** (1 / 3) * (2 * rho / (1 - rho**2)) ** (2 / 3)
    return int(np.clip(np.ceil(length), 1, max(samples // 5, 1)))
