"""VersaStudio's files (.par): tables between <Segment1> and </Segment1>, their columns named by Definition=."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ..derived import impedance_of
from ..kind import RECORD, SPECTRUM, Kind
from ..said import pick
from ..table import Rows, Table, parse_rows

NAME = "VersaStudio"
KINDS: tuple[Kind, ...] = (RECORD, SPECTRUM)

_KNOWN = {
    **{"elapsed time(s)": ("time", "s"), "e(v)": ("voltage", "V"), "i(a)": ("current", "A")},
    **{"frequency(hz)": ("frequency", "Hz"), "z real": ("re", "ohm"), "z imag": ("im", "ohm")},
}
#: Real and imaginary parts of voltage and current, where no impedance is written.
_PARTS = ("e real", "e imag", "i real", "i imag")


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return the kind of data in a file that has the definition of a segment's columns."""
    titles = [_titles(lines[k]) for k in _definitions(lines)[:20]]
    if not titles:
        return None
    spectra = [any("frequency" in t.lower() for t in row) and any("real" in t.lower() for t in row) for row in titles]
    return SPECTRUM if all(spectra) else RECORD


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the columns of the segment that is meant; an impedance is the voltage over the current.

    Raises
    ------
    InputError
        Several segments and none chosen, no rows, or a column that cannot be read.
    """
    parts = [
        (f"segment in line {k + 1}, {len(rows)} rows", (k, rows))
        for k in _definitions(lines)
        if (rows := _rows(lines, k))
    ]
    if not parts:
        raise InputError(f"{name}: a VersaStudio file without a row of readings")
    start, rows = pick(parts, kind.said, name)
    titles = _titles(lines[start])
    words = [title.lower() for title in titles]
    kind = kind.whole.knowing(_KNOWN)
    if kind == SPECTRUM and "z real" not in words and all(part in words for part in _PARTS):
        titles = [*titles, "Z Real", "Z Imag"]
        rows = [
            (k, [*cells, *_impedance([cells[words.index(p)] for p in _PARTS])])
            for k, cells in rows
            if len(cells) == len(words)
        ]
    table = parse_rows([(start + 1, titles), *rows], name, kind, ())
    return impedance_of(table, kind) if kind == SPECTRUM else table


def _definitions(lines: Sequence[str]) -> list[int]:
    return [k for k, line in enumerate(lines) if line.startswith("Definition=") and "," in line]


def _titles(line: str) -> list[str]:
    return [cell.strip() for cell in line.removeprefix("Definition=").split(",")]


def _rows(lines: Sequence[str], start: int) -> Rows:
    rows: Rows = []
    for k in range(start + 1, len(lines)):
        if lines[k].startswith("<"):
            break
        if lines[k].strip():
            rows.append((k + 1, lines[k].rstrip(",").split(",")))
    return rows


def _impedance(cells: Sequence[str]) -> tuple[str, str]:
    """Return the real and the imaginary part of voltage over current, blanks where there is none."""
    try:
        a, b, c, d = map(float, cells)
        z = complex(a, b) / complex(c, d)
    except (ValueError, ZeroDivisionError, OverflowError):
        return "", ""
    return repr(z.real), repr(z.imag)
