"""Time grids designed from a circuit's poles, so that the trapezoidal rule converges fast everywhere on them.

After a jump of the drive every mode k of the circuit is excited and then dies out as exp(Re(p_k) t). A step h makes an
error that goes with (|p_k| h)^q times what is left of the mode, so h may grow as the modes die:

    h(t) = min over k of  theta/|p_k| exp(-Re(p_k) t/q)      and  theta/omega under a sine of frequency omega

The rule's own errors are removed by Richardson extrapolation over equal subdivisions of this grid, which needs no
more than that the grid's steps are split evenly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..circuit.drive import Drive

Array = NDArray[np.float64]

#: ngspice's first step is backward Euler; so short (in units of the fastest mode) its error is below 1e-9.
_FIRST_STEP = 1e-5
_ORDER = 8
#: A step never grows beyond this part of the time since the segment began.
_GROWTH = 0.35


@dataclass(frozen=True)
class Grid:
    """Points of one solve, from 0, and where the requested samples are among them.

    ``nodes`` [s]; ``samples`` [s]; ``index``: node of each sample, or -1 where the sample lies between nodes and is
    interpolated; ``segments``: (first node, last node) of every smooth piece.
    """

    nodes: Array
    samples: Array
    index: NDArray[np.intp]
    segments: NDArray[np.intp]

    def subdivided(self, parts: int) -> Array:
        """The nodes with every step split into ``parts`` equal ones."""
        steps = np.diff(self.nodes)
        inner = self.nodes[:-1, None] + steps[:, None] * (np.arange(parts) / parts)
        return np.append(inner.ravel(), self.nodes[-1])


def rise_time(poles: NDArray[np.complex128], duration: float) -> float:
    """How long [s] a jump takes in a solve: too short for any mode to notice, long enough for a double to resolve."""
    fastest = float(np.abs(poles).max(initial=1 / duration))
    return max(1e-8 / fastest, 1e-12 * duration)


def design_grid(
    poles: NDArray[np.complex128], drive: Drive, samples: Array, rise: float, theta: float, *, interpolate: bool = True
) -> Grid:
    """The grid for a circuit (or several, ``poles`` together) under ``drive`` with results wanted at ``samples``.

    ``samples`` [s] ascending, >= 0. ``theta`` sets the fineness. Where samples are much denser than the circuit needs
    they are interpolated (if ``interpolate``), elsewhere they are nodes.
    """
    end = float(samples[-1])
    breakpoints = drive.breakpoints(end)
    jumps = np.isin(breakpoints, _jump_times(drive, breakpoints))
    starts = np.concatenate([[0.0], np.where(jumps, breakpoints + rise / 2, breakpoints)])
    ends = np.concatenate([np.where(jumps, breakpoints - rise / 2, breakpoints), [end]])
    valid = ends > starts
    samples_right = _off_edges(samples, breakpoints[jumps], rise)
    profile = _profile(poles, drive.angular_frequency(), float((ends - starts).max(initial=0.0)), theta)
    fastest = float(np.abs(poles).max(initial=max(1 / end, drive.angular_frequency())))
    pieces: list[Array] = []
    spline: list[Array] = []
    for k in np.flatnonzero(valid):
        a, b = float(starts[k]), float(ends[k])
        piece = np.concatenate([[a], _cut(profile, b - a) + a, [b]])
        if k == 0:
            piece = np.concatenate([[a], _launch(float(piece[1] - a), _FIRST_STEP / fastest) + a, piece[1:]])
        low, high = np.searchsorted(samples_right, [a, b], side="left")
        inside = samples_right[low : high + (k == len(starts) - 1)]
        if interpolate and len(inside) > 2 * len(piece) and len(piece) > 12:
            spline.append(inside)
        else:
            piece = _merged(piece, inside, 1e-3 * rise if rise < end else 0.0)
        pieces.append(piece)
    nodes = np.unique(np.concatenate(pieces)) if pieces else np.array([0.0])
    bounds = np.array([(p[0], p[-1]) for p in pieces]).reshape(-1, 2)
    segments = np.searchsorted(nodes, bounds)
    nearest = np.clip(np.searchsorted(nodes, samples_right - 1e-3 * rise), 0, len(nodes) - 1)
    index = np.where(np.abs(nodes[nearest] - samples_right) <= 1e-3 * rise, nearest, -1)
    return Grid(nodes, samples_right, index.astype(np.intp), segments.astype(np.intp))


def _jump_times(drive: Drive, breakpoints: Array) -> Array:
    """Breakpoints at which the value, not only the slope, jumps."""
    times = getattr(drive, "times", np.empty(0))
    return np.unique(times[1:][np.diff(times) == 0]) if len(times) else breakpoints[:0]


def _off_edges(samples: Array, jumps: Array, rise: float) -> Array:
    """Samples on or in a jump's rise are moved to its end: a sample on an edge is the right limit."""
    if not len(jumps):
        return samples
    nearest = jumps[np.clip(np.searchsorted(jumps, samples - rise / 2), 0, len(jumps) - 1)]
    return np.where(np.abs(samples - nearest) <= rise / 2, nearest + rise / 2, samples)


def _profile(poles: NDArray[np.complex128], omega: float, longest: float, theta: float) -> Array:
    """Nodes (without the start) of a segment of length ``longest``, by inverting the count N(t) = integral dt/h(t)."""
    modes = poles[np.abs(poles) > 0]
    if not longest or (not len(modes) and not omega):
        return np.empty(0)
    fastest = np.abs(modes).max(initial=omega)
    first = min(theta / fastest, longest)
    t = np.concatenate([[0.0], np.geomspace(first / 8, longest, 2000)])
    step = np.full(len(t), theta / omega if omega else np.inf)
    for pole in _representatives(modes):
        decay = max(-pole.real, 0.0)
        step = np.minimum(step, theta / abs(pole) * np.exp(np.minimum(decay * t / _ORDER, 600)))
    step = np.minimum(step, np.maximum(_GROWTH * t, first))
    density = 1 / step
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(t))])
    return np.asarray(np.interp(np.arange(1, np.floor(count[-1]) + 1), count, t))


def _representatives(modes: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Few modes that bound many: of those within a tenth of a decade the fastest, with the slowest decay."""
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
    """The profile's nodes within a segment, without one so close to its end that the last step would be a sliver."""
    inside = profile[profile < length]
    if len(inside) > 1 and length - inside[-1] < 0.3 * (inside[-1] - inside[-2]):
        inside = inside[:-1]
    return np.asarray(inside)


def _launch(first: float, smallest: float) -> Array:
    """Points from 0 towards ``first``, each step twice the one before, for the start from rest."""
    if smallest >= first / 3:
        return np.empty(0)
    count = int(np.ceil(np.log2(first / smallest)))
    return np.asarray(first * 2.0 ** np.arange(-count, 0), dtype=np.float64)


def _merged(piece: Array, samples: Array, tolerance: float) -> Array:
    """Nodes and samples together; a node that all but coincides with a sample gives way to it."""
    if not len(samples):
        return piece
    right = np.clip(np.searchsorted(samples, piece), 0, len(samples) - 1)
    near = np.minimum(np.abs(samples[right] - piece), np.abs(samples[np.maximum(right - 1, 0)] - piece)) <= tolerance
    near[[0, -1]] = False
    kept = piece[~near]
    inside = samples[(samples > kept[0] + tolerance) & (samples < kept[-1] - tolerance)]
    return np.asarray(np.union1d(kept, inside), dtype=float)
