"""Interpolates a smooth measured voltage between its readings, by polynomials through as many of them as agree.

Chords of a sine have a smaller amplitude, and so has a cubic through four of eleven readings a cycle, by 0.25 %: enough
to bias a fitted conductance by many standard errors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask

#: Relative difference of neighbouring second differences below which a curve is smooth, and below which it may be,
#: relative to the largest of four.
_SMOOTH, _NO_CORNER = 0.5, 0.9
#: Numbers of samples that polynomials are put through; largest correction by the next one, relative to the last.
_THROUGH, _CONVERGED = (4, 6, 8), 0.25
#: Least and largest number of parts of a sampling interval, and most points that are added, if more than the least.
_PARTS, _MOST_PARTS, _MOST_POINTS = 8, 20, 20_000


def between_samples(t: Array, u: Array, tolerance: float) -> tuple[Array, Array]:
    """Return times and voltages with added points where a smooth voltage deviates by ``tolerance`` from its chords.

    A curve is smooth where the two second differences of four samples are similar, or, at no corner, where polynomials
    through four, six and eight samples converge; the points lie on the last of these that does.

    Parameters
    ----------
    t, u
        Times [s], ascending, and voltages [V] (n,).
    tolerance
        Distance [V] that needs no points.

    Returns
    -------
    tuple
        Times and voltages (m,), the samples among them.
    """
    if len(u) < _THROUGH[0]:
        return t, u
    bend = np.diff(np.diff(u) / np.diff(t)) / (t[2:] - t[:-2])  # half the second derivative
    left, right = np.append(bend[0], bend), np.append(bend, bend[-1])
    deviation = np.maximum(np.abs(left), np.abs(right)) * np.diff(t) ** 2 / 4
    k = np.flatnonzero(deviation > tolerance)
    if not len(k):
        return t, u
    alike = np.abs(left - right) <= _SMOOTH * np.maximum(np.abs(left), np.abs(right))
    alike[[0, -1]] = False  # beside the first and the last sample there is only one of them
    around = np.lib.stride_tricks.sliding_window_view(np.pad(np.abs(bend), 2, mode="edge"), 4).max(axis=1)
    corner = np.abs(left - right) > _NO_CORNER * around
    wanted = int(np.ceil(np.sqrt(float(deviation[k].max()) / tolerance))) if tolerance else _MOST_PARTS
    parts = max(_PARTS, min(wanted, _MOST_PARTS, _MOST_POINTS // len(k)))
    share = np.arange(1, parts) / parts
    at = t[k, None] + (t[k + 1] - t[k])[:, None] * share
    chord = u[k, None] + (u[k + 1] - u[k])[:, None] * share
    curve, converge = _curves(t, u, k, at, chord)
    smooth = alike[k] | (converge & ~corner[k])
    curve, at = curve[smooth], at[smooth]
    times = np.concatenate([t, at.ravel()])
    order = np.argsort(times, kind="stable")
    return times[order], np.concatenate([u, curve.ravel()])[order]


def _curves(t: Array, u: Array, k: NDArray[np.intp], at: Array, chord: Array) -> tuple[Array, Mask]:
    """Return values (m, points) ``at`` times after samples ``k`` (m,), and where all polynomials converge (m,).

    ``chord`` (m, points) are those of straight lines.
    """
    found, last = chord, chord
    correction, converging = np.full(len(k), np.inf), np.ones(len(k), dtype=bool)
    for count in (c for c in _THROUGH if c <= len(u)):
        values = _polynomials(t, u, k, at, count)
        more = np.abs(values - last).max(axis=1)
        converging &= more <= _CONVERGED * correction
        found = np.where(converging[:, None], values, found)
        last, correction = values, more
    return found, converging & (len(u) >= _THROUGH[-1])


def _polynomials(t: Array, u: Array, k: NDArray[np.intp], at: Array, count: int) -> Array:
    """Return polynomials (m, points) through ``count`` samples about the intervals after ``k`` (m,), ``at`` times."""
    first = np.clip(k - count // 2 + 1, 0, len(t) - count)
    rows = first[:, None] + np.arange(count)
    width = (t[k + 1] - t[k])[:, None]
    x, place = (t[rows] - t[k, None]) / width, (at - t[k, None]) / width
    total = np.zeros_like(at)
    for j in range(count):
        others = [i for i in range(count) if i != j]
        weight = np.prod(x[:, [j]] - x[:, others], axis=1)
        term = u[rows[:, j]] / weight
        factor = np.ones_like(at)
        for i in others:
            factor *= place - x[:, [i]]
        total += term[:, None] * factor
    return total
