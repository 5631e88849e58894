"""Descent to a minimum of a sum of squares: Levenberg-Marquardt by lmfit, ended by Gauss-Newton steps.

What a minimiser calls a success is not believed. A descent counts only where it stands at a minimum: Bates and Watts'
relative offset (Technometrics 23, 179, 1981), the part of the residuals that the tangent plane still explains, is
negligible, and every parameter is felt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array

#: p (n,) -> residuals (m,)
Residuals = Callable[[Array], Array]
#: p (n,) -> their derivatives (m, n)
Jacobian = Callable[[Array], Array]

#: Relative offset below which a descent has converged: parameters within this part of their standard errors.
OFFSET = 1e-6
#: Condition of the Jacobian, its columns of equal length, beyond which a parameter is not felt.
CONDITION = 1e11
#: Larger residuals count as not finite.
HUGE = 1e100


@dataclass(frozen=True)
class Run:
    """End of a descent: ``parameters`` (n,), ``sum_of_squares``, ``offset`` (see the module), ``condition``."""

    parameters: Array
    sum_of_squares: float
    offset: float
    condition: float

    @property
    def degenerate(self) -> bool:
        """True if a parameter is not felt there: it ran away, or two act alike."""
        return not self.condition < CONDITION

    @property
    def converged(self) -> bool:
        """True at a minimum at which every parameter is felt."""
        return self.offset < OFFSET and not self.degenerate


def levenberg_marquardt(
    residuals: Residuals, jacobian: Jacobian, start: Array, *, ftol: float, xtol: float, most: int
) -> Array:
    """Return where lmfit's Levenberg-Marquardt ends from ``start`` (n,).

    ``ftol`` and ``xtol`` are the relative changes of the sum of squares and of the parameters at which it ends;
    ``most`` evaluations end it too.
    """
    import lmfit

    parameters = lmfit.Parameters()
    for j, value in enumerate(start.tolist()):
        parameters.add(f"p{j}", value=value)

    best = (np.inf, start)

    def at(current: lmfit.Parameters) -> Array:
        return np.array([p.value for p in current.values()])

    def function(current: lmfit.Parameters) -> Array:
        nonlocal best
        x = at(current)
        r = residuals(x)
        best = min(best, (float(r @ r), x), key=lambda pair: pair[0])
        return r

    minimizer = lmfit.Minimizer(function, parameters, nan_policy="raise", max_nfev=most)
    found = minimizer.leastsq(Dfun=lambda p: jacobian(at(p)), col_deriv=0, ftol=ftol, xtol=xtol, gtol=0.0)
    return best[1] if found.aborted else at(found.params)


def descend(
    residuals: Residuals,
    jacobian: Jacobian,
    start: Array,
    *,
    rounding: float = 0.0,
    tolerance: float = 1e-15,
    most: int = 2000,
    polishes: int = 60,
) -> Run:
    """Return the end of a descent from ``start`` (n,).

    ``tolerance`` (relative change of sum of squares and parameters) ends Levenberg-Marquardt, or ``most`` evaluations
    do; ``polishes`` are the most Gauss-Newton steps thereafter. ``rounding`` is the sum of squares that rounding alone
    leaves. Where the model has no value, residuals count as huge and flat.
    """
    problem = _Guarded(residuals, jacobian)
    if np.abs(problem.residuals(start)).max(initial=0.0) >= HUGE:
        return Run(start, np.inf, np.inf, np.inf)
    end = levenberg_marquardt(problem.residuals, problem.jacobian, start, ftol=tolerance, xtol=tolerance, most=most)
    return _polished(problem, end, rounding, polishes)


def blur(sum_of_squares: float, rounding: float) -> float:
    """Return by how much rounding of the residuals moves a sum of their squares."""
    if not np.isfinite(sum_of_squares):
        return 0.0
    return float(1e-13 * sum_of_squares + rounding + 2 * np.sqrt(rounding * sum_of_squares))


class _Guarded:
    """Residuals and Jacobian that stay finite."""

    def __init__(self, residuals: Residuals, jacobian: Jacobian) -> None:
        self._residuals, self._jacobian = residuals, jacobian

    def residuals(self, p: Array) -> Array:
        with np.errstate(all="ignore"):
            r = self._residuals(p)
        if np.isfinite(r).all() and float(np.abs(r).max(initial=0.0)) < HUGE:
            return r
        return np.full(len(r), HUGE)

    def jacobian(self, p: Array) -> Array:
        with np.errstate(all="ignore"):
            j = self._jacobian(p)
        return np.where(np.isfinite(j) & (np.abs(j) < HUGE), j, 0.0)


def _polished(problem: _Guarded, p: Array, rounding: float, polishes: int) -> Run:
    """Take Gauss-Newton steps, halved if they overshoot, while they help; return the end and its measures."""
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
            if total < squares or (not halvings and offset < 1e-2 and total <= squares + blur(squares, rounding)):
                break
        else:
            break
        p, r, squares = candidate, trial, total
    return Run(p, squares, offset, condition)


def gauss_newton(j: Array, r: Array, rounding: float = 0.0) -> tuple[Array, float, float]:
    """Return the step, the relative offset and the condition of the Jacobian with columns of equal length."""
    m, n = j.shape
    size = np.linalg.norm(j, axis=0)
    if not (np.isfinite(size).all() and (size > 0).all()):
        return np.zeros(n), np.inf, np.inf
    scaled = j / size
    upper: Array = np.asarray(np.linalg.qr(scaled, mode="r"))
    condition = float(np.linalg.cond(upper))
    if not condition < CONDITION:
        return np.zeros(n), np.inf, condition
    # Q^T r by the triangular factor alone, its rounding mended once
    along = np.linalg.solve(upper.T, scaled.T @ r)
    along += np.linalg.solve(upper.T, scaled.T @ (r - scaled @ np.linalg.solve(upper, along)))
    step = -np.linalg.solve(upper, along) / size
    across = max(float(r @ r) - float(along @ along), 0.0)
    if not across or float(along @ along) <= rounding:
        return step, 0.0, condition
    offset = float(np.sqrt((along @ along) / n / (across / max(m - n, 1))))
    return step, offset, condition
