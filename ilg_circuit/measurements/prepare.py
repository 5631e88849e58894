"""Prepares a record: finds the onset and the drive, the rest before it, and the samples to keep."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..findings import Finding
from ..units import format_quantity
from .forced import AnsweredDrive, as_set, forces_current
from .lost import mended
from .onset import Beginning, Bracket, Onset, Stated, answer_bracket, find_onset
from .quality import blanks, clipped_tops, current_drift, dropouts, rest_drift
from .record import Channel, Forced, Record
from .saturation import saturated
from .smoothing import noise_level
from .table import Table
from .voltage import MeasuredDrive, answers_noise, measured_drive

#: Smallest plausible nonzero reading, in SI units.
_LEAST_READING = 1e-30
#: Least numbers of samples after the onset for a fit.
LEAST_CURRENT, LEAST_DISPLACEMENT = 10, 20
#: Least number of samples before the onset that determines the instrument's offset.
LEAST_REST = 5
#: Least change of a run's drive, as a fraction of its largest value, by which it determines an offset.
_LEVELS = 0.05
#: Readings at rest stand before the onset by at least this time [s], relative to the record.
_BEFORE = 1e-12


def prepare(table: Table, onset: Stated = None) -> Record:
    """Return the record in a table: find the onset and the jumps of the drive, and drop invalid samples.

    ``table`` has the columns ``time``, ``voltage``, ``current`` and, if measured, ``displacement``. ``onset`` is its
    time [s] in the file if that is known, or the reading at that time: "last-rest" or "first-level".

    Raises
    ------
    InputError
        Nothing was excited (no step or other change of the voltage), or there are too few samples after it.
    """
    if forces_current(table):
        return _forced(table, onset)
    name, notes = table.source, list(table.notes)
    voltage = table.columns["voltage"]
    notes += _blanks(table)
    known = np.isfinite(voltage)
    if known.sum() < 2:
        raise InputError(f"{name}: the voltage column has fewer than two numbers")
    time, u = table.time[known], voltage[known]
    largest = float(np.abs(u).max())
    if 0 < largest < _LEAST_READING:
        raise InputError(f"{name}: the voltage is {largest:g} V at most; check its unit")
    if table.get("current") is None:
        raise InputError(f"{name}: the current column has no number in it")
    found = find_onset(time, u, table.columns["current"][known], name, onset)
    mend = mended(table, found)
    if mend.notes:
        if mend.late and isinstance(onset, float) and found.between[0] <= onset <= found.between[1]:
            onset = None  # the voltage's onset is not the time of contact
        table = mend.table
        notes += mend.notes
        known = np.isfinite(table.columns["voltage"])
        time, u = table.time[known], table.columns["voltage"][known]
        _require_enough(table, found.between[1] + mend.late, mend.end)
        found = find_onset(time, u, table.columns["current"][known], name, onset)
    if len(u) - found.first < 2:
        raise InputError(f"{name}: the voltage changes at the last reading only; nothing was recorded after it")
    drive = _drive(table, time, u, found)
    if drive.noise > 1e-9 * largest:
        notes.append(Finding("voltage-noise-averaged", values={"noise": drive.noise}))
    current, late = _current(table, found, drive.drive)
    notes += late
    noise = noise_level(current.values)
    at_limit, clipped = clipped_tops(current.time, current.values, drive.drive, noise, found.beginning)
    current = current.without(at_limit)
    notes += clipped
    count = int((~current.rest).sum())
    if count < LEAST_CURRENT:
        at = f"the onset at {found.time:g} s"
        raise InputError(f"{name}: {count} current samples after {at}; {LEAST_CURRENT} are needed")
    _require_response(current, drive.drive, name)
    if found.beginning == "run":
        notes.append(Finding("begins-within-run"))
    elif found.beginning == "step" and not found.first:
        notes.append(Finding("onset-assumed", values={"at": found.time}))
    if not tells_offset(current, drive.drive, found.beginning):
        notes.append(Finding("offset-assumed"))
    step = step_level(drive.drive)
    if step is not None:
        notes += current_drift(current, step - found.rest)
    displacement, missing = _displacement(table, found, mend.late)
    notes += missing
    if displacement is not None and (~displacement.rest).sum() < LEAST_DISPLACEMENT:
        notes.append(Finding("displacement-too-short", values={"needed": LEAST_DISPLACEMENT}))
        displacement = None
    unknown = [title for title in table.ignored if title]
    if unknown:
        notes.append(Finding("columns-ignored", values={"columns": unknown}))
    return Record(name, found.time, drive, step, current, displacement, tuple(notes), found.beginning)


def _forced(table: Table, onset: Stated) -> Record:
    """Return the record of a table whose current was controlled: the same steps with the two quantities exchanged."""
    name, notes = table.source, [*table.notes, Finding("current-controlled"), *_blanks(table)]
    exchanged = replace(table, columns={**table.columns} | dict(zip(_EXCHANGED, _both(table), strict=True)))
    known = np.isfinite(exchanged.columns["voltage"])
    time, forced = table.time[known], exchanged.columns["voltage"][known]
    found = find_onset(time, forced, exchanged.columns["current"][known], name, onset)
    before = forced[: found.first]
    if abs(found.rest) <= _NO_CURRENT * noise_level(forced) / np.sqrt(max(len(before), 1)):
        found = replace(found, rest=0.0)  # open terminals, read with noise
    drive = _drive(exchanged, time, forced, found)
    drive = replace(drive, drive=as_set(drive.drive, noise_level(forced)))
    answers = np.isfinite(exchanged.columns["current"])
    voltage = _channel(table.time[answers], exchanged.columns["current"][answers], found, found.between)
    count = int((~voltage.rest).sum())
    if count < LEAST_CURRENT:
        raise InputError(
            f"{name}: {count} samples of the voltage after the onset at {found.time:g} s; {LEAST_CURRENT} are needed"
        )
    if found.beginning == "run":
        notes.append(Finding("begins-within-run"))
    elif found.beginning == "step" and not found.first:
        notes.append(Finding("onset-assumed", values={"at": found.time}))
    displacement, missing = _displacement(table, found)
    if displacement is not None and (~displacement.rest).sum() < LEAST_DISPLACEMENT:
        missing = [*missing, Finding("displacement-too-short", values={"needed": LEAST_DISPLACEMENT})]
        displacement = None
    unknown = [title for title in table.ignored if title]
    if unknown:
        missing = [*missing, Finding("columns-ignored", values={"columns": unknown})]
    current = _channel(time, forced, found, found.between)
    measured = AnsweredDrive.of(drive, voltage)
    notes = [*notes, *missing]
    return Record(
        name, found.time, measured, None, current, displacement, tuple(notes), found.beginning,
        forced=Forced(drive, voltage),
    )  # fmt: skip


#: A current at rest is none if it is no more than this many standard errors.
_NO_CURRENT = 4.0
#: The columns that a controlled current exchanges.
_EXCHANGED = ("voltage", "current")


def _blanks(table: Table) -> list[Finding]:
    """Return findings on the rows without a voltage or without a current that the reader has not told of."""
    marked = [note for note in table.notes if note.code in ("overloaded", "readings-marked")]
    told = [(note.values.get("quantity", "current"), note.values["count"]) for note in marked]
    return [
        note
        for column in _EXCHANGED
        for note in blanks(table.columns[column], column, sum(count for of, count in told if of == column))
    ]


def _both(table: Table) -> tuple[Array, Array]:
    return table.columns["current"], table.columns["voltage"]


def _require_enough(table: Table, onset: float, end: str) -> None:
    """Raise InputError if too few samples of a record remain before its ``end``."""
    count = int((np.isfinite(table.columns["current"]) & (table.time >= onset)).sum())
    if end and count < LEAST_CURRENT:
        raise InputError(
            f"{table.source}: {end}, with {count} current samples between the onset at {onset:g} s and that; "
            f"{LEAST_CURRENT} are needed: look at the clamp and its leads, and measure again"
        )


def _drive(table: Table, time: Array, u: Array, onset: Onset) -> MeasuredDrive:
    """Return the measured voltage as a drive, with the resolution that the current requires."""
    known = np.isfinite(table.columns["voltage"]) & np.isfinite(table.columns["current"])
    current, v = table.columns["current"][known], table.columns["voltage"][known]
    span = float(np.abs(v - onset.rest).max())
    conductance = float(np.abs(current - np.median(current)).max()) / span if span else 0.0
    answered = answers_noise(table.time[known], v, current, conductance)
    return measured_drive(time, u, onset, conductance, noise_level(current), answered)


def _current(table: Table, onset: Onset, drive: PiecewiseLinear) -> tuple[Channel, list[Finding]]:
    """Return the current, with time 0 at its response to the voltage's jump, and findings on its delay."""
    values = table.columns["current"]
    known = np.isfinite(values)
    t, v = table.time[known], values[known]
    jumps = drive.jumps(np.inf)
    until = onset.time + float(jumps[0]) if len(jumps) else np.inf
    found = answer_bracket(t, v, onset, until)
    between, rows = found or (onset.between, 0)
    if onset.stated is not None and not any(a <= onset.stated <= b for a, b in (between, onset.between)):
        between_rows = f"{format_quantity(between[0], 's', 6)} and {format_quantity(between[1], 's', 6)}"
        raise InputError(
            f"{table.source}: {argument('onset')} {format_quantity(onset.stated, 's', 6)} is excluded by the readings: "
            f"the current begins to answer between {between_rows}"
        )
    if not rows:
        return _channel(t, v, onset, between), []
    late = between[1] - onset.between[1]
    code = {1: "current-one-row-late", -1: "current-one-row-early"}.get(rows, "current-late")
    about = {"late": late, "rows": rows, "from": between[0], "to": between[1]}
    return _channel(t, v, replace(onset, first=max(onset.first, 1)), between), [Finding(code, values=about)]


