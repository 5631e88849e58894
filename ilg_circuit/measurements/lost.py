"""Removes the readings of a record that a lost, late or reversed contact has spoilt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..findings import Finding
from ..units import format_quantity
from .contact import Break, Seen, breaks, runs, seen
from .jumps import voltage_jumps
from .onset import Onset, answer_bracket
from .passive import PassivePort
from .table import Table

#: Largest reading of a lost voltage, and least voltage before and after it, as fractions of the largest voltage.
_NO_VOLTAGE, _VOLTAGE = 0.02, 0.2
#: Least change of the current at a real jump of the voltage, as a fraction and in noise levels.
_ANSWERED, _SEEN = 0.25, 8.0
#: Largest change of the current while a voltage is lost, as a fraction of the largest current.
_STILL = 0.1
#: Largest fraction of readings of an open clamp with which a lost voltage can be found.
_IDLE = 0.2
#: Difference below which two levels are the same, as a fraction of the largest voltage.
_SAME = 0.05
#: Largest ratio of the residuals with the current reversed to the residuals as measured, if the sign is wrong.
_REVERSED = 0.5
#: Standard errors within which the mean current of an open clamp equals its level.
_LEVEL = 4.0
#: Least number of readings without current after the voltage's jump for a late contact; one may be a clock's delay.
_LATE = 2
#: Largest number of breaks whose times are listed.
_NAMED = 6


@dataclass(frozen=True)
class Mended:
    """A table without readings spoilt by contacts: the voltage rests until contact is made, rows end where it is lost.

    ``late`` [s] is the delay of contact after the voltage's onset ``between`` two readings, 0 without delay; ``end`` is
    the reason why later rows were dropped, if any.
    """

    table: Table
    notes: tuple[Finding, ...] = ()
    late: float = 0.0
    end: str = ""


def mended(table: Table, onset: Onset) -> Mended:
    """Return a table without readings spoilt by lost and late contacts; ``onset`` is the onset of its voltage.

    Raises
    ------
    InputError
        The current's sign is reversed.
    """
    s = _seen(table, onset)
    if len(s.t) < 2 or not s.largest:
        return Mended(table)
    _require_forward(table, s)
    found = Mended(table)
    for first, back in _voltage_lost(s):
        found = _without_voltage(found, s, first, back)
    if found.notes:
        s = _seen(found.table, onset)
    lost = breaks(s)
    made = _made_late(s, onset, lost)
    if made:
        found = _from_contact(found, s, onset, made)
    lost = [b for b in lost if b.first > s.onset + 1]
    return _until_lost(found, s, lost) if lost else found


def _seen(table: Table, onset: Onset) -> Seen:
    u, i = table.columns["voltage"], table.columns["current"]
    known = np.isfinite(u) & np.isfinite(i)
    return seen(table.time[known], u[known], i[known], onset)


def _require_forward(table: Table, s: Seen) -> None:
    """Raise InputError if the current is a passive strip's with the sign reversed."""
    rest, offset = (float(np.median(x[: s.onset])) if s.onset else 0.0 for x in (s.u, s.i))
    v, j = s.u - rest, s.i - offset
    energy = float(np.trapezoid((v * j)[s.onset :], s.t[s.onset :]))
    at = int(np.argmax(np.abs(j)))
    if energy >= 0 and v[at] * j[at] >= 0:
        return
    port = s.port()
    forward, reverse = (port.fit(sign * s.i, s.sound).rms for sign in (1.0, -1.0))
    if reverse > _REVERSED * min(forward, float(s.i.std())):
        return
    title = table.headers["current"][0] if "current" in table.headers else "current"
    raise InputError(
        f"{table.source}: the sign of the current (column '{title}') is reversed: from {s.t[s.onset]:.6g} s on it "
        "flows against the voltage; no strip gives back more energy than it took: turn its leads, or the column's sign"
    )


def _voltage_lost(s: Seen) -> list[tuple[int, int | None]]:
    """Return the stretches of lost voltage: first reading of zero without a change of current, next good reading."""
    largest = float(np.abs(s.u).max())
    low, high = np.abs(s.u) <= _NO_VOLTAGE * largest, np.abs(s.u) > _VOLTAGE * largest
    found: list[tuple[int, int | None]] = []
    port: PassivePort | None = None
    for a, b in runs(low):
        if a <= s.onset + 3 or not high[a - 1] or (b < len(low) and not high[b]):
            continue
        if any(s.near(level)[a - 1 : b].mean() > _IDLE for level in s.levels):
            continue
        port = port or s.port()
        expected = port.fit(s.i, s.sound & (np.arange(len(s.t)) < a)).current
        answer = abs(float(expected[a] - expected[a - 1]))
        around = s.i[max(a - 2, 0) : a + 2]
        unanswered = min(_ANSWERED * answer, _STILL * s.largest) + _SEEN / 2 * s.noise
        if answer > _SEEN * s.noise and float(np.ptp(around)) < unanswered:
            found.append((a, b if b < len(low) else None))
    return found


