"""The uncertainty of a fitted strip: the covariance of its parameters, and what its model leaves of the records."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError

#: Quantities whose residuals a fit tells.
RESIDUAL_UNITS = {"current": "A/V", "displacement": "m/V"}


@dataclass(frozen=True)
class Residuals:
    """The misfit of a ``quantity``, beyond the noise: its standard deviation by the time since the onset.

    ``deviations`` [A/V or m/V] are per volt of the record's largest voltage, at ``times`` [s] since the onset;
    ``correlation`` is that of neighbouring readings of the records.
    """

    quantity: str
    times: tuple[float, ...]
    deviations: tuple[float, ...]
    correlation: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(x) for x in self.times))
        object.__setattr__(self, "deviations", tuple(float(x) for x in self.deviations))
        t, d = np.array(self.times), np.array(self.deviations)
        if self.quantity not in RESIDUAL_UNITS:
            raise InputError(
                f"uncertainty.residuals: '{self.quantity}' is no quantity; choose {', '.join(RESIDUAL_UNITS)}"
            )
        if not len(t) or len(t) != len(d) or not (np.isfinite(t).all() and np.isfinite(d).all()):
            raise InputError("uncertainty.residuals: times and deviations are two lists of numbers of one length")
        if (t <= 0).any() or (np.diff(t) <= 0).any() or (d < 0).any() or not -1 <= self.correlation <= 1:
            raise InputError("uncertainty.residuals: times ascend above zero, no deviation is negative")

    @property
    def unit(self) -> str:
        """The unit of the deviations."""
        return RESIDUAL_UNITS[self.quantity]

    @property
    def rms(self) -> float:
        """Root mean square of the deviations, over the logarithm of time."""
        return float(np.sqrt(np.mean(np.array(self.deviations) ** 2)))

    def at(self, since: Array) -> Array:
        """Return the deviations per volt at times ``since`` the onset [s], 0 before it; held beyond both ends."""
        logarithm = np.log(np.maximum(since, self.times[0]))
        found = np.interp(logarithm, np.log(self.times), self.deviations)
        return np.asarray(np.where(since < 0, 0.0, found))


@dataclass(frozen=True)
class Uncertainty:
    """The ``covariance`` of the logarithms of the fitted parameters ``names`` of an electrical ``model``.

    ``voltage`` [V] is the largest voltage of the data, of either sign; None if it is unknown. ``residuals`` are
    what the model leaves of the records beyond their noise, by quantity.
    """

    model: str
    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]
    voltage: float | None = None
    residuals: tuple[Residuals, ...] = ()

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
