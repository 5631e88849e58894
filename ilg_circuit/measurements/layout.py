"""Finds the table in a file: its row of names, perhaps a row of units, its first row of numbers, its end."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from ..errors import InputError, argument
from ..findings import Finding
from .cells import LONGEST_LINE, clock, is_mark, is_number, split
from .header import Column, chosen, columns_of, is_unit_row
from .kind import EDGE, PREAMBLE, RECORD, TRACK, Kind
from .said import options
from .suggest import suggestion

#: Largest number of rows of units and remarks between the names and the numbers.
_BETWEEN = 4
#: Largest number of columns of a table.
_MOST_COLUMNS = 1000
_COMMENTS = ("#", "%")
_SEPARATORS = ",;\t"
_SPOKEN = {
    "im": "Im Z",
    "minus_im": "-Im Z",
    "phase": "the phase",
    "minus_phase": "-phase",
    "im_y": "Im Y",
    "minus_im_y": "-Im Y",
    "stress": "a nominal",
    "true stress": "a true stress",
}
#: A line of these characters only is blank: spreadsheets fill up tables with separators.
_SPACE = ' \t,;"\r'
_FIRST = frozenset((*_SPACE, *_COMMENTS))


@dataclass(frozen=True)
class Layout:
    """A table among lines: the ``header`` (its line, from 0), the ``titles`` in it, and the line ``first`` below.

    ``delimiter`` separates the cells of the rows ("": spaces). ``columns`` name quantities; ``complete`` is True if all
    of them can be read and numbers stand below them.
    """

    header: int
    titles: tuple[str, ...]
    columns: tuple[Column, ...]
    first: int
    delimiter: str
    complete: bool

    def place(self, kind: Kind) -> int:
        """Return the column that has a number in every row: the time, the frequency, the stretch."""
        first = (*kind.required, *kind.way(readable(self.columns)))[0]
        return next((c.place for c in self.columns if c.quantity == first and not c.complaint), 0)


def readable(columns: Sequence[Column]) -> set[str]:
    """Return the quantities that have a readable column."""
    return {c.quantity for c in columns if not c.complaint}


def find_layout(lines: Sequence[str], kind: Kind) -> Layout | None:
    """Return the layout of the table that holds a ``kind``, None if all lines are blank.

    The header is the first row that names all required quantities of ``kind``, with units, above a row of numbers; it
    may be a comment. If there is none, it is the row that names most, so that an error can state the missing ones.
    """
    best: Layout | None = None
    score = 0
    shown = [k for k, line in enumerate(lines[:PREAMBLE]) if line.strip()]
    rows = [k for k in shown if not lines[k].startswith(_COMMENTS)]
    for k in (*rows, *(k for k in shown if lines[k].startswith(_COMMENTS))):
        if len(lines[k]) > LONGEST_LINE or _bare(lines[k]):
            continue
        for layout in _layouts(lines, k, kind):
            if layout.complete:
                return layout
            below = lines[layout.first] if layout.first < len(lines) else ""
            if not any(s in lines[k] for s in _SEPARATORS) and not _bare(below):
                continue  # words of a sentence
            named = {c.quantity for c in layout.columns if c.quantity in kind.needed}
            worth = 2 * len(readable(layout.columns).intersection(kind.needed)) + len(named)
            if worth > score:
                best, score = layout, worth
    if best is None and rows and kind.said.columns and all(t.isdecimal() for t in kind.said.columns.values()):
        for sign in (*(s for s in _SEPARATORS if s in lines[rows[0]]), ""):  # columns without names are given by number
            titles = tuple(map(str, range(1, len(cells_of(lines[rows[0]], sign)) + 1)))
            columns = tuple(columns_of(titles, (), kind))
            if len(titles) > 1 and all(is_number(c.strip(), sign) for c in cells_of(lines[rows[0]], sign)):
                return Layout(rows[0], titles, columns, rows[0], sign, kind.complete(readable(columns)))
    if best is not None or not rows:
        return best
    # no row names anything: the first row, or the row above the first number if that belongs to another table
    numbers = next((k for k in rows if _bare(lines[k])), rows[0])
    sign = _likely(lines[rows[0]])
    alike = len(rows) > 1 and bool(sign) and lines[rows[0]].count(sign) == lines[rows[1]].count(sign)
    header = rows[0] if alike else max((k for k in rows if k < numbers), default=rows[0])
    sign = _likely(lines[header])
    table = sign or any(_bare(lines[k]) for k in rows if header <= k <= header + 1)
    words = cells_of(lines[header], sign) if table else [lines[header].strip()]
    return Layout(header, tuple(words), (), header + 1, sign, False)


def choose(
    layout: Layout, kind: Kind, name: str, line: int
) -> tuple[dict[str, Column], list[str], tuple[Finding, ...]]:
    """Return the column of each quantity, the remaining titles, and findings.

    ``line`` is the header's number in the file.

    Raises
    ------
    InputError
        A quantity that ``kind`` needs has no readable column.
    """
    wrong = [text for q, text in kind.said.columns.items() if q in kind.quantities and not _said(layout, q)]
    if wrong:
        filled = ", ".join(repr(title.strip()[:40]) for title in layout.titles[:20] if title.strip())
        raise InputError(f"{name}: there is no column '{wrong[0][:80]}'; the file has {filled}")
    taken, notes = chosen(layout.columns, kind, name)
    way = kind.way(taken)
    needed = dict.fromkeys((*kind.required, *way, *kind.used))
    alternatives = {q for other in kind.ways for q in other}
    for one, other in kind.opposed:
        if one in taken and other in taken and (one in way or other in way):
            if not {one, other} & kind.said.quantities:
                raise InputError(
                    f"{name}: columns for both {_SPOKEN[one]} and {_SPOKEN[other]}; leave one out or say "
                    f"which: {options(('columns', one, taken[one].title))}"
                )
            if other in kind.said.quantities:
                way = tuple(other if q == one else q for q in way)
    needed = dict.fromkeys((*kind.required, *way, *kind.used))
    taken = {q: c for q, c in taken.items() if q in needed or q not in alternatives}
    complaints = {c.quantity: c for c in reversed(layout.columns) if c.complaint and c.quantity not in taken}
    named = {c.place for c in layout.columns if not c.complaint}
    left = [title.strip() for k, title in enumerate(layout.titles) if k not in named]
    if not kind.complete(taken):  # the way with most columns is taken to be the intended one
        named_at_all = {*taken, *complaints}
        way = max(kind.ways, key=lambda w: (sum(q in named_at_all for q in w), sum(q in taken for q in w)))
        needed = dict.fromkeys((*kind.required, *way, *kind.used))
    for quantity in needed:
        must = quantity not in taken and (quantity in kind.required or quantity in way)
        if not must and quantity not in complaints:
            continue
        column = complaints.get(quantity)
        how = suggestion(layout, kind, [q for q in needed if q not in taken], left)
        if column is not None:
            said = column.complaint
            raise InputError(f"{name}: column '{column.title[:80]}'{said}{how}")
        where = f"line {line}: " if line > 1 else ""
        raise InputError(
            f"{name}: {where}{_missing(quantity, layout, left)}; columns are written like {kind.example}{how}"
            f"{_alone(layout, kind, taken)}"
        )
    if kind.said.scale is not None and all(c.unit != "px" for c in taken.values()):
        lengths = ", ".join(f"'{c.title.strip()[:40]}' is in {c.unit}" for c in taken.values())
        raise InputError(f"{name}: a scale of pixels was given, and no column is in pixels ({lengths}); leave it out")
    return taken, left, notes


def _said(layout: Layout, quantity: str) -> bool:
    return any(c.quantity == quantity for c in layout.columns)


def table_end(lines: Sequence[str], layout: Layout, kind: Kind) -> int:
    """Return the line (from 0) after the last row of the table; lines of text below do not belong to it."""
    place, end = layout.place(kind), len(lines)
    while end > layout.first and _is_text(lines[end - 1], place, layout.delimiter):
        end -= 1
    return end if end > layout.first else len(lines)


def left_out(lines: Sequence[str]) -> list[int]:
    """Return the lines (from 0) that are blank, apart from separators, or comments."""
    possible = [k for k, line in enumerate(lines) if not line or line[0] in _FIRST]
    return [k for k in possible if is_left_out(lines[k])]


def is_left_out(line: str) -> bool:
    """Return True if a line is blank, apart from separators, or a comment."""
    return line[:1] in "#%" or not line.strip(_SPACE)


def _missing(quantity: str, layout: Layout, left: Sequence[str]) -> str:
    if all(is_number(cell.strip()) for cell in layout.titles):
        return (
            f"no column for {quantity}: the first row holds numbers, not names; put a row of names above it, one for "
            "each column"
        )
    filled = [repr(title[:40]) for title in left if title][:20]
    spoken = "the imaginary part" if quantity in ("im", "minus_im") else quantity
    return f"no column for {spoken}" + (f"; not understood: {', '.join(filled)}" if filled else "")


def _alone(layout: Layout, kind: Kind, taken: Collection[str]) -> str:
    """Return advice for a file that holds a displacement but no other quantity of a record, empty for other files."""
    if kind != RECORD or "current" in taken or kind.repeats == EDGE:
        return ""
    titles = [title for title in layout.titles if title.strip()]
    found = {c.quantity for c in columns_of(titles, [""] * len(titles), TRACK)}
    if not TRACK.complete(found):
        return ""
    if "voltage" in taken:
        return f"; a displacement without a current takes its own voltage as {argument('drive', 'file:')}FILE"
    return (
        f"; of a displacement alone state what drove it: {argument('drive', 'step:2V')}, or give it beside a record: "
        f"{argument('displacement')}"
    )


def _layouts(lines: Sequence[str], k: int, kind: Kind) -> Iterator[Layout]:
    """Yield the layouts with a line as the header, for every separator that occurs in it."""
    line = lines[k].lstrip("#% ") if lines[k].startswith(_COMMENTS) else lines[k]
    below = [j for j in range(k + 1, min(k + 50, len(lines))) if not is_left_out(lines[j]) or _percent(lines, j, k)][
        : _BETWEEN + 1
    ]
    ways = sorted((s for s in _SEPARATORS if s in line), key=line.count, reverse=True)
    for delimiter in ways or ("  ", ""):
        titles = tuple(cells_of(line, delimiter))
        if len(titles) > _MOST_COLUMNS or (len(titles) < 2 and delimiter):
            continue
        units: list[str] = []
        first = below[0] if below else k + 1
        if below and not _bare(lines[below[0]]):
            cells = cells_of(lines[below[0]], delimiter)
            if len(cells) <= len(titles) and is_unit_row(cells):
                units, first = cells, below[1] if len(below) > 1 else below[0] + 1
        columns = tuple(columns_of(titles, units, kind))
        known = readable(columns)
        wanted = (*kind.required, *kind.way(known))
        places = [c.place for c in columns if c.quantity in wanted and not c.complaint]
        complete = kind.complete(known)
        found = _first_row(lines, below, places, delimiter, len(titles)) if complete else None
        if found is None:
            yield Layout(k, titles, columns, first, _likely(lines[first]) if first < len(lines) else "", False)
        else:
            yield Layout(k, titles, columns, *found, True)


def _percent(lines: Sequence[str], j: int, header: int) -> bool:
    """Return True if a line below the header is a row of units that begins with percent, and not a comment."""
    return j == header + 1 and lines[j][:1] == "%" and lines[j][1:2] in tuple(_SEPARATORS)


def _first_row(
    lines: Sequence[str], below: Sequence[int], places: Sequence[int], like: str, width: int
) -> tuple[int, str] | None:
    """Return the first line that has a number at the first of ``places``, and the separator of its cells.

    If that differs from the separator of the names (``like``), the line must have one cell for each name.
    """
    for j in below:
        line = lines[j]
        if len(line) > LONGEST_LINE:
            continue
        present = [s for s in _SEPARATORS if s in line and s != like]
        for delimiter in (*([like] if like.strip(" ") and like in line else []), *present[::-1], ""):
            cells = cells_of(line, delimiter)
            if (delimiter != like or not delimiter) and len(cells) != width:
                continue
            at = [cells[p].strip() if p < len(cells) else "" for p in places]
            if (is_number(at[0], delimiter) or clock(at[0]) is not None) and all(
                not c or is_number(c, delimiter) or is_mark(c) or clock(c) is not None for c in at
            ):
                return j, delimiter
        if _bare(line) or any(is_number(c.strip(), like) for c in cells_of(line, like)):
            return None  # an unreadable row is not skipped
    return None


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line; "  " means two spaces or more, "" any spaces, brackets staying with their names."""
    if delimiter == "  ":
        return [cell.strip() for cell in line.split("  ") if cell.strip()]
    if delimiter:
        try:
            return [cell.strip() for cell in split(line, delimiter)]
        except csv.Error:
            return [line]
    cells: list[str] = []
    for word in line.split():
        if cells and word[0] in "([/":
            cells[-1] += f" {word}"
        else:
            cells.append(word)
    return cells


def _likely(line: str) -> str:
    """Return the most likely separator of the cells of a line."""
    sign = max(_SEPARATORS, key=line.count)
    return sign if sign in line else ""


def _bare(line: str) -> bool:
    """Return True if a line begins with a number, so that it is not a row of names."""
    begin = line[:100].replace(";", " ").replace("\t", " ").replace(",", " ").split()
    return bool(begin) and is_number(begin[0].strip('"'))


def _is_text(line: str, place: int, delimiter: str) -> bool:
    """Return True if a line does not belong to the table: left out, or words where the rows have a number."""
    if is_left_out(line):
        return True
    cells = cells_of(line, delimiter)
    cell = cells[place].strip() if place < len(cells) else ""
    if is_number(cell, delimiter):
        return False
    others = any(is_number(c.strip(), delimiter) for k, c in enumerate(cells) if k != place)
    return not others or (cell[:1].isalpha() and not is_mark(cell))
