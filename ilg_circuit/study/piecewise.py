"""Waveforms as Legendre series on panels, and their numbers: end, peak, mean square, times of crossing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ..arrays import Array, Mask
from ..solve.panels import FRACTIONS, NODES, WEIGHTS, Panels

#: Points at which a panel's polynomial is sampled before a peak or a crossing is refined.
_SAMPLES = np.linspace(0.0, 1.0, 25)
#: Samples of waveforms that are computed at once.
_AT_ONCE = 1024
#: Newton steps to a peak, bisections to a crossing: both reach the digits of a double's time.
_NEWTON_STEPS = 6
_HALVINGS = 40


def _basis(at: Array) -> Array:
    """Return the Legendre polynomials (..., NODES) at ``at``, from 0 to 1."""
    return np.asarray(legendre.legvander(2 * at - 1, NODES - 1))


_TO_SERIES = np.linalg.inv(_basis(FRACTIONS)).T
_TO_SAMPLES = _TO_SERIES @ _basis(_SAMPLES).T


@dataclass(frozen=True, eq=False)
class PiecewiseLegendre:
    """``values`` (n, m, NODES): n waveforms at the points of m panels."""

    panels: Panels
    values: Array

    @cached_property
    def _samples(self) -> Array:
        """Samples (n, m, k) within every panel, both ends included."""
        return self.values @ _TO_SAMPLES

    @cached_property
    def truncation(self) -> Array:
        """Truncation error (n, m) of every panel: the last terms of its series over the waveform's largest value."""
        tail = np.abs(self.values @ _TO_SERIES[:, -2:]).max(axis=2)
        largest = np.abs(self.values).max(axis=(1, 2))[:, None]
        return np.divide(tail, largest, out=np.zeros_like(tail), where=largest > 0)

    @cached_property
    def final(self) -> Array:
        """Values (n,) at the end; the left limit where the drive jumps there."""
        return self._samples[:, -1, -1]

    def sampled(self, times: Array) -> Array:
        """Return values (n, t) at ``times`` [s] within the run; at a jump the right limit, at the end the left one."""
        result = np.empty((len(self.values), len(times)))
        panel = np.clip(np.searchsorted(self.panels.starts, times, side="right") - 1, 0, None)
        at = (times - self.panels.starts[panel]) / self.panels.widths[panel]
        for k in range(0, len(times), _AT_ONCE):  # every sample takes a copy of its panel's values
            some = slice(k, k + _AT_ONCE)
            weights = _basis(at[some]) @ _TO_SERIES.T
            result[:, some] = np.einsum("ntk,tk->nt", self.values[:, panel[some]], weights)
        return result

    def integral(self, other: Array) -> Array:
        """Return the integrals (n,) over the run of the product with ``other`` (n, m, NODES)."""
        return (self.values * other) @ WEIGHTS @ self.panels.widths

    def rms(self) -> Array:
        """Return the root mean square (n,) over the run."""
        return np.sqrt(self.integral(self.values) / self.panels.end)

    def peak(self) -> tuple[Array, Array]:
        """Return the value of largest size (n,), with its sign, and its time [s]; the first of equal ones."""
        highest, lowest = self._samples.max(axis=(1, 2)), self._samples.min(axis=(1, 2))
        return self.extreme(np.where(highest >= -lowest, 1.0, -1.0))

    def extreme(self, sign: Array) -> tuple[Array, Array]:
        """Return the largest values (n,) of ``sign`` (n,) times the waveforms, and their times [s] (n,).

        The first of equal ones; NaN is the time of a value of 0.
        """
        flat = (self._samples * sign[:, None, None]).reshape(len(self.values), -1)
        largest = flat.max(axis=1, keepdims=True)
        best = (flat >= largest - 1e-12 * np.abs(largest)).argmax(axis=1)  # equal apart from rounding counts as equal
        panel, sample = np.divmod(best, len(_SAMPLES))
        value, time = self._refined(sign, panel, sample)
        # at a panel's end the peak may lie on the other side, which begins or ends with the same sample
        last = len(_SAMPLES) - 1
        over = np.where(sample == last, 1, 0) - np.where(sample == 0, 1, 0)
        beside = np.clip(panel + over, 0, len(self.panels.starts) - 1)
        crossed = np.where(beside == panel, sample, np.where(over > 0, 0, last))
        other, when = self._refined(sign, beside, crossed)
        better = other > value
        value = sign * np.where(better, other, value)
        return value, np.where(np.abs(value) > 0, np.where(better, when, time), np.nan)

    def _refined(self, sign: Array, panel: NDArray[np.intp], sample: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return the largest of ``sign`` times each waveform near a sample, and its time [s], by Newton's method."""
        series, at = self._series(panel), _SAMPLES[sample]
        slope = legendre.legder(series, axis=1)
        bend = legendre.legder(slope, axis=1)
        found = at
        for _ in range(_NEWTON_STEPS):
            curvature = _along(bend, found) * 4
            move = np.divide(2 * _along(slope, found), curvature, out=np.zeros_like(found), where=curvature != 0)
            found = np.clip(found - move, np.maximum(at - _SAMPLES[1], 0), np.minimum(at + _SAMPLES[1], 1))
        start, refined = (sign * _along(series, x) for x in (at, found))
        better = refined > start
        return np.where(better, refined, start), self._time(panel, np.where(better, found, at))

    def settled(self, band: float) -> Array:
        """Return times [s] (n,) from which on a waveform stays within ``band`` of its final value; NaN if that is 0."""
        flat = self._samples.reshape(len(self.values), -1)
        width = band * np.abs(self.final)
        outside = np.abs(flat - self.final[:, None]) > width[:, None]
        last = outside.shape[1] - 1 - outside[:, ::-1].argmax(axis=1)
        times = self._crossing(last, lambda v: np.abs(v - self.final) > width)
        return np.where(np.abs(self.final) > 0, np.where(outside.any(axis=1), times, 0.0), np.nan)

    def reached(self, part: float) -> Array:
        """Return times [s] (n,) at which a waveform first reaches ``part`` of its final value; NaN if that is 0."""
        flat = self._samples.reshape(len(self.values), -1)
        sign, level = np.sign(self.final), part * np.abs(self.final)
        first = (flat * sign[:, None] >= level[:, None]).argmax(axis=1)
        times = self._crossing(np.maximum(first - 1, 0), lambda v: v * sign < level)
        return np.where(np.abs(self.final) > 0, np.where(first == 0, 0.0, times), np.nan)

    def _crossing(self, before: NDArray[np.intp], holds: Callable[[Array], Mask]) -> Array:
        """Return times [s] at which ``holds`` ceases to be true, between sample ``before`` (n,) and the next."""
        panel, sample = np.divmod(before, len(_SAMPLES))
        series = self._series(panel)
        low, high = _SAMPLES[sample], _SAMPLES[np.minimum(sample + 1, len(_SAMPLES) - 1)]
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            still = holds(_along(series, middle))
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        return self._time(panel, high)

    def _series(self, panel: NDArray[np.intp]) -> Array:
        """Return Legendre coefficients (n, NODES) of waveform k on panel ``panel[k]``."""
        return self.values[np.arange(len(panel)), panel] @ _TO_SERIES

    def _time(self, panel: NDArray[np.intp], at: Array) -> Array:
        return self.panels.starts[panel] + at * self.panels.widths[panel]


def _along(series: NDArray[np.floating], at: Array) -> Array:
    """Evaluate series k (n, degrees) at ``at[k]``, from 0 to 1."""
    return (legendre.legvander(2 * at - 1, series.shape[1] - 1) * series).sum(axis=1)
