"""Designs time grids from a circuit's poles, on which the trapezoidal rule converges fast.

A jump of the drive excites every mode k of the circuit, which then decays as exp(Re(p_k) t). A step h has an error
proportional to (|p_k| h)^q times the mode's amplitude, so that h may grow as the modes decay:

    h(t) = min over k of  theta/|p_k| exp(-Re(p_k) t/q)      and  theta/omega under a sine of frequency omega

The rule's own errors are removed by Richardson extrapolation over equal subdivisions of this grid, which needs no
more than that the grid's steps are split evenly.

A jump of the drive takes a short time, which all of these runs share. In a linear circuit the drive overshoots in it by
a twelfth on either side, so that its first three moments are those of the jump. A nonlinear one has it in one step that
is never split: the trapezoidal rule then is the mean of before and after.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, ComplexArray, Mask
from ..drive import Drive, Drives, levels
from ..errors import SolveError, argument

#: First step, in units of the fastest mode: ngspice uses backward Euler, whose error is then below 1e-9.
_FIRST_STEP = 1e-5
#: Least step as a fraction of the run, since ngspice's time is a double.
_LEAST_STEP = 1e-13
#: Duration of a jump of the drive in units of the fastest mode; shorter jumps would only add rounding.
_RISE = 1e-3
#: The same for a jump in one step, whose error is proportional to its square, not to the fourth power.
_RISE_NONLINEAR = 1e-5
#: Error that slopes beside such a jump may add, relative to the largest voltage and in units of the fastest mode.
_LEVEL = 1e-12
#: Least step of a jump as a fraction of the run.
_LEAST_RISE = 1e-11
#: Fineness of intervals over which a low-order quadrature is accurate to many digits.
_SMOOTH = 0.4
#: Fewest nodes of a piece that begins or ends with a jump, to which samples and powers are extrapolated.
_BESIDE_JUMP = 9
_ORDER = 8
#: Excitation of a mode by a corner, relative to that by a jump, below which no steps are made for it: at a fineness of
#: 0.4, with whose sixth power errors go.
_FAINT, _USUAL = 1e-6, 0.4
#: Largest number of time points between two edges of the drive; more would take too long to solve.
_MOST_POINTS = 1e8
#: Largest step, as a fraction of the time since the beginning of the segment.
_GROWTH = 0.35
#: Largest factor by which a step is longer than the one before: a capacitor's current is the difference of its charges
#: over the step, whose rounding the next step takes on in proportion to this factor.
_LONGER = 100.0
#: Distance of two kinks, in steps, up to which they are the same.
_SAME_BEND = 0.1


@dataclass(frozen=True)
class Grid:
    """Points of one solve, from 0, and the indices of the requested samples among them.

    ``nodes`` [s]; ``samples`` [s]; ``index``: node of each sample, or -1 where the sample lies between nodes and is
    interpolated; ``segments``: (first node, last node) of every smooth piece; ``piece``: the piece of each sample.
    ``rise`` [s] is the duration of a jump; ``linear`` is True if its nodes are a quarter of that apart, else only ends.
    """

    nodes: Array
    samples: Array
    index: NDArray[np.intp]
    segments: NDArray[np.intp]
    piece: NDArray[np.intp]
    rise: float = 0.0
    linear: bool = True

    @cached_property
    def smooth(self) -> Mask:
        """True for steps in a smooth piece, False for steps of a jump."""
        inside = np.zeros(len(self.nodes), dtype=int)
        np.add.at(inside, self.segments[:, 0], 1)
        np.subtract.at(inside, self.segments[:, 1], 1)
        return np.asarray(np.cumsum(inside)[:-1] > 0)

    @cached_property
    def unevenness(self) -> float:
        """Largest factor by which a step is longer than the one before."""
        steps = np.diff(self.nodes)
        return float((steps[1:] / steps[:-1]).max(initial=1.0))

    def parts(self, parts: int) -> NDArray[np.intp]:
        """Return the number of equal steps into which each step is split for ``parts``."""
        return np.where(self.smooth | self.linear, parts, 1)

    def subdivided(self, parts: int) -> Array:
        """Return the nodes with every step split into ``parts`` equal ones, except jumps of a nonlinear circuit."""
        counts = self.parts(parts)
        inner = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        steps = np.repeat(np.diff(self.nodes) / counts, counts)
        return np.append(np.repeat(self.nodes[:-1], counts) + steps * inner, self.nodes[-1])

    def voltages(self, drive: Drive, points: Array) -> Array:
        """Return the drive at ``points`` (see `subdivided`): straight lines from node to node, a sine itself.

        Of several drives all (sources, points).
        """
        if isinstance(drive, Drives):
            return np.stack([self.voltages(part, points) for part in drive.parts])
        if drive.angular_frequency():
            return drive.value(points)
        at_nodes = drive.value(self.nodes)
        if self.linear:
            before, after = self.segments[:-1, 1], self.segments[1:, 0]
            start = before[after > before]
            # limits at the jump, by the lines that it lies between
            left, right = (2 * at_nodes[start + k] - at_nodes[start + m] for k, m in ((1, 0), (3, 4)))
            at_nodes[start + 1] -= (right - left) / 12
            at_nodes[start + 2] = (left + right) / 2
            at_nodes[start + 3] += (right - left) / 12
        return np.asarray(np.interp(points, self.nodes, at_nodes))

    def jump_error(self, rates: Array) -> Array:
        """Return the error due to a jump's duration in modes of ``rates`` [1/s], relative to their excitation."""
        z = self.rise * rates
        return np.asarray(np.minimum(z**4 / 7680 if self.linear else z**2 / 8, 1.0))

    def halved(self) -> Grid:
        """Return the grid with every step of a smooth piece split in two."""
        counts = np.where(self.smooth, 2, 1)
        place = np.concatenate([[0], np.cumsum(counts)])
        nodes = np.empty(place[-1] + 1)
        nodes[place] = self.nodes
        split = np.flatnonzero(self.smooth)
        nodes[place[split] + 1] = (self.nodes[split] + self.nodes[split + 1]) / 2
        index = np.where(self.index < 0, -1, place[self.index])
        return replace(self, nodes=nodes, index=index, segments=place[self.segments])

    def near(self, bends: Array, others: Array) -> bool:
        """Return True if ``bends`` and ``others`` [s] are the same within a small part of the steps round them."""
        if len(bends) != len(others):
            return False
        step = np.diff(self.nodes)[np.clip(np.searchsorted(self.nodes, bends) - 1, 0, len(self.nodes) - 2)]
        return bool((np.abs(bends - others) <= _SAME_BEND * step).all())

    def bent(self, bends: Array) -> Grid:
        """Return the grid with nodes at ``bends`` [s], ascending, within its pieces, none too close to another.

        Where samples are interpolated the pieces end there, and short ones have more nodes.
        """
        right = np.clip(np.searchsorted(self.nodes, bends), 1, len(self.nodes) - 1)
        before, after = bends - self.nodes[right - 1], self.nodes[right] - bends
        width = before + after
        nearest = np.minimum(np.minimum(before, after), np.diff(bends, prepend=-np.inf))
        apart = (nearest > 1e-3 * width) & (width > 100 * _LEAST_RISE * self.nodes[-1])
        bends = bends[apart & self.smooth[right - 1]]
        grid = self._with_nodes(bends)
        if not len(bends) or (self.index >= 0).all():
            return grid
        at, least = np.searchsorted(grid.nodes, bends), 100 * _LEAST_RISE * self.nodes[-1]
        bounds = np.unique(np.concatenate([grid.segments.ravel(), at]))
        counts = np.repeat(np.ceil((_BESIDE_JUMP - 1) / np.diff(bounds)).astype(int), np.diff(bounds))
        counts = np.where(grid.smooth & (np.diff(grid.nodes) > least), counts, 1)
        inner = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        more = np.repeat(grid.nodes[:-1], counts) + np.repeat(np.diff(grid.nodes) / counts, counts) * inner
        ends = grid.nodes[at]
        grid = grid._with_nodes(more[inner > 0])
        bounds = np.union1d(grid.segments.ravel(), np.searchsorted(grid.nodes, ends))
        parts = np.stack([bounds[:-1], bounds[1:]], axis=1)
        parts = parts[grid.smooth[parts[:, 0]]]
        home = np.searchsorted(parts[:, 0], grid.segments[grid.piece, 0])
        last = np.searchsorted(parts[:, 1], grid.segments[grid.piece, 1])
        at_time = np.searchsorted(grid.nodes[parts[:, 0]], self.samples, side="right") - 1
        return replace(grid, segments=parts, piece=np.clip(at_time, home, last))

    def _with_nodes(self, more: Array) -> Grid:
        """Return the grid with ``more`` nodes [s] within its pieces."""
        nodes = np.union1d(self.nodes, more)
        index = np.where(self.index < 0, -1, np.searchsorted(nodes, self.nodes[self.index]))
        return replace(self, nodes=nodes, index=index, segments=np.searchsorted(nodes, self.nodes[self.segments]))


