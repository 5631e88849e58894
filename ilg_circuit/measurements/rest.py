"""Estimates the level of a quantity at rest, and its drift, from the readings before the onset.

A drift of the instrument and the slow part of d(s) are similar over the record. At rest only the drift changes the
position. A drift is therefore fitted, within the interval of the slope at rest. It is not left out for being small
beside its uncertainty: that would make an unknown zero. The drift of a current is its instrument's; it is fitted where
the rest shows it beyond doubt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..fit.criteria import effective_samples
from ..fit.quantiles import student
from .smoothing import resolution

#: Confidence level of the interval of the slope, three standard errors. A 95 % interval would exclude the true slope
#: for one record in twenty, and a drift held at its end would then bias d(s).
_LEVEL = 0.997
_FEWEST = 10
#: Rounding of readings, relative to their size.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Rest:
    """The line through ``count`` readings over ``length`` [s] before the onset; ``middle`` is their median.

    ``mean`` is their mean, at ``center`` [s]; ``slope`` [1/s times their unit] the line's slope and ``half`` the
    half-width of the slope's 99.7 % interval, infinite for too few readings. Without readings at rest ``middle`` is
    the first reading of the record, without any reading zero.
    """

    count: int
    length: float
    middle: float
    mean: float
    center: float
    slope: float
    half: float

    @classmethod
    def of(cls, time: Array, readings: Array) -> Rest:
        """Return the line through those ``readings`` (n,) that stand before the onset at ``time`` (n,) 0 [s]."""
        t, values = time[time < 0], readings[time < 0]
        count = len(t)
        middle = float(np.median(values) if count else readings[0] if len(readings) else 0.0)
        if count < _FEWEST:
            return cls(count, float(-t[0]) if count else 0.0, middle, middle, 0.0, 0.0, np.inf)
        slope, half = _line(t, values, resolution(readings))
        return cls(count, float(-t[0]), middle, float(values.mean()), float(t.mean()), slope, half)

    @property
    def drifts(self) -> bool:
        """True if the readings at rest drift beyond doubt."""
        return abs(self.slope) > self.half

    @property
    def bounds_drift(self) -> bool:
        """True if there are enough readings at rest for an interval of the drift."""
        return bool(np.isfinite(self.half))

    def position(self, drift: float) -> float:
        """Return the level at the onset by the readings at rest, which move by ``drift`` a second."""
        return self.mean - drift * self.center

    def nearest(self, slope: float) -> float:
        """Return ``slope`` clipped to the interval of the slope at rest."""
        return float(np.clip(slope, self.slope - self.half, self.slope + self.half))


def _line(t: Array, values: Array, step: float) -> tuple[float, float]:
    """Return the slope of the line through readings at rest, and the half-width of its interval.

    Autocorrelated readings count as fewer independent ones; the slope is not determined to better than one ``step`` of
    the instrument over their length.
    """
    x = t - t.mean()
    slope = float(x @ (values - values.mean()) / (x @ x))
    residuals = values - values.mean() - slope * x
    samples = effective_samples(residuals)
    spread = np.sqrt(float(residuals @ residuals) / (len(t) - 2) * len(t) / samples / float(x @ x))
    half = float(student((1 + _LEVEL) / 2, samples - 2) * spread)
    least = max(step, _ROUNDING * float(np.abs(values).max())) / float(np.ptp(t))
    return slope, max(half, least)