def _channel(t: Array, values: Array, onset: Onset, between: Bracket) -> Channel:
    """Return readings at ``t`` [s] in the file as a channel whose response begins ``between`` two of them.

    Time 0 is the onset if it is known, else the middle of the bracket.
    """
    bracket = onset.bracket(between)
    middle = sum(bracket) / 2
    time = t - middle
    if onset.first:  # the last reading at rest may stand at the onset itself
        before = t <= between[0]
        time[before] = np.minimum(time[before], -_BEFORE * max(float(t[-1] - t[0]), 1e-300))
    return Channel(time, values, (bracket[0] - middle, bracket[1] - middle), middle)


def tells_offset(channel: Channel, drive: PiecewiseLinear, beginning: Beginning) -> bool:
    """Return True if readings of a ``channel`` at rest determine its offset, or the levels of a run's drive do."""
    levels = float(np.ptp(drive.values)) > _LEVELS * float(np.abs(drive.values).max())
    return channel.at_rest.count >= LEAST_REST or (beginning == "run" and levels)


def step_level(drive: PiecewiseLinear) -> float | None:
    """Return the level of a step, whose voltage stays within 5 % of its height; None for another drive."""
    start = float(drive.values[0])
    height = start - drive.rest
    return start if height and float(np.abs(drive.values - start).max()) <= 0.05 * abs(height) else None


