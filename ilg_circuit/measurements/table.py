"""Measured tables: CSV files with a name and a unit in every column's header."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..units import scale
from .text import read_text

Array = NDArray[np.float64]

#: quantity -> (SI unit, "" for a pure number; words that a column's name may end in before its unit)
Quantities = dict[str, tuple[str, tuple[str, ...]]]

QUANTITIES: Quantities = {
    "time": ("s", ("time", "t", "t_nominal")),
    "voltage": ("V", ("voltage", "potential", "u")),
    "current": ("A", ("current", "i")),
    "displacement": ("m", ("displacement", "deflection", "position")),
    "force": ("N", ("force",)),
    "charge": ("C", ("charge",)),
}

EXAMPLES = "time_s, voltage_V, current_mA, displacement_mm, force_N"

#: No measurement is larger.
MOST_BYTES = 300_000_000
#: No reading in SI units is larger.
_LARGEST = 1e30

_PURE_NUMBER = ("", "-", "1")

_BRACKETED = re.compile(r"(.+?)\s*(?:\[(.+)\]|\((.+)\)|/\s*(\S+))")


@dataclass(frozen=True)
class Table:
    """Columns of a measurement in SI units, NaN where a cell was blank; ``time``, if any, ascends strictly.

    ``ignored`` are the headers that were not understood and not needed, ``notes`` what a reader dropped, and why.
    """

    columns: dict[str, Array]
    source: str = "data"
    ignored: tuple[str, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())

    @property
    def time(self) -> Array:
        return self.columns["time"]

    def get(self, quantity: str) -> Array | None:
        """A column [SI], or None where the file has none or nothing but blanks."""
        column = self.columns.get(quantity)
        return column if column is not None and np.isfinite(column).any() else None


def read_table(
    path: str | Path,
    required: tuple[str, ...] = ("time",),
    *,
    quantities: Quantities = QUANTITIES,
    example: str = EXAMPLES,
) -> Table:
    """Read a CSV file: comma, or semicolon, tab, spaces (then decimal commas are allowed); # starts a comment line.

    ``quantities`` are those that columns may hold, ``example`` a header to show in errors. Raises InputError naming
    file, line and column for what cannot be read: a missing column or unit, text in a number, times that repeat or
    decrease.
    """
    name = Path(path).name
    text = read_text(path, MOST_BYTES, "measurement")
    return parse_table(text, name, required, quantities=quantities, example=example)


def parse_table(
    text: str,
    name: str,
    required: tuple[str, ...] = ("time",),
    *,
    quantities: Quantities = QUANTITIES,
    example: str = EXAMPLES,
) -> Table:
    """The table that a file's ``text`` holds; ``name`` stands for the file in errors. As `read_table`."""
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise InputError(f"{name}: the file is empty; it needs a header row such as {example}")
    if "\0" in text:
        raise InputError(f"{name}: not a text file; export the measurement as CSV")
    if any(len(line) > 100_000 for _, line in lines):
        raise InputError(f"{name}: a line is longer than 100000 characters; export the measurement as CSV")
    lines = _tabbed(lines)
    delimiter = max(",;\t", key=lines[0][1].count)
    header = [cell.strip() for cell in next(csv.reader([lines[0][1]], delimiter=delimiter))]
    used, factors, ignored = _understand(header, name, quantities)
    for quantity in required:
        if quantity not in used:
            others = f"; not understood: {', '.join(repr(c[:40]) for c in ignored[:20])}" if ignored else ""
            if all(_is_number(cell) for cell in header):
                others = ": the first row holds numbers, not names; put a row of names above it, one for each column"
            raise InputError(f"{name}: no column for {quantity}{others}; columns are written like {example}")
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
    """Lines whose columns are separated by spaces, with tabs instead; other lines as they are.

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
    """Which column holds which quantity, its factor to SI, and the headers left over."""
    used: dict[str, int] = {}
    factors: dict[str, float] = {}
    ignored = []
    for k, title in enumerate(header):
        bare = _named(title.lower(), quantities)
        word, unit = split_header(title)
        if bare and not quantities[bare][0]:  # a pure number needs no unit
            word, unit = title.lower(), ""
        quantity = _named(word, quantities)
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


def _named(word: str, quantities: Quantities) -> str | None:
    """The quantity that a column's name, its unit taken off, stands for."""
    return next((q for q, (_, words) in quantities.items() if _names(word, words)), None)


def _factor(unit: str, si_unit: str, title: str, name: str) -> float:
    if not si_unit and unit in _PURE_NUMBER:
        return 1.0
    try:
        return float(scale(unit.replace("µ", "u").replace("μ", "u"), si_unit))
    except InputError as error:
        said = str(error) if si_unit else f"unit '{unit}' does not measure a pure number; leave it out"
        raise InputError(f"{name}: column '{title[:80]}': {said}") from None


def split_header(title: str) -> tuple[str, str]:
    """Name and unit of a header: ``voltage_V``, ``Voltage [V]``, ``voltage (V)`` or ``voltage/V``."""
    bracketed = _BRACKETED.fullmatch(title)
    if bracketed:
        word, *units = bracketed.groups()
        return word.strip().lower().replace(" ", "_"), next(u for u in units if u)
    word, _, unit = title.rpartition("_")
    return word.strip().lower().replace(" ", "_"), unit.strip()


def _names(word: str, words: tuple[str, ...]) -> bool:
    return any(word == w or (len(w) > 2 and word.endswith("_" + w)) for w in words)


def _numbers(
    body: list[tuple[int, str]], used: dict[str, int], width: int, header: list[str], delimiter: str, name: str
) -> Array:
    """The used columns as numbers (rows, columns), NaN for blanks."""
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
