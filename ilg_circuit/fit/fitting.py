"""Fits a problem by lmfit, tests the minimum, and computes the covariance.

A fit is accepted only at a minimum (relative offset, see `minimise`) where the data determine every parameter;
otherwise an error is raised.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import NotDetermined, SolveError, argument
from .minimise import gauss_newton, levenberg_marquardt
from .multistart import StartSummary
from .observation import Predict, observation
from .parameter import Parameter
from .problem import RAN_AWAY, Evaluation, Problem, Progress
from .result import FitResult
from .tall import lengths, triangle

MOST_EVALUATIONS = 200
#: Largest distance of a logarithm from its start; beyond it the fit has diverged.
_RUNAWAY = 12.0
#: Largest relative offset of a converged fit: distance of the parameters from the minimum in standard errors.
_OFFSET = 1e-2
#: Largest next step of a logarithm that also counts as converged, for data without noise.
_CLOSE = 1e-6
#: Condition of the Jacobian, its columns of equal length, above which two parameters have the same effect.
_CONDITION = 1e9
#: Least share of a parameter in the undetermined direction, and of its distance to go in the farthest, to be named.
_SHARE, _FARTHEST = 0.3, 0.3
#: Largest first step of a logarithm in a leave-one-out fit, which starts from the first-order estimate.
_LONGEST_STEP = 1.0
#: Rounding of residuals, in parts of the data, that is reckoned with where they are exactly zero.
_ROUNDING = 1e-18
#: Gauss-Newton steps of a fit near its minimum, and the relative offset that ends them.
_NEAR_STEPS, _NEAR_OFFSET = 12, 1e-6
#: Relative rise of the sum of squares that is rounding.
_UPWARDS = 1e-9
#: Relative change of the sum of squares that ends a leave-one-out fit.
_LEFT_OUT = 1e-8


def fit(
    problem: Problem,
    start: Array,
    progress: Progress = None,
    tolerance: float = 1e-10,
    most: int | None = None,
) -> FitResult:
    """Return the fit of ``problem`` from values ``start`` (n,), in the order of its labels.

    ``tolerance`` is the relative change of the sum of squares at which the descent ends, ``most`` the number of its
    evaluations (default 200). Observations that share no parameter are fitted separately.

    Raises
    ------
    SolveError
        The fit does not converge, or the data do not determine a parameter.
    """
    if len(problem.components()) > 1:
        return _each(problem, start, lambda part, begin: fit(part, begin, progress, tolerance, most))
    return _fit_connected(problem, start, progress, tolerance, most)


def fit_near(
    problem: Problem, start: Array, progress: Progress = None, most: int | None = None, offset: float = _NEAR_OFFSET
) -> FitResult:
    """Return the fit of ``problem`` from values ``start`` (n,) near its minimum, by few Gauss-Newton steps.

    Where residuals are more than noise, each step leaves a constant part of the distance to go: the steps are
    accelerated by Anderson's method (J. ACM 12, 547, 1965) of depth 1. They need less memory than a descent, which is
    used if they do not converge, or lead upwards: that method is drawn to maxima, too. ``most`` is the number of its
    evaluations, as of `fit`. The steps end at a relative ``offset``. Raises SolveError as that.
    """
    if len(problem.components()) > 1:
        return _each(problem, start, lambda part, begin: fit_near(part, begin, progress, most, offset))
    evaluate, n = Evaluation(problem, progress), len(problem.labels)
    x = np.concatenate([problem.scales.coordinates(start), np.zeros(problem.nuisance.shape[1])])
    before: tuple[Array, Array] | None = None
    least = np.inf
    for _ in range(_NEAR_STEPS):
        prediction, slopes = evaluate(x[:n])
        whole = np.column_stack([slopes, problem.nuisance])
        residuals = problem.data - prediction - problem.nuisance @ x[n:]
        step, distance, condition = gauss_newton(whole, -residuals)
        left = problem.projected(residuals)
        squares = float(left @ left)
        if not (condition < _CONDITION and squares <= least * (1 + _UPWARDS)):
            break
        least = min(least, squares)
        if distance < offset:
            return finished(problem, x[:n], x[n:], residuals, whole, offset=distance, evaluations=evaluate.count)
        gained = step
        if before is not None:
            moved, change = x - before[0], step - before[1]
            felt = whole @ change  # what the steps change of the prediction is their common unit
            if (size := float(felt @ felt)) > 0:
                gained = step - (whole @ step) @ felt / size * (moved + change)
        before, x = (x, step), x + gained
    return fit(problem, start, progress, most=most)


def _each(problem: Problem, start: Array, fitted: Callable[[Problem, Array], FitResult]) -> FitResult:
    """Return the fits of observations that share no parameter, each by itself, as one."""
    at, groups = dict(zip(problem.labels, start.tolist(), strict=True)), problem.components()
    parts = [problem.of(group) for group in groups]
    return assembled(problem, groups, [fitted(part, np.array([at[name] for name in part.labels])) for part in parts])


def fit_data(
    predict: Predict,
    data: Array,
    names: Sequence[str],
    start: Array,
    nuisance: Array | None = None,
    progress: Progress = None,
    tolerance: float = 1e-10,
    upper: Array | None = None,
) -> FitResult:
    """Return the fit of plain ``data`` (m,) by ``predict`` with positive parameters ``names`` from ``start`` (n,).

    ``nuisance`` (m, q) are linear terms; ``upper`` (n,) are upper limits of the parameters. Raises SolveError as `fit`.
    """
    limits = np.full(len(names), np.inf) if upper is None else upper
    parameters = tuple(Parameter(name, upper=limit) for name, limit in zip(names, limits.tolist(), strict=True))
    return fit(Problem((observation(predict, data, names, nuisance=nuisance),), parameters), start, progress, tolerance)


def fit_without(found: FitResult, left_out: Sequence[int], progress: Progress = None) -> FitResult:
    """Return the fit of all observations except ``left_out``, started from the first-order estimate by the slopes.

    Raises SolveError if the others do not determine every parameter.
    """
    problem = found.problem
    rest = problem.of([k for k in range(len(problem.observations)) if k not in left_out])
    rows = np.concatenate([np.arange(len(problem.data))[s] for k, s in enumerate(problem.slices) if k not in left_out])
    used = np.array([problem.labels.index(label) for label in rest.labels])
    columns = np.concatenate([used, np.arange(len(found.values), found.count)])
    slopes = found.slopes[np.ix_(rows, columns)]
    slopes[:, : len(used)] *= found.units[used]
    size = np.linalg.norm(slopes, axis=0)
    size[size == 0] = 1.0
    step = np.linalg.lstsq(slopes / size, found.residuals[rows], rcond=1e-9)[0] / size
    x = found.coordinates[used] + np.clip(step[: len(used)], -_LONGEST_STEP, _LONGEST_STEP)
    return fit(rest, rest.scales.values(x), progress, _LEFT_OUT)


def _fit_connected(problem: Problem, start: Array, progress: Progress, tolerance: float, most: int | None) -> FitResult:
    n = len(problem.labels)
    scale = float(np.abs(problem.data).max()) or 1.0
    columns = np.abs(problem.nuisance).max(axis=0)
    weights = problem.nuisance / columns
    evaluate = Evaluation(problem, progress)
    origin = problem.scales.coordinates(start)

    def residuals(p: Array) -> Array:
        return (evaluate(p[:n])[0] - problem.data) / scale + weights @ p[n:]

    def jacobian(p: Array) -> Array:
        return np.column_stack([evaluate(p[:n])[1] / scale, weights])

    begin = np.concatenate([origin, np.zeros(len(columns))])
    how = {"ftol": tolerance, "xtol": tolerance**0.8}
    end = levenberg_marquardt(residuals, jacobian, begin, most=most or MOST_EVALUATIONS, **how)
    require_near(problem, end[:n], origin)
    offset = _require_converged(problem, jacobian(end), residuals(end), tolerance, evaluate)
    amounts = end[n:] * scale / columns
    slopes = np.column_stack([evaluate(end[:n])[1], problem.nuisance])
    return finished(
        problem, end[:n], amounts, -residuals(end) * scale, slopes, offset=offset, evaluations=evaluate.count
    )


def finished(
    problem: Problem,
    x: Array,
    amounts: Array,
    residuals: Array,
    slopes: Array,
    *,
    offset: float,
    evaluations: int,
    variance: float | None = None,
    singular: float = np.inf,
) -> FitResult:
    """Return the result at coordinates ``x`` (n,), with its covariance.

    ``residuals`` (samples,) and ``slopes`` (samples, n + q) with respect to coordinates and linear coefficients are
    divided by the sigmas. Every observation has a separate variance, its sum of squares over its degrees of freedom;
    with J = Q R the covariance is R^-1 (sum of v_k Q_k^T Q_k) R^-T, for one observation s^2 (J^T J)^-1. Degrees of
    freedom of each error are Satterthwaite's. ``variance``, if given, is used instead. The covariance is NaN if the
    condition of the slopes, columns of equal length, exceeds ``singular``.
    """
    size = lengths(slopes)
    single = len(problem.observations) == 1
    q, upper = np.empty((0, 0)), np.empty((0, 0))
    if single:  # the orthogonal factor of a long record is large, and not needed
        upper = triangle(slopes, size)
    else:
        q, upper = np.linalg.qr(slopes / size)
    determined = np.isinf(singular) or np.linalg.cond(upper) <= singular
    inverse = np.linalg.inv(upper) / size[:, None] if determined else np.full_like(upper, np.nan)
    units = np.concatenate([problem.scales.slopes(x), np.ones(len(amounts))])
    samples, unknowns = slopes.shape
    if single or variance is not None:
        leverage = np.array([float(unknowns)] if single else [(q[s] ** 2).sum() for s in problem.slices])
        freedom = np.full(len(x), float(max(samples - unknowns, 1)))
        own = _squares(problem, slice(None), residuals) / max(samples - unknowns, 1) if variance is None else variance
        covariance = own * (inverse @ inverse.T)
    else:
        leverage = np.array([(q[s] ** 2).sum() for s in problem.slices])
        spare = np.array([max(s.stop - s.start - p, 1.0) for s, p in zip(problem.slices, leverage, strict=True)])
        squares = np.array([_squares(problem, s, residuals) for s in problem.slices]) / spare
        parts = np.array(
            [v * inverse @ (q[s].T @ q[s]) @ inverse.T for v, s in zip(squares, problem.slices, strict=True)]
        )
        covariance = parts.sum(axis=0)
        shares = np.diagonal(parts, axis1=1, axis2=2)[:, : len(x)]
        least = np.finfo(float).tiny
        freedom = shares.sum(axis=0) ** 2 / np.maximum((shares**2 / spare[:, None]).sum(axis=0), least)
    return FitResult(
        problem=problem,
        values=problem.scales.values(x),
        nuisance=amounts,
        covariance=covariance * np.outer(units, units),
        residuals=residuals,
        slopes=slopes / units,
        leverage=leverage,
        freedom=freedom,
        offset=offset,
        evaluations=evaluations,
    )


def _squares(problem: Problem, part: slice, residuals: Array) -> float:
    """Return the sum of squares of a part of the residuals; where all are exactly zero, that of a little rounding."""
    data, r = problem.data[part], residuals[part]
    rounding = len(data) * (_ROUNDING * float(np.abs(data).max(initial=0.0))) ** 2
    return max(float(r @ r), rounding)


def assembled(problem: Problem, groups: Sequence[Sequence[int]], parts: Sequence[FitResult]) -> FitResult:
    """Return the result of ``problem`` from the results of its components; ``groups`` are their observations."""
    n = len(problem.labels)
    starts = np.cumsum([0, *(o.nuisance.shape[1] for o in problem.observations)]).tolist()
    count = n + starts[-1]
    values, freedom, leverage = np.empty(n), np.empty(n), np.empty(len(problem.observations))
    nuisance, residuals = np.empty(starts[-1]), np.empty(len(problem.data))
    covariance, slopes = np.zeros((count, count)), np.zeros((len(problem.data), count), order="F")
    for group, part in zip(groups, parts, strict=True):
        rows = np.concatenate([np.arange(len(problem.data))[problem.slices[k]] for k in group])
        linear = np.concatenate([np.arange(starts[k], starts[k + 1]) for k in group]).astype(int)
        moved = np.array([problem.labels.index(label) for label in part.labels], dtype=int)
        columns = np.concatenate([moved, n + linear])
        values[moved], freedom[moved], nuisance[linear] = part.values, part.freedom, part.nuisance
        residuals[rows], leverage[list(group)] = part.residuals, part.leverage
        covariance[np.ix_(columns, columns)] = part.covariance
        slopes[np.ix_(rows, columns)] = part.slopes
    return FitResult(
        problem=problem,
        values=values,
        nuisance=nuisance,
        covariance=covariance,
        residuals=residuals,
        slopes=slopes,
        leverage=leverage,
        freedom=freedom,
        offset=max(part.offset for part in parts),
        evaluations=sum(part.evaluations for part in parts),
        starts=min((part.starts for part in parts), key=lambda s: s.agreeing),
        components=tuple(parts),
    )


def composed(problem: Problem, parts: Sequence[FitResult]) -> FitResult:
    """Return the result of ``problem``, whose components are the problems of ``parts``."""
    groups = problem.components()
    by_labels = {frozenset(part.labels): part for part in parts}
    chosen = [by_labels[frozenset(problem.of(group).labels)] for group in groups]
    return chosen[0] if len(groups) == 1 else assembled(problem, groups, chosen)


def with_starts(found: FitResult, starts: StartSummary) -> FitResult:
    """Return the fit with a summary of its starts."""
    return replace(found, starts=starts)


def require_near(problem: Problem, x: Array, origin: Array, most: float = _RUNAWAY) -> None:
    """Raise NotDetermined, with names, if coordinates (n,) are farther than ``most`` from their ``origin``."""
    far = (np.abs(x - origin) > most) & ~problem.scales.free
    lost = [label for label, away in zip(problem.labels, far, strict=True) if away]
    if lost:
        raise NotDetermined(f"{RAN_AWAY} ({', '.join(lost)})", lost)


def _require_converged(problem: Problem, slope: Array, residuals: Array, tolerance: float, done: Evaluation) -> float:
    """Return the relative offset of a fit at a minimum.

    Raises SolveError elsewhere: if the fit ended early, on a plateau, or where two parameters have the same effect.
    """
    size = np.linalg.norm(slope, axis=0)
    unfelt = [label for label, felt in zip(problem.labels, size, strict=False) if not felt > 0]
    if unfelt:
        raise NotDetermined(
            f"the data do not determine every parameter of this model: {', '.join(unfelt)} has no effect on them",
            unfelt,
        )
    step, offset, condition = gauss_newton(slope, residuals)
    if not condition < _CONDITION:
        *others, last = acting_alike(slope, problem.labels)
        alike = f"{', '.join(others)} and {last}" if others else last
        raise NotDetermined(
            f"the data do not determine every parameter of this model: {alike} have the same effect", (*others, last)
        )
    # with a loose tolerance a fit may end farther from the minimum
    limit = max(_OFFSET, 10 * float(np.sqrt(tolerance * len(residuals) / len(size))))
    if offset > limit and np.abs(step[: len(problem.labels)]).max(initial=0.0) > _CLOSE:
        if done.unsolved:
            missed = f"{len(done.unsolved)} of {done.count} evaluations could not be solved: {done.unsolved[-1]}"
            raise SolveError(f"the fit did not converge; {missed}")
        far = np.abs(step[: len(problem.labels)])
        lost = [label for label, distance in zip(problem.labels, far, strict=True) if distance >= _FARTHEST * far.max()]
        raise NotDetermined(
            f"the fit did not converge in {done.count} evaluations: the data do not determine this model; "
            f"try {argument('model', 'rc')}",
            lost,
        )
    return offset


def acting_alike(slope: Array, labels: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters, two or more, of the direction with the least effect by ``slope`` (samples, parameters)."""
    direction = np.abs(np.linalg.svd(slope / np.linalg.norm(slope, axis=0))[2][-1])
    felt = direction[: len(labels)]
    chosen = felt >= min(_SHARE, float(np.sort(felt)[-min(2, len(felt))]))
    return tuple(label for label, member in zip(labels, chosen, strict=True) if member)
