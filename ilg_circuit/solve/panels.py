"""A run cut into panels, on each of which every waveform is a polynomial to seven digits.

On a panel of width h a mode exp(p t) is known by its values at 10 points to about 3e-12 (abs(p) h)^10 of what is left
of it, so h = 3.5/abs(p), growing as the mode dies. Widths are a smooth piece's length over powers of two, so that
exact propagators of one width are squares of the propagators of another. The points are Gauss and Radau's with the left
end among them, which is the right limit where the drive jumps; sums over them with `WEIGHTS` are integrals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

from ..arrays import Array, ComplexArray, Mask
from ..drive import Drive
from ..errors import SolveError
from .grid import representatives

NODES = 10
#: Largest width of a panel, in units of the fastest mode alive.
_FINENESS = 3.5
_MOST_PANELS = 20_000


def _radau(count: int) -> tuple[Array, Array]:
    """Return the nodes on [0, 1] with 0 among them and weights, exact for polynomials of degree 2 count - 2."""
    series = np.zeros(count + 1)
    series[count - 1 :] = 1.0  # P_(n-1) + P_n
    nodes = np.sort(legendre.legroots(series))
    nodes[0] = -1.0
    moments = np.zeros(count)
    moments[0] = 2.0
    weights = np.linalg.solve(legendre.legvander(nodes, count - 1).T, moments)
    return (nodes + 1) / 2, weights / 2


#: Positions of the points on a panel (0 to 1), and the weights of a mean over it.
FRACTIONS, WEIGHTS = _radau(NODES)


@dataclass(frozen=True)
class Panels:
    """``starts`` [s] and ``widths`` [s] (m,) of panels that follow one another from 0 to ``end`` [s]."""

    starts: Array
    widths: Array
    end: float

    @cached_property
    def points(self) -> Array:
        """Times [s] (m, NODES) of the points, each panel's first being its start."""
        return np.asarray(self.starts[:, None] + self.widths[:, None] * FRACTIONS)

    def split(self, chosen: Mask, parts: int) -> Panels:
        """Return the panels with the ``chosen`` (m,) ones cut into equal ``parts``."""
        counts = np.where(chosen, parts, 1)
        widths = np.repeat(self.widths / counts, counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        return Panels(np.repeat(self.starts, counts) + (np.arange(len(widths)) - first) * widths, widths, self.end)


def design_panels(poles: ComplexArray, drive: Drive, end: float) -> Panels:
    """Return panels for circuits with ``poles`` [1/s] (any shape, all together) under ``drive`` to ``end`` [s].

    Raises SolveError when a mode rings so fast and so long that more than 20000 would be needed.
    """
    modes = representatives(poles[np.abs(poles) > 0])
    rates = np.append(np.abs(modes), drive.angular_frequency())
    decays = np.append(np.clip(-modes.real, 0, None), 0.0)
    bounds = np.concatenate([[0.0], drive.breakpoints(end), [end]])
    tiles: dict[float, Array] = {}
    starts, widths = [], []
    total = 0
    for a, length in zip(bounds[:-1], np.diff(bounds), strict=True):
        key = float(f"{length:.9e}")  # periods that differ by rounding only are cut in the same way
        if key not in tiles:
            tiles[key] = _tiles(key, rates, decays)
        total += len(tiles[key])
        if total > _MOST_PANELS:
            _refuse(end, rates)
        starts.append(a + np.concatenate([[0.0], np.cumsum(tiles[key][:-1])]))
        widths.append(tiles[key])
    return Panels(np.concatenate(starts), np.concatenate(widths), end)


def _tiles(length: float, rates: Array, decays: Array) -> Array:
    """Return widths that fill a smooth piece, each the length over a power of two and aligned to it."""
    with np.errstate(divide="ignore"):
        widest = _FINENESS / rates
    levels = math.ceil(math.log2(length / min(float(widest.min()), length)))
    if levels > 60:
        _refuse(length, rates)
    unit, whole = length / 2**levels, 2**levels
    position, tiles = 0, []
    while position < whole:
        alive = np.exp(np.minimum(decays * (position * unit) / NODES, 600))
        allowed = float((widest * alive).min()) / unit
        size = min(position & -position or whole, whole - position)  # the largest that is aligned here
        while size > 1 and size > allowed:
            size //= 2
        tiles.append(size * unit)
        position += size
        if len(tiles) > _MOST_PANELS:
            _refuse(length, rates)
    return np.array(tiles)


def _refuse(length: float, rates: Array) -> None:
    raise SolveError(
        f"a run of {length:g} s with modes or a drive of {rates.max():.3g} rad/s that hardly die needs more than "
        f"{_MOST_PANELS} panels; shorten it, or give the beam some damping"
    )
