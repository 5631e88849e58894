"""Fits the current of a general passive port under a measured voltage, without an electrical model.

The response of every port of resistors and capacitors is a conductance and a sum of relaxations, all with coefficients
that are not negative. Non-negative least squares with rates on a grid describes any of them to a few parts in a
thousand, which is enough to distinguish impossible currents from possible ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, Mask
from ..extras import whole
from .onset import Beginning

#: Rates per decade, and their range relative to the record's length and to its shortest intervals.
_PER_DECADE, _SLOWEST, _FASTEST = 4, 0.3, 3.0
_MOST_RATES = 32
#: Largest number of evenly spaced readings in a fit, and number of last readings that are added.
_MOST, _LAST = 4000, 500
#: Quantile of the intervals that is taken as the shortest interval.
_SHORT = 0.05
#: Number of readings whose high-passes are held at once: those of a long record are made again for each fit.
_BLOCK = 16384


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
        self._t, self._u, self._rates = t, u, np.geomspace(low, high, count)
        self._first = np.zeros(count)
        if beginning == "step":
            self._first = _risen(self._rates, float(np.median(positive)))[1] * u[0]
        self._offset, self._stored = offset, self._rates[::2] if beginning == "run" else self._rates[:0]
        self._columns = 1 + count + 2 * offset + 2 * len(self._stored)

    def _blocks(self, columns: Mask) -> Iterator[tuple[slice, Array]]:
        """Yield the responses (columns, m) of elements at successive parts of the readings."""
        if len(self._t) <= _BLOCK:
            yield slice(0, len(self._t)), self._short[columns]
            return
        relaxing = columns[1 : 1 + len(self._rates)]
        rates, state = self._rates[relaxing], self._first[relaxing]
        for start in range(0, len(self._t), _BLOCK):
            part = slice(start, start + _BLOCK)
            waves = relaxed(
                self._t[max(start - 1, 0) : part.stop], self._u[max(start - 1, 0) : part.stop], rates, state
            )
            state = waves[:, -1]
            yield part, self._responses(part, waves[:, min(start, 1) :], columns)

    @cached_property
    def _short(self) -> Array:
        """The responses (columns, n) at all readings of a short record."""
        waves = relaxed(self._t, self._u, self._rates, self._first)
        return self._responses(slice(0, len(self._t)), waves, np.ones(self._columns, dtype=bool))

    def _responses(self, part: slice, waves: Array, columns: Mask) -> Array:
        """Return the chosen responses (columns, m) at a part of the readings; ``waves`` (k, m) are the high-passes."""
        t = self._t[part]
        offset = np.repeat(np.array([[1.0], [-1.0]])[: 2 * self._offset], len(t), axis=1)
        decaying = np.exp(-self._stored[:, None] * (t - self._t[0]))
        others = np.concatenate([offset, decaying, -decaying])[columns[1 + len(self._rates) :]]
        return np.concatenate([self._u[None, part][columns[:1]], waves, others])

    def fit(self, current: Array, used: Mask) -> Passive:
        """Return the best fit of a port to the readings of ``current`` [A] (n,) that are ``used`` (n,)."""
        with whole():
            from scipy.optimize import nnls

        rows = np.flatnonzero(used)
        if not len(rows):
            return Passive(np.zeros(len(current)), 0.0, used)
        if len(rows) > _MOST:  # the last readings matter most where a fit is extrapolated from them
            rows = rows[
                np.unique(np.append(np.linspace(0, len(rows) - 1, _MOST).astype(int), np.arange(-_LAST, 0) + len(rows)))
            ]
        basis = np.empty((len(rows), self._columns))
        for part, responses in self._blocks(np.ones(self._columns, dtype=bool)):
            a, b = np.searchsorted(rows, [part.start, part.stop])
            basis[a:b] = responses[:, rows[a:b] - part.start].T
        size = np.linalg.norm(basis, axis=0)
        size[size == 0] = 1.0
        scale = float(np.abs(current[rows]).max()) or 1.0
        table = np.column_stack([basis / size, current[rows] / scale])
        triangle: Array = np.asarray(np.linalg.qr(table, mode="r")) if len(table) > table.shape[1] else table
        amounts: Array = nnls(triangle[:, :-1], triangle[:, -1], maxiter=100 * len(size))[0]
        amounts = amounts * scale / size
        predicted = np.empty(len(current))
        for part, responses in self._blocks(amounts > 0):
            predicted[part] = amounts[amounts > 0] @ responses
        rms = float(np.sqrt(np.mean((predicted - current)[used] ** 2)))
        return Passive(predicted, rms, used)


def relaxed(t: Array, u: Array, rates: Array, first: Array) -> Array:
    """Return high-passes s/(s + rate) (rates, n) of a voltage ``u`` [V] that is linear between readings at ``t`` [s].

    ``first`` (rates,) are those at the first reading. y[k] = decay[k] y[k - 1] + added[k] is composed in groups of
    readings, all groups at once, and then from group to group.
    """
    steps = len(t) - 1
    length = int(np.sqrt(steps)) + 1
    count = -(-steps // length)

    def grouped(values: Array) -> Array:  # (length, 1, groups)
        return np.append(values, np.zeros(length * count - steps)).reshape(count, length).T[:, None]

    decay, added = _risen(rates[:, None], grouped(np.diff(t)))
    added *= grouped(np.diff(u))
    for k in range(1, length):
        added[k] += decay[k] * added[k - 1]
        decay[k] *= decay[k - 1]
    begins = np.empty((len(rates), count))
    begin = first
    for k in range(count):
        begins[:, k] = begin
        begin = decay[-1, :, k] * begin + added[-1, :, k]
    added += decay * begins
    found = added.transpose(1, 2, 0).reshape(len(rates), -1)[:, :steps]
    return np.concatenate([first[:, None], found], axis=1)


def _risen(rates: Array, h: Array | float) -> tuple[Array, Array]:
    """Return what is left of a high-pass after ``h`` [s], and what a rise of 1 V over that time adds to it."""
    x = np.maximum(rates * h, 1e-12)
    fallen = np.expm1(-x)
    return np.asarray(1 + fallen), np.asarray(-fallen / x)
