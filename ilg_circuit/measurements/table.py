"""Measured tables: columns in SI units, from rows of text below a header with a name and a unit for each of them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..findings import Finding
from ..units import scale
from .kind import Kind, Quantities

#: No reading in SI units is larger.
_LARGEST = 1e30

_PURE_NUMBER = ("", "-", "1")

_BRACKETED = re.compile(r"(.+?)\s*(?:\[(.+)\]|\((.+)\)|/\s*(\S+))")


@dataclass(frozen=True)
class Table:
    """Columns of a measurement in SI units, NaN where a cell was blank; ``time``, if any, ascends strictly.

    ``ignored`` are the headers that were not understood and not needed, ``notes`` say what a reader left out.
    """

    columns: dict[str, Array]
    source: str = "data"
    ignored: tuple[str, ...] = ()
    notes: tuple[Finding, ...] = ()

    @property
    def time(self) -> Array:
        """The column of times [s]."""
        return self.columns["time"]

    def get(self, quantity: str) -> Array | None:
        """Return a column [SI], or None where the file has none or nothing but blanks."""
        column = self.columns.get(quantity)
        return column if column is not None and np.isfinite(column).any() else None


def parse_table(text: Iterable[tuple[int, str]], name: str, kind: Kind) -> Table:
    """Read lines of text: a header, then rows; commas, or semicolons, tabs, spaces (decimal commas are then allowed).

    Parameters
    ----------
    text
        Lines with their numbers in the file; those that are blank or begin with # are left out.
    name
        Stands for the file in errors.
    kind
        Says which quantities columns may hold and which must be there.

    Raises
    ------
    InputError
        A column or a unit is missing, a cell is no number, times repeat or decrease; the message names file, line and
        column.
    """
    lines = [(k, line) for k, line in text if line.strip() and not line.startswith("#")]
    if not lines:
        raise InputError(f"{name}: the file is empty; it needs a header row such as {kind.example}")
    if any(len(line) > 100_000 for _, line in lines):
        raise InputError(f"{name}: a line is longer than 100000 characters; export the {kind.name} as CSV")
    lines = _tabbed(lines)
    delimiter = max(",;\t", key=lines[0][1].count)
    header = [cell.strip() for cell in next(csv.reader([lines[0][1]], delimiter=delimiter))]
    used, factors, ignored = _understand(header, name, kind.quantities)
    for quantity in kind.required:
        if quantity not in used:
            others = f"; not understood: {', '.join(repr(c[:40]) for c in ignored[:20])}" if ignored else ""
            if all(_is_number(cell) for cell in header):
                others = ": the first row holds numbers, not names; put a row of names above it, one for each column"
            raise InputError(f"{name}: no column for {quantity}{others}; columns are written like {kind.example}")
    body = lines[1:]
    if not body:
        raise InputError(f"{name}: there is a header but no row of numbers")
    cells = _numbers(body, used, len(header), header, delimiter, name)
    with np.errstate(over="ignore"):
        columns = {quantity: cells[:, k] * factors[quantity] for k, quantity in enumerate(used)}
    for quantity, values in columns.items():
        if np.abs(values[~np.isnan(values)]).max(initial=0.0) > _LARGEST:
            raise InputError(
                f"{name}: column '{header[used[quantity]]}' has a value beyond all proportion; check its unit"
            )
    if "time" in columns:
        _check_times(columns["time"], [number for number, _ in body], name)
    return Table(columns, name, tuple(ignored))


def _tabbed(lines: list[tuple[int, str]]) -> list[tuple[int, str]]:
    """Return lines whose columns are separated by spaces with tabs instead, other lines as they are.

    The first row of numbers decides; a header may have commas above a body of spaces.
    """
    first = lines[min(1, len(lines) - 1)][1]
    if any(c in first for c in ",;\t") or len(first.split()) < 2 or not all(_is_number(c) for c in first.split()):
        return lines
    number, header = lines[0]
    names = re.split(r"\s*[,;\t]\s*", header.strip()) if any(c in header for c in ",;\t") else header.split()
    return [(number, "\t".join(names)), *((k, "\t".join(line.split())) for k, line in lines[1:])]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _understand(
    header: list[str], name: str, quantities: Quantities
) -> tuple[dict[str, int], dict[str, float], list[str]]:
    """Return the column that holds each quantity, its factor to SI, and the headers left over."""
    used: dict[str, int] = {}
    factors: dict[str, float] = {}
    ignored = []
    for k, title in enumerate(header):
        bare = named(title.lower(), quantities)
        word, unit = split_header(title)
        if bare and not quantities[bare][0]:  # a pure number needs no unit
            word, unit = title.lower(), ""
        quantity = named(word, quantities)
        if quantity is None:
            if bare:
                si = quantities[bare][0]
                raise InputError(f"{name}: column '{title[:80]}' has no unit; write it like '{title}_{si}'")
            ignored.append(title)
            continue
        factor = _factor(unit, quantities[quantity][0], title, name)
        if quantity in used:
            raise InputError(
                f"{name}: columns '{header[used[quantity]]}' and '{title}' both give the {quantity}; leave one out"
            )
        used[quantity], factors[quantity] = k, factor
    return used, factors, ignored


def named(word: str, quantities: Quantities) -> str | None:
    """Return the quantity that a column's name, without its unit, stands for; None for other names."""
    for quantity, (_, words) in quantities.items():
        if any(word == w or (len(w) > 2 and word.endswith("_" + w)) for w in words):
            return quantity
    return None


