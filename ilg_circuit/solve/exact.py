"""Solves linear netlists exactly: the state space by matrix exponentials, without time step and tolerance.

Between breakpoints a drive is a straight line or a sine, so that state and input together obey a homogeneous linear
equation, whose exponential is exact. It checks ngspice and makes huge linear sweeps cheap.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import Drive, each
from ..errors import SolveError
from .modes import CANCELLING, SMALL, modes_of, phi, recursion
from .panels import FRACTIONS, Panels
from .state_space import StateSpace

#: Number of intervals whose states are stored before outputs are computed.
_BLOCK = 2000
#: Relative contribution to an output below which a mode is negligible.
_FELT = 1e-13
#: Samples per edge of the drive above which a run is solved from edge to edge, not from sample to sample.
_FEW_EDGES = 8
#: Largest number of values in stored exponentials: an irregular grid needs one exponential per interval.
_MOST_KEPT = 20_000_000


def exact_outputs(system: StateSpace, drive: Drive, times: Array) -> Array:
    """Return the outputs at ``times`` [s] (ascending, >= 0), from rest at t = 0; shape (n, outputs, times).

    A sample on a jump of the drive is the right limit. Raises SolveError when the result is not finite.
    """
    grid = interval_grid(drive, times)
    inputs = np.append(_inputs(drive, grid[:-1], np.diff(grid)), _inputs(drive, grid[-1:]), axis=1)
    widths = _shared_widths(grid, interval_grid(drive, times[-1:]))
    outputs = list(_outputs(system, _frequencies(drive), inputs, widths, np.ones(1)))
    return _finite(np.concatenate(outputs, axis=2)[..., 0])[:, :, np.searchsorted(grid, times)]


def exact_on_panels(system: StateSpace, drive: Drive, panels: Panels) -> Array:
    """Return the outputs at the points of ``panels``, from rest at t = 0; shape (n, outputs, panels, points).

    Raises SolveError when the result is not finite.
    """
    inputs = _inputs(drive, panels.starts, panels.widths)
    fractions = np.append(FRACTIONS[1:], 1.0)
    outputs = list(_outputs(system, _frequencies(drive), inputs, panels.widths, fractions))
    return _finite(np.concatenate(outputs, axis=2))


def modal_output(system: StateSpace, output: str, drive: Drive, times: Array) -> Array:
    """Return one output at ``times`` [s] (ascending, >= 0) as a sum of modes; shape (n, times).

    It applies to systems whose poles have negative real parts, under a piecewise linear drive, and costs a small part
    of `exact_outputs`, which is used instead where modes cancel: if poles are so close that their eigenvectors are
    nearly parallel, as in a critically damped filter.
    """
    row = system.output_names.index(output)
    modes = modes_of(system)
    if modes is None:
        return exact_outputs(system, drive, times)[:, row]
    poles, amounts = modes.poles, modes.shown[:, row] * modes.excited[..., 0]
    with np.errstate(all="ignore"):
        held = amounts / poles  # steady response of each mode to a constant input
        total = np.maximum(np.abs(held.sum(axis=1)), np.abs(system.d[:, row, 0]))
        size = np.abs(held)
        tell_apart = (size.sum(axis=1) < CANCELLING * total).all()
    if not tell_apart:
        return exact_outputs(system, drive, times)[:, row]
    felt = (size > _FELT * total[:, None]).any(axis=0)
    poles, amounts = poles[:, felt], amounts[:, felt]
    direct = np.asarray(system.d[:, row, :1] * drive.value(times))
    edges = interval_grid(drive, times[-1:])
    if len(edges) * _FEW_EDGES <= len(times):
        return _between_edges(poles, amounts, drive, edges, times, direct)
    grid = interval_grid(drive, times)
    widths = np.diff(grid)
    start, slopes = drive_lines(drive, grid[:-1], widths)
    moved = np.zeros((len(grid), len(poles)))
    state = np.zeros_like(poles)
    for first in range(0, len(widths), _BLOCK):
        part = slice(first, first + _BLOCK)
        width = widths[part, None, None]
        z = poles * width
        gained = width * (start[part, None, None] * phi(z, 1) + slopes[part, None, None] * width * phi(z, 2))
        states = recursion(np.exp(z), gained, state)
        state = states[-1]
        moved[first + 1 : first + 1 + len(states)] = np.real((states * amounts).sum(axis=2))
    return np.asarray(direct + moved[np.searchsorted(grid, times)].T)


def _between_edges(
    poles: NDArray[Any], amounts: NDArray[Any], drive: Drive, edges: Array, times: Array, direct: Array
) -> Array:
    """Return ``direct`` (n, times) and sums of modes, from one edge of the drive to the next.

    Between them modes are exponentials.
    """
    result = direct
    state = np.zeros_like(poles)
    starts, slopes = drive_lines(drive, edges[:-1], np.diff(edges))
    bounds = np.searchsorted(times, edges)
    bounds[-1] = len(times)
    for k, (start, slope) in enumerate(zip(starts.tolist(), slopes.tolist(), strict=True)):
        slow = bool((np.abs(poles) * (edges[k + 1] - edges[k]) < SMALL).any())
        after = partial(_after, poles, state, start, slope, slow)
        for first in range(bounds[k], bounds[k + 1], _BLOCK):
            part = slice(first, min(first + _BLOCK, bounds[k + 1]))
            modes = after((times[part] - edges[k])[:, None, None])
            result[:, part] += np.real(np.einsum("tns,ns->nt", modes, amounts))
        state = after(np.array(edges[k + 1] - edges[k]))
    return result


def _after(
    poles: NDArray[Any], state: NDArray[Any], start: float, slope: float, slow: bool, time: Array
) -> NDArray[Any]:
    """Return modes x' = pole x + u after ``time`` [s] from ``state``, u beginning at ``start`` and rising by ``slope``.

    ``slow`` is True if a pole is so slow that its response to the slope must be computed by a series.
    """
    z = poles * time
    grown = np.expm1(z)
    modes = state + grown * (state + start / poles)
    if slope:
        modes += slope * time**2 * phi(z, 2) if slow else slope * (grown / poles - time) / poles
    return modes


def interval_grid(drive: Drive, times: Array) -> Array:
    """Return start, breakpoints of the drive and ``times`` [s], ascending: between them the drive is smooth."""
    end = float(times[-1]) if len(times) else 0.0
    return np.union1d(np.concatenate([[0.0], drive.breakpoints(end)]), times)


def _shared_widths(grid: Array, edges: Array) -> Array:
    """Return the widths of the intervals of ``grid`` [s], between whose ``edges`` [s] the drive is smooth.

    Pieces from edge to edge that are divided equally, apart from rounding of times, get the widths of the first one, so
    that they share exponentials. Widths of each piece start at its edge, so that rounding does not accumulate.
    """
    widths = np.diff(grid)
    rounding = 4 * np.spacing(grid[-1])
    bounds = np.searchsorted(grid, edges).tolist()
    first: dict[tuple[int, str], tuple[int, int]] = {}
    for begin, end in pairwise(bounds):
        a, b = first.setdefault((end - begin, f"{grid[end] - grid[begin]:.9e}"), (begin, end))
        apart = np.abs((grid[begin : end + 1] - grid[begin]) - (grid[a : b + 1] - grid[a])).max(initial=0.0)
        if apart <= rounding:
            widths[begin:end] = widths[a:b]
    return widths


def _frequencies(drive: Drive) -> list[float]:
    """Return the angular frequency [rad/s] of each source's drive, 0 for lines."""
    return [part.angular_frequency() for part in each(drive)]


