"""Reads numbers from the rows of a table: by numpy if every cell is a number, else cell by cell."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import repeat

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError

#: Numbers of this size or more are instruments' marks for "no reading": 9.9E37, 9.91E37, 3.4E38, 1.8E308.
NO_READING = 9.9e36
#: Number of rows that are read at once.
_CHUNK = 20_000
#: Largest number of characters in a line.
LONGEST_LINE = 100_000

_MARKS = re.compile(
    r"[sq]?nan[sq]?|#?n/?a|n\.a\.|null|none|nil|missing|inf(?:inity)?|err|error|invalid|undef(?:ined)?"
    r"|[o0]\.?l\.?|ovl?d?|ovrl?d?|ovfl?|ovflw|over[ -]?(?:load(?:ed)?|range|flow)?|over?rng|ovrange|orng"
    r"|#(?:num!|value!|div/0!|ref!|null!)|1\.#\w{1,8}|\?"
)
_CLOCK = re.compile(r"(?:(\d{1,5}):)?(\d{1,3}):(\d{1,2}(?:\.\d{1,9})?)")
#: A date, by year, month, day or day.month.year, and a time of day.
_DATED = re.compile(
    r"(?:(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})|(\d{1,2})\.(\d{1,2})\.(\d{4}))"
    r"[T ] ?(\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)Z?"
)
_STROKES = re.compile(r"[-\u2013\u2014*?]+(?:\.[-\u2013\u2014*?]*)?")


@dataclass
class Marked:
    """Readings of a column that an instrument marks as missing: their number and the first ``mark``."""

    count: int = 0
    mark: str = ""

    def add(self, mark: str, count: int = 1) -> None:
        self.mark = self.mark or mark
        self.count += count


@dataclass
class Rows:
    """Rows of a table as text: ``lines``, their ``numbers`` in the file, and the ``delimiter`` of cells ("": spaces).

    ``titles`` are the names of all columns.
    """

    lines: Sequence[str]
    numbers: Sequence[int]
    delimiter: str
    titles: Sequence[str]
    source: str
    marked: dict[int, Marked] = field(default_factory=dict)

    def numbers_at(self, places: Sequence[int]) -> Array:
        """Return the numbers (rows, places) in some columns, NaN for blanks and for marks, which ``marked`` counts.

        Raises
        ------
        InputError
            A cell is neither, or a row has more cells than there are titles; the message names line and column.
        """
        result = np.empty((len(self.lines), len(places)), order="F")
        for start in range(0, len(self.lines), _CHUNK):
            chunk = self.lines[start : start + _CHUNK]
            found = self._at_once(chunk, places)
            result[start : start + len(chunk)] = self._by_cell(chunk, start, places) if found is None else found
        return result

    def _at_once(self, chunk: Sequence[str], places: Sequence[int]) -> Array | None:
        """Return the numbers of rows that hold only numbers and blanks, None for other rows."""
        sign, text = self.delimiter, "\n".join(["", *chunk, ""])
        widest = max(map(str.count, chunk, repeat(sign))) + 1 if sign else max(len(line.split()) for line in chunk)
        if '"' in text or "_" in text or widest > len(self.titles):
            return None
        plain = text if sign == "," else text.replace(",", ".")
        blanks = bool(sign) and any(pair in plain for pair in (2 * sign, f"\n{sign}", f"{sign}\n"))
        if blanks:
            for _ in range(2):  # the first pass reduces three separators in a row to two
                plain = plain.replace(2 * sign, f"{sign}nan{sign}")
            plain = plain.replace(f"\n{sign}", f"\nnan{sign}").replace(f"{sign}\n", f"{sign}nan\n")
        lines = chunk if plain is text else plain[1:-1].split("\n")
        try:
            found = np.loadtxt(lines, delimiter=sign or None, usecols=list(places), comments=None, ndmin=2)
        except ValueError:
            return None
        if len(found) != len(chunk) or np.abs(found).max(initial=0.0, where=~np.isnan(found)) >= NO_READING:
            return None
        if np.isnan(found).any() and any("n" in line or "N" in line for line in chunk):
            if blanks:
                return None  # blanks and NaN are distinguished
            self._count(chunk, places, np.isnan(found))
        return found

    def _count(self, chunk: Sequence[str], places: Sequence[int], marked: Mask) -> None:
        """Count the NaN in rows without blanks."""
        for j, place in enumerate(places):
            if marked[:, j].any():
                row = chunk[int(marked[:, j].argmax())]
                cells = row.split(self.delimiter or None)
                self.marked.setdefault(place, Marked()).add(cells[place].strip(), int(marked[:, j].sum()))

    def _by_cell(self, chunk: Sequence[str], start: int, places: Sequence[int]) -> Array:
        result = np.full((len(chunk), len(places)), np.nan)
        rows = self._split(chunk)
        wide = len(self.titles)
        for k, row in enumerate(rows):
            if len(row) > wide and any(cell.strip() for cell in row[wide:]):
                raise InputError(
                    f"{self.source}: line {self.numbers[start + k]} has {len(row)} cells, the header {wide}; "
                    "one comma too many?"
                )
            for j, place in enumerate(places):
                cell = row[place] if place < len(row) else ""
                try:
                    value = float(cell)
                except ValueError:
                    value = math.nan
                if not abs(value) < NO_READING or "_" in cell:
                    value = self._odd(cell.strip(), place, start + k)
                result[k, j] = value
        return result

    def _odd(self, cell: str, place: int, row: int) -> float:
        """Return the number in a cell that is not a plain number: NaN for a blank or a mark."""
        if not cell:
            return math.nan
        value = clock(cell) if ":" in cell else number(cell, self.delimiter)
        if value is not None and abs(value) < NO_READING:
            return value
        if value is not None or is_mark(cell):
            self.marked.setdefault(place, Marked()).add(cell)
            return math.nan
        raise InputError(
            f"{self.source}: line {self.numbers[row]}, column '{self.titles[place]}': '{cell[:40]}' is not a number; "
            "leave the cell blank where there is no reading"
        )

    def _split(self, chunk: Sequence[str]) -> list[list[str]]:
        if not self.delimiter:
            return [line.split() for line in chunk]
        try:
            rows = list(csv.reader(chunk, delimiter=self.delimiter))
        except csv.Error:
            rows = []
        if len(rows) != len(chunk):
            raise InputError(f"{self.source}: a cell without end; is a quotation mark not closed?")
        return rows


def require_short(lines: Iterable[str], source: str, kind: str) -> None:
    """Raise InputError for a line that is longer than any instrument writes."""
    if max(map(len, lines), default=0) > LONGEST_LINE:
        raise InputError(f"{source}: a line is longer than {LONGEST_LINE} characters; export the {kind} as CSV")


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of one line without quotation marks. Raises csv.Error for a cell without end."""
    return next(csv.reader([line], delimiter=delimiter, strict=False), [])


