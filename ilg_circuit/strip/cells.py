"""Divides a strip with electrodes into cells along its length, and says where its segments are wired.

Places [m] are counted from the clamp's edge: the clamped part has negative ones, the free end is at L0. A cell has one
segment on each side, or none where the gel is bare; its shunt stands in its middle (mid-point rule).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

from ..errors import InputError
from .actuator import Actuator
from .electrodes import Electrodes

#: Parts of the strip's length below which two places are one.
_SAME = 1e-9


@dataclass(frozen=True)
class Cell:
    """A piece of the strip from ``start`` to ``end`` [m], with the segments (from 0, or None) of side 1 and side 2.

    ``contact``: both segments are at their contacts' potentials over the whole of it.
    """

    start: float
    end: float
    segments: tuple[int | None, int | None]
    contact: bool = False

    @property
    def length(self) -> float:
        return self.end - self.start

    @property
    def middle(self) -> float:
        return (self.start + self.end) / 2

    @property
    def free(self) -> bool:
        """Whether it is of the free part, which bends."""
        return self.start >= 0

    @property
    def active(self) -> bool:
        """Whether it has electrodes on both sides."""
        return None not in self.segments

    def arm(self, at: float) -> float:
        """Return the displacement at ``at`` per curvature [m^2]: the integral of (``at`` - x) dx over it."""
        if not self.free or self.start >= at:
            return 0.0
        end = min(self.end, at)
        return (end - self.start) * (at - (self.start + end) / 2)


@dataclass(frozen=True)
class Layout:
    """The cells of a strip from its inner to its free end, and the place [m] of each segment's contact by side."""

    cells: tuple[Cell, ...]
    contacts: tuple[tuple[float, ...], tuple[float, ...]]

    @property
    def free(self) -> tuple[Cell, ...]:
        """The cells of the free length."""
        return tuple(cell for cell in self.cells if cell.free)

    def finer(self, factor: int = 2) -> Layout:
        """Return the layout with every cell but the contact and bare ones split into equal ones."""
        cells = []
        for cell in self.cells:
            parts = factor if cell.active and not cell.contact else 1
            cells += _split(cell, parts)
        return replace(self, cells=tuple(cells))


def pieces(actuator: Actuator) -> Layout:
    """Return the layout with as few cells as there can be: one from each edge or contact to the next."""
    sheets, g = _electrodes(actuator), actuator.geometry
    inner, tolerance = g.free_length - g.length, _SAME * g.length
    contacted = sheets.contacted(g)
    spans = [list(sheets.spans(side, g)) for side in (1, 2)]
    contacts = [[_contact(sheets, span, k, inner) for k, span in enumerate(of_side)] for of_side in spans]
    for of_side in spans:
        of_side[0] = (inner, of_side[0][1])
    places = [inner, inner + contacted, 0.0, g.free_length]
    places += [place for of_side in spans for span in of_side for place in span]
    places += [place for of_side in contacts for place in of_side]
    distinct: list[float] = []
    for place in sorted(places):
        if not distinct or place - distinct[-1] > tolerance:
            distinct.append(place)
    # the clamp's edge and the free end are what they are
    distinct = [0.0 if abs(place) <= tolerance else place for place in distinct]
    cells = []
    for start, end in pairwise(distinct):
        middle = (start + end) / 2
        found = [next((k for k, (a, b) in enumerate(of_side) if a < middle < b), None) for of_side in spans]
        contact = contacted > tolerance and middle < inner + contacted
        cells.append(Cell(start, end, (found[0], found[1]), contact))
    if contacted > tolerance:
        for wired in contacts:
            wired[0] = inner + contacted
    return Layout(tuple(cells), (tuple(contacts[0]), tuple(contacts[1])))


def layout(actuator: Actuator, count: int, *, alike: bool = False) -> Layout:
    """Return the layout with ``count`` cells with electrodes in the free length, and cells as long in the clamp.

    ``alike`` takes as many more as make pieces of one length alike. Raises InputError for fewer cells than pieces
    between edges and contacts.
    """
    coarse = pieces(actuator)
    free = [cell for cell in coarse.cells if cell.free and cell.active]
    if count < len(free):
        raise InputError(
            f"electrodes.cells is {count}; segments and contacts divide the free length into {len(free)} pieces with "
            f"electrodes on both sides: give {len(free)} cells or more"
        )
    if not free:
        raise InputError("no part of the free length has electrodes on both sides; change electrodes.lengths_1 or _2")
    lengths = [cell.length for cell in free]
    each = [max(math.ceil(count * x / sum(lengths) * (1 - _SAME)), 1) for x in lengths] if alike else []
    parts = dict(zip(free, each or _shared(count, lengths), strict=True))
    size = sum(lengths) / count
    cells: list[Cell] = []
    for cell in coarse.cells:
        clamped = cell.active and not cell.free and not cell.contact
        cells += _split(cell, parts.get(cell, max(round(cell.length / size), 1) if clamped else 1))
    return replace(coarse, cells=tuple(cells))


def least_cells(actuator: Actuator) -> int:
    """Return the smallest number of cells of the free length."""
    return max(sum(cell.free and cell.active for cell in pieces(actuator).cells), 1)


def _electrodes(actuator: Actuator) -> Electrodes:
    if actuator.electrodes is None:
        raise InputError(f"actuator '{actuator.name}' has no [electrodes]; it is one lump")
    return actuator.electrodes


def _contact(sheets: Electrodes, span: tuple[float, float], k: int, inner: float) -> float:
    """Return the place [m] of the contact of segment ``k``, whose free part is ``span``."""
    if sheets.contact == "each":
        return (span[0] + span[1]) / 2
    return span[0] if k else inner


def _split(cell: Cell, parts: int) -> list[Cell]:
    edges = [cell.start + cell.length * k / parts for k in range(parts)] + [cell.end]
    return [replace(cell, start=a, end=b) for a, b in pairwise(edges)]


def _shared(count: int, lengths: list[float]) -> list[int]:
    """Return ``count`` in whole numbers, one at least, in proportion to ``lengths``."""
    whole = sum(lengths)
    found = [max(math.floor(count * length / whole * (1 + _SAME)), 1) for length in lengths]
    while sum(found) != count:
        step = 1 if sum(found) < count else -1
        # one more where cells are the longest, one less where they stay the shortest
        if step > 0:
            sizes = [length / n for length, n in zip(lengths, found, strict=True)]
        else:
            sizes = [-length / (n - 1) if n > 1 else -math.inf for length, n in zip(lengths, found, strict=True)]
        found[sizes.index(max(sizes))] += step
    return found
