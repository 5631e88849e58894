"""Measured tables: columns in SI units, from rows of text below a header with a name and a unit for each of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError, argument
from ..findings import Finding
from ..units import ANY_SIZE, PLAUSIBLE
from .cells import Rows as CellRows
from .cells import require_short
from .header import Column
from .kind import EDGE, LATER, Kind
from .layout import choose, find_layout, left_out, table_end
from .said import pick

#: Titles of columns that count cycles.
_CYCLES = (
    "cycle number",
    "cycle",
    "cycle_number",
    "cycle index",
    "scan",
    "loop",
    "sweep",
    "half cycle",
    "segment",
    "segment #",
)

#: Seconds of a day; least number of seconds since 1970 that is a date (1990).
_DAY, _DATES = 86400.0, 6.3e8
#: Distance from the first value, as a fraction of the span, within which times or frequencies begin again.
_NEAR = 0.1

#: quantity -> (title of its column, its unit)
Headers = Mapping[str, tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """Columns of a measurement in SI units, NaN where there is no reading; ``time``, if any, ascends.

    It ascends strictly except for the edges of a drawn drive. ``ignored`` are the headers that were not understood and
    not needed, ``notes`` are findings on what a reader left out, ``headers`` are the column and unit of each quantity.
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
        """Return a column [SI], or None if it is missing or blank."""
        column = self.columns.get(quantity)
        return column if column is not None and np.isfinite(column).any() else None


def parse_table(lines: Sequence[str], name: str, kind: Kind, numbers: Sequence[int] | None = None) -> Table:
    """Return the table in lines of text: a header, perhaps below other lines, a row of units, then rows of numbers.

    Columns are separated by commas, or by semicolons, tabs, spaces (decimal commas are then allowed). Blank lines,
    comments (# or %) and text below the table are left out. NaN, OVL, inf, -- and numbers such as 9.91E+37 are
    instruments' marks for no reading.

    Parameters
    ----------
    lines
        The lines of the file.
    name
        Name of the file in errors.
    kind
        Quantities that columns may hold, required ones, and the meaning of repeated times.
    numbers
        Numbers of the lines in the file (default: from 1 on).

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
    cells, taken, unreadable = _read(rows, taken, kind)
    left += unreadable
    with np.errstate(over="ignore"):
        cells *= [c.factor for c in taken.values()]
    columns = {quantity: cells[:, k] for k, quantity in enumerate(taken)}
    if "time" in columns and columns["time"][0] >= _DATES:  # a date and time: the time of its first day
        columns["time"] = columns["time"] - columns["time"][0] // _DAY * _DAY
    columns, at = _part(columns, _cycle(rows, columns, kind), at, name, kind)
    quantities = {c.place: quantity for quantity, c in taken.items()}
    for place, marked in ((place, marked) for place, marked in rows.marked.items() if place in quantities):
        values = {"quantity": quantities[place], "count": marked.count, "mark": marked.mark[:30]}
        notes = (*notes, Finding("readings-marked", values=values))
    return table_of(columns, taken, left, notes, at, name, kind)


def _read(rows: CellRows, taken: dict[str, Column], kind: Kind) -> tuple[Array, dict[str, Column], list[str]]:
    """Return the numbers of the taken columns; an optional column that cannot be read is left out."""
    try:
        return rows.numbers_at([c.place for c in taken.values()]), taken, []
    except InputError:
        kept = {quantity: c for quantity, c in taken.items() if quantity in kind.needed}
        if len(kept) == len(taken):
            raise
    cells = rows.numbers_at([c.place for c in kept.values()])
    return cells, kept, [c.title.strip() for quantity, c in taken.items() if quantity not in kept]


def _cycle(rows: CellRows, columns: dict[str, Array], kind: Kind) -> Mask:
    """Return a mask (n,) of the rows of the chosen cycle, all if none was chosen."""
    wanted = kind.said.cycle
    if wanted is None:
        return np.ones(len(rows.lines), dtype=bool)
    words = [title.strip().strip('"').lower() for title in rows.titles]
    place = next((words.index(word) for word in _CYCLES if word in words), None)
    if place is None:
        raise InputError(f"{rows.source}: no column of cycles, such as 'cycle number'; leave {argument('cycle')} out")
    cycles = rows.numbers_at([place])[:, 0]
    if not (cycles == wanted).any():
        there = np.unique(cycles[np.isfinite(cycles)])
        span = f"{there[0]:g} to {there[-1]:g}" if len(there) else "none"
        raise InputError(f"{rows.source}: no cycle {wanted}; column '{rows.titles[place]}' holds {span}")
    found: Mask = cycles == wanted
    return found


def _part(
    columns: dict[str, Array], rows: Mask, numbers: Sequence[int], name: str, kind: Kind
) -> tuple[dict[str, Array], Sequence[int]]:
    """Return ``rows`` of the columns, limited to the chosen part if times or frequencies begin again.

    Raises InputError if there are several parts and none was chosen.
    """
    if not rows.all():
        columns = {quantity: values[rows] for quantity, values in columns.items()}
        numbers = [numbers[k] for k in np.flatnonzero(rows).tolist()]
    first = next((q for q in ("time", "frequency") if q in columns), None)
    parts = runs(columns[first]) if first else []
    several = len(parts) > 1 and sum(b - a for a, b in parts) == len(numbers)
    if several and first is not None:  # a new measurement begins near the first value; a single wrong reading does not
        values = columns[first]
        begins = np.array([values[a] for a, _ in parts])
        back = [(values[a + 1] - values[a - 1]) * (values[1] - values[0]) < 0 for a, _ in parts[1:]]
        several = all(back) and bool((np.abs(begins - begins[0]) <= _NEAR * np.ptp(values)).all())
    if not several and kind.said.part is None:
        return columns, numbers
    ends = parts if several else [(0, len(numbers))]
    labels = [f"lines {numbers[a]} to {numbers[b - 1]}" for a, b in ends]
    a, b = pick(list(zip(labels, ends, strict=True)), kind.said, name)
    return {quantity: values[a:b] for quantity, values in columns.items()}, numbers[a:b]


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

    ``taken`` are their headers, ``left`` headers that were not understood, ``numbers`` the lines of the rows. Raises
    InputError for an implausibly large value, and for times that repeat or decrease.
    """
    _require_sensible(columns, taken, name, kind)
    if "time" in columns:
        columns, more = _in_time(columns, numbers, name, kind.repeats)
        notes = (*notes, *more)
    headers = {quantity: (c.title.strip(), c.unit) for quantity, c in taken.items()}
    return Table(columns, name, tuple(left), notes, headers)


