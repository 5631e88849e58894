"""Profile likelihood of a quantity that is known to lie between bounds, such as a step's onset.

The data hardly determine such a quantity. Its profile over the closed interval gives the change of each fitted
parameter with it, without a prior within the interval.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Array, Mask
from ..errors import IlgError, SolveError
from .fitting import fit, require_near
from .problem import Problem
from .result import FitResult

#: Number of places at first, and in each refinement if the likelihood distinguishes them; number of refinements.
_FIRST, _CLOSER, _LOOKS = 5, 9, 6
#: Number of refinements for a starting value only.
_ROUGH_LOOKS = 2
#: Number of parabolas through the places about the least deviance.
_PARABOLAS = 5
#: Difference of deviances below which places are equally likely.
_FLAT = 0.3
#: Square of the normal quantile of 95 %: a place of a larger deviance is not admitted. Of two models of as many
#: parameters the one that is worse by more is the true one in 2.5 % at most.
LEVEL = 3.84
#: The same for a parameter that goes with the place, where that may lie at its bound: chi-square of no, one and two
#: degrees of freedom with weights 1/4, 1/2 and 1/4 (Self and Liang, J. Am. Stat. Assoc. 82, 1987, 605).
_CORNER = 4.23
#: Normal quantiles of one side and of two, of 95 %, and the number of bisections between them.
_ONE_SIDED, _TWO_SIDED, _HALVINGS = 1.6448536269514722, 1.959963984540054, 30
#: Distance below which two places are the same, relative to the bounds.
_CLOSE = 1e-3
#: Relative distance of two places that are one.
_SAME_PLACE = 1e-12
#: Tolerance of the intermediate fits.
_TOLERANCE = 1e-9
#: Step of a coordinate for the derivatives of derived quantities.
_STEP = 1e-5
#: Largest number of Gauss-Newton steps, and the step in standard errors that ends them.
_STEPS, _SETTLED = 25, 1e-3


@dataclass(frozen=True, eq=False)
class BoundedProfile:
    """The profile of a quantity over ``places`` (g,), its values in ascending order.

    ``deviance`` (g,) is -2 log(likelihood) above its minimum, on independent samples; ``coordinates`` (g, n) are the
    fit's parameters at each place, ``covariances`` (g, n, n) their covariances up to a common factor. ``known`` is the
    place of the estimate, None for the middle of the admitted interval.
    """

    places: Array
    deviance: Array
    coordinates: Array
    covariances: Array
    known: float | None = None

    @cached_property
    def admitted(self) -> tuple[float, float]:
        """The 95 % interval of the quantity: where the deviance stays below `LEVEL`."""
        return self._within(LEVEL)

    def _within(self, level: float) -> tuple[float, float]:
        """Return the first and last place where the deviance is ``level``, by linear interpolation, or the bounds."""
        inside = np.flatnonzero(self.deviance <= level)

        def end(k: int, side: int) -> float:
            place = float(self.places[k])
            if not 0 <= k + side < len(self.places):
                return place
            share = (level - self.deviance[k]) / (self.deviance[k + side] - self.deviance[k])
            return place + float(share) * (float(self.places[k + side]) - place)

        return end(int(inside[0]), -1), end(int(inside[-1]), 1)

    @property
    def middle(self) -> float:
        """The estimate: the middle of the admitted interval, or what is ``known``."""
        return sum(self.admitted) / 2 if self.known is None else self.known

    def knowing(self, place: float, coordinates: Array) -> BoundedProfile:
        """Return the profile with the ``coordinates`` (n,) of a further fit at a ``place``."""
        k, deviance = int(np.searchsorted(self.places, place)), np.interp(place, self.places, self.deviance)
        if place in self.places:
            return replace(self, coordinates=np.vstack([self.coordinates[:k], coordinates, self.coordinates[k + 1 :]]))
        return BoundedProfile(
            np.insert(self.places, k, place),
            np.insert(self.deviance, k, deviance),
            np.insert(self.coordinates, k, coordinates, axis=0),
            np.insert(self.covariances, k, _between(self.places, self.covariances, place), axis=0),
        )

    def beside(self, other: BoundedProfile) -> BoundedProfile:
        """Return the profile with what another model of the same parameters admits; the estimate stays this model's."""
        low, high = other._within(_CORNER)
        within = other.places[(other.places > low) & (other.places < high)]
        new = np.unique(np.concatenate([[low], within, [high]]))
        new = new[[np.abs(self.places - x).min() > _SAME_PLACE * max(abs(x), 1.0) for x in new]]
        if not len(new):
            return self
        places = np.concatenate([self.places, new])
        deviance = np.minimum(np.interp(new, other.places, other.deviance), _CORNER)
        coordinates = [_between(other.places, other.coordinates, x) for x in new]
        covariances = [_between(other.places, other.covariances, x) for x in new]
        order = np.argsort(places)
        return BoundedProfile(
            places[order],
            np.concatenate([self.deviance, deviance])[order],
            np.concatenate([self.coordinates, coordinates])[order],
            np.concatenate([self.covariances, covariances])[order],
            self.middle,
        )

    def of(self, quantities: Callable[[Array], Array]) -> BoundedProfile:
        """Return the profile of ``quantities`` (g, m) derived from the coordinates (g, n)."""
        x, steps = self.coordinates, _STEP * np.eye(self.coordinates.shape[1])
        slopes = np.stack([(quantities(x + s) - quantities(x - s)) / (2 * _STEP) for s in steps], axis=1)
        covariances = slopes.transpose(0, 2, 1) @ self.covariances @ slopes
        return BoundedProfile(self.places, self.deviance, quantities(x), covariances, self.known)

    def reach(self, errors: Array, quantile: Array) -> tuple[Array, Array]:
        """Return the lengths of intervals below and above the coordinates at the `middle` (n,), with their ``errors``.

        ``quantile`` (n,) is Student's. The intervals follow from the joint profile likelihood; ``errors`` are standard
        errors at the middle, scaled elsewhere by the square roots of the covariances' diagonals. Beside a range whose
        places the data do not distinguish they are shorter, as by Imbens and Manski: the truth has one place in it.
        Where the data distinguish them, the range's ends are uncertain themselves, and one may be a bound: intervals
        are longer by up to 5 %, the more the quantity goes with the place.
        """
        sizes = np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        at_middle = _between(self.places, sizes, self.middle)
        there = errors * np.divide(sizes, at_middle, out=np.ones_like(sizes), where=at_middle > 0)
        ranges = np.divide(np.abs(self.range), errors, out=np.zeros_like(errors), where=errors > 0)
        if float(self.deviance.max()) < _FLAT:
            share = _one_sided(ranges)
        else:
            # a corner's weights go with its angle, and the admitted places are about two standard errors wide
            share = np.sqrt(1 + (_CORNER / LEVEL - 1) * np.arctan(ranges / 2) * 2 / np.pi)
        spare = np.sqrt(np.maximum(1 - self.deviance[:, None] / _CORNER, 0.0)) * share * quantile * there
        inside = self.deviance <= _CORNER
        middle = _between(self.places, self.coordinates, self.middle)
        ends = np.array([_between(self.places, self.coordinates, x) for x in self._within(_CORNER)])
        low = np.minimum((self.coordinates - spare)[inside].min(axis=0), ends.min(axis=0))
        high = np.maximum((self.coordinates + spare)[inside].max(axis=0), ends.max(axis=0))
        return middle - low, high - middle

    @property
    def range(self) -> Array:
        """Changes (n,) of the coordinates from one end of the admitted interval to the other."""
        low, high = (_between(self.places, self.coordinates, x) for x in self.admitted)
        return high - low


