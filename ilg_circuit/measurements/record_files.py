"""Records over time from files: our own CSV, and steps as potentiostats export them.

What a file is, its content tells: Gamry's .DTA by its CURVE tables, EC-Lab's text export (.mpt, .txt) by its first line
or by columns such as Ewe/V and <I>/mA; anything else is a table with a name and a unit in every header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .table import EXAMPLES, MOST_BYTES, Table, parse_table
from .text import read_text

Array = NDArray[np.float64]

#: The header of an export without a count of its header lines is looked for in so many lines.
_PREAMBLE = 400

#: EC-Lab's names, the first that is there is taken: the voltage between both electrodes before that of one.
_EC_LAB = {
    "time": ("time",),
    "voltage": ("ewe-ece", "<ewe>", "ewe", "control"),
    "current": ("<i>", "i"),
}
_EC_LAB_NAME = re.compile(r"(^|\t)\s*(<?Ewe>?|<I>|control)/", re.IGNORECASE)
_EC_LAB_COUNT = re.compile(r"Nb header lines\s*:\s*(\d{1,6})\s*$", re.IGNORECASE)
_GAMRY_RECORD = re.compile(r"CURVE\d*\s+TABLE")
_GAMRY = {"time": "t", "voltage": "vf", "current": "im"}


def read_columns(path: str | Path, required: tuple[str, ...] = ("time",)) -> Table:
    """Read a record over time in any of the formats; see the module, and `table.read_table` for CSV.

    Raises InputError naming file, line and column for what cannot be read.
    """
    name = Path(path).name
    text = read_text(path, MOST_BYTES, "measurement")
    lines = text.splitlines()
    if is_gamry(lines):
        return _gamry(lines, name, required)
    start = _ec_lab_header(lines)
    if start is not None:
        return _ec_lab(lines, start, name, required)
    return parse_table(text, name, required)


def read_waveform(path: Path, quantity: str) -> tuple[Array, Array]:
    """Times and values of one quantity, blanks left out. InputError as `read_columns`, or when it is all blank."""
    table = read_columns(path, ("time", quantity))
    values = table.columns[quantity]
    known = np.isfinite(values)
    if not known.any():
        raise InputError(f"{table.source}: the column for {quantity} has no number in it")
    return table.time[known], values[known]


def is_gamry(lines: Sequence[str]) -> bool:
    """Whether a file is Gamry's, by its first line or by a table of readings."""
    return bool(lines) and (
        lines[0].strip().strip("\ufeff") == "EXPLAIN" or any(re.match(r"Z?CURVE\d*\s+TABLE", line) for line in lines)
    )


def is_gamry_record(lines: Sequence[str]) -> bool:
    """Whether a Gamry file holds readings over time and no spectrum."""
    tables = [line for line in lines if line.startswith(("CURVE", "ZCURVE"))]
    return any(_GAMRY_RECORD.match(t) for t in tables) and not any(re.match(r"ZCURVE\s+TABLE", t) for t in tables)


def gamry_rows(lines: Sequence[str], start: int) -> list[tuple[int, list[str]]]:
    """(line number, cells) of the table whose name stands in line ``start`` (from 0), names and units left out."""
    rows = []
    for k in range(start + 3, len(lines)):
        if not lines[k].startswith(("\t", " ")):
            break  # the next entry
        if lines[k].strip():
            rows.append((k + 1, lines[k].split("\t")))
    return rows


def _gamry(lines: list[str], name: str, required: tuple[str, ...]) -> Table:
    """All CURVE tables, one after the other; a reading that the instrument marks as overloaded has no current."""
    starts = [k for k, line in enumerate(lines) if _GAMRY_RECORD.match(line) and k + 3 <= len(lines)]
    if not starts:
        raise InputError(f"{name}: a Gamry file without a CURVE table: it holds no record over time")
    kept = [""] * len(lines)
    overloaded = 0
    for start in starts:
        header = [cell.strip().lower() for cell in lines[start + 1].split("\t")]
        units = [cell.strip() for cell in lines[start + 2].split("\t")] + [""] * len(header)
        missing = [title for title in _GAMRY.values() if title not in header]
        if missing:
            raise InputError(f"{name}: line {start + 2}: no column {missing[0].capitalize()} in its CURVE table")
        places = [header.index(title) for title in _GAMRY.values()]
        over = header.index("over") if "over" in header else None
        titles = [
            f"{quantity} [{(units[place].split() or [''])[0]}]" for quantity, place in zip(_GAMRY, places, strict=True)
        ]
        kept[starts[0] + 1] = kept[starts[0] + 1] or "\t".join(titles)
        for number, cells in gamry_rows(lines, start):
            chosen = [cells[place].strip() if place < len(cells) else "" for place in places]
            if over is not None and over < len(cells) and cells[over].strip(" .0"):
                chosen[2] = ""
                overloaded += 1
            kept[number - 1] = "\t".join(chosen)
    note = f"{overloaded} readings that the instrument marks as overloaded: their current was left out"
    return _parsed(kept, name, required, [note] if overloaded else [])


def _ec_lab_header(lines: list[str]) -> int | None:
    """The line (from 0) that names an EC-Lab export's columns; None for other files."""
    for line in lines[:5]:
        count = _EC_LAB_COUNT.search(line)
        if count and 0 < int(count[1]) <= len(lines):
            return int(count[1]) - 1
    for k, line in enumerate(lines[:_PREAMBLE]):
        if len(line) < 10_000 and _EC_LAB_NAME.search(line):
            return k
    return None


def _ec_lab(lines: list[str], start: int, name: str, required: tuple[str, ...]) -> Table:
    """The columns that a record needs; of several voltages that between both electrodes, or the one measured."""
    titles = [cell.strip() for cell in lines[start].split("\t")]
    bare = [title.rpartition("/")[0].lower() for title in titles]
    places = {}
    for quantity, names in _EC_LAB.items():
        found = next((n for n in names if n in bare), None)
        if found is not None:
            places[quantity] = bare.index(found)
        elif quantity in required:
            told = ", ".join(repr(t[:40]) for t in titles[:20] if t)
            raise InputError(
                f"{name}: line {start + 1}: no column for {quantity} among {told}; EC-Lab calls it {names[0]}/... "
                f"(or write columns like {EXAMPLES})"
            )
    kept = [""] * len(lines)
    kept[start] = "\t".join(f"{quantity} [{titles[k].rpartition('/')[2]}]" for quantity, k in places.items())
    for k in range(start + 1, len(lines)):
        if lines[k].strip():
            cells = lines[k].split("\t")
            kept[k] = "\t".join(cells[place].strip() if place < len(cells) else "" for place in places.values())
    notes = [f"voltage is the column {titles[places['voltage']]}"] if "voltage" in places else []
    return _parsed(kept, name, required, notes)


def _parsed(lines: list[str], name: str, required: tuple[str, ...], notes: list[str]) -> Table:
    """The table of chosen columns, ``lines`` in their places in the file, so that errors count the file's own.

    Where a step begins instruments write two readings at one time: the later one stays.
    """
    filled = [k for k, line in enumerate(lines) if line]
    times = [lines[k].split("\t")[0] for k in filled]
    again = [a for a, now, then in zip(filled[1:], times[1:], times[2:], strict=False) if now == then and now]
    for k in again:
        lines[k] = ""
    if again:
        notes = [*notes, f"{len(again)} readings at the time of the next one were left out"]
    return replace(parse_table("\n".join(lines), name, required), notes=tuple(notes))
