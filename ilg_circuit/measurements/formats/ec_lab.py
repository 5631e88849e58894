"""EC-Lab's text exports (.mpt, .txt): columns such as Ewe/V, <I>/mA, freq/Hz, with or without a preamble."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from ...findings import Finding
from ..kind import LONGEST_HEADER, PREAMBLE, RECORD, SPECTRUM, Kind, frequency_row, names_a_spectrum
from ..table import Table, parse_table, two_readings
from . import csv

NAME = "EC-Lab"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

_NAME = re.compile(r"(?:^|[,;\t])[ \"]{0,9}(?:<?Ewe>?|<I>|control)/", re.IGNORECASE)
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
    table = parse_table(lines[start:], name, two_readings(kind), range(start + 1, len(lines) + 1))
    told = {note.values.get("quantity") for note in table.notes if note.code == "column-taken"}
    notes = table.notes
    if "voltage" in table.headers and "voltage" not in told:
        notes = (Finding("voltage-column", values={"column": table.headers["voltage"][0]}), *notes)
    return replace(table, ignored=(), notes=notes)


def _header(lines: Sequence[str]) -> int | None:
    """Return the line (from 0) that names the columns, None for files of other programs."""
    for line in lines[:5]:
        count = _COUNT.search(line)
        if count and 0 < int(count[1]) <= len(lines):
            return int(count[1]) - 1
    for k, line in enumerate(lines[:PREAMBLE]):
        if len(line) < LONGEST_HEADER and _NAME.search(line):
            return k
    return None