def _one_sided(ranges: Array) -> Array:
    """Return the ratio (n,) of the quantile c beside a range, in standard errors, to that of a symmetric interval.

    c solves Phi(c + range) - Phi(-c) = 0.95 (Imbens and Manski, Econometrica 72, 2004, 1845): from 1.96 without a
    range to 1.64 beside a wide one. Found by bisection.
    """
    from scipy.special import ndtr

    low, high = np.full_like(ranges, _ONE_SIDED), np.full_like(ranges, _TWO_SIDED)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        enough = ndtr(middle + ranges) - ndtr(-middle) >= 0.95
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high / _TWO_SIDED)


def _between(places: Array, rows: Array, place: float) -> Array:
    """Return ``rows`` (g, ...) at ascending ``places`` (g,) interpolated at a ``place``."""
    k = int(np.clip(np.searchsorted(places, place), 1, len(places) - 1)) if len(places) > 1 else 0
    if not k:
        return np.asarray(rows[0])
    share = np.clip((place - places[k - 1]) / (places[k] - places[k - 1]), 0.0, 1.0)
    return np.asarray((1 - share) * rows[k - 1] + share * rows[k])


def profile_bounded(
    found: FitResult,
    at: Callable[[float], Problem],
    bounds: tuple[float, float],
    moved: Sequence[int],
    *,
    start: float = 0.0,
    costly: bool = False,
    looks: int = _LOOKS,
) -> BoundedProfile:
    """Return the profile over a quantity within ``bounds``.

    ``found`` is the fit with the quantity at ``start``; ``at`` returns the problem with another value; ``moved`` are
    the observations whose residuals determine it. A ``costly`` problem is solved at the ends only; ``looks`` is the
    largest number of refinements.
    """
    trial = _Trial(found, at, moved)
    trial.at(start)
    low, high = bounds
    for x in (low, high) if costly else np.linspace(low, high, _FIRST).tolist():
        trial.at(x)
    for _ in range(0 if costly else looks):
        places, deviance, _ = trial.table
        if float(deviance.max()) < _FLAT:
            break
        inside = np.flatnonzero(deviance <= _CORNER)
        first, last = max(inside[0] - 1, 0), min(inside[-1] + 1, len(places) - 1)
        if last - first > _CLOSER:
            break
        for x in np.linspace(places[first], places[last], _CLOSER).tolist():
            trial.at(x)
    return trial.profile()