def _displacement(table: Table, onset: Onset, late: float = 0.0) -> tuple[Channel | None, list[Finding]]:
    """Return the displacement without its drop-outs, and findings on it.

    Where the current is ``late`` [s], nothing tells whether the strip moved from the voltage's jump or from the
    current's on: readings between them are left out, being neither at rest nor after the onset.
    """
    values = table.get("displacement")
    if values is None:
        return None, []
    missing, notes = dropouts(values, "displacement", "m")
    channel = _channel(table.time[~missing], values[~missing], onset, onset.between)
    stuck, limits = saturated(channel.time, channel.values)
    channel = channel.without(stuck)
    if late:
        channel = channel.without(channel.rest & (channel.time > -late - channel.width))
    return channel, [*notes, *limits, *rest_drift(channel, "displacement", "m")]


def _require_response(current: Channel, drive: PiecewiseLinear, name: str) -> None:
    """Raise InputError for a record without a transient: the voltage is constant and the current does not change."""
    if float(np.abs(current.values).max()) < _LEAST_READING:
        raise InputError(f"{name}: no step in the record: the current is zero throughout")
    if step_level(drive) is None:
        return
    if _steady(current.until(np.inf)):
        raise InputError(
            f"{name}: no step in the record: the voltage is constant and the current does not change; "
            "record from before the step on"
        )


def _steady(current: Channel) -> bool:
    """Return True if the current at the end equals the current at the onset, apart from noise."""
    after = current.values[~current.rest]
    edge = max(len(after) // 20, 3)
    if len(after) < 2 * edge:
        return False
    change = abs(float(after[:edge].mean() - after[-edge:].mean()))
    return bool(change <= 4 * noise_level(after) / np.sqrt(edge) + 1e-12 * float(np.abs(after).max()))
