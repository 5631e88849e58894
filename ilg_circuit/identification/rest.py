"""What the readings before the onset say by themselves: where the tip rests, and whether its position drifts.

A drift of the instrument and the slow part of d(s) look alike over the record. At rest nothing but the drift moves, so
that only a rest which tells the slope by itself supports a drift in the fit; length and noise decide, never the size of
the slope that is found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..fit.criteria import effective_samples
from ..measurements.record import Channel
from ..measurements.smoothing import resolution

#: Longest stretch, in lengths of the rest, over which the rest supports a drift,
_LONGEST = 20.0
#: and largest uncertainty of the line's end by the slope of the rest, as a fraction of the readings' span.
_VAGUEST = 0.1
#: Level of the interval of the slope, three standard errors: one of 95 % would miss the truth of every twentieth
#: record, and a drift held at its end would then move d(s).
_LEVEL = 0.997
_FEWEST = 10
#: Rounding of readings, relative to their size.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Rest:
    """``count`` readings over ``length`` [s] before the onset; ``middle`` [m] is their median.

    ``onset`` [m] is where their straight line ends, ``slope`` [m/s] its slope and ``half`` [m/s] half the slope's
    99.7 % interval, infinite where too few readings tell none. Without readings at rest ``middle`` is the first one of
    all.
    """

    count: int
    length: float
    middle: float
    onset: float
    slope: float
    half: float

    @classmethod
    def of(cls, channel: Channel) -> Rest:
        """Return what the readings at rest of ``channel`` say."""
        t, values = channel.time[channel.rest], channel.values[channel.rest]
        count = len(t)
        middle = float(np.median(values)) if count else float(channel.values[0])
        if count < _FEWEST:
            return cls(count, float(-t[0]) if count else 0.0, middle, middle, 0.0, np.inf)
        slope, half, onset = _line(t, values, resolution(channel.values))
        return cls(count, float(-t[0]), middle, onset, slope, half)

    def supports(self, end: float, span: float) -> bool:
        """Return True if the rest determines a drift to ``end`` [s] after the onset, of readings over ``span`` [m]."""
        return self.length * _LONGEST >= end and self.half * end <= _VAGUEST * span

    def nearest(self, slope: float) -> float:
        """Return ``slope`` [m/s], or the end of the rest's interval that it lies beyond."""
        return float(np.clip(slope, self.slope - self.half, self.slope + self.half))


def _line(t: Array, values: Array, step: float) -> tuple[float, float, float]:
    """Return slope, half its interval and the value at the onset of the line through readings at rest.

    Readings that wander count as fewer than they are; those that differ by one ``step`` of the instrument tell no slope
    finer than a step over their length.
    """
    from scipy.stats import t as student

    middle = float(t.mean())
    x = t - middle
    slope = float(x @ (values - values.mean()) / (x @ x))
    residuals = values - values.mean() - slope * x
    samples = effective_samples(residuals)
    spread = np.sqrt(float(residuals @ residuals) / (len(t) - 2) * len(t) / samples / float(x @ x))
    half = float(student.ppf((1 + _LEVEL) / 2, samples - 2) * spread)
    least = max(step, _ROUNDING * float(np.abs(values).max())) / float(np.ptp(t))
    return slope, max(half, least), float(values.mean() - slope * middle)
