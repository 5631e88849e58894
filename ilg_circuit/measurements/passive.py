"""Fits the current of a general passive port under a measured voltage, without an electrical model.

The response of every port of resistors and capacitors is a conductance and a sum of relaxations, all with coefficients
that are not negative. Non-negative least squares with rates on a grid describes any of them to a few parts in a
thousand, which is enough to distinguish impossible currents from possible ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Mask
from .onset import Beginning

#: Rates per decade, and their range relative to the record's length and to its shortest intervals.
_PER_DECADE, _SLOWEST, _FASTEST = 4, 0.3, 3.0
_MOST_RATES = 32
#: Largest number of evenly spaced readings in a fit, and number of last readings that are added.
_MOST, _LAST = 4000, 500
#: Quantile of the intervals that is taken as the shortest interval.
_SHORT = 0.05
#: Number of readings whose high-passes are composed at once.
_BLOCK = 4096


@dataclass(frozen=True)
class Passive:
    """A fitted passive port: ``current`` [A] (n,) at every reading, ``rms`` [A] of the residuals of the readings that
    were ``used`` (n,).
    """

    current: Array
    rms: float
    used: Mask


class PassivePort:
    """Currents of passive ports under one measured voltage, which can be fitted to different sets of readings.

    Parameters
    ----------
    t, u
        Time [s] and voltage [V] of the readings (n,).
    beginning
        State before the record: at rest under the first voltage; at rest under 0 V, with a step at the first reading;
        or within a longer run, whose initial charges decay in addition to the response.
    offset
        True if the record has readings at rest, which determine an offset of the current.
    """

    def __init__(self, t: Array, u: Array, beginning: Beginning = "rest", offset: bool = True) -> None:
        step = np.diff(t)
        positive = step[step > 0]
        span = float(t[-1] - t[0])
        low, high = _SLOWEST / span, _FASTEST / float(np.quantile(positive, _SHORT))
        count = min(int(_PER_DECADE * np.log10(high / low)) + 1, _MOST_RATES)
        rates = np.geomspace(low, high, count)
        first = None
        if beginning == "step":
            first = _risen(rates, float(np.median(positive)))[1] * u[0]
        stored = rates[::2] if beginning == "run" else rates[:0]
        # one row a column, in place: those of a long record are large
        rows = np.empty((1 + count + 2 * offset + 2 * len(stored), len(t)))
        rows[0] = u
        relaxed(t, u, rates, rows[1 : 1 + count], first)
        rows[1 + count : 1 + count + 2 * offset] = np.array([[1.0], [-1.0]])[: 2 * offset]
        decaying = rows[1 + count + 2 * offset :]
        decaying[: len(stored)] = np.exp(-stored[:, None] * (t - t[0]))
        decaying[len(stored) :] = -decaying[: len(stored)]
        self._basis = rows.T

    def fit(self, current: Array, used: Mask) -> Passive:
        """Return the best fit of a port to the readings of ``current`` [A] (n,) that are ``used`` (n,)."""
        from scipy.optimize import nnls

        rows = np.flatnonzero(used)
        if not len(rows):
            return Passive(np.zeros(len(current)), 0.0, used)
        if len(rows) > _MOST:  # the last readings matter most where a fit is extrapolated from them
            rows = rows[
                np.unique(np.append(np.linspace(0, len(rows) - 1, _MOST).astype(int), np.arange(-_LAST, 0) + len(rows)))
            ]
        size = np.linalg.norm(self._basis[rows], axis=0)
        size[size == 0] = 1.0
        scale = float(np.abs(current[rows]).max()) or 1.0
        table = np.column_stack([self._basis[rows] / size, current[rows] / scale])
        triangle: Array = np.asarray(np.linalg.qr(table, mode="r")) if len(table) > table.shape[1] else table
        amounts: Array = nnls(triangle[:, :-1], triangle[:, -1], maxiter=100 * len(size))[0]
        amounts = amounts * scale / size
        predicted = self._basis @ amounts
        rms = float(np.sqrt(np.mean((predicted - current)[used] ** 2)))
        return Passive(predicted, rms, used)


def relaxed(t: Array, u: Array, rates: Array, found: Array, first: Array | None = None) -> None:
    """Write high-passes s/(s + rate) of a voltage ``u`` [V] that is linear between readings to ``found`` (rates, n).

    ``first`` (rates,) are those at the first reading, zero if it is left out.
    """
    h, du = np.diff(t), np.diff(u)
    found[:, 0] = 0.0 if first is None else first
    for start in range(1, len(t), _BLOCK):
        part = slice(start - 1, start - 1 + _BLOCK)
        decay, added = _risen(rates[:, None], h[part])
        added *= du[part]
        added[:, 0] += decay[:, 0] * found[:, start - 1]
        shift = 1
        while shift < added.shape[1]:  # y[k] = decay[k] y[k - 1] + added[k], composed over twice as many readings
            added[:, shift:] += decay[:, shift:] * added[:, :-shift]
            decay[:, shift:] *= decay[:, :-shift].copy()
            shift *= 2
        found[:, start : start + _BLOCK] = added


def _risen(rates: Array, h: Array | float) -> tuple[Array, Array]:
    """Return what is left of a high-pass after ``h`` [s], and what a rise of 1 V over that time adds to it."""
    x = np.maximum(rates * h, 1e-12)
    fallen = np.expm1(-x)
    return np.asarray(1 + fallen), np.asarray(-fallen / x)