def _without_voltage(found: Mended, s: Seen, first: int, back: int | None) -> Mended:
    """Return the table without a lost voltage: held if its level is the same afterwards, else cut off."""
    time = found.table.time
    about = {"quantity": "voltage", "from": float(s.t[first - 1]), "to": float(s.t[-1 if back is None else back])}
    same = back is not None and abs(s.u[back] - s.u[first - 1]) <= _SAME * float(np.abs(s.u).max())
    if not same:
        if time[-1] < s.t[first]:
            return found  # cut off already
        end = f"the voltage is lost from {format_quantity(float(s.t[first - 1]), 's', 6)} on"
        return replace(
            found,
            table=_rows(found.table, s.t[first]),
            notes=(*found.notes, Finding("voltage-lost", values=about)),
            end=end,
        )
    assert back is not None
    blank = (time >= s.t[first]) & (time < s.t[back])
    voltage = np.where(blank, np.nan, found.table.columns["voltage"])
    table = replace(found.table, columns={**found.table.columns, "voltage": voltage})
    about["level"] = float(s.u[first - 1])
    return replace(found, table=table, notes=(*found.notes, Finding("voltage-lost-held", values=about)))


def _made_late(s: Seen, onset: Onset, lost: list[Break]) -> int:
    """Return the first reading of a current that began late, else 0."""
    if lost and lost[0].first <= s.onset + 1 and lost[0].back is not None:
        moved = np.abs(s.u[s.onset : max(lost[0].back - _LATE, s.onset)] - onset.rest)
        return lost[0].back if moved.max(initial=0.0) > _NO_VOLTAGE * float(np.abs(s.u).max()) else 0
    jumps = s.t[voltage_jumps(s.u) + 1]
    later = jumps[jumps > onset.between[1]]
    answer = answer_bracket(s.t, s.i, onset, float(later[0]) if len(later) else np.inf)
    if answer is None or answer[1] < _LATE:
        return 0
    made = int(np.searchsorted(s.t, answer[0][1]))
    before = float(s.i[s.onset : made].mean())
    error = s.noise / np.sqrt(made - s.onset)
    return made if min(abs(before - level) for level in s.levels) <= _LEVEL * error else 0


def _from_contact(found: Mended, s: Seen, onset: Onset, made: int) -> Mended:
    """Return the table with the voltage at rest until contact was made at reading ``made``."""
    columns = found.table.columns
    voltage = np.where(found.table.time < s.t[made], onset.rest, columns["voltage"])
    table = replace(found.table, columns={**columns, "voltage": voltage})
    late = float(s.t[made] - onset.between[1])
    about = {"late": late, "rows": made - s.onset, "from": float(s.t[made - 1]), "to": float(s.t[made])}
    return replace(found, table=table, notes=(*found.notes, Finding("current-late", values=about)), late=late)


def _until_lost(found: Mended, s: Seen, lost: list[Break]) -> Mended:
    """Return the table up to the first of the breaks."""
    first = lost[0]
    times = [(float(s.t[b.first - 1]), None if b.back is None else float(s.t[b.back])) for b in lost]
    shown = [
        f"from {format_quantity(a, 's', 6)} " + ("to the end" if b is None else f"to {format_quantity(b, 's', 6)}")
        for a, b in times[:_NAMED]
    ]
    shown += ["..."] * (len(times) > _NAMED)
    about = {
        "times": shown,
        "breaks": [list(pair) for pair in times],
        "until": float(s.t[first.earliest - 1]),
    }
    end = f"contact is lost {shown[0]}"
    return replace(
        found,
        table=_rows(found.table, s.t[first.earliest]),
        notes=(*found.notes, Finding("contact-lost", values=about)),
        end=end,
    )


def _rows(table: Table, before: float) -> Table:
    """Return the rows of a table before a time [s]."""
    kept = table.time < before
    return replace(table, columns={quantity: values[kept] for quantity, values in table.columns.items()})
