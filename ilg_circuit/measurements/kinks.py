"""Finds where a measured voltage bends between two readings: a triangle's vertex, a ramp's end, a sine's beginning.

A chord from reading to reading cuts such a kink off. The curves on both sides, continued, meet in it.
"""

from __future__ import annotations

from collections.abc import Callable
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
#: Factor by which a sine or an exponential must tell the next reading better than a polynomial to be preferred.
_CLEARLY = 3.0
#: Number of samples on each side that tell a sine or an exponential.
_LONG = 6
#: Largest coefficient of such a recurrence: beyond it two exponentials are one, apart from rounding.
_STEEPEST = 1e3
#: Number of points among which the meeting of two curves is looked for.
_POINTS = 33
#: Largest difference of sampling intervals that are even, relative to their mean.
_EVEN = 1e-3

#: Position in an interval -> voltage [V].
Curve = Callable[[float], float]


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
    padded = np.concatenate([np.full(_LONG, np.nan), u, np.full(_LONG, np.nan)])
    broken = np.ones(len(k), dtype=bool)
    for first, direction in ((k, -1), (k + 1, 1)):
        side = padded[_LONG + first[:, None] + direction * np.arange(_LONG)]
        behind = padded[_LONG + first - direction]
        continues = np.zeros(len(k), dtype=bool)
        for order, share in enumerate(_NEXT, start=1):
            weights = np.array([(-1) ** m * comb(order + 1, m + 1) for m in range(order + 1)])
            missed = np.abs(side[:, : order + 1] @ weights - behind)
            own, following = (np.abs(np.diff(side[:, : n + 1], n)[:, 0]) for n in (order, order + 1))
            bends = following > share * own if order > 1 else np.zeros(len(k), dtype=bool)
            continues |= (following <= _SMOOTH * missed) & ~bends & (missed >= seen.least)
        d = np.diff(side, axis=1).T
        with np.errstate(all="ignore"):
            ratio = (d[0] + d[2]) / d[1]
            missed = np.abs(side[:, 0] - (ratio * d[0] - d[1]) - behind)
            errors = np.abs([ratio * d[m] - d[m - 1] - d[m + 1] for m in (2, 3)]).max(axis=0)
            continues |= (errors <= _SMOOTH * missed) & (missed >= seen.least)
        broken &= continues
    return broken


def _meeting(t: Array, u: Array, k: int, seen: Seen) -> tuple[float, float] | None:
    """Return time and voltage at which the curves on both sides of the interval after sample ``k`` meet inside it."""
    scale = float(t[k + 1] - t[k])
    left = _continued((t[k::-1][:_LONG] - t[k]) / scale, u[k::-1][:_LONG], 1.0, float(u[k + 1]))
    right = _continued((t[k + 1 :][:_LONG] - t[k]) / scale, u[k + 1 :][:_LONG], 0.0, float(u[k]))
    if left is None or right is None or min(abs(left(1.0) - u[k + 1]), abs(right(0.0) - u[k])) < seen.least:
        return None
    x = _root(lambda x: left(x) - right(x))
    if x is None:
        return None
    value = float(left(x))
    if abs(value - (u[k] + x * (u[k + 1] - u[k]))) <= seen.tolerance:
        return None
    return float(t[k]) + x * scale, value


def _root(of: Curve) -> float | None:
    """Return the only root of a function between 0 and 1, None if there is none, or more than one."""
    from scipy.optimize import brentq

    x = np.linspace(0.0, 1.0, _POINTS)
    signs = np.sign([of(float(at)) for at in x])
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    inside = signs[1:-1] == 0
    if len(changes) + np.count_nonzero(inside) != 1:
        return None
    return float(x[1:-1][inside][0]) if inside.any() else float(brentq(of, x[changes[0]], x[changes[0] + 1]))


def _continued(x: Array, u: Array, to: float, shown: float) -> Curve | None:
    """Return the curve through samples ``u`` at ``x``, the nearest first, that leads on; None if they tell none.

    It is a polynomial, or a sine or exponential if that tells the next sample better. ``shown`` is the sample on the
    other side of the interval, at ``to``: a curve that breaks off before misses it.
    """
    differences = [abs(float(np.diff(u[: m + 1], m)[0])) for m in range(min(len(x), len(_NEXT) + 2))]
    found: Curve | None = None
    missed_next = np.inf
    for order, share in enumerate(_NEXT, start=1):
        if order + 1 >= len(differences):
            break
        points, next_one = slice(0, order + 1), differences[order + 1]
        curve = np.polynomial.Polynomial.fit(x[points], u[points], order).convert()
        # one step on, a smooth curve misses by about its next difference
        bends = order > 1 and next_one > share * differences[order]
        if not bends and next_one <= _SMOOTH * abs(float(curve(to)) - shown):
            found, missed_next = curve, next_one
            break
    wave, error = _recurrence(x, u)
    if wave is None or error * _CLEARLY >= missed_next:
        return found
    return wave if error <= _SMOOTH * abs(wave(to) - shown) else None


def _recurrence(x: Array, u: Array) -> tuple[Curve | None, float]:
    """Return the sine, or exponentials, on a level through four even samples, and how far two more are off.

    Its differences d follow d(k + 1) + d(k - 1) = c d(k). None for other samples.
    """
    if len(x) < _LONG or np.ptp(np.diff(x)) > _EVEN * abs(x[1] - x[0]):
        return None, np.inf
    d = np.diff(u)
    if not d[1]:
        return None, np.inf
    ratio = float(d[0] + d[2]) / float(d[1])
    if abs(ratio) > _STEEPEST:
        return None, np.inf
    error = max(abs(float(ratio * d[m] - d[m - 1] - d[m + 1])) for m in (2, 3))
    rate = np.arccos(complex(ratio / 2))
    if abs(rate) < _EVEN or abs(rate - np.pi) < _EVEN:  # a parabola, or alternating
        return None, np.inf
    step, first = float(x[1] - x[0]), float(x[0])
    places = np.arange(3)
    columns = np.column_stack([np.ones(3), np.cos(rate * places), np.sin(rate * places)])
    level, even, odd = np.linalg.solve(columns, u[:3].astype(complex))

    def wave(at: float) -> float:
        z = rate * (at - first) / step
        return float((level + even * np.cos(z) + odd * np.sin(z)).real)

    return wave, error
