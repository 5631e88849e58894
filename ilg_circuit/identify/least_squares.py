"""Least squares with a circuit transient in the loop: lmfit drives, ngspice evaluates.

All parameters are positive, so their logarithms are fitted, or log(p/(1 - p)) where they stay below a limit. The
columns of a Jacobian are central differences whose 2 n + 1 circuits are solved together in one netlist.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError

Array = NDArray[np.float64]

#: values (m, parameters) -> model (m, samples)
Model = Callable[[Array], Array]

_STEP = 1e-4
_RAN_AWAY = "the fit ran away: the data do not determine every parameter of this model"
_MOST_EVALUATIONS = 200
#: A logarithm that leaves this distance from its start has run away: the data do not hold it.
_RUNAWAY = 25.0
#: So far from its start a logarithm is no sensible value any more, whatever the solver makes of it.
_FAR = 5.0


@dataclass(frozen=True)
class Fit:
    """Result of a fit: positive parameters, then linear nuisance terms, each with its standard error.

    ``covariance`` is that of (values, nuisance), in their units; ``residuals`` = data - model (samples,); ``slopes``
    (samples, values and nuisance) are those of the model. ``parts`` are the numbers of samples of several data sets in
    turn; empty for one.
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
    parts: tuple[int, ...] = ()

    @property
    def rmse(self) -> float:
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def count(self) -> int:
        return len(self.values) + len(self.nuisance)

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
    import lmfit

    linear = np.zeros((len(data), 0)) if nuisance is None else nuisance
    n, k = len(names), linear.shape[1]
    scale = float(np.abs(data).max()) or 1.0
    columns = np.abs(linear).max(axis=0)
    weights = linear / columns if k else linear
    scales = Scales(np.full(n, np.inf) if below is None else below)
    evaluate = _Evaluation(lambda x: model(scales.values(x)), n, progress)

    parameters = lmfit.Parameters()
    for j, value in enumerate(scales.coordinates(start)):
        parameters.add(f"p{j}", value=float(value))
    for j in range(k):
        parameters.add(f"n{j}", value=0.0)

    def unpack(current: lmfit.Parameters) -> tuple[Array, Array]:
        return (
            np.array([current[f"p{j}"].value for j in range(n)]),
            np.array([current[f"n{j}"].value for j in range(k)]),
        )

    def residual(current: lmfit.Parameters) -> Array:
        logs, amounts = unpack(current)
        return (evaluate(logs)[0] - data) / scale + weights @ amounts

    def jacobian(current: lmfit.Parameters) -> Array:
        logs, _ = unpack(current)
        return np.column_stack([evaluate(logs)[1] / scale, weights])

    minimizer = lmfit.Minimizer(residual, parameters, nan_policy="raise")
    result = minimizer.leastsq(
        Dfun=jacobian, col_deriv=0, max_nfev=_MOST_EVALUATIONS, ftol=tolerance, xtol=tolerance**0.8, gtol=0.0
    )
    if not result.success and evaluate.best_change > 1e-8:
        raise SolveError(
            f"the fit did not converge in {evaluate.count} evaluations: the data do not determine this model; "
            "try --model rc"
        )
    logs, amounts = unpack(result.params)
    if np.abs(logs - scales.coordinates(start)).max(initial=0.0) > _RUNAWAY:
        raise SolveError(_RAN_AWAY)
    slope = jacobian(result.params)
    return _finish(names, logs, scales, amounts, residual(result.params) * scale, slope, scale, columns, evaluate.count)


def _finish(
    names: Sequence[str],
    logs: Array,
    scales: Scales,
    amounts: Array,
    residuals: Array,
    slope: Array,
    scale: float,
    columns: Array,
    count: int,
) -> Fit:
    """Covariance s^2 (J^T J)^-1 by QR, in the parameters' own units, and the statistics."""
    samples, unknowns = slope.shape
    size = np.sqrt((slope**2).sum(axis=0))
    if not (size > 0).all():
        raise SolveError("the data do not determine every parameter of this model")
    r = np.linalg.qr(slope / size, mode="r")
    if np.linalg.cond(r) > 1e9:
        raise SolveError("the data do not determine every parameter of this model: two of them act alike")
    inverse = np.linalg.inv(r) / size[:, None]
    variance = float((residuals**2).sum() / scale**2 / max(samples - unknowns, 1))
    values = scales.values(logs)
    units = np.concatenate([scales.slopes(logs), scale / columns if len(columns) else np.empty(0)])
    covariance = variance * (inverse @ inverse.T) * np.outer(units, units)
    errors = np.sqrt(np.diag(covariance))
    n = len(values)
    chi = max(float((residuals**2).sum()), np.finfo(float).tiny)
    likelihood = samples * np.log(chi / samples)
    return Fit(
        names=tuple(names),
        values=values,
        errors=errors[:n],
        covariance=covariance,
        nuisance=amounts * units[n:],
        nuisance_errors=errors[n:],
        residuals=-residuals,
        aic=float(likelihood + 2 * unknowns),
        bic=float(likelihood + np.log(samples) * unknowns),
        evaluations=count,
        slopes=slope * scale / units,
    )


@dataclass(frozen=True)
class Scales:
    """Coordinates without limits for positive parameters, some of them ``below`` a limit (infinite: none)."""

    below: Array

    def coordinates(self, values: Array) -> Array:
        return np.asarray(np.log(values) - np.where(np.isinf(self.below), 0.0, np.log1p(-values / self.below)))

    def values(self, x: Array) -> Array:
        e = np.exp(x)
        return np.asarray(e / (1 + e / self.below))

    def slopes(self, x: Array) -> Array:
        """d values / d coordinates."""
        v = self.values(x)
        return np.asarray(v * (1 - v / self.below))


class _Evaluation:
    """Model and Jacobian at a point, solved together and kept for the other of the two callbacks."""

    def __init__(self, model: Model, parameters: int, progress: Callable[[], None] | None) -> None:
        self._model, self._n, self._progress = model, parameters, progress
        self._at = self._start = np.full(parameters, np.nan)
        self._result: tuple[Array, Array] = (np.empty(0), np.empty(0))
        self.count = 0
        self.best_change = np.inf

    def __call__(self, logs: Array) -> tuple[Array, Array]:
        if not self.count:
            self._start = logs.copy()
        if not np.array_equal(logs, self._at):
            steps = np.concatenate([np.zeros((1, self._n)), _STEP * np.eye(self._n), -_STEP * np.eye(self._n)])
            try:
                waves = self._model(logs + steps)
            except InputError:  # a value beyond all measure
                raise SolveError(_RAN_AWAY) from None
            except SolveError:  # or one that is still a number, but no circuit that can be solved
                if np.abs(logs - self._start).max() >= _FAR:
                    raise SolveError(_RAN_AWAY) from None
                if not self.count:
                    raise
                # a step too far: so large a misfit that it is taken back
                kept, slopes = self._result
                self.count += 1
                return kept + 1e3 * np.abs(kept).max(), slopes
            central = (waves[1 : self._n + 1] - waves[self._n + 1 :]) / (2 * _STEP)
            self.best_change = float(np.abs(logs - self._at).max()) if self.count else np.inf
            self._at, self._result = logs.copy(), (waves[0], central.T)
            self.count += 1
            if self._progress:
                self._progress()
        return self._result
