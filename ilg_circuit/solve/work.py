"""Work: integrals over time of powers, which are products of a circuit's outputs, as further outputs of a run.

ngspice's are sums by the trapezoidal rule over the points of a run, as a further state of the circuit would be: their
error is a series in even powers of the step too, so that they are extrapolated, with an error, like any output.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from ..arrays import Array
from ..drive import Drive
from .exact import exact_outputs
from .grid import Grid, lagrange, smooth_intervals
from .state_space import StateSpace

#: Name of an output -> its values (n, t).
Named = Callable[[str], Array]


@dataclass(frozen=True)
class Work:
    """The integral from t = 0 on of a ``power`` (drive [V] (t,), outputs by name (n, t)) -> [W] (n, t).

    ``probe`` as for an output of a netlist.
    """

    name: str
    power: Callable[[Array, Named], Array]
    probe: bool = True


def powers(works: Sequence[Work], names: Sequence[str], voltages: Array, outputs: Array) -> Array:
    """Return the powers [W] (n, works, t) of ``outputs`` (n, outputs, t) of ``names`` under ``voltages`` [V] (t,)."""
    found = np.empty((len(outputs), len(works), outputs.shape[2]))
    for k, work in enumerate(works):
        found[:, k] = work.power(voltages, lambda name: np.asarray(outputs[:, names.index(name)]))
    return found


def on_grid(grid: Grid, parts: int, power: Array) -> Array:
    """Return the integrals (n, works, nodes) at a grid's nodes after 0 of ``power`` at its points after 0.

    The points are those of `Grid.subdivided`. Of a jump's two halves each has the limit on its side.
    """
    counts = grid.parts(parts)
    begins = np.cumsum(counts) - counts
    steps = np.repeat(np.diff(grid.nodes) / counts, counts)
    pieces = power * (steps / 2)
    pieces[..., 1:] += power[..., :-1] * (steps[1:] / 2)
    found = np.add.reduceat(pieces, begins, axis=-1)
    found[..., ~grid.smooth] = 0.0
    found[..., 0] = 0.0
    at_nodes = power[..., begins + counts - 1]
    ends = grid.segments[:, 1]
    jumps = np.flatnonzero(np.append(True, grid.segments[1:, 0] > ends[:-1]))
    for k in jumps.tolist():
        first = max(int(grid.segments[k, 0]), 1)
        begin = (grid.nodes[ends[k - 1]] + grid.nodes[first]) / 2 if k else 0.0
        found[..., first - 1] += _beside(grid, at_nodes, first, min(first + _NEAR, int(ends[k])), begin, first)
        if k:
            last, least = int(ends[k - 1]), max(int(grid.segments[k - 1, 0]), 1)
            found[..., first - 1] -= _beside(grid, at_nodes, max(last - _NEAR, least), last, begin, last)
    return np.asarray(np.cumsum(found, axis=-1))


#: Nodes beside a jump by which a power is extrapolated to it, less one.
_NEAR = 7


def _beside(grid: Grid, at_nodes: Array, first: int, last: int, begin: float, node: int) -> Array:
    """Return the integral (n, works) from ``begin`` to a node, by the polynomial of nodes ``first`` to ``last``."""
    width = grid.nodes[node] - begin
    fractions, weights = gauss(4)
    values = lagrange(grid.nodes[first : last + 1], begin + width * fractions, _NEAR + 1)
    return np.asarray(at_nodes[..., first - 1 : last] @ (width * weights @ values))


def gauss(count: int) -> tuple[Array, Array]:
    """Return nodes in (0, 1) and weights of Gauss and Legendre's rule."""
    nodes, weights = legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


def exact_with_work(
    system: StateSpace, drive: Drive, times: Array, works: Sequence[Work], *, modes: bool = True
) -> Array:
    """Return the outputs at ``times`` [s] and after them the works, (n, outputs + works, t), by the exact engine.

    The works by five Gauss points in every interval in which outputs and drive are smooth. ``modes`` as for
    `exact_outputs`.
    """
    if not works:
        return exact_outputs(system, drive, times, modes=modes)
    intervals = smooth_intervals(system.poles().ravel(), drive, float(times[-1]) or 1e-300)
    ends = np.union1d(times, intervals[intervals <= times[-1]])
    fractions, weights = gauss(5)
    widths = np.diff(ends)[:, None]
    points = ends[:-1, None] + widths * fractions
    grid = np.union1d(times, points.ravel())
    outputs = exact_outputs(system, drive, grid, modes=modes)
    inside = np.searchsorted(grid, points.ravel())
    power = powers(works, system.output_names, drive.value(grid[inside]), outputs[..., inside])
    steps = (power.reshape(*power.shape[:2], *points.shape) * (widths * weights)).sum(axis=-1)
    total = np.append(np.zeros((*power.shape[:2], 1)), np.cumsum(steps, axis=-1), axis=-1)
    at, until = np.searchsorted(grid, times), np.searchsorted(ends, times)
    return np.concatenate([outputs[..., at], total[..., until]], axis=1)
