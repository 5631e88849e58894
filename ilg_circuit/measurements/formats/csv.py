"""Tables with a name and a unit in every header: records, spectra and load tests, this package's own format.

Columns are separated by commas, or by semicolons, tabs or spaces (then decimal commas are allowed). A spectrum's header
may stand below a preamble. Im Z is negative for a capacitor; columns called -Im(Z) or -Z'' are turned round.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ..kind import LOAD_TEST, RECORD, SPECTRUM, Kind, frequency_row, names_a_record, names_a_spectrum
from ..table import Table, named, parse_table
from . import bare

NAME = "CSV"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM, LOAD_TEST)

_OHM = re.compile(r"ohms?\b|[\u03a9\u2126]", re.IGNORECASE)


def recognises(lines: Sequence[str]) -> Kind:
    """Return the kind of data that the names of the columns speak of; a record where they speak of none."""
    start = frequency_row(lines)
    if start is not None:
        return SPECTRUM if names_a_spectrum(lines[start]) else RECORD
    header = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    words = re.split(r"[,;\s\"]+", header[:10_000].lower())
    stretched = any(named(word, LOAD_TEST.quantities) == "stretch" for word in words)
    return LOAD_TEST if stretched and not names_a_record(header) else RECORD


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the columns of a ``kind``, a spectrum's as ``frequency``, ``re`` and ``im``.

    Raises
    ------
    InputError
        A column or a unit is missing, a cell is no number, times repeat or decrease; see `table.parse_table`.
    """
    if kind != SPECTRUM:
        return parse_table(enumerate(lines, 1), name, kind)
    start = frequency_row(lines)
    if start is None:
        return bare.read(lines, name, kind)
    if kind.most_rows and len(lines) - start > 2 * kind.most_rows:
        raise InputError(f"{name}: {len(lines) - start} rows; a {kind.name} has {kind.most_rows} at most")
    below = [_OHM.sub("ohm", lines[start]), *lines[start + 1 :]]
    table = parse_table(enumerate(below, start + 1), name, kind)
    columns = dict(table.columns)
    minus = columns.pop("minus_im", None)
    if minus is None and "im" not in columns:
        raise InputError(f"{name}: no column for the imaginary part; columns are written like {kind.example}")
    if minus is not None:
        if "im" in columns:
            raise InputError(f"{name}: columns for both Im Z and -Im Z; leave one out")
        columns["im"] = -minus
    return Table(columns, name, table.ignored)
