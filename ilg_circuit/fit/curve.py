"""Least-squares fits of any curve y = model(x, *parameters), with standard errors.

Parameters that enter linearly are detected and eliminated in the search for starts (variable projection, Golub and
Pereyra 1973). Fits then run from the given start and from the best of many others scattered around it, over decades if
necessary. The result was reached from at least two starts and is a minimum by its gradient; otherwise SolveError is
raised.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, one_thread
from ..errors import InputError, SolveError, checked
from .criteria import structured
from .fitting import finished, with_starts
from .minimise import HUGE, Run
from .multistart import Search, StartSummary, gather, search
from .observation import Observation
from .parameter import Parameter
from .problem import Problem
from .result import FitResult

#: Relative step of central differences, at which rounding and truncation errors are similar.
_STEP = 6e-6
#: Number of scattered starts per nonlinear parameter whose sums of squares are compared; number of fits from the best.
_SCATTERED, _FITS = 60, 8
_ROUNDS = 5
#: Decades within which scattered starts lie about the given one, in each round.
_DECADES = (0.1, 0.5, 1.0, 2.0, 4.0)


@one_thread()
@checked
def fit_curve(
    model: Callable[..., Any],
    x: Any,
    y: ArrayLike,
    start: ArrayLike,
    *,
    sigma: ArrayLike | None = None,
    absolute_sigma: bool = False,
    names: Sequence[str] = (),
    seed: int = 0,
) -> FitResult:
    """Return the fit of ``y`` (m,), real or complex, by ``model(x, *parameters)`` (m,).

    Parameters
    ----------
    model : callable
        Function of ``x`` and the parameters.
    x : Any
        Abscissa of y, in any form; it is passed to the model unchanged.
    y : array_like
        Measured values (m,).
    start : array_like
        Starting values (n,). They need not be near the solution; right signs and sizes help.
    sigma : array_like, optional
        Standard deviations of y (m,).
    absolute_sigma : bool
        True if ``sigma`` are absolute; False if only their ratios are known.
    names : sequence of str
        Names of the parameters (default: b1, b2, ...).
    seed : int
        The same seed gives the same answer.

    Returns
    -------
    FitResult
        Values, errors and intervals of the parameters, residuals.

    Raises
    ------
    InputError
        The data cannot be fitted.
    SolveError
        No minimum was found twice, or a parameter is not determined.

    Examples
    --------
    >>> x = np.linspace(0, 5, 20)
    >>> fit = fit_curve(lambda x, a, b: a * np.exp(-b * x), x, 3 * np.exp(-2 * x), [1, 1], names=("a", "b"))
    >>> fit.labels, fit.values.round(9).tolist()
    (('a', 'b'), [3.0, 2.0])
    >>> round(fit["b"].value, 9), fit["b"].stderr < 1e-9
    (2.0, True)
    """
    curve = _Curve(model, x, y, sigma, np.atleast_1d(np.asarray(start, dtype=float)))
    if names and len(names) != len(curve.start):
        raise InputError(f"{len(names)} names for {len(curve.start)} parameters")
    found, own = _searched(curve, np.random.default_rng(seed))
    best = found.best
    if best.degenerate:
        raise SolveError(
            "the fit diverged or two parameters have the same effect: the data do not determine every parameter of "
            "this curve"
        )
    if not best.converged:
        raise SolveError(f"the fit did not converge from {len(found.runs)} starts; give a better one")
    if found.agreeing < 2:
        raise SolveError(
            f"the best of {len(found.runs)} fits was not reached a second time: it may not be the global minimum; "
            "give a better start"
        )
    p = _nearest(found, own, curve.start)
    labels = tuple(names) or tuple(f"b{k}" for k in range(1, len(p) + 1))
    problem = Problem((curve.observation(labels),), tuple(Parameter(label, lower=-np.inf) for label in labels))
    result = finished(
        problem,
        p,
        np.empty(0),
        -curve.residuals(p),
        curve.jacobian(p),
        offset=best.offset,
        evaluations=0,
        variance=1.0 if absolute_sigma else None,
    )
    return with_starts(result, StartSummary(len(found.runs), found.agreeing))


class _Curve:
    """Weighted residuals of a curve as real numbers (m,), their Jacobian, and the parameters that enter linearly."""

    def __init__(self, model: Callable[..., Any], x: Any, y: ArrayLike, sigma: ArrayLike | None, start: Array) -> None:
        self.y = np.asarray(y)
        if self.y.ndim != 1 or not np.issubdtype(self.y.dtype, np.number) or not np.isfinite(self.y).all():
            raise InputError("a fit needs a row of finite numbers y")
        if start.ndim != 1 or not len(start) or not np.isfinite(start).all():
            raise InputError("a fit needs a finite start for every parameter")
        deviation = np.ones(len(self.y)) if sigma is None else np.broadcast_to(np.asarray(sigma, float), self.y.shape)
        if not (np.isfinite(deviation).all() and (deviation > 0).all()):
            raise InputError("standard deviations of y must be positive and finite")
        self._model, self._x, self.start = model, x, start
        self._channels = 2 if np.iscomplexobj(self.y) else 1
        self.sigma = np.tile(deviation, self._channels)
        self.data = self._flat(self.y) / self.sigma
        if len(self.data) <= len(start):
            raise InputError(f"{len(self.data)} numbers do not determine {len(start)} parameters; more are needed")
        # residual due to rounding of y and of the model
        self.rounding = float(len(self.data) * (2 * np.finfo(float).eps * np.abs(self.data).max(initial=0.0)) ** 2)
        self.curve(start, check=True)

    def observation(self, names: tuple[str, ...]) -> Observation:
        """Return the curve as an observation of the fit."""

        def predict(sets: Array) -> Array:
            return np.array([self.curve(p) * self.sigma for p in sets])

        places = np.asarray(self._x) if np.shape(self._x) == self.y.shape else np.arange(len(self.y), dtype=float)
        data, nothing = self._flat(self.y), np.zeros((len(self.data), 0))
        return Observation(
            source="data",
            quantity="data",
            unit="",
            x=places,
            data=data,
            names=names,
            predict=predict,
            nuisance=nothing,
            sigma=self.sigma,
            channels=self._channels,
            derivatives=self._unweighted,
        )

    def _unweighted(self, p: Array) -> Array:
        return self.jacobian(p) * self.sigma[:, None]

    def curve(self, p: Array, check: bool = False) -> Array:
        """Return the weighted model (m,), NaN where it is not defined."""
        try:
            with np.errstate(all="ignore"):
                value = np.asarray(self._model(self._x, *p.tolist()))
        except (ArithmeticError, ValueError):
            if check:
                raise
            return np.full(len(self.data), np.nan)
        if check and value.shape != self.y.shape:
            raise InputError(f"the model gives an answer of shape {value.shape} for y of shape {self.y.shape}")
        if np.iscomplexobj(value) and self._channels == 1:
            return np.full(len(self.data), np.nan)
        return self._flat(value) / self.sigma

    def _flat(self, values: NDArray[Any]) -> Array:
        return np.concatenate([values.real, values.imag] if self._channels == 2 else [values]).astype(float)

    def residuals(self, p: Array) -> Array:
        return self.curve(p) - self.data

    def structured(self, p: Array) -> bool:
        """Return True if residuals are autocorrelated along x, or in the given order if x is not numeric."""
        x = np.asarray(self._x)
        order = np.argsort(x, kind="stable") if x.shape == self.y.shape else np.arange(len(self.y))
        return any(structured(part[order]) for part in np.split(self.residuals(p), self._channels))

    def jacobian(self, p: Array) -> Array:
        """Return central differences with steps adapted to the scale on which the curve varies."""
        columns = []
        here = self.curve(p)
        size = float(np.linalg.norm(here)) if (np.abs(here) < HUGE).all() else 1.0
        for k in range(len(p)):
            usual = _STEP * (abs(self.start[k]) or 1.0)
            step = _STEP * abs(p[k]) or usual
            column, slope = self._slope(p, k, step)
            while not slope and step < usual:  # too short to have an effect
                step = min(1e3 * step, usual)
                column, slope = self._slope(p, k, step)
            if slope > 0:
                fitting = _STEP * size / slope
                if not 0.1 * step < fitting < 1e3 * step:
                    column, _ = self._slope(p, k, min(max(fitting, 1e-4 * step), 1e3 * step))
            columns.append(column)
        return np.column_stack(columns)

    def _slope(self, p: Array, k: int, step: float) -> tuple[Array, float]:
        """Return the derivative with respect to parameter k, and its size (zero if it has no effect)."""
        ahead, behind = p.copy(), p.copy()
        ahead[k] += step
        behind[k] -= step
        with np.errstate(all="ignore"):
            column = (self.curve(ahead) - self.curve(behind)) / (ahead[k] - behind[k])
        return column, float(np.linalg.norm(column)) if (np.abs(column) < HUGE).all() else 0.0

    def linear(self, random: np.random.Generator) -> list[int]:
        """Return parameters in which the curve is jointly affine, by second differences at a few points."""
        chosen: list[int] = []
        for k in range(len(self.start)):
            if all(self._affine(k, j, random) for j in [*chosen, k] for _ in range(2)):
                chosen.append(k)
        return chosen

    def _affine(self, k: int, j: int, random: np.random.Generator) -> bool:
        p = self.start * random.uniform(0.8, 1.2, len(self.start))
        a, b = np.zeros(len(p)), np.zeros(len(p))
        a[k], b[j] = 0.5 * (p[k] or 1.0), 0.7 * (p[j] or 1.0)
        values = [self.curve(v) for v in (p + a + b, p + a, p + b, p)]
        bend = values[0] - values[1] - values[2] + values[3]
        size = max(float(np.abs(v).max()) for v in values)
        return bool(np.isfinite(size) and np.abs(bend).max() <= 1e-12 * size)

    def projected(self, p: Array, linear: Sequence[int]) -> Array:
        """Return ``p`` with its linear parameters solved for."""
        if not linear:
            return p
        base = p.copy()
        base[list(linear)] = 0.0
        rest = self.curve(base)
        columns = []
        for k in linear:
            unit = base.copy()
            unit[k] = 1.0
            columns.append(self.curve(unit) - rest)
        matrix = np.column_stack(columns)
        if not (np.abs(matrix) < HUGE).all() or not (np.abs(rest) < HUGE).all():
            return p
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0] = 1.0
        base[list(linear)] = np.linalg.lstsq(matrix / size, self.data - rest, rcond=1e-13)[0] / size
        return base


def _searched(curve: _Curve, random: np.random.Generator) -> tuple[Search, Run]:
    """Return the fits from all starts, with increasing scatter, and the run from the given start.

    The search ends when two rounds give the same best minimum, reached twice. All rounds are run if its residuals are
    autocorrelated, as they are at a local minimum.
    """
    linear = curve.linear(random)
    free = [k for k in range(len(curve.start)) if k not in linear]
    found = search(curve.residuals, curve.jacobian, [curve.start], rounding=curve.rounding)
    runs, first = list(found.runs), found.best
    trusted = 0
    for turn in range(_ROUNDS):
        starts = [] if turn else [curve.projected(curve.start, linear)]
        starts += _scattered(curve, curve.start, linear, free, random, _FITS)
        if np.isfinite(found.best.sum_of_squares):
            starts += _scattered(curve, found.best.parameters, linear, free, random, _FITS if turn else 1)
        if not starts:
            raise SolveError("the curve has no finite value at or around the start; give a better one")
        before = found.best.sum_of_squares
        runs += search(curve.residuals, curve.jacobian, starts, rounding=curve.rounding).runs
        found = gather(runs, curve.rounding)
        trusted += found.agreeing >= 2 and found.best.sum_of_squares >= before * (1 - 1e-9) - curve.rounding
        if trusted and (not free or (turn and not curve.structured(found.best.parameters))):
            break
    return found, first


def _scattered(
    curve: _Curve, centre: Array, linear: list[int], free: list[int], random: np.random.Generator, count: int
) -> list[Array]:
    """Return the best ``count`` distinct starts of many around ``centre``."""
    candidates: list[tuple[float, Array]] = []
    for k in range(_SCATTERED * max(len(free), 1)):
        decades = _DECADES[k % len(_DECADES)]
        p = centre.copy()
        p[p == 0] = 10.0 ** random.uniform(-3, 1, int((p == 0).sum()))
        # all parameters, or only a few of them
        moved = random.random(len(p)) < (1.0 if k % 2 else 0.4)
        p[moved] *= 10.0 ** random.uniform(-decades, decades, int(moved.sum()))
        if k % 4 == 3:
            p *= random.choice([-1.0, 1.0], len(p))
        p = curve.projected(p, linear)
        r = curve.residuals(p)
        if (np.abs(r) < HUGE).all():
            candidates.append((float(r @ r), p))
    candidates.sort(key=lambda pair: pair[0])
    chosen: list[tuple[float, Array]] = []
    for squares, p in candidates:
        if all(squares > other * (1 + 1e-6) or np.abs(p - q).max() > 0 for other, q in chosen):
            chosen.append((squares, p))
        if len(chosen) == count:
            break
    return [p for _, p in chosen]


def _nearest(found: Search, own: Run, start: Array) -> Array:
    """Return the run ``own`` if it is among equal minima (exchanged terms, a sign), else the nearest to the start."""
    equal = found.runs[: found.agreeing]
    if any(run is own for run in equal):
        return own.parameters

    def distance(run: Run) -> float:
        size = np.abs(run.parameters) + np.abs(start)
        return float((((run.parameters - start) / np.where(size > 0, size, 1.0)) ** 2).sum())

    return min(equal, key=distance).parameters
