"""Bare numbers without a header: frequency [Hz], Re Z [ohm], Im Z [ohm] in every row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import InputError
from ..kind import PREAMBLE, SPECTRUM, Kind, frequency_row
from ..table import Table

NAME = "bare numbers"
KINDS: tuple[Kind, ...] = (SPECTRUM,)

#: Least number of rows to distinguish the frequencies of a sweep from the times of a record.
_FEWEST_ROWS = 6


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return SPECTRUM if nearly all rows are three numbers and the first ones are even in logarithm, as in a sweep."""
    filled = [line for line in lines[:PREAMBLE] if line.strip()]
    rows = [row for row in map(_numbers, filled) if row is not None]
    if len(rows) < max(_FEWEST_ROWS, 0.9 * len(filled)) or frequency_row(lines) is not None:
        return None
    if _numbers(filled[0]) is None and not filled[0].startswith("#"):
        return None
    # a record's times are even and begin at zero
    f = np.array([row[0] for row in rows])
    if not (np.isfinite(f).all() and (f > 0).all() and f.max() > 10 * f.min()):
        return None
    steps = np.diff(f)
    even = np.abs(steps).max() <= 3 * np.abs(steps).min()
    return SPECTRUM if ((steps > 0).all() or (steps < 0).all()) and not even else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the first three numbers of every row as ``frequency``, ``re`` and ``im``.

    Raises
    ------
    InputError
        A line holds something else, or there are no rows, or too many.
    """
    rows: list[tuple[float, float, float]] = []
    for k, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        row = _numbers(line)
        if row is None:
            if rows:
                raise InputError(f"{name}: line {k}: '{line.strip()[:40]}' is not frequency, Re Z, Im Z")
            raise InputError(f"{name}: no column for frequency; columns are written like {kind.example}")
        rows.append(row)
        if kind.most_rows and len(rows) > kind.most_rows:
            raise InputError(f"{name}: more than {kind.most_rows} points; that is no {kind.name}")
    if not rows:
        raise InputError(f"{name}: no rows of numbers; a {kind.name} has columns such as {kind.example}")
    return Table(dict(zip(("frequency", "re", "im"), np.array(rows).T, strict=True)), name)


def _numbers(line: str) -> tuple[float, float, float] | None:
    """Return the first three numbers of a line of numbers, None for another line."""
    if len(line) > 10_000:
        return None
    if ";" in line or "\t" in line:
        cells = line.strip().replace(",", ".").replace(";", "\t").split("\t")
    else:
        cells = line.strip().replace(",", " ").split()
    try:
        a, b, c, *_ = (float(cell) if "_" not in cell else float("x") for cell in cells if cell.strip())
    except ValueError:
        return None
    return a, b, c
