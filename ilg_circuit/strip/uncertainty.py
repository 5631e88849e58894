"""The uncertainty of a fitted strip: the covariance of its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Uncertainty:
    """The ``covariance`` of the logarithms of the fitted parameters ``names`` of an electrical ``model``.

    ``voltage`` [V] is the largest voltage of the data, of either sign; None if it is unknown.
    """

    model: str
    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]
    voltage: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "covariance", tuple(tuple(float(x) for x in row) for row in self.covariance))
        n = len(self.names)
        if not n or len(self.covariance) != n or any(len(row) != n for row in self.covariance):
            raise InputError(f"uncertainty.covariance must be a table of {n} by {n} numbers, one row a name")
        table = np.array(self.covariance)
        if not np.isfinite(table).all() or (table != table.T).any() or (table.diagonal() < 0).any():
            raise InputError("uncertainty.covariance must be finite and symmetric, with no negative diagonal")
        if self.voltage is not None and not (math.isfinite(self.voltage) and self.voltage >= 0):
            raise InputError(f"uncertainty.voltage is {self.voltage!r}; it must be a number of volts, zero or more")
