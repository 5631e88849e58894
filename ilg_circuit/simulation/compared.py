"""The comparison of a prediction with a measurement, part of a response; made by `identification.comparison`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array

_NORMAL_95 = 1.96


@dataclass(frozen=True)
class Compared:
    """Values of one quantity at ``time`` [s] of the file, ``measured`` and ``predicted`` (n,), positive to the anode.

    A displacement is counted from its rest; ``offset`` is True if, without a rest, the mean difference was removed.
    ``stderr`` (n,) is the prediction's standard error by the fit's covariance; ``noise`` the measurement's white noise.
    """

    source: str
    quantity: str
    time: Array
    measured: Array
    predicted: Array
    stderr: Array | None
    noise: float
    reversed_axis: bool = False
    offset: bool = False

    @property
    def rms(self) -> float:
        """Root mean square of the differences."""
        return float(np.sqrt(np.mean((self.measured - self.predicted) ** 2)))

    @property
    def largest(self) -> float:
        """Largest measured magnitude."""
        return float(np.abs(self.measured).max())

    def to_dict(self) -> dict[str, Any]:
        """Return the compared values and the size of the differences as plain data."""
        names = ("source", "quantity", "rms", "largest", "covered", "reversed_axis", "offset")
        return {name: getattr(self, name) for name in names} | {"samples": len(self.time)}

    @property
    def covered(self) -> float | None:
        """Fraction of the samples within the 95 % band of prediction and noise together; None without a band."""
        if self.stderr is None:
            return None
        limit = _NORMAL_95 * np.hypot(self.stderr, self.noise)
        return float(np.mean(np.abs(self.measured - self.predicted) <= limit))
