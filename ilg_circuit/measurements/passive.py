"""What a passive port would have read: the current that follows from a measured voltage, by no model in particular.

Every port of resistors and capacitors answers a voltage by a conductance and relaxations, none of them negative. Rates
on a grid and least squares without negative amounts describe any of them to a few parts in a thousand, which is enough
to distinguish what no strip does from what a strip may do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Mask
from .onset import Beginning

#: Rates a decade, and their range in parts of the record's length and of its shortest intervals.
_PER_DECADE, _SLOWEST, _FASTEST = 4, 0.3, 3.0
_MOST_RATES = 32
#: Number of evenly spaced readings in a fit, and of last readings.
_MOST, _LAST = 4000, 500
#: The shortest intervals are below this part of all.
_SHORT = 0.05


@dataclass(frozen=True)
class Passive:
    """A passive port that was fitted: ``current`` [A] (n,) at every reading, ``rms`` [A] of what it leaves of those
    that were ``used`` (n,).
    """

    current: Array
    rms: float
    used: Mask


class PassivePort:
    """Currents of passive ports under one measured voltage, to be fitted to some readings or others.

    Parameters
    ----------
    t, u
        Time [s] and voltage [V] of the readings (n,).
    beginning
        What is known of the time before: a strip that rests under the first voltage, one at rest under 0 V, to which
        the first voltage is a step, or a longer run, from which what was stored decays beside the answer.
    offset
        Whether there is rest in the record, which tells an offset of the current.
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
        """Return the port that describes best those readings of ``current`` [A] (n,) that are ``used`` (n,)."""
        from scipy.optimize import nnls

        rows = np.flatnonzero(used)
        if not len(rows):
            return Passive(np.zeros(len(current)), 0.0, used)
        if len(rows) > _MOST:  # the last ones tell what a fit up to them is asked for
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
    """Return high-passes s/(s + rate) of a voltage ``u`` [V] that goes straight from reading to reading, (rates, n)."""
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
