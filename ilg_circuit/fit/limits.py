"""Finds how far a parameter may go with all others refitted, also where a fit is degenerate or at the end of a range.

`profile` starts from a regular minimum. Here every step is a descent, which needs none: two parameters may have the
same effect, and a parameter may have none. The criterion is the F test at 95 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import IlgError
from .multistart import search
from .problem import Problem
from .quantiles import fisher
from .result import FitResult

#: First step of a logarithm without slopes, the largest with them, and the factor of the next ones.
_FIRST, _LARGEST, _GROWTH = 0.15, 0.7, 2.0
#: Part of the way to the limit by a straight line that a step goes on beyond it.
_BEYOND = 1.05
#: Largest distance of a logarithm within which a limit is searched: a factor of 1e6.
LOG_REACH = float(np.log(1e6))
#: Distance of a logarithm up to which others follow by their slopes.
_FAR = 3.0
#: Error of a limit, relative to its distance from the fit; least share of a bracket by which it shrinks.
_CLOSE, _EDGE = 5e-3, 0.1
#: Range of coordinates that floating-point numbers resolve.
_RANGE = 100.0
_EVALUATIONS = 60
#: Tolerance of the descents of a search, relative to the growth that is searched for, and of those at its end.
_ROUGH, _CLOSER, _FINER, _TIGHT = 1e-4, 1e-8, 1e-2, 1e-10


@dataclass(frozen=True, eq=False)
class Ends:
    """The 95 % limits of a value, those of its parameter where the data give none, and ``coordinates`` (2, n) there.

    Where there is no limit, coordinates are those at the end of the search.
    """

    low: float
    high: float
    coordinates: Array


def limits(fit: FitResult, k: int, widening: float = 1.0) -> Ends:
    """Return the 95 % limits of value ``k`` of a ``fit``.

    ``widening`` is the ratio of reported errors to those of independent residuals, as in `reported.widening`.
    """
    gain = gain_at_limits(fit, widening)
    (low, below), (high, above) = (_end(fit, k, side, gain) for side in (-1.0, 1.0))
    lower, upper = fit.problem.moved[k].lower, fit.problem.moved[k].upper
    return Ends(lower if low is None else low, upper if high is None else high, np.array([below, above]))


def gain_at_limits(fit: FitResult, widening: float) -> float:
    """Return the growth of the sum of squares at 95 % limits, by the F test."""
    freedom = fit.degrees_of_freedom
    return fit.sum_of_squares * float(fisher(0.95, 1, freedom)) * widening**2 / freedom


def least_squares(problem: Problem, start: Array, tolerance: float = _TIGHT) -> tuple[Array, float]:
    """Return coordinates (n,) and sum of squares at the end of a descent from coordinates ``start`` (n,).

    ``tolerance`` is the relative change of the sum of squares at which it ends.
    """
    if not len(start):
        return start, float(problem.sum_of_squares(start[None])[0])

    def residuals(x: Array) -> Array:
        with suppress(IlgError):
            return problem.projected(problem.predictions(np.clip(x, -_RANGE, _RANGE)[None])[0] - problem.data)
        return np.full(len(problem.data), np.inf)

    def jacobian(x: Array) -> Array:
        with suppress(IlgError):
            return problem.projected(problem.derivatives(np.clip(x, -_RANGE, _RANGE))[1].T).T
        return np.full((len(problem.data), len(x)), np.inf)

    polishes = 0 if tolerance > _TIGHT else 4
    best = search(
        residuals, jacobian, [start], rounding=1e-26, tolerance=tolerance, most=_EVALUATIONS, polishes=polishes
    ).best
    return np.clip(best.parameters, -_RANGE, _RANGE), best.sum_of_squares


def _end(fit: FitResult, k: int, side: float, gain: float) -> tuple[float | None, Array]:
    """Return the value at which the sum of squares has grown by ``gain``, and all coordinates (n,) there.

    It is None where the sum does not grow so much within the reach.
    """
    problem, label, centre = fit.problem, fit.labels[k], fit.coordinates
    limit, tolerance = float(np.sqrt(gain)), _ROUGH * gain / (fit.sum_of_squares + gain)
    at: list[tuple[float, Array]] = [(0.0, np.delete(centre, k))]  # other coordinates at known distances

    def value(distance: float) -> float:
        x = centre.copy()
        x[k] += side * distance
        return float(problem.scales.values(x)[k])

    def misfit(distance: float) -> float:
        """Return the root of the growth, which is about linear in the distance; beyond the limit by two descents."""
        held = problem.holding(label, value(distance))
        found, squares = least_squares(held, _towards(at, distance, along), tolerance)
        if not squares - fit.sum_of_squares <= gain:
            again = least_squares(held, _nearest_below(at, distance), tolerance)
            found, squares = min((found, squares), again, key=lambda run: run[1])
        at.append((distance, found))
        return float(np.sqrt(max(squares - fit.sum_of_squares, 0.0)))

    step, along = _by_slopes(fit, k, side, gain)
    inside, low, rough = 0.0, 0.0, True
    while True:
        outside = min(inside + step, LOG_REACH)
        high = misfit(outside)
        if high <= limit:
            if outside >= LOG_REACH:
                return None, np.insert(at[-1][1], k, centre[k] + side * outside)
            straight = (limit - high) / (high - low) if high > low else np.inf
            step *= float(np.clip(_BEYOND * straight, _EDGE, _GROWTH))
            inside, low = outside, high
            continue
        while outside - inside > _CLOSE * outside and outside > _CLOSE * step:
            share = (limit - low) / (high - low)
            middle = inside + float(np.clip(share, _EDGE, 1 - _EDGE)) * (outside - inside)
            there = misfit(middle)
            if there > limit:
                outside, high = middle, there
            else:
                inside, low = middle, there
            if abs(there - limit) < _CLOSE * limit:
                break
        end = at[-1][0]
        if rough:  # along a ridge a rough descent ends too soon
            rough, tolerance = False, min(_CLOSER, _FINER * tolerance)
            closer = misfit(end)
            if closer < (1 - 2 * _CLOSE) * limit:
                inside, low, step = end, closer, max(_EDGE * end, outside - end)
                continue
        return value(end), np.insert(at[-1][1], k, centre[k] + side * end)


def _by_slopes(fit: FitResult, k: int, side: float, gain: float) -> tuple[float, Array]:
    """Return how far value ``k`` may go by the slopes at the fit, and the way (n,) of the others for each unit of that.

    That is a first guess: the first is kept within bounds, and the others stay where slopes lead them far away.
    """
    n = len(fit.values)
    own, others = fit.pooled_errors[k] / fit.units[k], np.zeros(n - 1)
    step = float(own * np.sqrt(gain / fit.sum_of_squares * fit.degrees_of_freedom))
    if not (np.isfinite(step) and step > 0):
        return _FIRST, others
    with np.errstate(all="ignore"):
        way = np.delete(side * fit.covariance[:n, k] / fit.units, k) * fit.units[k] / fit.covariance[k, k]
    step = min(step, _LARGEST)
    return step, way if (np.abs(way) * step < _FAR).all() else others


def _towards(at: Sequence[tuple[float, Array]], distance: float, along: Array) -> Array:
    """Return coordinates (n,) on a line through those at the two nearest distances, not far from the nearest.

    From a single distance the line goes ``along`` (n,).
    """
    near = sorted(at, key=lambda known: abs(known[0] - distance))
    first, x = near[0]
    other = next((known for known in near if known[0] != first), None)
    if other is None:
        return x + along * (distance - first)
    second, y = other
    share = float(np.clip((distance - first) / (first - second), -1.0, 1.0))
    return x + share * (x - y)


def _nearest_below(at: Sequence[tuple[float, Array]], distance: float) -> Array:
    """Return the coordinates (n,) at the largest known distance up to another, none of which is less than the first."""
    return max((known for known in at if known[0] <= distance), key=lambda known: known[0])[1]
