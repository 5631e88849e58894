"""Tables with a name and a unit in every header: records, spectra and load tests, this package's own format.

Columns are separated by commas, or by semicolons, tabs or spaces (then decimal commas are allowed). The header
may stand below other text. Im Z is negative for a capacitor; columns called -Im(Z) or -Z'' are turned round.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ..derived import impedance_of, stretch_of
from ..kind import LOAD_TEST, PREAMBLE, RECORD, SPECTRUM, TRACK, Kind, frequency_row, names_a_spectrum
from ..layout import Layout, cells_of, find_layout, readable
from ..said import NOTHING, Said, pick
from ..table import Table, parse_table
from . import bare

NAME = "CSV"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM, LOAD_TEST, TRACK)


def recognises(lines: Sequence[str], said: Said = NOTHING) -> Kind:
    """Return the kind of data whose columns a row of names has all of, or else speaks of; a record where none does."""
    layouts = {kind.name: find_layout(lines, kind.told(said)) for kind in (RECORD, SPECTRUM, LOAD_TEST)}
    record = layouts[RECORD.name]
    electric = record is not None and bool(readable(record.columns) & {"voltage", "current"})
    for kind in (SPECTRUM, RECORD, LOAD_TEST):
        layout = layouts[kind.name]
        meant = kind != LOAD_TEST or not electric or _names(layout, "stretch")
        if layout is not None and layout.complete and meant:
            return kind
    start = frequency_row(lines)
    if start is not None:
        return SPECTRUM if names_a_spectrum(lines[start]) else RECORD
    if _names(layouts[SPECTRUM.name], "frequency") and _names(layouts[SPECTRUM.name], "re", "modulus", "re_y"):
        return SPECTRUM
    if not _names(record, "time", "voltage") and _names(layouts[LOAD_TEST.name], "stretch"):
        return LOAD_TEST
    return RECORD


def holds_table(lines: Sequence[str], said: Said = NOTHING) -> bool:
    """Return True if lines hold a table of any kind that can be read."""
    return any((found := find_layout(lines, kind.told(said))) is not None and found.complete for kind in KINDS)


def _names(layout: Layout | None, *quantities: str) -> bool:
    return layout is not None and any(c.quantity in quantities for c in layout.columns)


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the columns of a ``kind``, a spectrum's as ``frequency``, ``re`` and ``im``.

    Of several tables with one header the part that was chosen is read.

    Raises
    ------
    InputError
        A column or a unit is missing, a cell is not a number, times repeat or decrease; see `table.parse_table`.
    """
    layout = find_layout(lines, kind)
    if kind == SPECTRUM and (layout is None or not layout.columns):
        return bare.read(lines, name, kind)
    numbers: Sequence[int] = range(1, len(lines) + 1)
    above = lines[: layout.header] if layout is not None else []
    if layout is not None and layout.complete:
        starts = [k for k in _alike(lines, layout.header) if k == layout.header or k > layout.first]
        if len(starts) > 1:
            ends = [*starts[1:], len(lines)]
            parts = [(f"lines {a + 1} to {b}", (a, b)) for a, b in zip(starts, ends, strict=True)]
            a, b = pick(parts, kind.said, name)
            lines, numbers, kind = lines[a:b], numbers[a:b], kind.whole
        width = _block(layout) if len(starts) == 1 and not kind.said.columns else 0
        if width and len(cells_of(lines[layout.header], layout.delimiter)) == len(layout.titles):
            places = range(0, len(_titles(layout)), width)
            place = pick([(f"columns {k + 1} to {k + width}", k) for k in places], kind.said, name)
            rows = [cells_of(line, layout.delimiter)[place : place + width] for line in lines[layout.header :]]
            lines, numbers, kind = ["\t".join(row) for row in rows], numbers[layout.header :], kind.whole
    if kind.most_rows and layout is not None and len(lines) > 2 * kind.most_rows + PREAMBLE:
        raise InputError(f"{name}: {len(lines)} rows; a {kind.name} has {kind.most_rows} at most")
    table = parse_table(lines, name, kind, numbers)
    if kind == SPECTRUM:
        return impedance_of(table, kind)
    return stretch_of(table, kind, above) if kind == LOAD_TEST else table


def _titles(layout: Layout) -> list[str]:
    titles = [title.strip() for title in layout.titles]
    while titles and not titles[-1]:
        titles.pop()
    return titles


def _block(layout: Layout) -> int:
    """Return how many columns stand there again and again, as a table of each measurement beside the last; else 0."""
    titles = _titles(layout)
    for width in range(2, len(titles) // 2 + 1):
        if len(titles) % width == 0 and titles[:width] * (len(titles) // width) == titles:
            return width
    return 0


def _alike(lines: Sequence[str], header: int) -> list[int]:
    """Return the lines (from 0) that are the same as the header."""
    found = [header]
    while True:
        try:
            found.append(lines.index(lines[header], found[-1] + 1))
        except ValueError:
            return found