def design_grid(
    poles: ComplexArray,
    drive: Drive,
    samples: Array,
    theta: float,
    *,
    interpolate: bool = True,
    linear: bool = True,
    longer: float = 1.0,
    faint: bool = True,
) -> Grid:
    """Return the grid for a circuit (or several, ``poles`` together) under ``drive``, with results at ``samples``.

    ``samples`` [s] ascending, >= 0. ``theta`` sets the fineness. Where samples are much denser than the circuit needs
    they are interpolated (if ``interpolate``), elsewhere they are nodes. A jump of the drive lies in the middle of
    steps so short that no mode notices their length; samples on it are extrapolated from the side they belong to. The
    steps are ``longer`` than usual by this factor. If ``faint``, modes that a corner hardly excites take no steps.
    """
    end = float(samples[-1])
    fastest = float(np.abs(poles).max(initial=max(1 / end, drive.angular_frequency())))
    breakpoints = drive.breakpoints(end)
    jumping = np.isin(breakpoints, drive.jumps(end))
    least = (4 if linear else 1) * _LEAST_RISE * end  # in four steps, or in one
    usual = max((_RISE if linear else _RISE_NONLINEAR) / fastest, least)
    if not linear:
        usual = max(min(usual, _level_rise(drive, breakpoints, jumping, end, fastest)), least)
    rise = _rise(breakpoints, jumping, end, longer * usual, least / 2)
    half = np.where(jumping, rise / 2, 0.0)
    begins = np.concatenate([[0.0], breakpoints])
    starts = np.concatenate([[0.0], breakpoints + half])
    ends = np.concatenate([breakpoints - half, [end]])
    valid = np.flatnonzero(ends > starts)
    longest = float((ends - starts).max(initial=0.0))
    profile = _profile(poles, drive.angular_frequency(), longest, theta)
    bend = np.inf if drive.angular_frequency() else _bend(drive, begins, end)
    after_kink = profile if bend == np.inf else _profile(poles, 0.0, longest, theta, bend, faint=faint)
    smallest = max(_FIRST_STEP / fastest, _LEAST_STEP * end)
    pieces: list[Array] = []
    for k in valid:
        a, b = float(starts[k]), float(ends[k])
        nodes_of = after_kink if k and not half[k - 1] else profile
        piece = np.concatenate([[a], _cut(nodes_of, b - a) + a, [b]])
        if k == 0:
            piece = np.concatenate([[a], _launch(float(piece[1] - a), smallest) + a, piece[1:]])
        elif (half[k - 1] or half[k : k + 1].any()) and len(piece) < _BESIDE_JUMP:
            piece = np.linspace(a, b, _BESIDE_JUMP)
        inside = samples[np.searchsorted(samples, a) : np.searchsorted(samples, b, side="right")]
        if not (interpolate and len(inside) > 2 * len(piece) and len(piece) > 12):
            piece = _merged(piece, inside, 3e-8 / fastest)
        if pieces and (linear or not half[k - 1]):
            before = rise / 4 if half[k - 1] else pieces[-1][-1] - pieces[-1][-2]
        else:
            before = np.inf
        pieces.append(_graded(piece, float(before)))
    within = breakpoints[jumping, None] + rise * np.array([-0.25, 0.0, 0.25]) if linear else np.empty(0)
    nodes = np.unique(np.concatenate([*pieces, within.ravel()]))
    segments = np.searchsorted(nodes, np.array([(p[0], p[-1]) for p in pieces]))
    nearest = np.clip(np.searchsorted(nodes, samples), 0, len(nodes) - 1)
    index = np.where((nodes[nearest] == samples) & ~np.isin(samples, within), nearest, -1)
    home = np.searchsorted(begins[valid], samples, side="right") - 1
    home = np.clip(home, 0, None).astype(np.intp)
    rise = rise if jumping.any() else 0.0
    return Grid(nodes, samples, index.astype(np.intp), segments.astype(np.intp), home, rise, linear)


