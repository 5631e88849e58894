"""Finds where a measured voltage or current jumps between two readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask
from .smoothing import digit

#: Least change of a jump between two samples, as a fraction of the range; its least ratio to the changes beside it and
#: to the median change.
_JUMP = 0.01
_JUMP_OVER_NEIGHBOURS = 4.0
_JUMP_OVER_NOISE = 12.0
#: Number of changes in a row that are a ramp, and the least of them beside the largest.
_RAMP, _BESIDE = 3, 0.1
#: Smallest jump, as a fraction of the largest value and in steps of the instrument.
_LEAST_JUMP, _JUMP_OVER_RESOLUTION = 0.01, 3.0
#: Largest change within the levels of a staircase: in quartiles of all changes, in steps of the instrument, as a
#: fraction of the range.
_WITHIN, _DIGITS, _ROUNDED = 12.0, 1.5, 1e-6
#: Beside the jumps of a staircase: least fraction of changes within levels, largest of changes that are neither; least
#: ratio of a jump to the largest change within levels.
_LEVEL, _NEITHER, _APART = 1 / 3, 0.05, 3.0


def voltage_jumps(u: Array) -> NDArray[np.intp]:
    """Return the intervals k -> k + 1 in which the voltage ``u`` (n,) jumps.

    It is smooth before and after, or a `staircase`. A voltage that rises or falls over several intervals in a row is a
    ramp, and does not jump.
    """
    step = np.diff(u)
    change = np.abs(step)
    least = max(_least(u), _JUMP_OVER_NOISE * float(np.median(change)) if len(change) else 0.0)
    jumps = staircase(u)[0]
    for k in np.flatnonzero((change >= least) & ~jumps).tolist():
        around = np.r_[change[max(k - 4, 0) : k], change[k + 1 : k + 5]]
        moves = step[max(k - _RAMP, 0) : k + _RAMP + 1] * np.sign(step[k]) >= _BESIDE * change[k]
        here = min(k, _RAMP)
        before, after = moves[:here][::-1], moves[here + 1 :]
        steps = 1 + sum(int(np.argmin(np.append(side, False))) for side in (before, after))
        jumps[k] = len(around) >= 2 and change[k] > _JUMP_OVER_NEIGHBOURS * np.median(around) and steps < _RAMP
    return np.flatnonzero(jumps)


def staircase(u: Array) -> tuple[Mask, float]:
    """Return where a staircase ``u`` (n,) jumps (n - 1,), and the largest change [V] within its levels.

    Its levels may be as short as one or two readings, as those of a square wave or of a random binary sequence: beside
    its jumps it stands still, or jumps back. Without jumps and 0 V where the readings are none.
    """
    step = np.diff(u)
    change = np.abs(step)
    if len(step) < 2:
        return np.zeros(len(step), dtype=bool), 0.0
    within = max(_WITHIN * float(np.quantile(change, 0.25)), _DIGITS * digit(u), _ROUNDED * float(np.ptp(u)))
    jumps, still = change >= max(_least(u), _APART * within), change <= within
    left, right = np.append(True, still[:-1]), np.append(still[1:], True)
    back = jumps[1:] & jumps[:-1] & (np.sign(step[1:]) == -np.sign(step[:-1]))
    beside = np.concatenate([np.flatnonzero(jumps[1:]), 1 + np.flatnonzero(jumps[:-1])])
    if not len(beside) or still[beside].mean() < _LEVEL or (~still & ~jumps)[beside].mean() > _NEITHER:
        return np.zeros(len(step), dtype=bool), 0.0
    return jumps & (left | np.append(False, back)) & (right | np.append(back, False)), within


def _least(u: Array) -> float:
    """Return the smallest jump of a voltage ``u`` [V] (n,)."""
    range_, largest = float(np.ptp(u)), float(np.abs(u).max())
    return max(_JUMP * range_, _LEAST_JUMP * largest, _JUMP_OVER_RESOLUTION * digit(u))
