"""Computes the reported errors of a fit: by its covariance, or a wider one if residuals are autocorrelated.

The wider one is from an autoregression of the residuals, but at least the block bootstrap's: if residuals are model
errors and not noise, an autoregression need not hold. Where readings are coarse, their rounding is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ..arrays import Array
from .autoregression import autoregression, sequences
from .bootstrap import Bootstrap, block_bootstrap
from .coarse import rounding_covariance, steps_of
from .criteria import autocorrelation, structured
from .quantiles import student
from .result import FitResult

#: Correlation of neighbours, in standard errors of white noise, above which it is allowed for.
_BEYOND_CHANCE = 2.5


@dataclass(frozen=True)
class Reported:
    """Errors with autocorrelated residuals: ``covariance`` (n, n) of the values, 95 % ``intervals`` (n, 2).

    ``freedom`` (n,) are the degrees of freedom of the errors.
    Each error is the larger of the autoregression's and the bootstrap's (``blocks``), and the rounding's; each interval
    includes both.
    """

    covariance: Array
    freedom: Array
    intervals: Array
    blocks: Bootstrap

    @property
    def errors(self) -> Array:
        """Standard errors (n,)."""
        return np.sqrt(np.diag(self.covariance))


#: What was found for fits that are still in use.
_FOUND: WeakKeyDictionary[FitResult, Reported] = WeakKeyDictionary()


def with_autocorrelation(fit: FitResult) -> Reported:
    """Return errors and intervals of a ``fit`` of one component that allow for autocorrelation and coarse readings."""
    found = _FOUND.get(fit)
    if found is None:
        found = _FOUND[fit] = _with_autocorrelation(fit)
    return found


def _with_autocorrelation(fit: FitResult) -> Reported:
    noise, blocks = autoregression(fit), block_bootstrap(fit)
    errors = np.maximum(noise.errors, np.finfo(float).tiny)  # zero if the fit is exact
    wider = np.maximum(blocks.errors / errors, 1.0)
    rounding = rounding_covariance(fit)
    whole = np.sqrt(noise.errors**2 + np.diag(rounding))
    ends = np.array([fit.intervals_by(whole, noise.freedom), blocks.intervals])
    return Reported(
        covariance=noise.covariance * np.outer(wider, wider) + rounding,
        freedom=noise.freedom,
        intervals=np.column_stack([ends[:, :, 0].min(axis=0), ends[:, :, 1].max(axis=0)]),
        blocks=blocks,
    )


def reported_covariance(fit: FitResult) -> Array:
    """Return the covariance (n, n) of the values: by `with_autocorrelation` where errors are `widened`.

    Components of a fit are treated one by one.
    """
    n = len(fit.values)
    if fit.components:
        covariance = np.zeros((n, n))
        for part in fit.components:
            at = [fit.labels.index(label) for label in part.labels]
            covariance[np.ix_(at, at)] = reported_covariance(part)
        return covariance
    return with_autocorrelation(fit).covariance if widened(fit) else fit.covariance[:n, :n]


def reported_freedom(fit: FitResult) -> Array:
    """Return the degrees of freedom (n,) of `reported_errors`."""
    if not fit.components:
        return with_autocorrelation(fit).freedom if widened(fit) else fit.freedom
    found = np.empty(len(fit.values))
    for part in fit.components:
        found[[fit.labels.index(label) for label in part.labels]] = reported_freedom(part)
    return found


def reported_errors(fit: FitResult) -> Array:
    """Return the standard errors (n,) of `reported_covariance`."""
    return np.sqrt(np.diag(reported_covariance(fit)))


def widening(fit: FitResult) -> Array:
    """Return the ratio (n,) of reported intervals to intervals for independent residuals of one variance.

    Its square is the adjustment of the profile likelihood of Royall and Tsou (2003).
    """
    if not widened(fit):
        return fit.errors / fit.pooled_errors
    found = with_autocorrelation(fit)
    students = student(0.975, found.freedom) / student(0.975, fit.degrees_of_freedom)
    return np.asarray(students * found.errors / fit.pooled_errors)


def widened(fit: FitResult) -> bool:
    """Return True if errors allow for more than independent noise: residuals are correlated or readings coarse."""
    return autocorrelated(fit) or bool(steps_of(fit).any())


def autocorrelated(fit: FitResult) -> bool:
    """Return True if the residuals of any row are significantly correlated: errors then allow for it."""
    rows = [fit.residuals[row.index] for row in sequences(fit)]
    return any(autocorrelation(r) > _BEYOND_CHANCE / np.sqrt(len(r)) for r in rows)


def correlated(fit: FitResult) -> bool:
    """Return True if the correlation of any observation's residuals shows a structure, not noise."""
    return any(structured(fit.residuals[part]) for part in fit.problem.slices)