def _bend(drive: Drive, begins: Array, end: float) -> float:
    """Return the largest change of slope at a drive's corners over its largest value [1/s].

    A mode of rate p is excited by a corner as by a jump of the change of slope over p.
    """
    bounds = np.append(begins, end)
    halves = np.maximum(np.diff(bounds) / 2, np.finfo(float).tiny)
    slopes = (levels(drive, bounds[:-1] + halves) - levels(drive, bounds[:-1])) / halves
    return float(np.abs(np.diff(slopes)).max(initial=0.0)) / (drive.largest() or 1.0) or np.inf


def _level_rise(drive: Drive, breakpoints: Array, jumping: Mask, end: float, fastest: float) -> float:
    """Return how long [s] a jump in one step may take beside slopes of the drive.

    A straight line over the jump adds rise^2/8 of the slopes' difference to the integral of the drive.
    """
    bounds = np.concatenate([[0.0], breakpoints, [end]])
    halves = np.diff(bounds) / 2
    rises = levels(drive, bounds[:-1] + halves) - levels(drive, bounds[:-1])
    slopes = rises / np.where(halves > 0, halves, np.inf)
    change = float(np.abs(np.diff(slopes))[:, jumping].max(initial=0.0)) * fastest
    return float(np.sqrt(8 * _LEVEL * drive.largest() / change)) if change else np.inf


