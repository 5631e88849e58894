"""Computes profile-likelihood intervals: a parameter is varied, with all others refitted, up to a significant misfit.

lmfit's `conf_interval` finds the ends; the criterion is the F test. If residuals are autocorrelated, the likelihood is
adjusted by the reported standard error (Royall and Tsou 2003, J. R. Stat. Soc. B 65, 391). A profile that does not
reach the criterion is open on that side: the data give no limit there.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array
from ..errors import IlgError, SolveError
from .problem import Evaluation, Progress
from .result import FitResult

if TYPE_CHECKING:
    import lmfit

#: Largest factor within which a limit of a parameter is searched.
REACH = 1e6
_LEVEL = 0.95
#: Value of the scaled parameter at the fit: lmfit's first step is a standard error if that is less than the value.
_CENTRE = 10.0
#: Increase of the criterion over a standard error below which a profile is flat.
_LEVEL_GAIN = 1e-4
#: F ratio that is larger than after any step of a standard error.
_JUMP = 1e5
#: Relative decrease of the sum of squares along the profile that counts as rounding.
_BETTER = 1e-6


@dataclass(frozen=True)
class ProfileInterval:
    """Ends of one parameter's 95 % interval, 0 or infinite if open; ``failure`` is the reason if there is none."""

    low: float
    high: float
    failure: str = ""

    @property
    def open_below(self) -> bool:
        return self.low == 0

    @property
    def open_above(self) -> bool:
        return bool(np.isinf(self.high))


def profile(fit: FitResult, widening: Array, progress: Progress = None) -> tuple[ProfileInterval, ...]:
    """Return profile intervals of the parameters of ``fit``; ``widening`` (n,) is `reported.widening`."""
    return tuple(_interval(fit, k, float(widening[k]), progress) for k in range(len(fit.values)))


def _interval(fit: FitResult, k: int, widening: float, progress: Progress) -> ProfileInterval:
    import lmfit
    from scipy.stats import f as fisher

    walk = _Walk(fit, k, widening, progress)
    minimizer = lmfit.Minimizer(
        walk.residual, walk.parameters, Dfun=walk.jacobian, col_deriv=0, ftol=1e-9, xtol=1e-7, nan_policy="raise"
    )
    lowest = 0.0

    def probability(best: lmfit.minimizer.MinimizerResult, new: lmfit.minimizer.MinimizerResult) -> float:
        nonlocal lowest
        gain = new.chisqr / best.chisqr - 1
        lowest = min(lowest, gain)
        ratio = max(gain, 0.0) * fit.degrees_of_freedom / widening**2
        if ratio > _JUMP:
            raise SolveError("no circuit can be solved within a standard error")
        return float(fisher.cdf(ratio, 1, fit.degrees_of_freedom))

    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # lmfit warns of an open side, which the result states
            best = minimizer.leastsq()
            walk.bound(best.params)
            ends_found = lmfit.conf_interval(
                minimizer,
                best,
                p_names=[walk.name(k)],
                sigmas=[_LEVEL],
                prob_func=probability,
                min_rel_change=_LEVEL_GAIN,
            )[walk.name(k)]
            ends = ends_found[0][1], ends_found[-1][1]
            for end in ends:
                # lmfit takes a profile that falls again for a flat one: points further out distinguish them
                if np.isinf(end) and any(probability(best, at) > _LEVEL for at in walk.beyond(minimizer, best, end)):
                    return ProfileInterval(np.nan, np.nan, "the profile rises, falls and rises again")
    except (IlgError, lmfit.MinimizerException, ValueError, ArithmeticError) as error:
        return ProfileInterval(np.nan, np.nan, f"the profile ended early: {error}")
    if lowest < -_BETTER:
        return ProfileInterval(np.nan, np.nan, "there is a better fit near this one")
    low, high = (walk.value(z) for z in ends)
    if not low < fit.values[k] < high:
        return ProfileInterval(np.nan, np.nan, "the profile has no ends about the value")
    return ProfileInterval(low, high)


class _Walk:
    """The fit in lmfit's form: coordinates in standard errors about `_CENTRE`, including the nuisance terms."""

    def __init__(self, fit: FitResult, k: int, widening: float, progress: Progress) -> None:
        import lmfit

        self._fit, self._k = fit, k
        self._evaluate = Evaluation(fit.problem, progress)
        self._n = len(fit.values)
        self._steps = np.concatenate([widening * fit.pooled_errors / fit.units, fit.nuisance_errors])
        self._middle = np.concatenate([fit.coordinates, fit.nuisance])
        self._size = float(np.abs(fit.problem.data).max()) or 1.0
        self.parameters = lmfit.Parameters()
        for j in range(fit.count):
            self.parameters.add(self.name(j), value=_CENTRE)

    def name(self, k: int) -> str:
        return f"p{k}"

    def bound(self, parameters: lmfit.Parameters) -> None:
        """Limit the profiled parameter to `REACH`, with a first step of a standard error."""
        reach = np.log(REACH) / self._steps[self._k]
        chosen = parameters[self.name(self._k)]
        chosen.stderr, chosen.min, chosen.max = 1.0, _CENTRE - reach, _CENTRE + reach

    def beyond(
        self, minimizer: lmfit.Minimizer, best: lmfit.minimizer.MinimizerResult, side: float
    ) -> Iterator[lmfit.minimizer.MinimizerResult]:
        """Return fits with the profiled parameter held further out on a ``side``, in steps of a decade."""
        parameters = best.params.copy()
        held = parameters[self.name(self._k)]
        held.vary = False
        reach = (held.max if side > 0 else held.min) - _CENTRE
        decades = round(np.log10(REACH))
        for k in range(1, decades + 1):
            held.value = _CENTRE + reach * k / decades
            yield minimizer.leastsq(parameters)

    def value(self, z: float) -> float:
        """Return the parameter's value; 0 or infinite where z is."""
        x = self._fit.coordinates.copy()
        x[self._k] += (z - _CENTRE) * self._steps[self._k]
        return float(self._fit.problem.scales.values(x)[self._k])

    def residual(self, parameters: lmfit.Parameters) -> Array:
        x, amounts = self._point(parameters)
        return (self._evaluate(x)[0] + self._fit.problem.nuisance @ amounts - self._fit.problem.data) / self._size

    def jacobian(self, parameters: lmfit.Parameters) -> Array:
        """Return the derivatives with respect to the free parameters."""
        x, _ = self._point(parameters)
        free = [j for j in range(self._fit.count) if parameters[self.name(j)].vary]
        slopes = np.column_stack([self._evaluate(x)[1], self._fit.problem.nuisance])
        return np.asarray((slopes * self._steps)[:, free] / self._size)

    def _point(self, parameters: lmfit.Parameters) -> tuple[Array, Array]:
        z = np.array([parameters[self.name(j)].value for j in range(self._fit.count)])
        all_of_them = self._middle + (z - _CENTRE) * self._steps
        return all_of_them[: self._n], all_of_them[self._n :]
