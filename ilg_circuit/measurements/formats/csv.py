"""Tables with a name and a unit in every header: records, spectra and load tests, this package's own format.

Columns are separated by commas, or by semicolons, tabs or spaces (then decimal commas are allowed). The header
may stand below other text. Im Z is negative for a capacitor; columns called -Im(Z) or -Z'' are turned round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...errors import InputError
from ..kind import LOAD_TEST, RECORD, SPECTRUM, Kind, frequency_row, names_a_spectrum
from ..layout import find_layout
from ..table import Table, parse_table
from . import bare

NAME = "CSV"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM, LOAD_TEST)


def recognises(lines: Sequence[str]) -> Kind:
    """Return the kind of data whose columns a row of names has all of, or else speaks of; a record where none does."""
    for kind in (SPECTRUM, RECORD, LOAD_TEST):
        layout = find_layout(lines, kind)
        if layout is not None and layout.complete:
            return kind
    start = frequency_row(lines)
    if start is not None:
        return SPECTRUM if names_a_spectrum(lines[start]) else RECORD
    stretched = find_layout(lines, LOAD_TEST)
    time = find_layout(lines, RECORD)
    if stretched is not None and any(c.quantity == "stretch" for c in stretched.columns):
        return (
            RECORD if time is not None and any(c.quantity in ("time", "voltage") for c in time.columns) else LOAD_TEST
        )
    return RECORD


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the columns of a ``kind``, a spectrum's as ``frequency``, ``re`` and ``im``.

    Raises
    ------
    InputError
        A column or a unit is missing, a cell is no number, times repeat or decrease; see `table.parse_table`.
    """
    if kind != SPECTRUM:
        return parse_table(lines, name, kind)
    layout = find_layout(lines, kind)
    if layout is None or not layout.columns:
        return bare.read(lines, name, kind)
    if kind.most_rows and len(lines) - layout.header > 2 * kind.most_rows:
        raise InputError(f"{name}: {len(lines) - layout.header} rows; a {kind.name} has {kind.most_rows} at most")
    return with_imaginary_part(parse_table(lines, name, kind), kind)


def with_imaginary_part(table: Table, kind: Kind) -> Table:
    """Return the table of a spectrum with its imaginary part [ohm] as ``im``, whatever its sign was.

    Raises InputError where there is none, or one of each sign.
    """
    name = table.source
    columns, headers = dict(table.columns), dict(table.headers)
    minus = columns.pop("minus_im", None)
    if minus is None and "im" not in columns:
        raise InputError(f"{name}: no column for the imaginary part; columns are written like {kind.example}")
    if minus is not None:
        if "im" in columns:
            raise InputError(f"{name}: columns for both Im Z and -Im Z; leave one out")
        columns["im"], headers["im"] = -minus, headers.pop("minus_im")
    return replace(table, columns=columns, headers=headers)
