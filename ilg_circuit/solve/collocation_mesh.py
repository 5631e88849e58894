"""Divides time into steps in which a drive is straight, and gives the three points of each that cubics go through."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import SolveError

#: Radau IIA: the points of a step, in steps.
POINTS = np.array([(4 - np.sqrt(6.0)) / 10, (4 + np.sqrt(6.0)) / 10, 1.0])
#: Largest number of steps, and what is told of more.
_MOST = 50_000
UNSOLVED = "the port's equations take more steps than are sensible: its values are out of all proportion"


@dataclass(frozen=True)
class Mesh:
    """``nodes`` (n + 1,) [s] and the source where each of the n steps begins and ends, between which it is straight."""

    nodes: Array
    left: Array
    right: Array

    @classmethod
    def of(cls, drive: PiecewiseLinear, nodes: Array) -> Mesh:
        left = drive.value(nodes[:-1])
        middle = drive.value((nodes[:-1] + nodes[1:]) / 2)
        return cls(nodes, left, 2 * middle - left)

    @cached_property
    def steps(self) -> Array:
        return np.diff(self.nodes)

    @cached_property
    def source(self) -> Array:
        """The source at the points of the steps (3, n)."""
        return self.left + POINTS[:, None] * (self.right - self.left)

    @cached_property
    def points(self) -> Array:
        """The times [s] of the points of the steps (3, n)."""
        times = self.nodes[:-1] + POINTS[:, None] * self.steps
        times[-1] = self.nodes[1:]
        return times

    def split(self, drive: PiecewiseLinear, parts: NDArray[np.intp]) -> Mesh:
        """Return the mesh with every step in so many equal parts (n,). Raises SolveError for too many of them."""
        if parts.sum() > _MOST:
            raise SolveError(UNSOLVED)
        inner = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        begins = np.repeat(self.nodes[:-1], parts) + inner * np.repeat(self.steps / parts, parts)
        return Mesh.of(drive, np.append(begins, self.nodes[-1]))
