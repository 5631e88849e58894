"""Measured tables: columns in SI units, from rows of text below a header with a name and a unit for each of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..findings import Finding
from ..units import ANY_SIZE, PLAUSIBLE
from .cells import Rows as CellRows
from .cells import is_mark, number, require_short
from .header import Column
from .kind import EDGE, LATER, Kind
from .layout import choose, find_layout, left_out, table_end

#: quantity -> (title of its column, its unit)
Headers = Mapping[str, tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """Columns of a measurement in SI units, NaN where there is no reading; ``time``, if any, ascends.

    It ascends strictly but for the edges of a drawn drive. ``ignored`` are the headers that were not understood and not
    needed, ``notes`` say what a reader left out, ``headers`` which column and unit each quantity was read from.
    """

    columns: dict[str, Array]
    source: str = "data"
    ignored: tuple[str, ...] = ()
    notes: tuple[Finding, ...] = ()
    headers: Headers = field(default_factory=dict)

    @property
    def time(self) -> Array:
        """The column of times [s]."""
        return self.columns["time"]

    def get(self, quantity: str) -> Array | None:
        """Return a column [SI], or None where the file has none or nothing but blanks."""
        column = self.columns.get(quantity)
        return column if column is not None and np.isfinite(column).any() else None


def parse_table(lines: Sequence[str], name: str, kind: Kind, numbers: Sequence[int] | None = None) -> Table:
    """Read a table of text: a header, perhaps below other lines, perhaps a row of units, then rows of numbers.

    Columns are separated by commas, or by semicolons, tabs, spaces (decimal commas are then allowed). Blank lines,
    comments (# or %) and text below the table are left out. NaN, OVL, inf, -- and numbers such as 9.91E+37 are
    instruments' marks for no reading.

    Parameters
    ----------
    lines
        The lines of the file.
    name
        Stands for the file in errors.
    kind
        Says which quantities columns may hold, which must be there, and what rows at one time are.
    numbers
        Of the lines in the file (default: from 1 on).

    Raises
    ------
    InputError
        A column or a unit is missing, a cell is no number, times repeat or decrease; the message names file, line and
        column.
    """
    numbers = numbers or range(1, len(lines) + 1)
    require_short(lines, name, kind.name)
    layout = find_layout(lines, kind)
    if layout is None:
        raise InputError(f"{name}: the file is empty; it needs a header row such as {kind.example}")
    taken, left, notes = choose(layout, kind, name, numbers[layout.header])
    end = table_end(lines, layout, kind)
    blank = set(left_out(lines[end:]))
    below = [line.strip() for k, line in enumerate(lines[end:]) if k not in blank]
    if below:
        values = {"count": len(below), "text": below[0][:40]}
        notes = (*notes, Finding("lines-below", values=values))
    body, at = lines[layout.first : end], numbers[layout.first : end]
    out = left_out(body)
    if out:
        kept = np.delete(np.arange(len(body)), out).tolist()
        body, at = [body[k] for k in kept], [at[k] for k in kept]
    if not body:
        raise InputError(f"{name}: there is a header but no row of numbers")
    titles = [title.strip() for title in layout.titles]
    rows = CellRows(body, at, layout.delimiter, titles, name)
    cells = rows.numbers_at([c.place for c in taken.values()])
    with np.errstate(over="ignore"):
        cells *= [c.factor for c in taken.values()]
    columns = {quantity: cells[:, k] for k, quantity in enumerate(taken)}
    quantities = {c.place: quantity for quantity, c in taken.items()}
    for place, marked in rows.marked.items():
        values = {"quantity": quantities[place], "count": marked.count, "mark": marked.mark[:30]}
        notes = (*notes, Finding("readings-marked", values=values))
    return table_of(columns, taken, left, notes, at, name, kind)


def table_of(
    columns: dict[str, Array],
    taken: Mapping[str, Column],
    left: Sequence[str],
    notes: tuple[Finding, ...],
    numbers: Sequence[int],
    name: str,
    kind: Kind,
) -> Table:
    """Return the table of ``columns`` in SI units, after a check of sizes and times.

    ``taken`` are their headers, ``left`` those not understood, ``numbers`` the lines of the rows. Raises InputError for
    a value beyond all proportion, and times that repeat or decrease.
    """
    _require_sensible(columns, taken, name, kind)
    if "time" in columns:
        columns, more = _in_time(columns, numbers, name, kind.repeats)
        notes = (*notes, *more)
    headers = {quantity: (c.title.strip(), c.unit) for quantity, c in taken.items()}
    return Table(columns, name, tuple(left), notes, headers)


def _require_sensible(columns: Mapping[str, Array], taken: Mapping[str, Column], name: str, kind: Kind) -> None:
    for quantity, values in columns.items():
        unit, title = kind.quantities[quantity][0], taken[quantity].title.strip()[:80]
        largest = PLAUSIBLE.get(unit, ANY_SIZE)[1]
        if np.abs(values).max(initial=0.0, where=~np.isnan(values)) > largest:
            raise InputError(f"{name}: column '{title}' has a value beyond {largest:g} {unit}; check its unit")


def _in_time(
    columns: dict[str, Array], numbers: Sequence[int], name: str, repeats: str
) -> tuple[dict[str, Array], tuple[Finding, ...]]:
    """Return the columns with times that ascend, and a finding where two readings had one time."""
    time = columns["time"]
    blank = np.flatnonzero(np.isnan(time))
    if len(blank):
        raise InputError(f"{name}: line {numbers[blank[0]]} has no time; every row needs one")
    step = np.diff(time)
    backwards = np.flatnonzero(step < 0 if repeats in (EDGE, LATER) else step <= 0)
    if len(backwards):
        k = int(backwards[0])
        what = "repeats" if time[k + 1] == time[k] else "goes back from"
        raise InputError(
            f"{name}: line {numbers[k + 1]}: time {time[k + 1]:g} s {what} {time[k]:g} s; sort the file by time"
        )
    earlier = np.append(step == 0, False)
    if repeats == EDGE or not earlier.any():
        return columns, ()
    kept = {quantity: values[~earlier] for quantity, values in columns.items()}
    return kept, (Finding("readings-at-one-time", values={"count": int(earlier.sum())}),)


#: Rows of an instrument's table: the number of each line in the file, and its cells.
Rows = list[tuple[int, list[str]]]


def cells_at(cells: Sequence[str], places: Iterable[int]) -> list[str]:
    """Return the cells at some places of a row, blank where the row is too short."""
    return [cells[place].strip() if place < len(cells) else "" for place in places]


def parse_rows(rows: Rows, name: str, kind: Kind, notes: Sequence[Finding]) -> Table:
    """Read rows of an instrument's table as `parse_table` does; the first holds names and units.

    Where a step begins instruments write two readings at one time: the later one stays, but for a drawn drive.

    Raises
    ------
    InputError
        As `parse_table`.
    """
    lines = ["\t".join(cells) for _, cells in rows]
    table = parse_table(lines, name, two_readings(kind), [number for number, _ in rows])
    return replace(table, notes=(*notes, *table.notes))


def two_readings(kind: Kind) -> Kind:
    """Return a kind of which an instrument writes two readings at one time where a step begins."""
    return kind if kind.repeats == EDGE else replace(kind, repeats=LATER)


def spectrum_of_cells(header: Sequence[str], titles: Sequence[str], rows: Rows, name: str, kind: Kind) -> Table:
    """Read a spectrum from the ``rows`` of an instrument's table.

    ``titles`` are its names of frequency [Hz], Re Z and Im Z [ohm], to be found in the ``header`` in lower case.

    Raises
    ------
    InputError
        A column is missing, a cell is no number, or there are no rows or too many.
    """
    missing = [title for title in titles if title.lower() not in header]
    if missing:
        raise InputError(f"{name}: no column {missing[0]} in its table of impedances")
    if not rows:
        raise InputError(f"{name}: its table of impedances has no rows")
    if kind.most_rows and len(rows) > kind.most_rows:
        raise InputError(f"{name}: {len(rows)} points; a {kind.name} has {kind.most_rows} at most")
    places = [header.index(title.lower()) for title in titles]
    values = [[_number(cell, name, number) for cell in cells_at(cells, places)] for number, cells in rows]
    units = dict(zip(("frequency", "re", "im"), zip(titles, ("Hz", "ohm", "ohm"), strict=True), strict=True))
    return Table(dict(zip(units, np.array(values).T, strict=True)), name, headers=units)


def _number(cell: str, name: str, line: int) -> float:
    if not cell or is_mark(cell):
        return math.nan
    value = number(cell, "")
    if value is None:
        raise InputError(f"{name}: line {line}: '{cell[:40]}' is not a number")
    return value
