"""Observations: the measured values of one quantity in one file, with a model's prediction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import SolveError
from .criteria import independent_samples

#: values (k, p) -> predictions (k, m): k sets of parameters at once
Predict = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class WithSlopes:
    """A prediction that knows its derivatives.

    ``slopes`` maps one set (p,) of parameters to the prediction (m,) and its derivatives (m, p) by their logarithms:
    new arrays, which the caller may change.
    """

    predict: Predict
    slopes: Callable[[Array], tuple[Array, Array]]

    def __call__(self, values: Array) -> Array:
        """Return the predictions (k, m) of sets (k, p)."""
        return self.predict(values)


@dataclass(frozen=True, eq=False)
class Observation:
    """An array of measured values and the prediction by a model.

    ``data`` (m,) are real numbers in ``unit``; ``x`` are their abscissae. ``predict`` maps sets of the parameters
    ``names`` (k, p) to predictions (k, m); ``derivatives``, given for all observations of a problem or none, maps one
    set (p,) to derivatives (m, p), which are central differences otherwise. ``nuisance`` (m, q) are linear terms of
    this observation alone, such as an offset. ``sigma`` [unit], one or one per sample (m,), is the standard deviation
    by which residuals are divided; ``size`` [unit] is the reference size of residuals. ``channels`` is the number of
    equal parts of ``data``, such as real and imaginary ones, one after the other. ``digits`` (m,) [unit] are the
    units of the last digits that the readings were written with, where these are known.
    """

    source: str
    quantity: str
    unit: str
    x: Array
    data: Array
    names: tuple[str, ...]
    predict: Predict
    nuisance: Array
    sigma: float | Array = 1.0
    size: float = 1.0
    channels: int = 1
    derivatives: Callable[[Array], Array] | None = None
    digits: Array | None = None

    @property
    def weighted(self) -> tuple[Array, Array]:
        """The data (m,) and the linear terms (m, q) over the sigma."""
        if np.ndim(self.sigma) == 0 and self.sigma == 1:
            return self.data, self.nuisance
        return self.data / self.sigma, self.nuisance / np.atleast_1d(self.sigma)[:, None]

    def __getstate__(self) -> dict[str, Any]:
        """Return the pickled state: everything except the model, a function of the fitting process."""
        return self.__dict__ | {"predict": _not_kept, "derivatives": None}

    def __deepcopy__(self, _: object) -> Observation:
        return self

    def fitted(self, values: Array) -> Array:
        """Return the prediction (m,) for the parameters (p,) with least-squares linear terms."""
        prediction = self.predict(values[None])[0]
        if self.nuisance.shape[1]:
            prediction = (
                prediction + self.nuisance @ np.linalg.lstsq(self.nuisance, self.data - prediction, rcond=None)[0]
            )
        return prediction

    def independent_samples(self, residuals: Array) -> float:
        """Return the effective number of independent samples of ``residuals`` (m,)."""
        return independent_samples(residuals, self.channels)

    def rms(self, fitted: Array) -> float:
        """Return the root mean square of data - ``fitted`` [unit]."""
        return float(np.sqrt(np.mean((self.data - fitted) ** 2)))


def _not_kept(values: Array) -> Array:
    raise SolveError("a stored fit cannot make new predictions; fit again, or use its stored curves")


def observation(
    predict: Predict,
    data: Array,
    names: Sequence[str],
    *,
    nuisance: Array | None = None,
    x: Array | None = None,
    derivatives: Callable[[Array], Array] | None = None,
) -> Observation:
    """Return an observation of plain ``data`` (m,) without source or unit; ``x`` defaults to 0, 1, ..."""
    linear = np.zeros((len(data), 0)) if nuisance is None else nuisance
    places = np.arange(len(data), dtype=float) if x is None else x
    return Observation("data", "data", "", places, data, tuple(names), predict, linear, derivatives=derivatives)
