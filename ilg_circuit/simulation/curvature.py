"""The curvature of a strip along its length, over time: what the circuits give and shapes are computed from."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Array


@dataclass(frozen=True, eq=False)
class Curvatures:
    """Free curvature ``values`` [1/m] (n, cells) at ``time`` [s] (n,), constant in each of the cells.

    ``lengths`` [m] (cells,) are those of the cells, from the clamp to the free end. Positive curvature bends towards
    the anode, the direction of a positive displacement.
    """

    time: Array
    lengths: Array
    values: Array
