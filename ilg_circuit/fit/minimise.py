"""Minimises a sum of squares: MINPACK's Levenberg-Marquardt, by lmfit or in searches directly, then Gauss-Newton steps.

The minimiser's own report of success is not used. A descent is accepted only at a minimum: Bates and Watts' relative
offset (Technometrics 23, 179, 1981), the part of the residuals in the tangent plane, is negligible, and the Jacobian is
not singular.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..extras import whole
from .tall import lengths, triangle

#: p (n,) -> residuals (m,)
Residuals = Callable[[Array], Array]
#: p (n,) -> their derivatives (m, n)
Jacobian = Callable[[Array], Array]

#: Relative offset below which a descent has converged: distance from the minimum in standard errors.
OFFSET = 1e-6
#: Condition of the Jacobian, its columns of equal length, above which it is singular.
CONDITION = 1e11
#: Largest residual that counts as finite.
HUGE = 1e100


@dataclass(frozen=True)
class Run:
    """The end of a descent: ``parameters`` (n,), ``sum_of_squares``, ``offset`` (see the module), ``condition``."""

    parameters: Array
    sum_of_squares: float
    offset: float
    condition: float

    @property
    def degenerate(self) -> bool:
        """True if the Jacobian is singular: a parameter diverged, or two have the same effect."""
        return not self.condition < CONDITION

    @property
    def converged(self) -> bool:
        """True at a minimum with a regular Jacobian."""
        return self.offset < OFFSET and not self.degenerate


def levenberg_marquardt(
    residuals: Residuals, jacobian: Jacobian, start: Array, *, ftol: float, xtol: float, most: int
) -> Array:
    """Return the parameters (n,) at the end of lmfit's Levenberg-Marquardt method from ``start`` (n,).

    ``ftol`` and ``xtol`` are the relative changes of the sum of squares and of the parameters at which it ends;
    ``most`` evaluations end it too.
    """
    with whole():
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


def descended(residuals: Residuals, jacobian: Jacobian, start: Array, *, ftol: float, xtol: float, most: int) -> Array:
    """Return the end of a descent of a search, of which there are hundreds: by the same method without lmfit.

    Where ``most`` evaluations end it, it is the last accepted step. Raises ValueError where residuals are not finite.
    """
    from scipy.optimize import leastsq

    def finite(x: Array) -> Array:
        r = residuals(x)
        if not np.isfinite(r).all():
            raise ValueError("the residuals are not finite")
        return r

    how = {"ftol": ftol, "xtol": xtol, "gtol": 0.0, "maxfev": most}
    with np.errstate(all="ignore"):  # of a covariance that is not used
        return np.asarray(leastsq(finite, start, Dfun=jacobian, full_output=True, **how)[0])


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

    Levenberg-Marquardt ends at ``tolerance`` (relative change of sum of squares and parameters) or after ``most``
    evaluations; ``polishes`` is the largest number of Gauss-Newton steps thereafter. ``rounding`` is the sum of squares
    due to rounding alone. Where the model is not defined, residuals are taken as huge and constant.
    """
    problem = _Guarded(_remembering(residuals), _remembering(jacobian))
    if np.abs(problem.residuals(start)).max(initial=0.0) >= HUGE:
        return Run(start, np.inf, np.inf, np.inf)
    end = descended(problem.residuals, problem.jacobian, start, ftol=tolerance, xtol=tolerance, most=most)
    return _polished(problem, end, rounding, polishes)


def blur(sum_of_squares: float, rounding: float) -> float:
    """Return the error of a sum of squares due to rounding of the residuals."""
    if not np.isfinite(sum_of_squares):
        return 0.0
    return float(1e-13 * sum_of_squares + rounding + 2 * np.sqrt(rounding * sum_of_squares))


def _remembering(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Return a function that is not computed twice in a row at one place, as the beginning of a descent asks for."""
    at, found = np.array([np.nan]), np.empty(0)

    def remembered(p: Array) -> Array:
        nonlocal at, found
        if not np.array_equal(p, at):
            found = function(p)
            at = p.copy()
        return found

    return remembered


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
    """Return the end of Gauss-Newton steps, halved if they overshoot, as long as they reduce the sum of squares."""
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
            # near the minimum the change of the sum of squares is rounding; the full step is then accepted
            if total < squares or (not halvings and offset < 1e-2 and total <= squares + blur(squares, rounding)):
                break
        else:
            break
        p, r, squares = candidate, trial, total
    return Run(p, squares, offset, condition)


def gauss_newton(j: Array, r: Array, rounding: float = 0.0) -> tuple[Array, float, float]:
    """Return the step, the relative offset and the condition of the Jacobian with columns of equal length."""
    m, n = j.shape
    size = lengths(j)
    if not (np.isfinite(size).all() and (size > 0).all()):
        return np.zeros(n), np.inf, np.inf
    upper = triangle(j, size)
    condition = float(np.linalg.cond(upper))
    if not condition < CONDITION:
        return np.zeros(n), np.inf, condition
    # Q^T r from the triangular factor alone, with one step of iterative refinement
    along = np.linalg.solve(upper.T, j.T @ r / size)
    along += np.linalg.solve(upper.T, j.T @ (r - j @ (np.linalg.solve(upper, along) / size)) / size)
    step = -np.linalg.solve(upper, along) / size
    across = max(float(r @ r) - float(along @ along), 0.0)
    if not across or float(along @ along) <= rounding:
        return step, 0.0, condition
    offset = float(np.sqrt((along @ along) / n / (across / max(m - n, 1))))
    return step, offset, condition