def _rise(breakpoints: Array, jumping: Mask, end: float, rise: float, least: float) -> float:
    """Return the duration [s] of a jump: below every mode's time constant and its neighbours, above rounding."""
    if jumping.any():
        gaps = np.diff(np.concatenate([[0.0], breakpoints, [end]]))
        nearest = float(np.minimum(gaps[:-1], gaps[1:])[jumping].min())
        rise = min(rise, nearest / 5)
    if rise < least:
        raise SolveError(
            f"two edges of the drive are too near each other for ngspice in a run of {end:g} s; shorten the run or use "
            f"{argument('engine', 'exact')}"
        )
    return rise


def smooth_intervals(poles: ComplexArray, drive: Drive, end: float) -> Array:
    """Return points from 0 to ``end`` [s] between which every mode and the drive are smooth, breakpoints included."""
    begins = np.concatenate([[0.0], drive.breakpoints(end)])
    ends = np.append(begins[1:], end)
    profile = _profile(poles, drive.angular_frequency(), float((ends - begins).max()), _SMOOTH)
    pieces = [np.concatenate([[a], a + _cut(profile, b - a)]) for a, b in zip(begins, ends, strict=True)]
    return np.unique(np.append(np.concatenate(pieces), end))


def _profile(
    poles: ComplexArray, omega: float, longest: float, theta: float, bend: float = np.inf, *, faint: bool = False
) -> Array:
    """Return nodes (without the start) of a segment of length ``longest``, by inverting N(t) = integral dt/h(t).

    Modes faster than ``bend`` [1/s] are excited by that ratio less than by a jump, see `_bend`; ``faint`` ones so
    little that steps need not follow them.
    """
    least = _FAINT * (theta / _USUAL) ** 6 if faint else 0.0
    modes = poles[(np.abs(poles) > 0) & (np.abs(poles) * least < bend)]
    if not longest or (not len(modes) and not omega):
        return np.empty(0)
    fastest = np.abs(modes).max(initial=omega)
    first = min(theta / fastest * max(fastest / bend, 1.0) ** (1 / _ORDER), longest)
    t = np.concatenate([[0.0], np.geomspace(first / 8, longest, 2000)])
    step = np.full(len(t), theta / omega if omega else np.inf)
    for pole in representatives(modes):
        decay = max(-pole.real, 0.0)
        less = max(abs(pole) / bend, 1.0) ** (1 / _ORDER)
        step = np.minimum(step, theta / abs(pole) * less * np.exp(np.minimum(decay * t / _ORDER, 600)))
    step = np.minimum(step, np.maximum(_GROWTH * t, first))
    density = 1 / step
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(t))])
    if not count[-1] < _MOST_POINTS:
        raise SolveError(
            f"the circuit's modes are too fast for a run of {longest:.3g} s: it would take {count[-1]:.1g} time points"
        )
    return np.asarray(np.interp(np.arange(1, np.floor(count[-1]) + 1), count, t))


