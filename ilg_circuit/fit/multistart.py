"""Least squares from many starts: no answer may depend on the luck of one.

Levenberg-Marquardt (MINPACK) runs from every start; Gauss-Newton steps end each run at rounding. A run counts only
where it stands at a minimum: Bates and Watts' relative offset (Technometrics 23, 179, 1981), the part of the residuals
that the tangent plane still explains, is negligible, and every parameter is felt. How many runs end at the best minimum
says how far it can be trusted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: p (n,) -> residuals (m,)
Residuals = Callable[[Array], Array]
#: p (n,) -> their derivatives (m, n)
Jacobian = Callable[[Array], Array]

#: Relative offset below which a run has converged: parameters within this part of their standard errors.
OFFSET = 1e-6
#: Condition of the Jacobian, its columns of equal length, beyond which a parameter is not felt.
CONDITION = 1e11
#: Minima are the same whose sums of squares differ by no more, relatively.
SAME = 1e-7
_HUGE = 1e100


@dataclass(frozen=True)
class Run:
    """End of a run: ``parameters`` (n,), sum of ``squares``, ``offset`` (see the module), ``condition``."""

    parameters: Array
    squares: float
    offset: float
    condition: float

    @property
    def degenerate(self) -> bool:
        """Whether a parameter is not felt there: it ran away, or two act alike."""
        return not self.condition < CONDITION

    @property
    def converged(self) -> bool:
        return self.offset < OFFSET and not self.degenerate


@dataclass(frozen=True)
class Search:
    """All runs, best first; ``agreeing`` of them, the first ones, ended at the best minimum."""

    runs: tuple[Run, ...]
    agreeing: int

    @property
    def best(self) -> Run:
        return self.runs[0]


def search(
    residuals: Residuals,
    jacobian: Jacobian,
    starts: Sequence[Array],
    *,
    rounding: float = 0.0,
    tolerance: float = 1e-15,
    most: int = 2000,
    polishes: int = 60,
) -> Search:
    """Runs from every start (n,). ``rounding`` is the sum of squares that rounding alone leaves.

    ``tolerance`` (relative change of squares and parameters) ends Levenberg-Marquardt, or ``most`` evaluations do;
    ``polishes`` are the most Gauss-Newton steps thereafter.
    """
    guarded = _Guarded(residuals, jacobian)
    runs = [_run(guarded, start, rounding, tolerance, most, polishes) for start in starts]
    return gather(runs, rounding)


def gather(runs: Sequence[Run], rounding: float = 0.0) -> Search:
    """Runs sorted, converged ones first among those of the same sum of squares, and counted."""
    lowest = min(run.squares for run in runs)

    def same(squares: float, other: float) -> bool:
        return abs(squares - other) <= SAME * max(squares, other) + _blur(squares, rounding)

    ordered = sorted(runs, key=lambda run: (not same(run.squares, lowest), not run.converged, run.squares))
    best = ordered[0]
    agreeing = sum(same(run.squares, best.squares) and run.converged for run in ordered)
    return Search(tuple(ordered), agreeing)


def _blur(squares: float, rounding: float) -> float:
    """By how much rounding of the residuals moves a sum of their squares."""
    return float(1e-13 * squares + rounding + 2 * np.sqrt(rounding * squares)) if np.isfinite(squares) else 0.0


class _Guarded:
    """Residuals and Jacobian that stay finite: where the model has no value, residuals are huge and flat."""

    def __init__(self, residuals: Residuals, jacobian: Jacobian) -> None:
        self._residuals, self._jacobian = residuals, jacobian

    def residuals(self, p: Array) -> Array:
        with np.errstate(all="ignore"):
            r = self._residuals(p)
        if np.isfinite(r).all() and float(np.abs(r).max(initial=0.0)) < _HUGE:
            return r
        return np.full(len(r), _HUGE)

    def jacobian(self, p: Array) -> Array:
        with np.errstate(all="ignore"):
            j = self._jacobian(p)
        return np.where(np.isfinite(j) & (np.abs(j) < _HUGE), j, 0.0)


def _run(problem: _Guarded, start: Array, rounding: float, tolerance: float, most: int, polishes: int) -> Run:
    from scipy.optimize import leastsq

    r = problem.residuals(start)
    if np.abs(r).max(initial=0.0) >= _HUGE:
        return Run(start, np.inf, np.inf, np.inf)
    with np.errstate(all="ignore"):  # of a covariance that nobody asked for
        found = leastsq(
            problem.residuals,
            start,
            Dfun=problem.jacobian,
            ftol=tolerance,
            xtol=tolerance,
            gtol=0.0,
            maxfev=most,
            full_output=True,
        )
    return _polished(problem, np.asarray(found[0], dtype=float), rounding, polishes)


def _polished(problem: _Guarded, p: Array, rounding: float, polishes: int) -> Run:
    """Gauss-Newton steps, halved where they overshoot, until they no longer help; then the measures of the end."""
    r = problem.residuals(p)
    squares = float(r @ r)
    offset = condition = np.inf
    for k in range(polishes):
        step, offset, condition = gauss_newton(problem.jacobian(p), r, rounding)
        if condition >= CONDITION or not np.isfinite(step).all():
            break
        if k > 1 and offset < 1e-3 * OFFSET:
            break
        for halvings in range(8):
            candidate = p + step / 2**halvings
            trial = problem.residuals(candidate)
            total = float(trial @ trial)
            # near the end squares no longer tell; the full step is then as good as the point
            if total < squares or (not halvings and offset < 1e-2 and total <= squares + _blur(squares, rounding)):
                break
        else:
            break
        p, r, squares = candidate, trial, total
    return Run(p, squares, offset, condition)


def gauss_newton(j: Array, r: Array, rounding: float) -> tuple[Array, float, float]:
    """The step, the relative offset and the condition of the Jacobian with columns of equal length."""
    m, n = j.shape
    size = np.linalg.norm(j, axis=0)
    if not (np.isfinite(size).all() and (size > 0).all()):
        return np.zeros(n), np.inf, np.inf
    q, upper = np.linalg.qr(j / size)
    condition = float(np.linalg.cond(upper))
    if not condition < CONDITION:
        return np.zeros(n), np.inf, condition
    along = q.T @ r
    step = -np.linalg.solve(upper, along) / size
    across = max(float(r @ r) - float(along @ along), 0.0)
    if not across or float(along @ along) <= rounding:
        return step, 0.0, condition
    offset = float(np.sqrt((along @ along) / n / (across / max(m - n, 1))))
    return step, offset, condition
