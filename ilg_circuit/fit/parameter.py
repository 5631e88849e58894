"""Parameters of a fit: what each is called and within what limits it lies, and the coordinates that a fit moves in.

A positive parameter is fitted by its logarithm, one between zero and a limit by log(p/(1 - p/limit)), one without
limits as it is: no step of a fit can leave the limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Array


@dataclass(frozen=True)
class Parameter:
    """One parameter: name in files, symbol, SI unit, meaning, and the limits between which it lies.

    ``lower`` is 0 (the parameter is positive) or minus infinity (any real number); ``upper`` may be finite if ``lower``
    is 0.
    """

    name: str
    symbol: str = ""
    unit: str = ""
    meaning: str = ""
    lower: float = 0.0
    upper: float = math.inf


@dataclass(frozen=True, eq=False)
class Scales:
    """Maps parameters (n,) between their limits to coordinates without limits, and back.

    ``upper`` (n,) are upper limits, infinite where there is none; ``free`` (n,) marks parameters of any sign.
    """

    upper: Array
    free: np.ndarray

    @classmethod
    def of(cls, parameters: tuple[Parameter, ...]) -> Scales:
        """The scales of some parameters, in their order."""
        return cls(np.array([p.upper for p in parameters]), np.array([p.lower < 0 for p in parameters], dtype=bool))

    def coordinates(self, values: Array) -> Array:
        """Coordinates (..., n) of ``values`` (..., n)."""
        positive = np.where(self.free, 1.0, values)
        logarithm = np.log(positive) - np.where(np.isinf(self.upper), 0.0, np.log1p(-positive / self.upper))
        return np.asarray(np.where(self.free, values, logarithm))

    def values(self, x: Array) -> Array:
        """Values (..., n) at coordinates ``x`` (..., n)."""
        with np.errstate(over="ignore", divide="ignore"):  # beyond all numbers: at the limit, or infinite
            e = np.exp(np.where(self.free, 0.0, x))
            return np.asarray(np.where(self.free, x, np.where(np.isinf(self.upper), e, 1 / (1 / e + 1 / self.upper))))

    def slopes(self, x: Array) -> Array:
        """d values / d coordinates (..., n)."""
        v = self.values(x)
        return np.asarray(np.where(self.free, 1.0, v * (1 - v / self.upper)))
