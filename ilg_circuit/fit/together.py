"""One least squares for several data sets: parameters shared by all, or own to each, and a weight for each.

A data set of any kind takes part as a `Part`: its numbers, the linear terms of its own, and what a model makes of sets
of parameters. Every part counts in units of its ``sigma``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import SolveError
from .least_squares import Fit, fit_circuit
from .problem import Scales

Array = NDArray[np.float64]

#: A fit that begins at the first-order answer of leaving a part out moves no logarithm further than this at first.
_LONGEST_STEP = 1.0
#: Relative change of the sum of squares at which the fit of all parts but one ends.
_LEFT_OUT = 1e-8


@dataclass(frozen=True)
class Part:
    """One data set in a joint fit: ``data`` (samples,), linear terms ``nuisance`` (samples, k) of its own.

    ``modelled`` takes sets of parameters (m, n) to (m, samples); ``sigma`` is the unit in which misfits count.
    """

    source: str
    data: Array
    nuisance: Array
    modelled: Callable[[Array], Array]
    sigma: float

    def fitted(self, values: Array) -> Array:
        """What the parameters (n,) make of this data set, with the linear terms that suit it best (samples,)."""
        wave = self.modelled(values[None])[0]
        if self.nuisance.shape[1]:
            wave = wave + self.nuisance @ np.linalg.lstsq(self.nuisance, self.data - wave, rcond=None)[0]
        return np.asarray(wave)

    def rms(self, fitted: Array) -> float:
        """Of what ``fitted`` leaves, in the data's unit."""
        return float(np.sqrt(np.mean((self.data - fitted) ** 2)))


@dataclass(frozen=True)
class Parameters:
    """The parameters of a model whose limits are ``below`` (n,); those in ``own`` each data set has for itself."""

    names: tuple[str, ...]
    below: Array
    own: frozenset[str] = frozenset()

    def places(self, count: int) -> NDArray[np.intp]:
        """Where each of ``count`` data sets finds its parameters (count, n) among those of the fit."""
        columns, at = [], 0
        for name in self.names:
            each = count if name in self.own else 1
            columns.append(at + np.arange(count) * (each > 1))
            at += each
        return np.column_stack(columns).astype(np.intp)

    def labels(self, sources: Sequence[str]) -> tuple[str, ...]:
        """Names of the fit's values: own ones with the name of their data set."""
        return tuple(
            label
            for name in self.names
            for label in ([f"{name}[{source}]" for source in sources] if name in self.own else [name])
        )


@dataclass(frozen=True)
class Together:
    """The joint fit of ``parts``; ``fit``'s residuals and slopes are those of all parts in turn, over their sigmas."""

    parts: tuple[Part, ...]
    parameters: Parameters
    fit: Fit

    @property
    def places(self) -> NDArray[np.intp]:
        return self.parameters.places(len(self.parts))

    def values(self, k: int) -> Array:
        """The model's parameters (n,) for data set ``k``."""
        return np.asarray(self.fit.values[self.places[k]])

    @property
    def averaging(self) -> Array:
        """Matrix (n, values) from the values' logarithms to those of the model's parameters, own ones averaged."""
        matrix = np.zeros((len(self.parameters.names), len(self.fit.values)))
        for row in self.places:
            matrix[np.arange(len(row)), row] += 1
        return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))

    @property
    def mean(self) -> Array:
        """The model's parameters (n,), the geometric mean where each data set has its own."""
        return np.asarray(np.exp(self.averaging @ np.log(self.fit.values)))

    def residuals(self, k: int) -> Array:
        """data - fit of data set ``k``, in its unit."""
        ends = np.cumsum([0, *self.fit.parts])
        return np.asarray(self.fit.residuals[ends[k] : ends[k + 1]] * self.parts[k].sigma)

    def without(self, k: int, progress: Callable[[], None] | None = None) -> Together:
        """The fit of all parts but ``k``, begun where the slopes say that it ends.

        Raises SolveError where the others do not determine every parameter.
        """
        rest = [j for j in range(len(self.parts)) if j != k]
        ends = np.cumsum([0, *self.fit.parts])
        kept = np.concatenate([np.arange(ends[j], ends[j + 1]) for j in rest])
        places = self.places[rest]
        used = np.unique(places)
        scales = Scales(self._limits[used])
        x = scales.coordinates(self.fit.values[used])
        columns = np.concatenate([used, np.arange(len(self.fit.values), self.fit.count)])
        slopes = self.fit.slopes[np.ix_(kept, columns)]
        slopes[:, : len(used)] *= scales.slopes(x)
        size = np.sqrt((slopes**2).sum(axis=0))
        size[size == 0] = 1.0
        step = np.linalg.lstsq(slopes / size, self.fit.residuals[kept], rcond=1e-9)[0] / size
        values = self.fit.values.copy()
        values[used] = scales.values(x + np.clip(step[: len(used)], -_LONGEST_STEP, _LONGEST_STEP))
        return fit_together([self.parts[j] for j in rest], self.parameters, values[places], progress, _LEFT_OUT)

    @property
    def _limits(self) -> Array:
        limits = np.empty(len(self.fit.values))
        limits[self.places] = self.parameters.below
        return limits


def fit_together(
    parts: Sequence[Part],
    parameters: Parameters,
    starts: Array,
    progress: Callable[[], None] | None = None,
    tolerance: float = 1e-10,
) -> Together:
    """Fit all ``parts`` by one model from ``starts`` (parts, n): one row a part, their mean where they share.

    Raises SolveError as `fit_circuit`.
    """
    places = parameters.places(len(parts))
    start = np.exp([np.log(starts[places == at]).mean() for at in range(places.max() + 1)])
    limits = np.empty(len(start))
    limits[places] = parameters.below
    data = np.concatenate([part.data / part.sigma for part in parts])
    lengths = tuple(len(part.data) for part in parts)
    ends = np.cumsum([0, *lengths])
    nuisance = np.zeros((len(data), sum(part.nuisance.shape[1] for part in parts)))
    at = 0
    for k, part in enumerate(parts):
        width = part.nuisance.shape[1]
        nuisance[ends[k] : ends[k + 1], at : at + width] = part.nuisance / part.sigma
        at += width

    def waves(values: Array) -> Array:
        return np.concatenate(
            [_distinct(part.modelled, values[:, row]) / part.sigma for part, row in zip(parts, places, strict=True)],
            axis=1,
        )

    labels = parameters.labels([part.source for part in parts])
    fit = fit_circuit(waves, data, labels, start, nuisance if at else None, progress, tolerance, below=limits)
    return Together(tuple(parts), parameters, replace(fit, parts=lengths))


def _distinct(modelled: Callable[[Array], Array], values: Array) -> Array:
    """``modelled`` of every row, none of them solved twice: another data set's own parameters change nothing here."""
    rows, back = np.unique(values, axis=0, return_inverse=True)
    return np.asarray(modelled(rows)[back.ravel()])


def squares(parts: Sequence[Part], values: Array) -> float:
    """Sum of squares of all parts, in units of their sigmas, with the same parameters (n,) for all; infinite: none."""
    try:
        return float(sum(len(p.data) * (p.rms(p.fitted(values)) / p.sigma) ** 2 for p in parts))
    except SolveError:
        return float("inf")
