"""Values of a solve at the samples that lie between its nodes, or on a jump of the drive, and their errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..drive import Drive, drive_times, each, levels
from ..errors import InputError
from .grid import Grid, lagrange

#: Nodes of the interpolation, and of two weaker ones for its error: errors of a fast and of a slow mode may cancel in
#: one of the differences, but hardly in both.
_NODES, _WEAKER = 8, (6, 7)
#: Factor for the one-sided interpolations near the ends, whose differences underestimate the error by a few percent.
_CAUTION = 1.1


def sampled_times(drive: Drive, times: ArrayLike, sources: int | None = None) -> Array:
    """Return ``times`` [s] (t,), on the edges of the drive where only rounding parts them.

    Raises InputError unless they are one row of finite, ascending numbers from zero on, and where there are not as many
    drives as ``sources`` of a circuit.
    """
    if sources is not None and len(each(drive)) != sources:
        raise InputError(f"{len(each(drive))} drives for a circuit with {sources} sources")
    samples: Array = np.asarray(times, dtype=np.float64)
    if samples.ndim != 1 or not len(samples):
        raise InputError("a transient needs at least one time")
    if not np.isfinite(samples).all() or samples[0] < 0 or (np.diff(samples) <= 0).any():
        raise InputError("the times of a transient must be finite, ascending and not negative")
    return drive_times(drive, samples)


def at_samples(grid: Grid, at_nodes: Array, drive: Drive, direct: Array | None = None) -> tuple[Array, Array]:
    """Return values (n, outputs, samples) and the errors (n, outputs) of interpolation, from those at the nodes.

    ``direct`` (n, outputs, sources) is what a jump of 1 V adds at once to the first outputs of a linear circuit, whose
    values on jumps are then left limits and that: behind a jump steps may be far shorter than it is long, and too short
    to extrapolate over it.
    """
    jumps = np.isin(grid.samples, drive.jumps(np.inf)) & (grid.index < 0) & (grid.piece > 0)
    jumps &= grid.samples - grid.nodes[grid.segments[grid.piece - 1, 1]] <= grid.rise  # a piece ends there
    if direct is None or not jumps.any():
        return _interpolated(grid, at_nodes)
    values, errors = _interpolated(replace(grid, piece=grid.piece - jumps), at_nodes)
    t = grid.samples[jumps]
    begins = grid.nodes[grid.segments[grid.piece[jumps] - 1, 0]]
    # a sine does not jump
    left = [
        p.value(t) if p.angular_frequency() else 2 * p.value((begins + t) / 2) - p.value(begins) for p in each(drive)
    ]
    values[:, : direct.shape[1], jumps] += direct @ (levels(drive, t) - left)
    return values, errors


def _interpolated(grid: Grid, at_nodes: Array) -> tuple[Array, Array]:
    """Return values at the samples, and the relative error (n, outputs) of interpolation between nodes."""
    result = np.empty((*at_nodes.shape[:2], len(grid.samples)))
    doubt = np.zeros(at_nodes.shape[:2])
    on_node = grid.index > 0
    result[..., on_node] = at_nodes[..., grid.index[on_node] - 1]
    between = np.flatnonzero(~on_node)
    if not len(between):
        return result, doubt
    piece = grid.piece[between]
    for k in np.unique(piece):
        first, last = grid.segments[k]
        first = max(first, 1)  # the point t = 0 is the state before the drive; its right limit is one step on
        where = between[piece == k]
        nodes, values = grid.nodes[first : last + 1], at_nodes[..., first - 1 : last]
        fewer = max(_NODES - len(nodes), 0)
        widths = (_NODES, *(max(width - fewer, 1) for width in _WEAKER))
        fine, *coarse = (values @ lagrange(nodes, grid.samples[where], width).T for width in widths)
        result[..., where] = fine
        for other in coarse:
            doubt = np.maximum(doubt, _CAUTION * relative(fine - other, at_nodes))
    return result, doubt


def relative(difference: Array, values: Array) -> Array:
    """Return largest difference over largest value, per waveform (last axis reduced); 0 where the waveform is zero."""
    error, scale = np.abs(difference).max(axis=-1), np.abs(values).max(axis=-1)
    return np.asarray(np.divide(error, scale, out=np.zeros_like(error), where=scale > 0))


def zero_between(t: Array, q: Array, left: float, right: float) -> float:
    """Return where between ``left`` and ``right`` the polynomial through (t, q) is zero, by bisection."""
    size = float(np.sign(q[np.searchsorted(t, left)]))
    divided = q.copy()  # Newton's form; plain numbers, as each is asked for by itself
    for order in range(1, len(t)):
        divided[order:] = (divided[order:] - divided[order - 1 : -1]) / (t[order:] - t[:-order])
    last, *others = zip(reversed(divided.tolist()), reversed(t.tolist()), strict=True)
    for _ in range(60):
        middle, value = (left + right) / 2, last[0]
        for amount, node in others:
            value = amount + (middle - node) * value
        if size * value > 0:
            left = middle
        else:
            right = middle
    return float(right)
