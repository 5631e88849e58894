"""Gamry's data files (.DTA): tables of readings over time (CURVE, CURVE1, ...) or an impedance spectrum (ZCURVE)."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ...findings import Finding
from ..kind import RECORD, SPECTRUM, Kind
from ..table import Rows, Table, cells_at, parse_rows, spectrum_of_cells

NAME = "Gamry"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

_TABLE = re.compile(r"Z?CURVE\d*\s+TABLE")
_RECORD = re.compile(r"CURVE\d*\s+TABLE")
_SPECTRUM = re.compile(r"ZCURVE\s+TABLE")
_RECORD_TITLES = {"time": "t", "voltage": "vf", "current": "im"}
_SPECTRUM_TITLES = ("Freq", "Zreal", "Zimag")


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return the kind of data in a file that begins with EXPLAIN or has a table of readings."""
    tables = [line for line in lines if line.startswith(("CURVE", "ZCURVE")) and _TABLE.match(line)]
    if not tables and not (lines and lines[0].strip().strip("\ufeff") == "EXPLAIN"):
        return None
    record = any(map(_RECORD.match, tables)) and not any(map(_SPECTRUM.match, tables))
    return RECORD if record else SPECTRUM


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return all CURVE tables, one after the other, or the ZCURVE table.

    A reading that the instrument marks as overloaded has no current; a note counts them.

    Raises
    ------
    InputError
        There is no such table, or a column of it is missing or cannot be read.
    """
    return _spectrum(lines, name, kind) if kind == SPECTRUM else _record(lines, name, kind)


def _rows(lines: Sequence[str], start: int) -> Rows:
    """Return (line number, cells) of the rows of the table whose name stands in line ``start`` (from 0)."""
    rows = []
    for k in range(start + 3, len(lines)):
        if not lines[k].startswith(("\t", " ")):
            break  # the next entry
        if lines[k].strip():
            rows.append((k + 1, lines[k].split("\t")))
    return rows


def _titles(lines: Sequence[str], start: int) -> list[str]:
    return [cell.strip().lower() for cell in lines[start + 1].split("\t")]


def _spectrum(lines: Sequence[str], name: str, kind: Kind) -> Table:
    start = next((k for k, line in enumerate(lines) if _SPECTRUM.match(line)), None)
    if start is None or start + 3 > len(lines):
        raise InputError(f"{name}: a Gamry file without a ZCURVE table: it holds no impedance spectrum")
    return spectrum_of_cells(_titles(lines, start), _SPECTRUM_TITLES, _rows(lines, start), name, kind)


def _record(lines: Sequence[str], name: str, kind: Kind) -> Table:
    starts = [k for k, line in enumerate(lines) if _RECORD.match(line) and k + 3 <= len(lines)]
    if not starts:
        raise InputError(f"{name}: a Gamry file without a CURVE table: it holds no record over time")
    kept: Rows = []
    overloaded = 0
    for start in starts:
        header = _titles(lines, start)
        units = [cell.strip() for cell in lines[start + 2].split("\t")] + [""] * len(header)
        missing = [title for title in _RECORD_TITLES.values() if title not in header]
        if missing:
            raise InputError(f"{name}: line {start + 2}: no column {missing[0].capitalize()} in its CURVE table")
        places = {quantity: header.index(title) for quantity, title in _RECORD_TITLES.items()}
        over = header.index("over") if "over" in header else None
        if not kept:
            titles = [f"{quantity} [{(units[place].split() or [''])[0]}]" for quantity, place in places.items()]
            kept.append((start + 2, titles))
        for number, cells in _rows(lines, start):
            chosen = cells_at(cells, places.values())
            if over is not None and over < len(cells) and cells[over].strip(" .0"):
                chosen[2] = ""
                overloaded += 1
            kept.append((number, chosen))
    notes = [Finding("overloaded", values={"count": overloaded})] if overloaded else []
    return parse_rows(kept, name, kind, notes)
