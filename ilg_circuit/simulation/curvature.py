"""The curvature of a strip along its length, over time: what the circuits give and shapes are computed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..circuit.netlist import Output
from ..circuit.relaxing import transducer
from ..errors import InputError
from ..solve.transient import Waveforms
from ..strip.actuator import Actuator
from ..strip.cells import Layout
from ..strip.elements import lumped_elements
from .waveforms import Solution

_PROBE = "free curvature"


@dataclass(frozen=True, eq=False)
class Curvatures:
    """Free curvature ``values`` [1/m] (n, cells) at ``time`` [s] (n,), constant in each of the cells.

    ``lengths`` [m] (cells,) are those of the cells, from the clamp to the free end. Positive curvature bends towards
    the anode, the direction of a positive displacement. Raises InputError for arrays that do not fit together.
    """

    time: Array
    lengths: Array
    values: Array

    def __post_init__(self) -> None:
        for name in ("time", "lengths", "values"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        wanted = (len(np.atleast_1d(self.time)), len(np.atleast_1d(self.lengths)))
        if self.time.ndim != 1 or self.lengths.ndim != 1 or self.values.shape != wanted or 0 in wanted:
            raise InputError(
                f"curvatures have the shape {self.values.shape}; give one for each time and cell, {wanted}"
            )
        if not (self.lengths > 0).all() or not (np.isfinite(self.values).all() and np.isfinite(self.time).all()):
            raise InputError("curvatures: give finite curvatures and times, and cells longer than zero")

    @property
    def ends(self) -> Array:
        """Distances of the cells' ends from the clamp [m] (cells + 1,), the clamp first."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    def angles(self, places: Array) -> Array:
        """Return the free angles [rad] (n, m) at ``places`` [m] (m,): the integral of the curvature from the clamp."""
        cell = cells_of(self.ends, places)
        before = np.pad(np.cumsum(self.values * self.lengths, axis=1), ((0, 0), (1, 0)))[:, cell]
        return np.asarray(before + self.values[:, cell] * (places - self.ends[cell]))


def cells_of(ends: Array, places: Array) -> NDArray[np.intp]:
    """Return the number of the cell that holds each of ``places`` [m] (m,); an end belongs to the cell before it."""
    return np.clip(np.searchsorted(ends, places, side="left") - 1, 0, len(ends) - 2)


def curvature_probe(actuator: Actuator, band: tuple[float, float]) -> tuple[Output, ...]:
    """Return the output from which a solve's `curvatures` are taken; none without a coupling or for a line.

    2 y1/L_F^2 of the free displacement y1, before beam, weight and load have their share.
    """
    lumped = lumped_elements(actuator, band)
    if lumped.coupling is None or actuator.electrodes is not None:
        return ()
    scale = 2 / actuator.geometry.load_distance**2
    terms = transducer(lumped).displacement()
    return (Output(_PROBE, "1/m", tuple((name, scale * gain) for name, gain in terms.items()), probe=True),)


def curvatures(actuator: Actuator, time: Array, waves: Waveforms) -> Curvatures | None:
    """Return the curvatures of an equipotential strip, one cell, from a solve with `curvature_probe`."""
    if _PROBE not in waves.names:
        return None
    return Curvatures(time, np.array([actuator.geometry.free_length]), waves.output(_PROBE)[:, None])


def along_segments(layout: Layout) -> dict[str, Array]:
    """Return the weights (cells,) of the cells' curvatures in the mean of each segment of side 1, and in the angle.

    "curvature_1", "curvature_2", ... are means [1/m] over the segments' free parts; "angle" [rad] is that of the free
    end as the free curvatures bend it.
    """
    lengths = np.array([cell.length for cell in layout.free])
    of = np.array([-1 if cell.segments[0] is None else cell.segments[0] for cell in layout.free])
    found = {}
    for k in range(len(layout.contacts[0])):
        own = np.where(of == k, lengths, 0.0)
        found[f"curvature_{k + 1}"] = own / own.sum()
    return found | {"angle": lengths}


def cell_curvatures(layout: Layout, solution: Solution) -> Curvatures | None:
    """Return the free curvatures of a line's cells; None for a strip without coupling."""
    names = [f"curvature_{k}" for k in range(1, len(layout.free) + 1)]
    if names[0] not in solution.waveforms.names:
        return None
    lengths = np.array([cell.length for cell in layout.free])
    return Curvatures(solution.time, lengths, np.stack([solution.sampled(name) for name in names], axis=1))
