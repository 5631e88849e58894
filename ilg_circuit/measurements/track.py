"""Reads displacements from separate files, projects them on an axis and combines them with a record."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, argument
from ..findings import Finding
from ..units import format_quantity
from .columns import columns_table
from .kind import TRACK
from .prepare import LEAST_DISPLACEMENT
from .quality import dropouts, rest_drift
from .read import read_columns
from .record import Channel, Record
from .said import NOTHING, Said
from .saturation import saturated
from .smoothing import noise_level
from .table import Headers, Table

#: Least likelihood of a position, DeepLabCut's own default.
_LIKELY = 0.6
#: Number of first readings whose median is the level at rest, and least number of readings before a motion; least
#: deviation of a moving tip, in noise levels.
_FIRST, _FEWEST_AT_REST, _LEAVES = 5, 5, 6.0
#: Difference of the criteria -2 log(likelihood) from which on a rest, and a motion after it, is no smooth motion.
_BROKEN = 20.0
#: Largest rise of readings at rest, in noise levels.
_RISES = 3.0
#: Part of the rise that is extrapolated back to rest, as a fraction of the largest excursion.
_RISE = 0.3
_AXIS = re.compile(r"([-+]?)([xy])", re.IGNORECASE)
_ANGLE = re.compile(r"([-+]?\d{1,4}(?:\.\d{0,9})?) ?(deg|\u00b0|rad)?")
_REAL = 1e-9


@dataclass(frozen=True)
class Track:
    """A displacement over time: ``time`` [s] on the camera's clock and ``values`` [m], both (n,), without drop-outs."""

    source: str
    time: Array
    values: Array
    notes: tuple[Finding, ...] = ()
    headers: Headers = field(default_factory=dict)


def read_track(path: str | Path, said: Said = NOTHING) -> Track:
    """Read a separate file of a displacement: times or frames, and a displacement or coordinates x and y of a point.

    Parameters
    ----------
    path
        CSV, or a file of DeepLabCut, Tracker or Kinovea.
    said
        Statements that the file lacks: columns, units, ``scale``, frame ``rate``, ``axis``, ``point``.

    Raises
    ------
    InputError
        The file cannot be read, or scale, rate or axis do not apply to it; the message says what does.
    """
    return track_of(read_columns(path, TRACK.told(said)), said)


def track_data(columns: Mapping[str, ArrayLike], name: str = "displacement", said: Said = NOTHING) -> Track:
    """Return the track in ``columns``, arrays (n,) by headers. Raises InputError as `read_track` does."""
    return track_of(columns_table(columns, name, TRACK.told(said)), said)


def track_of(table: Table, said: Said = NOTHING) -> Track:
    """Return the track in the columns of a table. Raises InputError if rate or axis do not apply to it."""
    notes = list(table.notes)
    time = _times(table, said)
    likely = table.columns.get("likelihood")
    if likely is not None and (vague := ~(likely >= _LIKELY)).any():
        told = {"count": int(vague.sum()), "of": len(time), "least": _LIKELY}
        notes.append(Finding("track-uncertain", values=told))
        time = time[~vague]
        table = replace(table, columns={q: values[~vague] for q, values in table.columns.items()})
    values, about = _along(table, said.axis)
    notes += about
    missing, more = dropouts(values, "displacement", "m")
    time, values = time[~missing], values[~missing]
    if len(time) < LEAST_DISPLACEMENT:
        raise InputError(f"{table.source}: {len(time)} readings of the displacement; {LEAST_DISPLACEMENT} are needed")
    return Track(table.source, time, values, (*notes, *more), table.headers)


def _times(table: Table, said: Said) -> Array:
    """Return the times [s] of a table; frames are divided by their rate. Raises InputError if the rate is missing."""
    frames = table.columns.get("frame")
    if "time" in table.columns:
        if said.rate is not None:
            raise InputError(
                f"{table.source}: a frame rate was given, but the file has times; leave out {argument('fps')}"
            )
        return table.time
    assert frames is not None
    if said.rate is None:
        raise InputError(f"{table.source}: has frames and no times; give the camera's rate: {argument('fps', 25)}")
    if not (math.isfinite(said.rate) and said.rate > 0):
        raise InputError(
            f"{table.source}: the frame rate is {said.rate:g}; give frames per second, such as {argument('fps', 25)}"
        )
    back = np.flatnonzero(~(np.diff(frames) > 0))
    if len(back):
        raise InputError(f"{table.source}: frame {frames[back[0] + 1]:g} follows {frames[back[0]]:g}; sort the file")
    return frames / said.rate