def likeliest(found: FitResult, at: Callable[[float], Problem], bounds: tuple[float, float]) -> float:
    """Return the estimate of a quantity of one observation; ``found`` is the fit with the quantity at 0.

    The estimate is the middle of the admitted values, or 0 if that is near; arguments as in `profile_bounded`.
    """
    middle = profile_bounded(found, at, bounds, (0,), looks=_ROUGH_LOOKS).middle
    return middle if abs(middle) > _CLOSE * (bounds[1] - bounds[0]) else 0.0


def likeliest_place(
    found: FitResult,
    at: Callable[[float], Problem],
    bounds: tuple[float, float],
    moved: Sequence[int] = (0,),
    *,
    start: float = 0.0,
) -> tuple[float, Array]:
    """Return the most likely value of a quantity, and the coordinates (n,) of the fit there.

    Its deviance is taken for a parabola near the least one of a few places; arguments as in `profile_bounded`.
    """
    trial, close = _Trial(found, at, moved), _CLOSE * (bounds[1] - bounds[0])
    for x in (start, *np.linspace(*bounds, _FIRST).tolist()):
        trial.at(x)
    for _ in range(_PARABOLAS):
        places, deviance, _ = trial.table
        if len(places) < 3 or float(deviance.max()) < _FLAT:
            break
        best = int(np.argmin(deviance))
        k = min(max(best, 1), len(places) - 2)
        origin = float(places[best])
        near = places[k - 1 : k + 2] - origin
        bent, slope, _ = np.polyfit(near, deviance[k - 1 : k + 2], 2).tolist()
        step = float(np.clip(-slope / (2 * bent), near.min(), near.max())) if bent > 0 else 0.0
        if abs(step) < close and best != k:  # at an end, within which it may lie all the same
            step = float(near[1]) / 2
        if abs(step) < close:
            break
        trial.at(origin + step)
    places, deviance, coordinates = trial.table
    best = int(np.argmin(deviance))
    return float(places[best]), coordinates[best]


def matters(profile: BoundedProfile, errors: Array, share: float = 0.2) -> Mask:
    """Return the parameters (n,) that change by more than a ``share`` of their ``errors`` over the admitted values."""
    return np.asarray(np.abs(profile.range) > share * errors)


@dataclass(frozen=True, eq=False)
class _Tangent:
    """The ``slopes`` (samples, n) of a problem, by coordinates times ``units`` (n,), and what their steps need.

    ``sizes`` (n,) are their lengths by coordinates without the linear terms, ``normal`` (n, n) their products over
    these.
    """

    slopes: Array
    units: Array
    sizes: Array
    normal: Array

    @classmethod
    def of(cls, problem: Problem, slopes: Array, units: Array) -> _Tangent:
        products = problem.products(slopes) * np.outer(units, units)
        sizes = np.sqrt(np.diag(products))
        sizes[sizes == 0] = 1.0  # a value without effect: the steps' normal equations are singular
        return cls(slopes, units, sizes, products / np.outer(sizes, sizes))

    def step(self, residuals: Array) -> Array:
        """Return the Gauss-Newton step (n,) of the coordinates, from residuals without the linear terms."""
        along = self.slopes.T @ residuals * self.units / self.sizes
        return np.asarray(np.linalg.solve(self.normal, along) / self.sizes)