def number(cell: str, delimiter: str = ",") -> float | None:
    """Return the number in a cell, or None; a comma is a decimal sign where it does not separate cells."""
    plain = cell.replace("\u2212", "-")
    try:
        value = float(plain if delimiter == "," else plain.replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in cell else None


def clock(cell: str) -> float | None:
    """Return the seconds of a time such as 1:02:03.5, or of a date and time since 1970; None for other text."""
    dated = _DATED.fullmatch(cell.strip()) if len(cell) < 60 else None
    if dated:
        year, month, day = (dated[1], dated[2], dated[3]) if dated[1] else (dated[6], dated[5], dated[4])
        try:
            midnight = datetime(int(year), int(month), int(day), tzinfo=UTC).timestamp()
        except ValueError:
            return None
        seconds = clock(dated[7])
        return None if seconds is None else midnight + seconds
    match = _CLOCK.fullmatch(cell.replace(",", "."))
    return 3600.0 * int(match[1] or 0) + 60.0 * int(match[2]) + float(match[3]) if match else None


def is_number(cell: str, delimiter: str = ",") -> bool:
    """Return True if a cell holds a finite number."""
    return number(cell, delimiter) is not None


def is_mark(cell: str) -> bool:
    """Return True if a cell holds an instrument's mark for no reading: NaN, OVL, inf, --."""
    text = cell.strip().lower().lstrip("+-")
    return bool(_MARKS.fullmatch(text)) or bool(_STROKES.fullmatch(cell.strip())) or _overflows(text)


def _overflows(text: str) -> bool:
    try:
        return math.isinf(float(text))
    except ValueError:
        return False
