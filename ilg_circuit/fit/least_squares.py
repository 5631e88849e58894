"""Least squares with a circuit transient in the loop: lmfit drives, ngspice evaluates.

What lmfit calls a success is not believed: a fit counts only where the tangent plane explains nothing more of the
residuals (Bates and Watts' relative offset, see `multistart`), and every parameter is felt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SolveError
from .multistart import gauss_newton
from .problem import RAN_AWAY, Evaluation, Model, Problem, Scales

Array = NDArray[np.float64]

_MOST_EVALUATIONS = 200
#: A logarithm that leaves this distance from its start has run away: the data do not hold it.
_RUNAWAY = 12.0
#: Relative offset of a fit that has converged: its parameters are within this part of their standard errors.
_OFFSET = 1e-2
#: Or the next step would move no logarithm by more: data without noise, met to the solver's accuracy.
_CLOSE = 1e-6
#: Condition of the Jacobian, its columns of equal length, beyond which two parameters act alike.
_CONDITION = 1e9
#: Parameters with this share of the direction that the data do not feel are named.
_SHARE = 0.3


@dataclass(frozen=True)
class Fit:
    """Result of a fit: positive parameters, then linear nuisance terms, each with its standard error.

    ``covariance`` is that of (values, nuisance), in their units; ``residuals`` = data - model (samples,); ``slopes``
    (samples, values and nuisance) are those of the model; ``offset`` tells how well it has converged; ``problem`` is
    what was fitted. ``parts`` are the numbers of samples of several data sets in turn; empty for one.
    """

    names: tuple[str, ...]
    values: Array
    errors: Array
    covariance: Array
    nuisance: Array
    nuisance_errors: Array
    residuals: Array
    aic: float
    bic: float
    evaluations: int
    slopes: Array
    offset: float
    problem: Problem
    parts: tuple[int, ...] = ()

    @property
    def rmse(self) -> float:
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def count(self) -> int:
        return len(self.values) + len(self.nuisance)

    @property
    def freedom(self) -> int:
        """Degrees of freedom."""
        return max(len(self.residuals) - self.count, 1)

    @property
    def coordinates(self) -> Array:
        """Logarithms (n,) of the values, or what stands for them below a limit."""
        return self.problem.scales.coordinates(self.values)

    @property
    def units(self) -> Array:
        """d values / d coordinates (n,)."""
        return self.problem.scales.slopes(self.coordinates)

    @property
    def intervals(self) -> Array:
        """95 % intervals (n, 2) by the covariance and Student's t, symmetric about the coordinates.

        No end is negative, and a resistance is treated as the conductance that it is the inverse of.
        """
        from scipy.stats import t as student

        middle, half = self.coordinates, float(student.ppf(0.975, self.freedom)) * self.errors / self.units
        return np.column_stack([self.problem.scales.values(middle + sign * half) for sign in (-1.0, 1.0)])

    def correlations(self) -> Array:
        """Correlation matrix of the parameters (nuisance terms left out)."""
        n = len(self.values)
        scale = np.sqrt(np.diag(self.covariance)[:n])
        return np.asarray(self.covariance[:n, :n] / np.outer(scale, scale))


def fit_circuit(
    model: Model,
    data: Array,
    names: Sequence[str],
    start: Array,
    nuisance: Array | None = None,
    progress: Callable[[], None] | None = None,
    tolerance: float = 1e-10,
    below: Array | None = None,
) -> Fit:
    """Fit ``data`` (samples,) by ``model`` with parameters from ``start`` (n,), plus ``nuisance`` (samples, k) columns.

    ``tolerance`` is the relative change of the sum of squares at which the fit ends; ``below`` (n,) are limits of the
    parameters, infinite where there is none.

    Raises SolveError when the fit does not converge, or when the data do not determine a parameter.
    """
    linear = np.zeros((len(data), 0)) if nuisance is None else nuisance
    scales = Scales(np.full(len(names), np.inf) if below is None else below)
    return fit_problem(Problem(model, data, tuple(names), scales, linear), start, progress, tolerance)


def fit_problem(
    problem: Problem, start: Array, progress: Callable[[], None] | None = None, tolerance: float = 1e-10
) -> Fit:
    """As `fit_circuit`, of a problem already put together."""
    import lmfit

    data, linear = problem.data, problem.nuisance
    n, k = len(problem.names), linear.shape[1]
    scale = float(np.abs(data).max()) or 1.0
    columns = np.abs(linear).max(axis=0)
    weights = linear / columns if k else linear
    evaluate = Evaluation(problem, progress)
    origin = problem.scales.coordinates(start)

    parameters = lmfit.Parameters()
    for j, value in enumerate(origin):
        parameters.add(f"p{j}", value=float(value))
    for j in range(k):
        parameters.add(f"n{j}", value=0.0)

    def unpack(current: lmfit.Parameters) -> tuple[Array, Array]:
        return (
            np.array([current[f"p{j}"].value for j in range(n)]),
            np.array([current[f"n{j}"].value for j in range(k)]),
        )

    def residual(current: lmfit.Parameters) -> Array:
        x, amounts = unpack(current)
        return (evaluate(x)[0] - data) / scale + weights @ amounts

    def jacobian(current: lmfit.Parameters) -> Array:
        x, _ = unpack(current)
        return np.column_stack([evaluate(x)[1] / scale, weights])

    minimizer = lmfit.Minimizer(residual, parameters, nan_policy="raise")
    result = minimizer.leastsq(
        Dfun=jacobian, col_deriv=0, max_nfev=_MOST_EVALUATIONS, ftol=tolerance, xtol=tolerance**0.8, gtol=0.0
    )
    x, amounts = unpack(result.params)
    require_near(problem, x, origin)
    rest, slope = residual(result.params), jacobian(result.params)
    offset = _converged(problem, slope, rest, tolerance, evaluate.count)
    return _finish(problem, x, amounts, rest * scale, slope, scale, columns, offset, evaluate.count)


def require_near(problem: Problem, x: Array, origin: Array) -> None:
    """Raise SolveError where coordinates (n,) have run away from their ``origin``, by name."""
    gone = [name for name, far in zip(problem.names, np.abs(x - origin) > _RUNAWAY, strict=True) if far]
    if gone:
        raise SolveError(f"{RAN_AWAY} ({', '.join(gone)})")


def _converged(problem: Problem, slope: Array, rest: Array, tolerance: float, count: int) -> float:
    """The relative offset of a fit that stands at a minimum.

    Raises SolveError where the fit does not: it ended early, on a plain, or where two parameters act alike.
    """
    size = np.linalg.norm(slope, axis=0)
    unfelt = [name for name, felt in zip(problem.names, size, strict=False) if not felt > 0]
    if unfelt:
        raise SolveError(f"the data do not determine every parameter of this model: {', '.join(unfelt)} is not felt")
    step, offset, condition = gauss_newton(slope, rest, 0.0)
    if not condition < _CONDITION:
        *others, last = acting_alike(slope, problem.names)
        alike = f"{', '.join(others)} and {last}" if others else last
        raise SolveError(f"the data do not determine every parameter of this model: {alike} act alike")
    # a fit told to end early may end as far from the minimum as its tolerance allows
    limit = max(_OFFSET, 10 * float(np.sqrt(tolerance * len(rest) / len(size))))
    n = len(problem.names)
    if offset > limit and np.abs(step[:n]).max(initial=0.0) > _CLOSE:
        raise SolveError(
            f"the fit did not converge in {count} evaluations: the data do not determine this model; try --model rc"
        )
    return offset


def acting_alike(slope: Array, names: Sequence[str]) -> tuple[str, ...]:
    """The parameters, at least two, of the direction that ``slope`` (samples, parameters first) feels least."""
    direction = np.abs(np.linalg.svd(slope / np.linalg.norm(slope, axis=0))[2][-1])
    felt = direction[: len(names)]
    chosen = felt >= min(_SHARE, float(np.sort(felt)[-min(2, len(felt))]))
    return tuple(name for name, member in zip(names, chosen, strict=True) if member)


def _finish(
    problem: Problem,
    x: Array,
    amounts: Array,
    residuals: Array,
    slope: Array,
    scale: float,
    columns: Array,
    offset: float,
    count: int,
) -> Fit:
    """Covariance s^2 (J^T J)^-1 by QR, in the parameters' own units, and the statistics."""
    samples, unknowns = slope.shape
    size = np.linalg.norm(slope, axis=0)
    inverse = np.linalg.inv(np.linalg.qr(slope / size, mode="r")) / size[:, None]
    variance = float((residuals**2).sum() / scale**2 / max(samples - unknowns, 1))
    units = np.concatenate([problem.scales.slopes(x), scale / columns if len(columns) else np.empty(0)])
    covariance = variance * (inverse @ inverse.T) * np.outer(units, units)
    errors = np.sqrt(np.diag(covariance))
    n = len(x)
    chi = max(float((residuals**2).sum()), np.finfo(float).tiny)
    likelihood = samples * np.log(chi / samples)
    return Fit(
        names=problem.names,
        values=problem.scales.values(x),
        errors=errors[:n],
        covariance=covariance,
        nuisance=amounts * units[n:],
        nuisance_errors=errors[n:],
        residuals=-residuals,
        aic=float(likelihood + 2 * unknowns),
        bic=float(likelihood + np.log(samples) * unknowns),
        evaluations=count,
        slopes=slope * scale / units,
        offset=offset,
        problem=problem,
    )
