"""A least-squares problem whose model is a circuit: data, parameters, and the coordinates that fits move in.

All parameters are positive, so their logarithms are the coordinates, or log(p/(1 - p)) where they stay below a limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError

Array = NDArray[np.float64]

#: values (m, parameters) -> model (m, samples)
Model = Callable[[Array], Array]

RAN_AWAY = "the fit ran away: the data do not determine every parameter of this model"
_STEP = 1e-4
#: So far from its start a coordinate is no sensible value any more, whatever the solver makes of it.
_FAR = 5.0
#: A step that leaves this distance is taken back unsolved.
_FENCE = 16.0


@dataclass(frozen=True)
class Scales:
    """Coordinates without limits for positive parameters, some of them ``below`` a limit (infinite: none)."""

    below: Array

    def coordinates(self, values: Array) -> Array:
        return np.asarray(np.log(values) - np.where(np.isinf(self.below), 0.0, np.log1p(-values / self.below)))

    def values(self, x: Array) -> Array:
        with np.errstate(over="ignore", divide="ignore"):  # beyond all numbers: at the limit, or infinite
            e = np.exp(x)
            return np.asarray(np.where(np.isinf(self.below), e, 1 / (1 / e + 1 / self.below)))

    def slopes(self, x: Array) -> Array:
        """d values / d coordinates."""
        v = self.values(x)
        return np.asarray(v * (1 - v / self.below))


@dataclass(frozen=True, eq=False)
class Problem:
    """``data`` (samples,) to be met by ``model`` with parameters ``names``, plus linear ``nuisance`` (samples, k)."""

    model: Model
    data: Array
    names: tuple[str, ...]
    scales: Scales
    nuisance: Array

    def waves(self, x: Array) -> Array:
        """The model (m, samples) at coordinates (m, n)."""
        return self.model(self.scales.values(x))

    def squares(self, x: Array) -> Array:
        """Sums of squares (m,) at coordinates (m, n), the nuisance terms at their best."""
        return np.asarray((self.projected(self.data - self.waves(x)) ** 2).sum(axis=-1))

    def projected(self, rows: Array) -> Array:
        """``rows`` (..., samples) without what nuisance terms explain."""
        if not self.nuisance.shape[1]:
            return rows
        basis = np.linalg.qr(self.nuisance)[0]
        return np.asarray(rows - (rows @ basis) @ basis.T)

    def holding(self, k: int, coordinate: float) -> Problem:
        """The problem that is left when parameter ``k`` is held."""

        def model(values: Array) -> Array:
            return self.model(np.insert(values, k, self.scales.values(held)[k], axis=1))

        held = np.zeros(len(self.names))
        held[k] = coordinate
        names = self.names[:k] + self.names[k + 1 :]
        return replace(self, model=model, names=names, scales=Scales(np.delete(self.scales.below, k)))


class Evaluation:
    """Model and Jacobian at a point, solved together and kept for the other of the two callbacks.

    The Jacobian's columns are central differences; their 2 n + 1 circuits share one netlist.
    """

    def __init__(self, problem: Problem, progress: Callable[[], None] | None = None) -> None:
        self._problem, self._n, self._progress = problem, len(problem.names), progress
        self._at = self._start = np.full(self._n, np.nan)
        self._result: tuple[Array, Array] = (np.empty(0), np.empty(0))
        self.count = 0

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Model (samples,) and its derivatives (samples, n) by the coordinates.

        Raises SolveError where the fit has run away, or its first circuit cannot be solved.
        """
        if not self.count:
            self._start = x.copy()
        if not np.array_equal(x, self._at):
            steps = np.concatenate([np.zeros((1, self._n)), _STEP * np.eye(self._n), -_STEP * np.eye(self._n)])
            if np.abs(x - self._start).max() > _FENCE:
                return self._too_far()
            try:
                waves = self._problem.waves(x + steps)
            except InputError:  # a value beyond all measure
                raise SolveError(RAN_AWAY) from None
            except SolveError:  # or one that is still a number, but no circuit that can be solved
                if np.abs(x - self._start).max() >= _FAR:
                    raise SolveError(RAN_AWAY) from None
                if not self.count:
                    raise
                return self._too_far()
            central = (waves[1 : self._n + 1] - waves[self._n + 1 :]) / (2 * _STEP)
            self._at, self._result = x.copy(), (waves[0], central.T)
            self.count += 1
            if self._progress:
                self._progress()
        return self._result

    def _too_far(self) -> tuple[Array, Array]:
        """So large a misfit that the step is taken back."""
        kept, slopes = self._result
        self.count += 1
        return kept + 1e3 * np.abs(kept).max(), slopes
