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
        if beginning == "step":
            before = float(np.median(positive))
            waves = relaxed(np.append(t[0] - before, t), np.append(0.0, u), rates)[:, 1:]
        else:
            waves = relaxed(t, u, rates)
        columns = [u, *waves]
        if offset:
            columns += [np.ones(len(t)), -np.ones(len(t))]
        if beginning == "run":
            stored = np.exp(-rates[::2, None] * (t - t[0]))
            columns += [*stored, *-stored]
        self._basis = np.array(columns).T

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


def relaxed(t: Array, u: Array, rates: Array) -> Array:
    """Return high-passes s/(s + rate) of a voltage ``u`` [V] that is linear between readings, (rates, n)."""
    h, du = np.diff(t), np.diff(u)
    x = np.maximum(rates[:, None] * h, 1e-12)
    decay = np.zeros((len(rates), len(t)))
    added = np.zeros((len(rates), len(t)))
    decay[:, 1:] = np.exp(-x)
    added[:, 1:] = du * (-np.expm1(-x) / x)
    shift = 1
    while shift < len(t):  # y[k] = decay[k] y[k - 1] + added[k], composed over twice as many readings each time
        added[:, shift:] += decay[:, shift:] * added[:, :-shift]
        decay[:, shift:] *= decay[:, :-shift].copy()
        shift *= 2
    return added
