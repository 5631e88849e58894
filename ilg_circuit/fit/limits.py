"""Finds how far a parameter may go with all others refitted, also where a fit is degenerate or at the end of a range.

`profile` starts from a regular minimum. Here every step is a descent, which needs none: two parameters may have the
same effect, and a parameter may have none. The criterion is the F test at 95 %.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .multistart import search
from .problem import Problem
from .quantiles import fisher
from .result import FitResult

#: Largest first step of a logarithm, and the factor of the next ones.
_FIRST, _GROWTH = 0.05, 1.8
#: Largest distance of a logarithm within which a limit is searched: a factor of 1e6.
_REACH = float(np.log(1e6))
#: Error of a limit, relative to its distance from the fit; least share of a bracket by which it shrinks.
_CLOSE, _EDGE = 5e-3, 0.1
#: Range of coordinates that floating-point numbers resolve.
_RANGE = 100.0
_EVALUATIONS = 60


def limits(fit: FitResult, k: int, widening: float = 1.0) -> tuple[float, float]:
    """Return the 95 % limits of value ``k`` of a ``fit``; 0 and infinite where the data give none.

    ``widening`` is the ratio of reported errors to those of independent residuals, as in `reported.widening`.
    """
    freedom = fit.degrees_of_freedom
    gain = fit.sum_of_squares * float(fisher(0.95, 1, freedom)) * widening**2 / freedom
    ends = [_end(fit, k, side, gain) for side in (-1.0, 1.0)]
    lower, upper = fit.problem.moved[k].lower, fit.problem.moved[k].upper
    return (lower if ends[0] is None else ends[0]), (upper if ends[1] is None else ends[1])


def least_squares(problem: Problem, start: Array) -> tuple[Array, float]:
    """Return coordinates (n,) and sum of squares at the end of a descent from coordinates ``start`` (n,)."""
    if not len(start):
        return start, float(problem.sum_of_squares(start[None])[0])

    def residuals(x: Array) -> Array:
        return problem.predictions(np.clip(x, -_RANGE, _RANGE)[None])[0] - problem.data

    def jacobian(x: Array) -> Array:
        return problem.derivatives(np.clip(x, -_RANGE, _RANGE))[1]

    best = search(residuals, jacobian, [start], tolerance=1e-10, rounding=1e-26, most=_EVALUATIONS, polishes=4).best
    return np.clip(best.parameters, -_RANGE, _RANGE), best.sum_of_squares


def _end(fit: FitResult, k: int, side: float, gain: float) -> float | None:
    """Return the value at which the sum of squares has grown by ``gain``; None where it does not within the reach."""
    problem, label, centre = fit.problem, fit.labels[k], fit.coordinates
    rest, limit = np.delete(centre, k), float(np.sqrt(gain))

    def value(distance: float) -> float:
        x = centre.copy()
        x[k] += side * distance
        return float(problem.scales.values(x)[k])

    def misfit(distance: float) -> tuple[Array, float]:
        """Return the other coordinates, and the root of the growth, which is about linear in the distance."""
        found, squares = least_squares(problem.holding(label, value(distance)), rest)
        return found, float(np.sqrt(max(squares - fit.sum_of_squares, 0.0)))

    own = float(fit.errors[k] / fit.units[k])
    step = min(2 * own, _FIRST) if np.isfinite(own) and own > 0 else _FIRST
    inside, low = 0.0, 0.0
    while True:
        outside = min(inside + step, _REACH)
        found, high = misfit(outside)
        if high > limit:
            break
        if outside >= _REACH:
            return None
        inside, low, rest, step = outside, high, found, step * _GROWTH
    while outside - inside > _CLOSE * outside:
        share = (limit - low) / (high - low)
        middle = inside + float(np.clip(share, _EDGE, 1 - _EDGE)) * (outside - inside)
        found, there = misfit(middle)
        if abs(there - limit) < _CLOSE * limit:
            return value(middle)
        if there > limit:
            outside, high = middle, there
        else:
            inside, low, rest = middle, there, found
    return value((inside + outside) / 2)
