"""Tracker's text files (Open Source Physics): the name of a track, then t, x, y; several tracks side by side."""

from __future__ import annotations

from collections.abc import Sequence

from ..kind import TRACK, Kind
from ..layout import cells_of
from ..table import Rows, Table, parse_rows
from .points import point_of

NAME = "Tracker"
KINDS: tuple[Kind, ...] = (TRACK,)

#: Number of lines within which the table begins.
_WITHIN = 8
#: Tracker counts in seconds; its lengths are in what it was calibrated to.
_KNOWN = {"t": ("time", "s")}


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return TRACK for a row of t, x, y below the name of a track."""
    return TRACK if _header(lines) is not None else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return t, x and y of the track that is meant.

    Raises
    ------
    InputError
        Several tracks and none chosen, lengths without a unit, or a cell is not a number.
    """
    found = _header(lines)
    assert found is not None
    header, sign = found
    titles = cells_of(lines[header].lstrip("#"), sign)
    starts = [k for k, title in enumerate(titles) if _plain(title) == "t"]
    above = cells_of(lines[header - 1].removeprefix("multi:"), sign)
    labels = [word.strip(" :#") for word in above if word.strip(" :#")]
    if len(labels) != len(starts):
        labels = [f"track {k + 1}" for k in range(len(starts))]
    start = starts[labels.index(point_of(labels, kind.said.point, name))]
    stop = next((k for k in starts if k > start), len(titles))
    rows: Rows = [(header + 1, titles[start:stop])]
    for k, line in enumerate(lines[header + 1 :], header + 2):
        cells = cells_of(line, sign)[start:stop]
        if any(cells) and cells[0]:
            rows.append((k, [cell.replace(",", ".") if sign != "," else cell for cell in cells]))
    return parse_rows(rows, name, kind.knowing(_KNOWN), ())


def _header(lines: Sequence[str]) -> tuple[int, str] | None:
    """Return the line (from 0) of the names t, x, y and what separates them; None where there is none."""
    for k, line in enumerate(lines[1:_WITHIN], 1):
        for sign in ("\t", ";", ",", ""):
            titles = [_plain(title) for title in cells_of(line[:2000].lstrip("#"), sign)]
            if titles[:3] == ["t", "x", "y"] and lines[k - 1].strip() and len(lines[k - 1]) < 2000:
                return k, sign
    return None


def _plain(title: str) -> str:
    """Return a name without its unit."""
    return title.partition("(")[0].strip().lower()