def _factor(unit: str, si_unit: str, title: str, name: str) -> float:
    if not si_unit and unit in _PURE_NUMBER:
        return 1.0
    try:
        return float(scale(unit.replace("µ", "u").replace("μ", "u"), si_unit))
    except InputError as error:
        reason = str(error) if si_unit else f"unit '{unit}' does not measure a pure number; leave it out"
        raise InputError(f"{name}: column '{title[:80]}': {reason}") from None


def split_header(title: str) -> tuple[str, str]:
    """Return name and unit of a header: ``voltage_V``, ``Voltage [V]``, ``voltage (V)`` or ``voltage/V``."""
    bracketed = _BRACKETED.fullmatch(title)
    if bracketed:
        word, *units = bracketed.groups()
        return word.strip().lower().replace(" ", "_"), next(u for u in units if u)
    word, _, unit = title.rpartition("_")
    return word.strip().lower().replace(" ", "_"), unit.strip()


def _numbers(
    body: list[tuple[int, str]], used: dict[str, int], width: int, header: list[str], delimiter: str, name: str
) -> Array:
    """Return the used columns as numbers (rows, columns), NaN for blanks."""
    result = np.full((len(body), len(used)), np.nan)
    wanted = list(used.values())
    for k, row in enumerate(_rows(body, delimiter, name)):
        if len(row) > width and any(cell.strip() for cell in row[width:]):
            raise InputError(f"{name}: line {body[k][0]} has {len(row)} cells, the header {width}; one comma too many?")
        for j, column in enumerate(wanted):
            cell = row[column].strip() if column < len(row) else ""
            if not cell or cell.lower() == "nan":
                continue
            try:
                value = float(cell if delimiter == "," else cell.replace(",", "."))
            except ValueError:
                value = math.inf
            if not math.isfinite(value) or "_" in cell:
                raise InputError(
                    f"{name}: line {body[k][0]}, column '{header[column]}': '{cell[:40]}' is not a number; leave the "
                    "cell blank where there is no reading"
                )
            result[k, j] = value
    return result


def _rows(body: list[tuple[int, str]], delimiter: str, name: str) -> Iterator[list[str]]:
    try:
        yield from csv.reader((line for _, line in body), delimiter=delimiter)
    except csv.Error:
        raise InputError(f"{name}: a cell without end; is a quotation mark not closed?") from None


def _check_times(time: Array, lines: list[int], name: str) -> None:
    blank = np.flatnonzero(np.isnan(time))
    if len(blank):
        raise InputError(f"{name}: line {lines[blank[0]]} has no time; every row needs one")
    backwards = np.flatnonzero(np.diff(time) <= 0)
    if len(backwards):
        k = int(backwards[0])
        what = "repeats" if time[k + 1] == time[k] else "goes back from"
        raise InputError(
            f"{name}: line {lines[k + 1]}: time {time[k + 1]:g} s {what} {time[k]:g} s; sort the file by time"
        )


#: Rows of an instrument's table: the number of each line in the file, and its cells.
Rows = list[tuple[int, list[str]]]


def cells_at(cells: Sequence[str], places: Iterable[int]) -> list[str]:
    """Return the cells at some places of a row, blank where the row is too short."""
    return [cells[place].strip() if place < len(cells) else "" for place in places]


def parse_rows(rows: Rows, name: str, kind: Kind, notes: Sequence[Finding]) -> Table:
    """Read rows of an instrument's table as `parse_table` does; the first holds names and units, the first cells times.

    Where a step begins instruments write two readings at one time: the later one stays.

    Raises
    ------
    InputError
        As `parse_table`.
    """
    header, *body = rows
    following = [cells[0] for _, cells in body[1:]] + [""]
    kept = [row for row, time in zip(body, following, strict=False) if row[1][0] != time or not time]
    if len(kept) < len(body):
        notes = (*notes, Finding("readings-at-one-time", values={"count": len(body) - len(kept)}))
    table = parse_table(((number, "\t".join(cells)) for number, cells in (header, *kept)), name, kind)
    return replace(table, notes=tuple(notes))


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
    return Table(dict(zip(("frequency", "re", "im"), np.array(values).T, strict=True)), name)


def _number(cell: str, name: str, line: int) -> float:
    if not cell:
        return math.nan
    try:
        return float(cell.replace(",", ".").replace("_", "x"))
    except ValueError:
        raise InputError(f"{name}: line {line}: '{cell[:40]}' is not a number") from None
