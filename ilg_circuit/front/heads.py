"""The head of a measured file: its titles and first rows, from which a user chooses columns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..measurements.formats import BINARIES
from ..measurements.kind import RECORD, SPECTRUM, TRACK, Kind
from ..measurements.layout import cells_of, find_layout
from ..measurements.said import NOTHING, Said
from ..measurements.text import read_raw, text_of

#: Longest cell that is shown, and most columns.
_LONGEST, _MOST = 24, 40


@dataclass(frozen=True)
class Head:
    """The beginning of a table: ``titles`` of its columns, and the cells of its first ``rows``.

    A column without a title has its number, from 1, which `read` takes in place of a title.
    """

    titles: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def head(path: str | Path, rows: int = 5) -> Head:
    """Return the head of the table in a file, understood or not.

    Raises
    ------
    InputError
        The file cannot be read as text.
    MissingLibraryError
        The reader of a binary format is not installed.
    """
    raw = read_raw(path, RECORD)
    opener = next((binary for binary in BINARIES if binary.opens(raw.raw)), None)
    lines = text_of(raw, RECORD).lines if opener is None else opener.lines(raw.raw, raw.name, NOTHING)[0]
    found = [layout for kind in (RECORD, SPECTRUM, TRACK, _numbered()) if (layout := find_layout(lines, kind))]
    if not found:
        return Head((), ())
    layout = max(found, key=lambda each: (each.complete, len(each.columns), len(each.titles)))
    below = [line for line in lines[layout.first :] if line.strip()][:rows]
    cells = tuple(tuple(c.strip()[:_LONGEST] for c in cells_of(line, layout.delimiter)[:_MOST]) for line in below)
    titles = tuple(title.strip() for title in layout.titles[:_MOST])
    return Head(tuple(title or str(k) for k, title in enumerate(titles, 1)), cells)


def _numbered() -> Kind:
    """Return a record whose columns are given by number: the way to a table without titles."""
    return RECORD.told(Said({"time": "1"}))
