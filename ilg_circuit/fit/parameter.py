"""Parameters of a fit with names, units and limits, and the coordinates in which they are fitted.

A positive parameter is fitted by its logarithm, a parameter with two limits by its logit, and one without limits
directly, so that no step of a fit can leave the limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, Mask


@dataclass(frozen=True)
class Parameter:
    """One parameter: name in files, symbol, SI unit, meaning, lower and upper limit.

    ``lower`` is finite (0: the parameter is positive), or minus infinity together with an infinite ``upper``.
    """

    name: str
    symbol: str = ""
    unit: str = ""
    meaning: str = ""
    lower: float = 0.0
    upper: float = math.inf


@dataclass(frozen=True, eq=False)
class Scales:
    """Maps parameters (n,) between their limits ``lower`` and ``upper`` (n,) to coordinates without limits, and back.

    With w = p - lower and W = upper - lower the coordinate is log(w/(1 - w/W)); for a parameter without limits it is p.
    """

    lower: Array
    upper: Array

    @classmethod
    def of(cls, parameters: Sequence[Parameter]) -> Scales:
        """Return the scales of ``parameters``, in their order."""
        return cls(np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters]))

    @cached_property
    def free(self) -> Mask:
        """True for parameters without limits (n,)."""
        return np.isinf(self.lower)

    def coordinates(self, values: Array) -> Array:
        """Return coordinates (..., n) of ``values`` (..., n)."""
        w = np.where(self.free, 1.0, values - self._lower)
        logit = np.log(w) - np.log1p(-np.where(np.isinf(self._width), 0.0, w) / self._width)
        return np.where(self.free, values, logit)

    def values(self, x: Array) -> Array:
        """Return values (..., n) at coordinates ``x`` (..., n)."""
        with np.errstate(over="ignore", divide="ignore"):  # overflow: at the limit, or infinite
            e = np.exp(np.where(self.free, 0.0, x))
            w = np.where(np.isinf(self._width), e, 1 / (1 / e + 1 / self._width))
        return np.where(self.free, x, self._lower + w)

    def slopes(self, x: Array) -> Array:
        """Return d values / d coordinates (..., n)."""
        w = self.values(x) - self._lower
        return np.where(self.free, 1.0, w * (1 - w / self._width))

    def part(self, chosen: Mask) -> Scales:
        """Return the scales of the ``chosen`` parameters (n,)."""
        return Scales(self.lower[chosen], self.upper[chosen])

    @cached_property
    def _lower(self) -> Array:
        return np.where(self.free, 0.0, self.lower)

    @cached_property
    def _width(self) -> Array:
        return self.upper - self._lower
