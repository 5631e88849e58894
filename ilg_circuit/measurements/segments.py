"""Reads columns of a strip's segments: their voltages, or a shape that they shall follow."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .kind import RECORD, Quantities
from .read import read_columns
from .said import NOTHING, Said

#: Columns of one quantity: times [s] and values [SI], both (n,).
Rows = tuple[Array, Array]

_HEADER_LINES = 400
#: voltage_1_V, voltage_12 [V]: what begins with a quantity and the number of a segment.
_NUMBERED = {q: re.compile(rf"\s*{q}_(\d{{1,3}})(?![\d.])", re.IGNORECASE) for q in ("voltage", "curvature")}
#: Quantities of a shape without a number.
_WHOLE: Quantities = {
    "displacement": RECORD.quantities["displacement"],
    "angle": ("rad", ("angle", "tip_angle", "theta")),
}


def header_rows(path: Path, lines: int = _HEADER_LINES) -> Iterator[list[str]]:
    """Yield the cells of the first lines of a text file; none of one that cannot be read."""
    try:
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            for _, line in zip(range(lines), file, strict=False):
                delimiter = next((mark for mark in ("\t", ";") if mark in line), ",")
                yield [title.strip() for title in next(csv.reader([line], delimiter=delimiter), [])]
    except (OSError, csv.Error):
        return  # the reader says what is wrong


def read_voltages(path: str | Path, said: Said = NOTHING) -> dict[str, Rows]:
    """Return the voltages [V] of segments, by their numbers, from the columns voltage_1_V, voltage_2_V, ... of a file.

    Empty for a file without such columns. Raises InputError for a file that cannot be read.
    """
    numbers = _numbers(Path(path), "voltage")
    found = _read(path, {f"voltage_{k}": ("V", (f"voltage_{k}",)) for k in numbers}, said) if numbers else {}
    return {name.removeprefix("voltage_"): rows for name, rows in found.items()}


def read_shape(path: str | Path, said: Said = NOTHING) -> dict[str, Rows]:
    """Return what a file says of a shape over time: displacement [m], angle [rad], curvature_1 [1/m], curvature_2, ...

    Raises InputError for a file that cannot be read, or holds none of these.
    """
    numbers = _numbers(Path(path), "curvature")
    found = _read(path, {f"curvature_{k}": ("1/m", (f"curvature_{k}",)) for k in numbers} | _WHOLE, said)
    if not found:
        raise InputError(
            f"{Path(path).name}: no column is that of a shape; give time_s and curvature_1_1/m, curvature_2_1/m, ... "
            "(one a segment), or displacement_mm, or angle_rad"
        )
    return found


def _numbers(path: Path, quantity: str) -> list[int]:
    """Return the numbers in the titles of a quantity, ascending."""
    for titles in header_rows(path):
        found = {int(match[1]) for title in titles if (match := _NUMBERED[quantity].match(title))}
        if found:
            return sorted(found)
    return []


def _read(path: str | Path, quantities: Quantities, said: Said) -> dict[str, Rows]:
    """Return the columns of a file that are there, gaps left out."""
    example = "time_s, " + ", ".join(f"{name}_{unit}" for name, (unit, _) in list(quantities.items())[:2])
    whole = {"time": RECORD.quantities["time"]} | quantities
    kind = replace(RECORD.drawn("time"), quantities=whole, used=tuple(quantities), example=example)
    table = read_columns(path, kind.told(said))
    found: dict[str, Rows] = {}
    for name in quantities:
        values = table.get(name)
        if values is not None:
            known = np.isfinite(values)
            found[name] = table.time[known], values[known]
    return found