def _along(table: Table, axis: str | None) -> tuple[Array, list[Finding]]:
    """Return displacements (n,) along an axis, and a finding on the direction where none was given."""
    columns = table.columns
    if "displacement" in columns:
        if axis is not None:
            raise InputError(
                f"{table.source}: {argument('axis')} is for coordinates x and y; the file has a displacement"
            )
        return columns["displacement"], []
    there = [name for name in ("x", "y") if name in columns]
    if axis is None and len(there) == 1:
        return columns[there[0]], []
    if axis is None:
        return _principal(columns["x"], columns["y"])
    plain = _AXIS.fullmatch(axis.strip())
    if plain:
        name = plain[2].lower()
        if name not in there:
            raise InputError(f"{table.source}: {argument('axis', axis)}: the file has no column {name}")
        return (-columns[name] if plain[1] == "-" else columns[name]), []
    if len(there) < 2:
        raise InputError(f"{table.source}: {argument('axis', axis)} needs columns x and y")
    turned = _ANGLE.fullmatch(axis.strip())
    if not turned:
        raise InputError(f"{argument('axis', axis[:20])}: write x, y, -x, -y or an angle from x to y, such as 30deg")
    angle = float(turned[1]) if turned[2] == "rad" else math.radians(float(turned[1]))
    return math.cos(angle) * columns["x"] + math.sin(angle) * columns["y"], []


