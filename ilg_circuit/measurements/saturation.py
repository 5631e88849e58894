"""Finds the readings of a displacement that stand still at the limit of a camera or a distance sensor."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Mask
from ..findings import Finding
from .contact import runs

#: Least number of neighbouring readings that are equal at a limit.
_STUCK = 5
#: Relative difference, to the span, up to which readings are equal.
_EQUAL = 1e-9
#: Largest part of neighbours elsewhere that are equal, too: with a coarser resolution equal readings tell nothing.
_SELDOM = 0.05
#: Least distance of a limit from the rest, and least change in front of it, relative to the span. A strip that settles
#: comes to equal readings by ever smaller changes.
_FAR, _SUDDEN = 0.2, 1e-6


def saturated(t: Array, values: Array) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the readings (n,) at a limit, and a finding for each limit.

    Readings between two stretches at a limit that are nearer than the longest of these is long are left out with them:
    noise alone took them off the limit.

    Parameters
    ----------
    t, values
        Time [s] since the onset, and displacement [m], both (n,).
    """
    stuck = np.zeros(len(t), dtype=bool)
    notes = []
    moving, span = t >= 0, float(np.ptp(values)) if len(values) else 0.0
    if not span or moving.sum() <= _STUCK:
        return stuck, ()
    still = float(np.median(values[~moving])) if (~moving).any() else float(values[0])
    limits = (float(values[moving].max()), float(values[moving].min()))
    between = moving & (np.abs(values[:, None] - limits) > _EQUAL * span).all(axis=1)
    steps = np.abs(np.diff(values[between]))
    for limit in limits:
        at = moving & (np.abs(values - limit) <= _EQUAL * span)
        long = [(a, b) for a, b in runs(at) if b - a >= _STUCK and _sudden(values, a, b, span)]
        if not long or len(steps) < _STUCK or abs(limit - still) < _FAR * span:
            continue
        if np.mean(steps <= _EQUAL * span) > _SELDOM:
            continue
        reach = max(b - a for a, b in long)
        held = np.zeros(len(t), dtype=bool)
        for k, (a, b) in enumerate(long):
            before = long[k - 1][1] if k else a
            held[before if a - before <= reach else a : b] = True
        stuck |= held
        notes.append(Finding("displacement-clipped", values={"level": limit, "count": int(held.sum())}))
    return stuck, tuple(notes)


def _sudden(values: Array, a: int, b: int, span: float) -> bool:
    """Return True if the readings before or behind values[a:b] leave the limit at once."""
    beside = [abs(values[k] - values[a]) for k in (a - 1, b) if 0 <= k < len(values)]
    return max(beside, default=0.0) > _SUDDEN * span