def representatives(modes: ComplexArray) -> ComplexArray:
    """Return a few modes that bound many: for each tenth of a decade the fastest rate with the slowest decay."""
    if len(modes) <= 24:
        return modes
    group = np.round(10 * np.log10(np.abs(modes))).astype(int)
    chosen = []
    for g in np.unique(group):
        members = modes[group == g]
        decay = np.clip(-members.real, 0, None).min()
        size = np.abs(members).max()
        chosen.append(complex(-decay, np.sqrt(max(size**2 - decay**2, 0.0))))
    return np.array(chosen)


def _cut(profile: Array, length: float) -> Array:
    """Return the profile's nodes within a segment, without a node that would make its last step too short."""
    inside = profile[profile < length]
    last = np.append(0.0, inside)[-2:]
    if len(inside) and length - last[1] < 0.3 * (last[1] - last[0]):
        inside = inside[:-1]
    return np.asarray(inside)


def _launch(first: float, smallest: float) -> Array:
    """Return the points from 0 towards ``first`` with steps that double, for the start from rest."""
    if smallest >= first / 3:
        return np.empty(0)
    count = int(np.ceil(np.log2(first / smallest)))
    return np.asarray(first * 2.0 ** np.arange(-count, 0), dtype=np.float64)


def _merged(piece: Array, samples: Array, tolerance: float) -> Array:
    """Return nodes and samples together; a node that nearly coincides with a sample is dropped."""
    if not len(samples):
        return piece
    right = np.clip(np.searchsorted(samples, piece), 0, len(samples) - 1)
    near = np.minimum(np.abs(samples[right] - piece), np.abs(samples[np.maximum(right - 1, 0)] - piece)) <= tolerance
    near[[0, -1]] = False
    kept = piece[~near]
    inside = samples[(samples > kept[0] + tolerance) & (samples < kept[-1] - tolerance)]
    return np.asarray(np.union1d(kept, inside), dtype=float)


def _graded(piece: Array, before: float) -> Array:
    """Return the nodes with more of them after short steps, of which the one before the piece is the first."""
    steps = np.diff(piece, prepend=piece[0] - before)
    added = []
    for k in np.flatnonzero(steps[1:] > _LONGER * steps[:-1]).tolist():
        ratio = steps[k + 1] / steps[k]
        parts = int(np.ceil(np.log(ratio) / np.log(_LONGER)))
        added.append(piece[k] + steps[k] * ratio ** (np.arange(1, parts) / parts))
    return np.union1d(piece, np.concatenate(added)) if added else piece


def lagrange(nodes: Array, at: Array, width: int) -> Array:
    """Return weights (samples, nodes) of local interpolation by polynomials through the ``width`` nearest nodes.

    Local, because a spline of this degree rings on grids whose steps grow as fast as these.
    """
    width = min(width, len(nodes))
    left = np.clip(np.searchsorted(nodes, at) - width // 2, 0, len(nodes) - width)
    window = left[:, None] + np.arange(width)
    x = nodes[window]
    difference = x[:, :, None] - x[:, None, :]
    distance = np.broadcast_to(at[:, None, None] - x[:, None, :], difference.shape).copy()
    diagonal = np.arange(width)
    difference[:, diagonal, diagonal] = distance[:, diagonal, diagonal] = 1.0
    weights = np.zeros((len(at), len(nodes)))
    np.put_along_axis(weights, window, np.prod(distance / difference, axis=2), axis=1)
    return weights
