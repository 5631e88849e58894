"""Kinovea's trajectories: a time and X, Y, as text with timecodes or as CSV with a unit in every name."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..kind import TRACK, Kind
from ..layout import cells_of
from ..table import Rows, Table, parse_rows
from .points import point_of

NAME = "Kinovea"
KINDS: tuple[Kind, ...] = (TRACK,)

_WITHIN = 10
#: Hours, minutes, seconds and hundredths, as Kinovea writes times.
_TIMECODE = re.compile(r"(\d{1,3}):(\d{1,2}):(\d{1,2}):(\d{1,2})")
_NAMES = re.compile(
    r"(?:(?P<point>.{1,60}?)[/ :])?(?P<what>time|t|x|y)(?:\s*[(\[](?P<unit>[^()\[\]]{1,12})[)\]])?", re.I
)


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return TRACK for a table of times, X and Y that names Kinovea or a trajectory, or writes times as it does."""
    found = _header(lines)
    if found is None:
        return None
    header, sign, titles = found
    named = any("kinovea" in line.lower() for line in lines[: header + 1]) or any(point for point, _, _ in titles[1:3])
    below = next((line for line in lines[header + 1 : header + 4] if line.strip()), "")
    coded = any(_TIMECODE.fullmatch(cell.strip().strip('"')) for cell in cells_of(below, sign)[:1])
    return TRACK if named or coded else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the times, X and Y of the trajectory that is meant.

    Raises
    ------
    InputError
        Several trajectories and none chosen, lengths without a unit, or a cell is not a number.
    """
    found = _header(lines)
    assert found is not None
    header, sign, titles = found
    labels = list(dict.fromkeys(point for point, what, _ in titles if what in ("x", "y")))
    label = point_of(labels, kind.said.point if labels != [""] else None, name)
    places = [0, *(k for k, (point, what, _) in enumerate(titles) if what in ("x", "y") and point == label)]
    coded = False
    rows: Rows = []
    for k, line in enumerate(lines[header + 1 :], header + 2):
        cells = cells_of(line, sign)
        if not any(cells) or line.startswith("#"):
            continue
        cells = [cells[p].strip().strip('"') if p < len(cells) else "" for p in places]
        code = _TIMECODE.fullmatch(cells[0])
        if code:
            h, m, s, hundredths = map(int, code.groups())
            cells[0], coded = repr(3600 * h + 60 * m + s + hundredths / 100), True
        rows.append((k, [cell.replace(",", ".") for cell in cells]))
    units = [titles[p][2] for p in places]
    units[0] = "s" if coded else units[0] or "ms"  # Kinovea counts in milliseconds
    above: Rows = [(header + 1, [titles[p][1] for p in places])]
    if any(units[1:]):
        above.append((header + 1, units))
    else:
        above = [(header + 1, [f"time ({units[0]})", *(titles[p][1] for p in places[1:])])]
    return parse_rows([*above, *rows], name, kind, ())


def _header(lines: Sequence[str]) -> tuple[int, str, list[tuple[str, str, str]]] | None:
    """Return the line (from 0) of names, what separates them, and (point, what, unit) of each; None for none."""
    for k, line in enumerate(lines[:_WITHIN]):
        for sign in (";", "\t", ",", ""):
            titles = [cell.strip().strip('"') for cell in cells_of(line[:2000].lstrip("# "), sign)]
            matches = [_NAMES.fullmatch(title) for title in titles if title]
            if len(matches) < 3 or not all(matches):
                continue
            found = [(m["point"] or "", m["what"].lower()[:1], m["unit"] or "") for m in matches if m]
            named = [(point, {"t": "time"}.get(what, what), unit) for point, what, unit in found]
            if [what for _, what, _ in named[:3]] == ["time", "x", "y"]:
                return k, sign, named
    return None
