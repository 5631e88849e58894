"""Finds where a measured voltage bends between two readings: a triangle's vertex, a ramp's end, a sine's beginning.

A chord from reading to reading cuts such a kink off. The curves on both sides, continued, meet in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask

#: Least distance of a curve's continuation from the reading behind the kink, in tolerances and in noise levels.
_OVER_TOLERANCE, _OVER_NOISE = 4.0, 12.0
#: Largest next difference of the readings that a curve continues, relative to that distance, and relative to the last
#: difference of a curve of order 1 (any), 2, 3.
_SMOOTH, _NEXT = 0.1, (np.inf, 0.4, 0.75)
#: Largest difference of sampling intervals that are even, relative to their mean.
_EVEN = 1e-3


@dataclass(frozen=True)
class Seen:
    """What can be seen of a voltage: a kink's distance [V] from its chord above the ``tolerance``, beyond ``noise``."""

    tolerance: float
    noise: float = 0.0

    @property
    def least(self) -> float:
        """Least distance [V] of a curve's continuation from the reading behind a kink."""
        return max(_OVER_TOLERANCE * self.tolerance, _OVER_NOISE * self.noise)


def with_kinks(t: Array, u: Array, seen: Seen, rest: float | None = None) -> tuple[Array, Array]:
    """Return times and voltages (m,) with the kinks between samples.

    Parameters
    ----------
    t, u
        Times [s], ascending, and voltages [V] (n,).
    seen
        What can be seen of it.
    rest
        Level [V] from which the curve starts behind the first sample, None if it does not.
    """
    if rest is not None and len(t) > 1:
        early = t[0] - (t[1] - t[0]) * np.arange(2, 0, -1)
        times, values = with_kinks(np.append(early, t), np.concatenate([[rest, rest, rest], u[1:]]), seen)
        return times[2:], np.append(u[0], values[3:])
    if len(u) < 4:
        return t, u
    width = np.diff(t)
    bends = np.abs(np.diff(np.diff(u) / width))
    candidates = 1 + np.flatnonzero(np.minimum(bends[:-1], bends[1:]) * width[1:-1] > seen.least)
    candidates = candidates[_broken(u, candidates, seen)] if np.ptp(width) < _EVEN * width.mean() else candidates
    found = [(k + 1, *meeting) for k in candidates.tolist() if (meeting := _meeting(t, u, k, seen))]
    if not found:
        return t, u
    at, times, values = (np.array(column) for column in zip(*found, strict=True))
    return np.insert(t, at, times), np.insert(u, at, values)


def _broken(u: Array, k: NDArray[np.intp], seen: Seen) -> Mask:
    """Return where samples in even intervals may have a kink after those of index ``k`` (m,): none of the others has.

    It is what `_continued` asks of both sides, for all at once.
    """
    padded = np.concatenate([np.full(4, np.nan), u, np.full(5, np.nan)])
    broken = np.ones(len(k), dtype=bool)
    for first, direction in ((k, -1), (k + 1, 1)):
        side = padded[4 + first[:, None] + direction * np.arange(5)]
        behind = padded[4 + first - direction]
        continues = np.zeros(len(k), dtype=bool)
        for order, share in enumerate(_NEXT, start=1):
            weights = np.array([(-1) ** m * comb(order + 1, m + 1) for m in range(order + 1)])
            missed = np.abs(side[:, : order + 1] @ weights - behind)
            own, following = (np.abs(np.diff(side[:, : n + 1], n)[:, 0]) for n in (order, order + 1))
            bends = following > share * own if order > 1 else np.zeros(len(k), dtype=bool)
            continues |= (following <= _SMOOTH * missed) & ~bends & (missed >= seen.least)
        broken &= continues
    return broken


def _meeting(t: Array, u: Array, k: int, seen: Seen) -> tuple[float, float] | None:
    """Return time and voltage at which the curves on both sides of the interval after sample ``k`` meet inside it."""
    scale = float(t[k + 1] - t[k])
    left = _continued((t[k::-1][:5] - t[k]) / scale, u[k::-1][:5], 1.0, float(u[k + 1]))
    right = _continued((t[k + 1 :][:5] - t[k]) / scale, u[k + 1 :][:5], 0.0, float(u[k]))
    if left is None or right is None or min(abs(left(1.0) - u[k + 1]), abs(right(0.0) - u[k])) < seen.least:
        return None
    roots = (left - right).roots()
    inside = roots[(np.abs(np.imag(roots)) < 1e-9) & (np.real(roots) > 0) & (np.real(roots) < 1)].real
    if len(inside) != 1:
        return None
    x = float(inside[0])
    value = float(left(x))
    if abs(value - (u[k] + x * (u[k + 1] - u[k]))) <= seen.tolerance:
        return None
    return float(t[k]) + x * scale, value


def _continued(x: Array, u: Array, to: float, shown: float) -> np.polynomial.Polynomial | None:
    """Return the curve through samples ``u`` at ``x``, the nearest first, that leads on; None if they tell none.

    ``shown`` is the sample on the other side of the interval, at ``to``: a curve that breaks off before misses it.
    """
    differences = [abs(float(np.diff(u[: m + 1], m)[0])) for m in range(len(x))]
    for order, share in enumerate(_NEXT, start=1):
        if order + 1 >= len(differences):
            return None
        points, next_one = slice(0, order + 1), differences[order + 1]
        curve = np.polynomial.Polynomial.fit(x[points], u[points], order).convert()
        # one step on, a smooth curve misses by about its next difference
        bends = order > 1 and next_one > share * differences[order]
        if not bends and next_one <= _SMOOTH * abs(float(curve(to)) - shown):
            return curve
    return None
