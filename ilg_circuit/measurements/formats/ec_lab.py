"""EC-Lab's text exports (.mpt, .txt): columns such as Ewe/V, <I>/mA, freq/Hz, with or without a preamble."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ...findings import Finding
from ..kind import PREAMBLE, RECORD, SPECTRUM, Kind, frequency_row, names_a_spectrum
from ..table import Table, cells_at, parse_rows
from . import csv

NAME = "EC-Lab"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

#: EC-Lab's names; the first that is there is taken: the voltage between both electrodes before that of one.
_NAMES = {"time": ("time",), "voltage": ("ewe-ece", "<ewe>", "ewe", "control"), "current": ("<i>", "i")}
_NAME = re.compile(r"(^|\t)\s*(<?Ewe>?|<I>|control)/", re.IGNORECASE)
_COUNT = re.compile(r"Nb header lines\s*:\s*(\d{1,6})\s*$", re.IGNORECASE)


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return the kind of data in a file that counts its header lines or has a column that only EC-Lab names so."""
    if _header(lines) is None:
        return None
    row = frequency_row(lines)
    return SPECTRUM if row is not None and names_a_spectrum(lines[row]) else RECORD


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return a record's time, voltage and current, or a spectrum.

    Of several voltages the one between both electrodes is taken, or else the one measured; a note names it.

    Raises
    ------
    InputError
        A column is missing, or its unit or a cell cannot be read.
    """
    if kind == SPECTRUM:
        return csv.read(lines, name, kind)
    start = _header(lines) or 0
    titles = [cell.strip() for cell in lines[start].split("\t")]
    bare = [title.rpartition("/")[0].lower() for title in titles]
    places = {}
    for quantity, names in _NAMES.items():
        present = next((n for n in names if n in bare), None)
        if present is not None:
            places[quantity] = bare.index(present)
        elif quantity in kind.required:
            there = ", ".join(repr(t[:40]) for t in titles[:20] if t) or "no names"
            raise InputError(
                f"{name}: line {start + 1}: no column for {quantity} among {there}; EC-Lab calls it {names[0]}/... "
                f"(or write columns like {kind.example})"
            )
    header = [f"{quantity} [{titles[k].rpartition('/')[2]}]" for quantity, k in places.items()]
    below = ((k, line) for k, line in enumerate(lines[start + 1 :], start + 2) if line.strip())
    rows = [(start + 1, header), *((k, cells_at(line.split("\t"), places.values())) for k, line in below)]
    notes = [Finding("voltage-column", values={"column": titles[places["voltage"]]})] if "voltage" in places else []
    return parse_rows(rows, name, kind, notes)


def _header(lines: Sequence[str]) -> int | None:
    """Return the line (from 0) that names the columns, None for files of other programs."""
    for line in lines[:5]:
        count = _COUNT.search(line)
        if count and 0 < int(count[1]) <= len(lines):
            return int(count[1]) - 1
    for k, line in enumerate(lines[:PREAMBLE]):
        if len(line) < 10_000 and _NAME.search(line):
            return k
    return None