def _inputs(drive: Drive, starts: Array, widths: Array | None = None) -> Array:
    """Return `drive_lines` of all sources (2 sources, m); without ``widths`` at single times, see `drive_at`."""
    parts = [drive_at(part, starts) if widths is None else drive_lines(part, starts, widths) for part in each(drive)]
    return np.concatenate(parts)


def drive_lines(drive: Drive, starts: Array, widths: Array) -> Array:
    """Return the drive at the ``starts`` [s] (m,) of smooth intervals and its companion there; shape (2, m).

    The companion of a line is its slope; the companion of a sine is its value a quarter of a period later.
    """
    if drive.angular_frequency():
        return drive_at(drive, starts)
    value = drive.value(starts)
    # the left limit at the interval's end: halfway plus half of the rise, exact on a line
    return np.stack([value, 2 * (drive.value(starts + widths / 2) - value) / widths])


def drive_at(drive: Drive, t: Array) -> Array:
    """Return the drive at ``t`` and a sine's companion there, zero for a line, whose slope is not needed."""
    omega = drive.angular_frequency()
    value = drive.value(t)
    return np.stack([value, drive.value(t + np.pi / 2 / omega) if omega else np.zeros_like(value)])


def _outputs(
    system: StateSpace, omegas: list[float], inputs: Array, widths: Array, fractions: Array
) -> Iterator[Array]:
    """Return the outputs (n, outputs, intervals, points) of blocks of intervals, one after the other.

    ``inputs`` (2 sources, m) at the starts of intervals of ``widths`` (m,), or of one interval more, which has no
    width: the end. ``omegas`` [rad/s] of the sources. The points of an interval are its start and ``fractions`` of its
    width, the last of which is 1 and begins the next one.
    """
    matrix, output = augmented(system, omegas)
    states, size = system.a.shape[1], matrix.shape[1]
    propagators = _Propagators(matrix, widths, fractions)
    x = np.zeros((len(matrix), size, 1))
    x[:, -1] = 1.0
    count = inputs.shape[1]
    for first in range(0, count, _BLOCK):
        block = range(first, min(first + _BLOCK, count))
        at_points = np.empty((len(matrix), size, len(block), len(fractions)))
        for k in block:
            x[:, states:-1, 0] = inputs[:, k]
            at_points[:, :, k - first, 0] = x[..., 0]
            if k < len(widths):
                later = (propagators.of(k) @ x[:, None])[..., 0]  # (n, points, states)
                at_points[:, :, k - first, 1:] = later[:, :-1].transpose(0, 2, 1)
                x = later[:, -1, :, None].copy()
        flat = output @ at_points.reshape(len(matrix), size, -1)
        yield flat.reshape(len(matrix), output.shape[1], len(block), len(fractions))