def runs(values: Array, least: int = 6) -> list[tuple[int, int]]:
    """Return (begin, end) of runs of at least ``least`` values that ascend, or descend as the first ones do."""
    step = np.sign(np.diff(values))
    moved = step[np.abs(step) > 0]
    turns = (np.flatnonzero(step * moved[0] < 0) + 1).tolist() if len(moved) else []
    return [(a, b) for a, b in pairwise([0, *turns, len(values)]) if b - a >= least]


def _require_sensible(columns: Mapping[str, Array], taken: Mapping[str, Column], name: str, kind: Kind) -> None:
    for quantity, values in columns.items():
        unit, title = kind.quantities[quantity][0], taken[quantity].title.strip()[:80]
        largest = PLAUSIBLE.get(unit, ANY_SIZE)[1]
        if np.abs(values).max(initial=0.0, where=~np.isnan(values)) > largest:
            raise InputError(f"{name}: column '{title}' has a value beyond {largest:g} {unit}; check its unit")


def _in_time(
    columns: dict[str, Array], numbers: Sequence[int], name: str, repeats: str
) -> tuple[dict[str, Array], tuple[Finding, ...]]:
    """Return the columns with ascending times, and a finding if two readings had the same time."""
    time = columns["time"]
    blank = np.flatnonzero(np.isnan(time))
    if len(blank):
        raise InputError(f"{name}: line {numbers[blank[0]]} has no time; every row needs one")
    step = np.diff(time)
    backwards = np.flatnonzero(step < 0 if repeats in (EDGE, LATER) else step <= 0)
    if len(backwards):
        k = int(backwards[0])
        line, later, earlier = numbers[k + 1], time[k + 1], time[k]
        if later < earlier:
            raise InputError(
                f"{name}: line {line}: time {later:g} s goes back from {earlier:g} s; sort the file by time"
            )
        count = int((step == 0).sum())
        raise InputError(
            f"{name}: line {line}: time {later:g} s repeats {earlier:g} s"
            + (f", as {count} of {len(time)} do: write times with more digits" if count > 1 else "; leave one row out")
        )
    double = np.append(step == 0, False)
    if repeats == EDGE or not double.any():
        return columns, ()
    kept = {quantity: values[~double] for quantity, values in columns.items()}
    return kept, (Finding("readings-at-one-time", values={"count": int(double.sum())}),)


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
