"""DeepLabCut's CSV files: three rows of names (scorer, bodyparts, coords), then x, y, likelihood of every frame."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ..kind import TRACK, Kind
from ..table import Rows, Table, parse_rows
from .points import point_of

NAME = "DeepLabCut"
KINDS: tuple[Kind, ...] = (TRACK,)

_NAMES = ("scorer", "individuals", "bodyparts", "coords")
_COORDINATES = ("x", "y", "likelihood")


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return TRACK for a file whose first rows are the scorer, the body parts and their coordinates."""
    names = [_cells(line)[0].lower() for line in lines[:4]]
    return TRACK if names[:1] == ["scorer"] and "bodyparts" in names and "coords" in names else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the frames with x and y, in pixels, and the likelihood of the body part that is meant.

    Raises
    ------
    InputError
        Several body parts and none chosen, or a cell is not a number.
    """
    head = {cells[0].lower(): cells[1:] for cells in map(_cells, lines[:4]) if cells[0].lower() in _NAMES}
    individuals = head.get("individuals", [""] * len(head["bodyparts"]))
    labels = [f"{a} {b}".strip() for a, b in zip(individuals, head["bodyparts"], strict=False)]
    parts: dict[str, dict[str, int]] = {}
    for place, (label, what) in enumerate(zip(labels, head["coords"], strict=False), 1):
        parts.setdefault(label, {})[what.lower()] = place
    label = point_of(list(parts), kind.said.point, name)
    places = [parts[label].get(what) for what in _COORDINATES]
    if None in places:
        raise InputError(f"{name}: body part {label} lacks one of {', '.join(_COORDINATES)}")
    rows: Rows = [(len(head), ["frame", *_COORDINATES]), (len(head), ["-", "px", "px", "-"])]
    for k, line in enumerate(lines[len(head) :], len(head) + 1):
        cells = _cells(line)
        if any(cells):
            rows.append((k, [cells[p] if p is not None and p < len(cells) else "" for p in (0, *places)]))
    return parse_rows(rows, name, kind, ())


def _cells(line: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(",")]
