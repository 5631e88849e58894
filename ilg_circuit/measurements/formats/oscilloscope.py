"""Oscilloscopes' CSV files (Tektronix, Rigol, Keysight): channels by number, their units above or beside the table."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ..cells import is_number, number
from ..kind import RECORD, Kind
from ..table import Rows, Table, parse_rows

NAME = "oscilloscope"
KINDS: tuple[Kind, ...] = (RECORD,)

_KNOWN = {"x-axis": ("time", "s"), "time": ("time", "s"), "x": ("time", "s")}
_PREAMBLE = 100


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return RECORD for a table as one of these instruments writes it."""
    return RECORD if _begin(lines) else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return times and channels; a channel is of the quantity that its unit measures.

    Raises
    ------
    InputError
        A quantity has no channel, or two; ``--columns`` says which.
    """
    found = _begin(lines)
    if found is None:
        raise InputError(f"{name}: no table of an oscilloscope")
    how, start = found
    first = [cell.strip() for cell in lines[start].split(",")]
    if how == "beside":  # Tektronix's readings stand right of the settings
        settings = {
            cells[0].strip(): cells[1].strip() for line in lines[:_PREAMBLE] if len(cells := line.split(",")) > 1
        }
        titles = ["TIME", settings.get("Source", "CH1")]
        units = [settings.get("Horizontal Units", "s"), settings.get("Vertical Units", "")]
        rows: Rows = [(k, line.split(",")[3:5]) for k, line in enumerate(lines, 1) if line.count(",") >= 4]
    elif how == "sequence":  # Rigol's numbers its readings
        second = [cell.strip() for cell in lines[start + 1].split(",")]
        count = next(k for k, title in enumerate(first) if title.lower() == "start")
        begin, step = (number(second[k]) if k < len(second) else None for k in (count, count + 1))
        if begin is None or not step:
            raise InputError(f"{name}: line {start + 2}: no start and increment of the time")
        titles, units = ["X", *first[1:count]], ["s", *second[1:count]]
        rows = []
        for k, line in enumerate(lines[start + 2 :], start + 3):
            cells = line.split(",")
            if is_number(cells[0].strip()):
                rows.append((k, [repr(begin + float(cells[0]) * step), *cells[1:count]]))
    else:
        titles, units = first, []
        above = {cells[0].strip(): cells[1:] for line in lines[:start] if len(cells := line.split(",")) > 1}
        if "Vertical Units" in above:
            units = [*above.get("Horizontal Units", ["s"])[:1], *above["Vertical Units"]]
        rows = [(k, line.split(",")) for k, line in enumerate(lines[start + 1 :], start + 2) if line.strip(", ")]
    heads = [(start + 1, titles), (start + 1, [unit.strip() for unit in units])] if units else [(start + 1, titles)]
    return parse_rows([*heads, *rows], name, kind.knowing(_KNOWN), ())


def _begin(lines: Sequence[str]) -> tuple[str, int] | None:
    """Return how readings are written and the line (from 0) where they begin, None for other files."""
    for k, line in enumerate(lines[:_PREAMBLE]):
        if len(line) > 2000:
            return None
        cells = [cell.strip().lower() for cell in line.split(",")]
        if cells[0] == "record length" and len(cells) > 4 and is_number(cells[3]):
            return "beside", k
        if cells[0] == "x" and "start" in cells and "increment" in cells and k + 1 < len(lines):
            return "sequence", k
        if cells[0] == "x-axis" and len(cells) > 1:
            return "table", k
        if cells[0] == "time" and len(cells) > 1 and all(cell[:2] in ("ch", "ma", "re", "") for cell in cells[1:]):
            return "table", k
    return None
