"""Finds how far a parameter may go with all others refitted, also where a fit is degenerate or at the end of a range.

`profile` starts from a regular minimum. Here every step is a descent, which needs none: two parameters may have the
same effect, and a parameter may have none. The criterion is the F test at 95 %.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .multistart import search
from .problem import Problem
from .result import FitResult

#: First step of a logarithm, and the factor of the next ones.
_FIRST, _GROWTH = 0.05, 1.8
#: Largest distance of a logarithm within which a limit is searched: a factor of 1e6.
_REACH = float(np.log(1e6))
#: Error of a limit's logarithm.
_CLOSE = 1e-3
#: Range of coordinates that floating-point numbers resolve.
_RANGE = 100.0
_EVALUATIONS = 60


def limits(fit: FitResult, k: int, widening: float = 1.0) -> tuple[float, float]:
    """Return the 95 % limits of value ``k`` of a ``fit``; 0 and infinite where the data give none.

    ``widening`` is the ratio of reported errors to those of independent residuals, as in `reported.widening`.
    """
    from scipy.stats import f as fisher

    freedom = fit.degrees_of_freedom
    allowed = fit.sum_of_squares * (1 + float(fisher.ppf(0.95, 1, freedom)) * widening**2 / freedom)
    ends = [_end(fit, k, side, allowed) for side in (-1.0, 1.0)]
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


def _end(fit: FitResult, k: int, side: float, allowed: float) -> float | None:
    """Return the value at which the sum of squares reaches ``allowed``; None where it does not within the reach."""
    problem, label, centre = fit.problem, fit.labels[k], fit.coordinates
    rest = np.delete(centre, k)

    def value(distance: float) -> float:
        x = centre.copy()
        x[k] += side * distance
        return float(problem.scales.values(x)[k])

    inside, step = 0.0, _FIRST
    while True:
        outside = min(inside + step, _REACH)
        found, squares = least_squares(problem.holding(label, value(outside)), rest)
        if squares > allowed:
            break
        if outside >= _REACH:
            return None
        inside, rest, step = outside, found, step * _GROWTH
    while outside - inside > _CLOSE * max(1.0, outside):
        middle = (inside + outside) / 2
        found, squares = least_squares(problem.holding(label, value(middle)), rest)
        if squares > allowed:
            outside = middle
        else:
            inside, rest = middle, found
    return value((inside + outside) / 2)