class _Trial:
    """Fits of one problem with a quantity at successive places, each started from the nearest earlier ones."""

    def __init__(self, found: FitResult, at: Callable[[float], Problem], moved: Sequence[int]) -> None:
        self._found, self._at = found, at
        self._places: dict[float, tuple[float, Array]] = {}
        self._parts = [found.problem.slices[k] for k in moved]
        residuals = [found.residuals[part] for part in self._parts]
        self._variances = [float(np.mean(r**2)) or 1.0 for r in residuals]
        self._tangent = _Tangent.of(found.problem, found.slopes[:, : len(found.values)], found.units)
        self._errors = found.errors / found.units
        self._shares = [found.independent_samples(k) / len(r) for k, r in zip(moved, residuals, strict=True)]

    def at(self, place: float) -> None:
        if any(abs(place - other) < 1e-12 * max(abs(place), 1e-300) for other in self._places):
            return
        try:
            x, residuals = self._fitted(self._at(place), self._begin(place))
        except IlgError:
            return  # no place at which this model can be fitted
        squares = [float(residuals[part] @ residuals[part]) for part in self._parts]
        pairs = zip(squares, self._variances, self._shares, strict=True)
        self._places[place] = (sum(s / v * share for s, v, share in pairs), x)

    def _begin(self, place: float) -> Array:
        """Return coordinates (n,) on a line through the two nearest places, or at the nearest if far from both."""
        near = sorted(self._places, key=lambda other: abs(other - place))[:2]
        if not near:
            return self._found.coordinates
        first, last = self._places[near[0]][1], self._places[near[-1]][1]
        if abs(place - near[0]) > abs(near[-1] - near[0]):
            return first
        return first + (place - near[0]) / (near[-1] - near[0]) * (last - first)

    def _fitted(self, problem: Problem, start: Array) -> tuple[Array, Array]:
        """Return coordinates (n,) and residuals of the fit, by Gauss-Newton steps with the slopes of the first fit.

        Each step needs one prediction, and few are needed near the minimum. After a step that leads past the minimum,
        slopes are computed before it. If the steps do not converge, a full fit is run.
        """
        tangent, x, before, fresh = self._tangent, start, np.inf, False
        last, left = x, self._found.residuals
        for _ in range(_STEPS):
            residuals = problem.projected(problem.data - problem.predictions(x[None])[0])
            squares = float(residuals @ residuals)
            if not squares <= before * (1 + _TOLERANCE):
                if fresh or not np.isfinite(before):
                    break
                x, residuals, squares, fresh = last, left, before, True
                tangent = _Tangent.of(problem, problem.derivatives(x)[1], np.ones(len(x)))
            else:
                fresh = False
            try:
                step = tangent.step(residuals)
                require_near(problem, x + step, start)
            except (np.linalg.LinAlgError, SolveError):
                break
            if not np.isfinite(step).all():
                break
            if np.abs(step / self._errors).max(initial=0.0) < _SETTLED:
                return x, residuals
            last, left, before = x, residuals, squares
            x = x + step
        made = fit(problem, problem.scales.values(start), None, _TOLERANCE)
        return made.coordinates, made.residuals

    def profile(self) -> BoundedProfile:
        """Return the profile; covariances are computed at admitted places, and copied from the nearest for others."""
        places, deviance, coordinates = self.table
        inside = np.flatnonzero(deviance <= _CORNER)
        known = np.unique(inside[[0, len(inside) // 2, -1]])
        covariances = np.array([self._covariance(self._at(places[k]), coordinates[k]) for k in known])
        every = np.array([_between(places[known], covariances, place) for place in places])
        return BoundedProfile(places, deviance, coordinates, every)

    def _covariance(self, problem: Problem, x: Array) -> Array:
        """Return the covariance (n, n) of the coordinates ``x`` by residuals of unit variance."""
        information = problem.information(x)
        sizes = np.sqrt(np.diag(information))
        sizes[sizes == 0] = 1.0
        return np.asarray(np.linalg.pinv(information / np.outer(sizes, sizes), hermitian=True) / np.outer(sizes, sizes))

    @property
    def table(self) -> tuple[Array, Array, Array]:
        places = sorted(self._places)
        if not places:
            raise SolveError("the model cannot be fitted with any admitted onset or clock")
        deviance = np.array([self._places[x][0] for x in places])
        least = float(deviance.min())
        # in units of the variance at the best place
        count = sum((part.stop - part.start) * share for part, share in zip(self._parts, self._shares, strict=True))
        scale = count / least if least else 1.0
        return np.array(places), (deviance - least) * scale, np.array([self._places[x][1] for x in places])
