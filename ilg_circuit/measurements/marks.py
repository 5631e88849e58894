"""Reads the tracks of several marks along a strip: one file a mark, or columns x1, y1, x2, y2, ... of one file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .kind import TRACK
from .read import read_columns
from .said import NOTHING, Said
from .segments import header_rows

#: x1_mm, x_2 [px]: what begins with x and a number.
_NUMBERED = re.compile(r"\s*x_?(\d{1,3})(?![\d.])", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Marks:
    """Tracks of m marks: times [s] and positions x, y [m] of each, the one nearest to the clamp first."""

    source: str
    times: tuple[Array, ...]
    x: tuple[Array, ...]
    y: tuple[Array, ...]

    def __post_init__(self) -> None:
        for t, x, y in zip(self.times, self.x, self.y, strict=True):
            if not (len(t) == len(x) == len(y) and len(t)) or not np.isfinite(np.concatenate([t, x, y])).all():
                raise InputError(f"{self.source}: give times, x and y of each mark, finite and as many of each")

    def __len__(self) -> int:
        return len(self.times)


def read_marks(paths: Sequence[str | Path], said: Said = NOTHING) -> Marks:
    """Return the marks of files, times without gaps; ``said.scale`` is a camera's pixel.

    Raises InputError for what cannot be read.
    """
    tracks = [track for path in paths for track in _tracks(Path(path), said)]
    if not tracks:
        raise InputError("no marks were given; give a file with time_s, x_mm, y_mm for each")
    times, x, y = zip(*tracks, strict=True)
    return Marks(", ".join(Path(path).name for path in paths), times, x, y)


def _tracks(path: Path, said: Said) -> list[tuple[Array, Array, Array]]:
    """Return time, x, y of each mark of a file."""
    numbered = _numbered(path)
    if not numbered:
        return [_track(path, said)]
    return [_track(path, replace(said, columns={**said.columns, "x": x, "y": y})) for x, y in numbered]


def _track(path: Path, said: Said) -> tuple[Array, Array, Array]:
    kind = replace(TRACK, ways=(("time", "x", "y"),))
    table = read_columns(path, kind.told(said))
    x, y = table.columns["x"], table.columns["y"]
    known = np.isfinite(x) & np.isfinite(y)
    if not known.any():
        raise InputError(f"{table.source}: no row has both x and y")
    return table.time[known], x[known], y[known]


def _numbered(path: Path) -> list[tuple[str, str]]:
    """Return the titles of x1 and y1, x2 and y2, ... in a file, by number; none where there are no such columns."""
    for titles in header_rows(path):
        found = {int(match[1]): title for title in titles if (match := _NUMBERED.match(title))}
        if found:
            return [(title, _beside(title, titles, path)) for _, title in sorted(found.items())]
    return []


def _beside(title: str, titles: list[str], path: Path) -> str:
    wanted = title.replace("x", "y", 1) if "x" in title else title.replace("X", "Y", 1)
    if wanted not in titles:
        raise InputError(f"{path.name}: there is a column '{title[:40]}' but none '{wanted[:40]}'")
    return wanted