def _finite(result: Array) -> Array:
    if not np.isfinite(result).all():
        raise SolveError("the exact engine's result is not finite: a value of the actuator is implausible")
    return result


def augmented(system: StateSpace, omegas: list[float]) -> tuple[Array, Array]:
    """Return the state, each drive and its companion, and the constant 1 as one autonomous system, and its outputs."""
    n, s, _ = system.a.shape
    size = s + 2 * len(omegas) + 1
    matrix = np.zeros((n, size, size))
    output = np.zeros((n, system.c.shape[1], size))
    matrix[:, :s, :s], matrix[:, :s, -1] = system.a, system.b[:, :, -1]
    output[:, :, :s], output[:, :, -1] = system.c, system.d[:, :, -1]
    for k, omega in enumerate(omegas):
        at = s + 2 * k
        matrix[:, :s, at], output[:, :, at] = system.b[:, :, k], system.d[:, :, k]
        matrix[:, at, at + 1] = omega or 1.0
        if omega:
            matrix[:, at + 1, at] = -omega
    return matrix, output


class _Propagators:
    """The exponentials exp(M f w) for the widths w of intervals that follow one another, and the ``fractions`` f.

    Widths that differ by rounding only share one. For twice a width the exponential is squared.
    """

    def __init__(self, matrix: Array, widths: Array, fractions: Array) -> None:
        self._matrix, self._widths, self._fractions = matrix, widths, fractions
        self._keys = [_key(w) for w in widths.tolist()]
        self._last = {key: k for k, key in enumerate(self._keys)}
        self._kept: dict[str, Array] = {}

    def of(self, interval: int) -> Array:
        """Return the exponentials (n, fractions, states, states); widths that are not needed again are discarded."""
        key, width = self._keys[interval], float(self._widths[interval])
        if key not in self._kept:
            if (len(self._kept) + 1) * len(self._fractions) * self._matrix.size > _MOST_KEPT:
                self._kept.clear()
            half = self._kept.get(_key(width / 2))
            self._kept[key] = half @ half if half is not None else self._exponential(width)
        before = self._keys[interval - 1] if interval else key
        if before != key and self._last[before] < interval:
            self._kept.pop(before, None)
        return self._kept[key]

    def _exponential(self, width: float) -> Array:
        from scipy.linalg import expm

        return np.asarray(expm(self._matrix[:, None] * (width * self._fractions)[:, None, None]))


def _key(width: float) -> str:
    """Return a width to 12 digits."""
    return f"{width:.11e}"