def _principal(x: Array, y: Array) -> tuple[Array, list[Finding]]:
    """Return positions along the direction of largest variance, positive at first, and a finding on the direction."""
    known = np.isfinite(x) & np.isfinite(y)
    if known.sum() < 2:
        return np.where(known, x, np.nan), []
    points = np.column_stack([x, y])[known]
    middle = np.median(points, axis=0)
    _, sizes, directions = np.linalg.svd(points - middle, full_matrices=False)
    along = directions[0]
    values = (np.column_stack([x, y]) - middle) @ along
    moved = values[known] - np.median(values[known][: max(int(known.sum()) // 50, 1)])
    if moved[np.argmax(np.abs(moved))] < 0:
        along, values = -along, -values
    angle = math.degrees(math.atan2(along[1], along[0]))
    across = float(sizes[1] / sizes[0]) if sizes[0] else 0.0
    return values, [Finding("track-axis", values={"angle": angle, "across": across})]


def with_track(record: Record, track: Track) -> Record:
    """Return a record with the displacement of a separate file, whose time 0 is where the tip begins to move.

    If the tip is not at rest first, time 0 is the first reading; a fit then determines the delay.

    Raises
    ------
    InputError
        The record already has a displacement, or the track is too short.
    """
    if record.displacement is not None:
        raise InputError(f"{record.source}: already has a displacement; leave out {track.source}, or that column")
    channel, notes = moving(track)
    length = next((track.headers[q] for q in ("displacement", "x", "y") if q in track.headers), None)
    headers = {**record.headers, "displacement": length} if length else record.headers
    about = tuple(note.about(track.source) for note in notes)
    return replace(record, displacement=channel, own_clock=True, notes=(*record.notes, *about), headers=headers)


def moving(track: Track) -> tuple[Channel, tuple[Finding, ...]]:
    """Return a track as a channel whose time 0 is where the tip begins to move, and findings on it.

    Raises InputError if too few readings remain from there on.
    """
    zero, rests = beginning(track.time, track.values)
    time = track.time - zero
    rest = track.values[time < 0]
    values = track.values - (float(np.median(rest)) if len(rest) else float(track.values[0]))
    stuck, limits = saturated(time, values)
    channel = Channel(time, values, zero=zero).without(stuck)
    if int((channel.time >= 0).sum()) < LEAST_DISPLACEMENT:
        raise InputError(
            f"{track.source}: {int((channel.time >= 0).sum())} readings from where the tip begins to move, at "
            f"{format_quantity(zero, 's', 4)} of its clock; {LEAST_DISPLACEMENT} are needed"
        )
    notes = [*track.notes, *limits, *rest_drift(channel, "displacement", "m")]
    if not rests and not _seems_at_rest(track.time, track.values):
        notes.append(Finding("track-without-rest"))
    return channel, tuple(notes)


def beside(files: Sequence[Any], tracks: Sequence[Track]) -> list[Any]:
    """Return the files with a track in each record. Raises InputError if records and tracks differ in number."""
    records = [k for k, file in enumerate(files) if isinstance(file, Record)]
    if len(tracks) != len(records):
        raise InputError(
            f"{len(records)} records and {len(tracks)} displacements were given; give one displacement for each record"
        )
    of = dict(zip(records, tracks, strict=True))
    return [with_track(file, of[k]) if k in of else file for k, file in enumerate(files)]


def beginning(t: Array, values: Array) -> tuple[float, bool]:
    """Return the time [s] at which a tip begins to move, and whether it is at rest until then.

    The first part of the rise is extrapolated back to the level at rest by a parabola. Without readings at rest, or
    where they may as well be the beginning of one smooth motion, it is the time of the first reading.
    """
    noise = noise_level(values)
    first, span = _leaving(values, noise)
    if first < _FEWEST_AT_REST or _moves(t[:first], values[:first], noise):
        return float(t[0]), False
    level = float(np.median(values[:first]))
    reached = np.abs(values - level) > max(_RISE * span, 2 * _LEAVES * noise)
    last = max(int(np.argmax(reached)), first + 2) if reached.any() else len(values)
    zero = _back(t, values - level, first, last)
    return (zero, True) if _breaks(t[: last + 1], values[: last + 1], zero) else (float(t[0]), False)


def _leaving(values: Array, noise: float) -> tuple[int, float]:
    """Return the index of the first reading that leaves the first few beyond the ``noise``, 0 if none, and the span."""
    level = float(np.median(values[:_FIRST]))
    span = float(np.abs(values - level).max())
    out = np.abs(values - level) > max(_LEAVES * noise, 1e-3 * span)
    stays = out & np.append(out[1:], True)  # a single reading is an outlier
    return int(np.argmax(stays)), span


def _seems_at_rest(t: Array, values: Array) -> bool:
    """Return True if enough first readings do not move beyond their noise, though a slow motion may."""
    noise = noise_level(values)
    first, _ = _leaving(values, noise)
    return first >= 2 * _FEWEST_AT_REST and not _moves(t[:first], values[:first], noise)


def _back(t: Array, moved: Array, first: int, last: int) -> float:
    """Return the time [s] to which a parabola through the readings ``first`` to ``last`` leads back to 0."""
    x, y = t[first : last + 1] - t[first], moved[first : last + 1]
    if len(x) >= 3:
        order = 2 if len(x) > 5 else 1
        roots = np.roots(np.polyfit(x, y, order))
        before = [r.real for r in np.atleast_1d(roots) if abs(r.imag) < _REAL and -3 * x[-1] <= r.real <= 0]
        if before:
            return float(max(t[first] + max(before), t[0]))
    return float(t[first])


def _breaks(t: Array, values: Array, zero: float) -> bool:
    """Return True if readings (n,) are a level up to ``zero`` [s] and a parabola from there, and by far no cubic.

    Both have four constants. A tip that moves from the first reading on, only slowly at first, has no such break.
    """
    x = (t - zero) / float(t[-1] - t[0])
    later = np.maximum(x, 0.0)
    broken, smooth = (
        float(np.sum((values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]) ** 2))
        for terms in (np.column_stack([np.ones(len(x)), later, later**2]), np.vander(x, 4))
    )
    return smooth > broken * float(np.exp(_BROKEN / len(x)))


def _moves(t: Array, values: Array, noise: float) -> bool:
    """Return True if readings before a motion already move: a line through their first half rises beyond the noise."""
    half = max(len(t) // 2, 2)
    line = np.polynomial.Polynomial.fit(t[:half], values[:half], 1)
    return abs(float(line(t[half - 1]) - line(t[0]))) > _RISES * noise * max(np.sqrt(12 / half), 0.5)
