"""The result of a fit: values, covariance and residuals at a minimum."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array
from ..result import Column, Curve, Result
from .criteria import likelihood
from .estimate import Estimate, Estimated
from .multistart import ONE_START, StartSummary
from .problem import Problem
from .quantiles import student
from .tall import lengths, triangle


@dataclass(frozen=True, repr=False, eq=False)
class FitResult(Estimated, Result):
    """The converged least-squares fit of a problem, as `ilg_circuit.fit_curve` returns it.

    ``fit["name"]`` is a parameter's `Estimate`. There are n parameters and q linear terms (nuisance), such as offsets.

    Attributes
    ----------
    labels : tuple of str
        Names of the parameters, in the order of ``values``.
    values : ndarray (n,)
        Values of the parameters.
    covariance : ndarray (n + q, n + q)
        Covariance of (values, nuisance), in their units.
    residuals : ndarray (samples,)
        Data minus prediction, over the standard deviations.
    nuisance : ndarray (q,)
        Amounts of the linear terms.
    slopes : ndarray (samples, n + q)
        Derivatives of the prediction with respect to (values, nuisance), over the standard deviations.
    leverage : ndarray (observations,)
        Number of unknowns that each observation determines.
    freedom : ndarray (n,)
        Degrees of freedom of each standard error.
    offset : float
        Relative offset: distance from the minimum, in standard errors of the parameters.
    starts : StartSummary
        Number of starts, and how many agree on the minimum.
    components : tuple of FitResult
        The independent fits of a problem whose observations share no parameter.
    problem : Problem
        The observations and parameters.
    """

    presenter: ClassVar[str] = "curve"

    problem: Problem
    values: Array
    nuisance: Array
    covariance: Array
    residuals: Array
    slopes: Array
    leverage: Array
    freedom: Array
    offset: float
    evaluations: int
    starts: StartSummary = ONE_START
    components: tuple[FitResult, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels (n,) of the values."""
        return self.problem.labels

    @property
    def parts(self) -> tuple[FitResult, ...]:
        """The fits of the problem's components; the fit itself if there is only one."""
        return self.components or (self,)

    @property
    def projection(self) -> Array:
        """Changes (n, samples) of the values with each residual, to first order, in their units."""
        size = np.linalg.norm(self.slopes, axis=0)
        return np.asarray((np.linalg.pinv(self.slopes / size) / size[:, None])[: len(self.values)])

    @cached_property
    def errors(self) -> Array:
        """Standard errors (n,) by the covariance."""
        return np.sqrt(np.diag(self.covariance))[: len(self.values)]

    @cached_property
    def pooled_errors(self) -> Array:
        """Standard errors (n,) with one variance for all observations, s^2 (J^T J)^-1."""
        if len(self.problem.observations) == 1:
            return self.errors
        size = lengths(self.slopes)
        inverse = np.linalg.inv(triangle(self.slopes, size)) / size[:, None]
        return self.deviation * np.linalg.norm(inverse, axis=1)[: len(self.values)]

    @cached_property
    def nuisance_errors(self) -> Array:
        """Standard errors (q,) of the linear terms."""
        return np.sqrt(np.diag(self.covariance))[len(self.values) :]

    @property
    def count(self) -> int:
        """Number of unknowns, linear terms included."""
        return len(self.values) + len(self.nuisance)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of residuals minus number of unknowns, at least 1."""
        return max(len(self.residuals) - self.count, 1)

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared weighted residuals."""
        return float(self.residuals @ self.residuals)

    @property
    def deviation(self) -> float:
        """Standard deviation of the residuals, over the sigmas."""
        return float(np.sqrt(self.sum_of_squares / self.degrees_of_freedom))

    @property
    def rmse(self) -> float:
        """Root mean square of all residuals, over the sigmas."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def coordinates(self) -> Array:
        """Coordinates (n,) of the values."""
        return self.problem.scales.coordinates(self.values)

    @property
    def units(self) -> Array:
        """d values / d coordinates (n,)."""
        return self.problem.scales.slopes(self.coordinates)

    @cached_property
    def intervals(self) -> Array:
        """95 % intervals (n, 2) by the covariance and Student's t, see `intervals_by`."""
        return self.intervals_by(self.errors, self.freedom)

    def intervals_by(self, errors: Array, freedom: Array) -> Array:
        """Return 95 % intervals (n, 2) by Student's t of ``errors`` (n,) in the values' units, about the coordinates.

        The ends respect the parameter's limits; the interval of a resistance is the inverse of its conductance's.
        """
        middle, half = self.coordinates, student(0.975, freedom) * errors / self.units
        return np.column_stack([self.problem.scales.values(middle + sign * half) for sign in (-1.0, 1.0)])

    @property
    def correlations(self) -> Array:
        """Correlation matrix (n, n) of the values."""
        n = len(self.values)
        return self.covariance[:n, :n] / np.outer(self.errors, self.errors)

    @property
    def aic(self) -> float:
        """Akaike's criterion, m log(sum of squares/m) + 2 k."""
        return likelihood(self.residuals) + 2 * self.count

    @property
    def bic(self) -> float:
        """Schwarz's criterion, m log(sum of squares/m) + k log m."""
        return likelihood(self.residuals) + float(np.log(len(self.residuals))) * self.count

    @cached_property
    def estimates(self) -> Mapping[str, Estimate]:
        """The values by labels, with errors except for held values."""
        units = {label: p.unit for label, p in self.problem.labelled}
        rows = zip(self.labels, self.values.tolist(), self.errors.tolist(), self.intervals.tolist(), strict=True)
        found = {label: Estimate(value, units[label], error, (low, high)) for label, value, error, (low, high) in rows}
        held = {label: Estimate(x, units[label], fixed_because="held") for label, x in self.problem.fixed.items()}
        return found | held

    def estimate_tables(self) -> dict[str, Mapping[str, Estimate]]:
        """Return the values with their errors."""
        return {"parameter": self.estimates}

    def curves(self) -> Iterator[Curve]:
        """Yield the data of every observation with the fit."""
        for k, o in enumerate(self.problem.observations):
            n = len(o.data) // o.channels
            data, fitted = (x if o.channels == 1 else x[:n] + 1j * x[n:] for x in (o.data, self.fitted(k)))
            yield Curve(o.quantity, o.unit, o.source, Column("x", o.x, ""), data, fitted)

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, statistics and correlations as plain data."""
        pairs = combinations(range(len(self.labels)), 2)
        return {
            "parameters": {name: e.to_dict() for name, e in self.estimates.items()},
            "statistics": {
                "rmse": self.rmse,
                "aic": self.aic,
                "bic": self.bic,
                "n": len(self.residuals),
                "starts": self.starts.starts,
                "starts_agreeing": self.starts.agreeing,
            },
            "correlations": {f"{self.labels[a]}, {self.labels[b]}": self.correlations[a, b].item() for a, b in pairs},
        }

    def residuals_of(self, k: int) -> Array:
        """Return data - prediction of observation ``k``, in its unit."""
        return self.residuals[self.problem.slices[k]] * self.problem.observations[k].sigma

    def fitted(self, k: int) -> Array:
        """Return the prediction of observation ``k``, linear terms included, in its unit."""
        return self.problem.observations[k].data - self.residuals_of(k)

    def rms_of(self, k: int) -> float:
        """Return the root mean square of the residuals of observation ``k``, in its unit."""
        return float(np.sqrt(np.mean(self.residuals_of(k) ** 2)))

    def nuisance_of(self, k: int) -> Array:
        """Return the amounts of the linear terms of observation ``k``."""
        return self.nuisance[self._terms_of(k)]

    def nuisance_errors_of(self, k: int) -> Array:
        """Return the standard errors of the amounts of the linear terms of observation ``k``."""
        return self.nuisance_errors[self._terms_of(k)]

    def _terms_of(self, k: int) -> slice:
        widths = [o.nuisance.shape[1] for o in self.problem.observations]
        return slice(sum(widths[:k]), sum(widths[: k + 1]))

    def statistics_of(self, k: int) -> dict[str, float]:
        """Return rmse [unit], AIC, BIC and n of observation ``k``, with the number of unknowns that it determines."""
        residuals = self.residuals_of(k)
        unknowns, size = float(self.leverage[k]), likelihood(residuals)
        bic = size + float(np.log(len(residuals))) * unknowns
        return {"rmse": self.rms_of(k), "aic": size + 2 * unknowns, "bic": bic, "n": len(residuals)}

    def independent_samples(self, k: int) -> float:
        """Return the effective number of independent samples of the residuals of observation ``k``."""
        return self.problem.observations[k].independent_samples(self.residuals_of(k))

    def by_label(self) -> Mapping[str, float]:
        """Return the values by their labels, fixed ones included."""
        return {**dict(zip(self.labels, self.values.tolist(), strict=True)), **self.problem.fixed}

    @cached_property
    def means(self) -> dict[str, float]:
        """The parameters by name, with the geometric mean for parameters per source."""
        known = self.by_label()
        each: dict[str, list[float]] = {}
        for label, p in self.problem.labelled:
            each.setdefault(p.name, []).append(known[label])
        return {name: v[0] if len(v) == 1 else float(np.exp(np.mean(np.log(v)))) for name, v in each.items()}

    @cached_property
    def averaging(self) -> tuple[tuple[str, ...], Array]:
        """Names (p,) of fitted parameters, and the matrix (p, n) from logarithms of values to logarithms of `means`."""
        names = tuple(dict.fromkeys(p.name for p in self.problem.moved))
        matrix = np.array([[float(p.name == name) for p in self.problem.moved] for name in names]).reshape(
            len(names), -1
        )
        return names, matrix / matrix.sum(axis=1, keepdims=True)

    def predicting(self, problem: Problem) -> FitResult:
        """Return the same result with another problem of the same data, such as one with cheaper predictions."""
        parts = self.components
        if parts:
            groups = problem.components()
            parts = tuple(part.predicting(problem.of(g)) for part, g in zip(parts, groups, strict=True))
        return replace(self, problem=problem, components=parts)
