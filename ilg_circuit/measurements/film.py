"""Films: a displacement alone, with a drive that is stated and not measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import plain
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..findings import Finding, sentences
from ..result import Column, Result
from ..units import format_quantity
from .columns import columns_table
from .kind import RECORD, TRACK, Kind
from .prepare import step_level
from .read import read_columns
from .record import Channel
from .said import NOTHING, Said
from .table import Headers, Table
from .track import Track, moving, track_of
from .voltage import MeasuredDrive

#: Largest time by which a drive may end before the film, in sampling intervals.
_SHORTER = 2.5
#: Quantities that a file of a displacement alone does not have.
_ELECTRICAL = ("voltage", "current")


@dataclass(frozen=True, repr=False, eq=False)
class Film(Result):
    """A displacement on a separate clock, ready for a fit, and the drive that is stated for it.

    The drive's voltage begins to change at ``onset`` [s] of the drive's time; ``voltage`` is the drive from there on,
    ``step`` [V] its level if it is constant. The displacement's time 0 is where the tip begins to move; its clock
    reads ``delay`` [s] more than the drive's, if that is known.
    """

    presenter: ClassVar[str] = "measured"

    source: str
    onset: float
    voltage: MeasuredDrive
    step: float | None
    displacement: Channel
    notes: tuple[Finding, ...] = ()
    headers: Headers = field(default_factory=dict)
    delay: float | None = None

    own_clock: ClassVar[bool] = True

    @property
    def drive(self) -> PiecewiseLinear:
        """The voltage over time since its onset at 0."""
        return self.voltage.drive

    @property
    def duration(self) -> float:
        """Time from the beginning of the tip's motion to the last reading [s]."""
        return float(self.displacement.time[-1])

    @property
    def warnings(self) -> tuple[str, ...]:
        """The notes as sentences."""
        return sentences(self.notes)

    def table(self) -> tuple[Column, ...]:
        """Return the time since the tip begins to move [s] (n,) and the displacement from its rest."""
        moved = self.displacement
        return Column("time", moved.time, "s", over=True), Column("displacement", moved.values, "m")

    def to_dict(self) -> dict[str, Any]:
        """Return the film as plain data, lists by header."""
        readings = {header: plain(values) for header, values in self.columns().items()}
        about = {"source": self.source, "drive": self.drive.text, "step_V": self.step}
        return about | {"readings": readings, "warnings": list(self.warnings)}


def read_film(path: str | Path, said: Said = NOTHING, *, drives: bool = False) -> Track:
    """Read the displacement of a file without voltage and current; with ``drives`` the file may hold the drive too.

    Raises
    ------
    InputError
        The file cannot be read, or holds a voltage or a current too.
    """
    table = read_columns(path, _kind(said))
    return track_of(table, said) if drives else _alone(table, said)


def film_data(columns: Mapping[str, ArrayLike], name: str, said: Said = NOTHING) -> Track:
    """Return the displacement in ``columns``, arrays (n,) by headers. Raises InputError as `read_film` does."""
    return _alone(columns_table(columns, name, _kind(said)), said)


def _kind(said: Said) -> Kind:
    electrical = {q: RECORD.quantities[q] for q in _ELECTRICAL}
    return replace(TRACK, quantities={**TRACK.quantities, **electrical}, prefix="").told(said)


def _alone(table: Table, said: Said) -> Track:
    there = [q for q in _ELECTRICAL if q in table.columns]
    if there:
        title = table.headers[there[0]][0] if there[0] in table.headers else there[0]
        way = f"leave {argument('drive')} out" if len(there) > 1 else "it is no displacement alone"
        if there == ["voltage"]:
            way = f"say so, {argument('drive', f'file:{table.source}')}, or leave that column out"
        raise InputError(f"{table.source}: has a {there[0]} of its own ('{title}'), which holds: {way}")
    return track_of(table, said)


def film_of(track: Track, drive: PiecewiseLinear, ends: float | None = None, until: float | None = None) -> Film:
    """Return the film of a track under a ``drive``; their clocks need not agree.

    Parameters
    ----------
    track
        The displacement, on the camera's clock.
    drive
        The voltage over time; the strip rests before it.
    ends
        Time [s] at which the drive's rows end, if it is made of rows.
    until
        Time [s] since the onset up to which the displacement is used (default: all).

    Raises
    ------
    InputError
        The drive is constant throughout or ends before the displacement, or there are too few readings.
    """
    begins = _begins(drive, track.source)
    channel, notes = moving(track)
    last = float(channel.time[-1]) if until is None else min(until, float(channel.time[-1]))
    interval = float(np.median(np.diff(channel.time)))
    if ends is not None and last > ends - begins + _SHORTER * interval:
        shown = [format_quantity(x, "s", 4) for x in (ends - begins, last)]
        raise InputError(
            f"{track.source}: the drive, {drive.text}, ends {shown[0]} after its onset, and the displacement goes on "
            f"to {shown[1]}: give the whole drive, or {argument('until', shown[0].replace(' ', ''))}"
        )
    shifted = _since(drive, begins)
    told = [note for note in drive.findings if note.code not in ("drive-held-after", "drive-held-before")]
    return Film(
        source=track.source,
        onset=begins,
        voltage=MeasuredDrive(shifted, np.zeros(1)),
        step=step_level(shifted),
        displacement=channel,
        notes=(*notes, *told),
        headers=track.headers,
    )


def _begins(drive: PiecewiseLinear, name: str) -> float:
    """Return the time [s] up to which a drive rests. Raises InputError for a constant drive."""
    moved = np.flatnonzero(drive.values != drive.rest)
    if not len(moved):
        level = format_quantity(drive.rest, "V", 3)
        raise InputError(f"{name}: the drive, {drive.text}, stays at {level}: nothing moves the strip")
    k = int(moved[0])
    return float(max(drive.times[k - 1], 0.0)) if k else 0.0


def _since(drive: PiecewiseLinear, begins: float) -> PiecewiseLinear:
    """Return a drive with time 0 at the end of its rest, ``begins`` [s]."""
    after = drive.times > begins
    times = np.append(0.0, drive.times[after] - begins)
    values = np.append(drive.value([begins]), drive.values[after])
    return replace(drive, times=times, values=values, findings=())
