"""Elchemea Analytical's data files (.i2b): five lines about the measurement, then frequency, Re Z and Im Z by spaces.

Its manual gives no more; this is what public readers of such files agree on.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..kind import PREAMBLE, SPECTRUM, Kind
from ..table import Table
from . import bare

NAME = "Elchemea Analytical"
KINDS: tuple[Kind, ...] = (SPECTRUM,)

#: Lines before the table, blank ones apart, and cells of a row.
_ABOUT, _CELLS = 5, 3


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return SPECTRUM if below five filled lines, the last of them no row, all lines are three numbers of a sweep."""
    start = _start(lines)
    rows = [line for line in lines[start:PREAMBLE] if line.strip()]
    if not start or not all(len(line.split()) == _CELLS for line in rows) or _row(lines[start - 1]):
        return None
    return SPECTRUM if all(map(_row, rows)) and bare.recognises(rows) else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the spectrum.

    Raises
    ------
    InputError
        A line below the first five holds something else than three numbers.
    """
    start = _start(lines)
    return bare.read(["#"] * start + list(lines[start:]), name, kind)


def _start(lines: Sequence[str]) -> int:
    """Return the line (from 0) below the first five filled ones, 0 where there are fewer."""
    filled = [k for k, line in enumerate(lines[:PREAMBLE]) if line.strip()]
    return filled[_ABOUT - 1] + 1 if len(filled) > _ABOUT else 0


def _row(line: str) -> bool:
    cells = line.split()
    try:
        return len(cells) == _CELLS and all(float(cell) == float(cell) for cell in cells)
    except ValueError:
        return False
