"""Preparing a record: the onset of the drive, the drive itself, the rest before it, and the samples to keep."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..findings import Finding
from .quality import clipped_tops, current_drift, dropouts, rest_drift
from .record import Channel, Record
from .smoothing import noise_level, resolution
from .table import Table

#: A change between two samples by this part of the voltage's range is a jump, if its neighbours change much less.
_JUMP = 0.2
_JUMP_OVER_NEIGHBOURS = 4.0
_JUMP_OVER_NOISE = 12.0
#: White noise beyond this part of a level is an excitation, not an instrument's.
_NOISE_OF_LEVEL = 0.1
#: No instrument reads less than this, in SI units.
_LEAST_READING = 1e-30
#: What is left out of a measured voltage: this part of its largest value.
_NEGLIGIBLE = 1e-5
#: On a smooth curve neighbouring second differences differ by less than this part.
_SMOOTH = 0.5
#: Parts into which the time between two samples of a smooth curve is divided.
_PARTS = 8
#: From so many samples at rest, or fewer, their noise cannot be found.
_FEW = 10
#: Samples after the onset that a fit needs.
_LEAST_CURRENT, _LEAST_DISPLACEMENT = 10, 20
#: Below this part of the largest voltage the record counts as at rest.
_REST = 0.05


def prepare(table: Table) -> Record:
    """Find the onset of the drive and the jumps in it, and drop the samples that are no measurement.

    ``table`` has the columns ``time``, ``voltage``, ``current`` and, if measured, ``displacement``.

    Raises
    ------
    InputError
        Nothing was excited (no step or other change of the voltage), or there are too few samples after it.
    """
    name, notes = table.source, list(table.notes)
    voltage = table.columns["voltage"]
    known = np.isfinite(voltage)
    if known.sum() < 2:
        raise InputError(f"{name}: the voltage column has fewer than two numbers")
    time, u = table.time[known], voltage[known]
    first = _onset(u, name)
    onset = float(time[first])
    if not _is_jump(u, first) and first:
        onset = float(time[first - 1])
        first -= 1
    if len(u) - first < 2:
        raise InputError(f"{name}: the voltage changes at the last reading only; nothing was recorded after it")
    drive, smoothed = _drive(time[first:] - onset, u[first:])
    if smoothed > 1e-9 * float(np.abs(u).max()):
        notes.append(Finding("voltage-noise-averaged", values={"noise": smoothed}))
    current = _channel(table, "current", onset)
    if current is None:
        raise InputError(f"{name}: the current column has no number in it")
    at_limit, clipped = clipped_tops(current.time, current.values, drive, noise_level(current.values))
    current = current.without(at_limit)
    notes += clipped
    count = int((~current.rest).sum())
    if count < _LEAST_CURRENT:
        raise InputError(f"{name}: {count} current samples after the onset at {onset:g} s; {_LEAST_CURRENT} are needed")
    _require_response(current, drive, name)
    step = _step_height(drive)
    if step is not None:
        notes += current_drift(current.time, current.values, step)
    displacement, missing = _displacement(table, onset)
    notes += missing
    if displacement is not None and (~displacement.rest).sum() < _LEAST_DISPLACEMENT:
        notes.append(Finding("displacement-too-short", values={"needed": _LEAST_DISPLACEMENT}))
        displacement = None
    unknown = [title for title in table.ignored if title]
    if unknown:
        notes.append(Finding("columns-ignored", values={"columns": unknown}))
    return Record(name, onset, drive, step, current, displacement, tuple(notes))


def _onset(u: Array, name: str) -> int:
    """Return the index of the first sample that belongs to the excitation."""
    largest = float(np.abs(u).max())
    if not largest:
        raise InputError(f"{name}: the voltage is zero throughout; a record needs a step or another waveform")
    if largest < _LEAST_READING:
        raise InputError(f"{name}: the voltage is {largest:g} V at most; check its unit")
    jumps = _jumps(u)
    moved = np.abs(u) > _REST * largest
    first = int(np.argmax(moved))
    if len(jumps) and first and abs(float(np.median(u[: jumps[0] + 1]))) <= _REST * largest:
        before = u[: jumps[0] + 1]
        if float(np.abs(before - np.median(before)).max()) <= max(6 * noise_level(before), _REST * largest):
            return int(jumps[0]) + 1  # noise at rest may pass the limit, the jump is what counts
    rest = u[:first]
    # a rest level that is not zero (an instrument's offset) is still rest; one that equals the drive is no step
    if np.ptp(u) <= _REST * largest and first == 0:
        return 0
    if _is_jump(u, first):
        return first
    if len(rest) <= _FEW:
        return 0  # a slow waveform: an onset too early costs nothing, one too late cuts off its beginning
    # it left its rest before it reached 5 %: go back to where it left the noise
    level, spread = float(np.median(rest[:5])), noise_level(rest)
    quiet = np.abs(rest - level) <= max(4 * spread, 1e-6 * largest)
    if quiet[: len(rest) // 3].mean() < 0.8:
        return 0  # it moves from its first sample on: there is no rest in the record
    return int(np.flatnonzero(quiet)[-1]) + 1


def _is_jump(u: Array, k: int) -> bool:
    return k > 0 and k - 1 in set(_jumps(u))


def _jumps(u: Array) -> NDArray[np.intp]:
    """Return the intervals k -> k + 1 in which the voltage jumps, though it is smooth before and after."""
    change = np.abs(np.diff(u))
    spread = float(np.ptp(u))
    jumps = []
    for k in np.flatnonzero((change > _JUMP * spread) & (change > _JUMP_OVER_NOISE * np.median(change))):
        around = np.r_[change[max(k - 4, 0) : k], change[k + 1 : k + 5]]
        if len(around) >= 2 and change[k] > _JUMP_OVER_NEIGHBOURS * np.median(around):
            jumps.append(k)
    return np.array(jumps, dtype=np.intp)


def _drive(t: Array, u: Array) -> tuple[PiecewiseLinear, float]:
    """Return the measured voltage from its onset: straight lines through the samples, a jump at the first one after it.

    Between jumps a voltage that is a constant level and white noise becomes that level, and one that varies keeps
    the samples that its noise and resolution do not explain. Also returns the noise [V] of the levels.
    """
    edges = [0, *(_jumps(u) + 1), len(u)]
    times: list[Array] = []
    values: list[Array] = []
    noise = 0.0
    for start, stop in pairwise(edges):
        level = u[start:stop]
        if float(level.std()) <= _NOISE_OF_LEVEL * float(np.abs(u).max()) and _is_level(level):
            noise = max(noise, float(level.std()))
            times.append(t[[start]])
            values.append(np.array([level.mean()]))
        else:
            tolerance = max(3 * noise_level(level), 1.5 * resolution(level), _NEGLIGIBLE * float(np.abs(u).max()))
            fine_times, fine = between_samples(t[start:stop], level, tolerance)
            kept = simplified(fine_times, fine, tolerance)
            times.append(fine_times[kept])
            values.append(fine[kept])
        if stop < len(u):  # hold until the jump
            times.append(t[[stop]])
            values.append(values[-1][-1:])
    return PiecewiseLinear(np.concatenate(times), np.concatenate(values), "measured voltage"), noise


def between_samples(t: Array, u: Array, tolerance: float) -> tuple[Array, Array]:
    """Add points between the samples where the voltage is a smooth curve more than ``tolerance`` from its chords.

    Straight lines through the samples of a sine make a smaller sine, which a fit would take for a smaller conductance.
    A curve is smooth where the two second differences of four samples are similar; the points lie on the cubic through
    them.

    Parameters
    ----------
    t, u
        Times [s], ascending, and voltages [V] (n,).
    tolerance
        Distance [V] that needs no points.

    Returns
    -------
    tuple
        Times and voltages (m,), the samples among them.
    """
    if len(u) < 4:
        return t, u
    bend = np.diff(np.diff(u) / np.diff(t)) / (t[2:] - t[:-2])  # half the second derivative
    left, right = bend[:-1], bend[1:]
    smooth = np.abs(left - right) <= _SMOOTH * np.maximum(np.abs(left), np.abs(right))
    width = np.diff(t)[1:-1]
    curved = 1 + np.flatnonzero(smooth & (np.abs(left + right) * width**2 / 8 > tolerance))
    share = np.arange(1, _PARTS) / _PARTS
    a, b = t[curved, None], t[curved + 1, None]
    at = a + (b - a) * share
    # Newton's form of the cubic through four samples, left to right
    third = ((bend[curved] - bend[curved - 1]) / (t[curved + 2] - t[curved - 1]))[:, None]
    slope = (u[curved, None] - u[curved - 1, None]) / (a - t[curved - 1, None])
    first = at - t[curved - 1, None]
    cubic = u[curved - 1, None] + first * (slope + (at - a) * (bend[curved - 1, None] + (at - b) * third))
    times = np.concatenate([t, at.ravel()])
    order = np.argsort(times, kind="stable")
    return times[order], np.concatenate([u, cubic.ravel()])[order]


def simplified(t: Array, u: Array, tolerance: float) -> NDArray[np.intp]:
    """Return the indices of samples whose connecting lines stay within ``tolerance`` of all (Ramer-Douglas-Peucker)."""
    keep = np.zeros(len(t), dtype=bool)
    keep[[0, -1]] = True
    open_ends = [(0, len(t) - 1)]
    while open_ends:
        a, b = open_ends.pop()
        if b - a < 2:
            continue
        line = u[a] + (u[b] - u[a]) * (t[a + 1 : b] - t[a]) / (t[b] - t[a])
        distance = np.abs(u[a + 1 : b] - line)
        k = int(np.argmax(distance))
        if distance[k] > tolerance:
            keep[a + 1 + k] = True
            open_ends += [(a, a + 1 + k), (a + 1 + k, b)]
    return np.flatnonzero(keep)


def _is_level(u: Array) -> bool:
    """Tell whether a voltage is constant but for white noise: not autocorrelated, and its halves have the same mean."""
    if len(u) < 2 or not np.ptp(u):
        return True
    if len(u) < 20:
        return bool(np.ptp(u) < 1e-3 * abs(u.mean()))
    deviation = u - u.mean()
    variance = float(deviation @ deviation)
    correlation = float(deviation[1:] @ deviation[:-1]) / variance
    half = len(u) // 2
    shift = abs(u[:half].mean() - u[half:].mean()) / np.sqrt(variance / len(u) * 4 / len(u))
    return bool(correlation < 3 / np.sqrt(len(u)) and shift < 4)


def _step_height(drive: PiecewiseLinear) -> float | None:
    """Return the height of a step, whose voltage stays within 5 % of its first value; None for another drive."""
    start = float(drive.values[0])
    return start if start and float(np.abs(drive.values - start).max()) <= 0.05 * abs(start) else None


def _channel(table: Table, quantity: str, onset: float) -> Channel | None:
    values = table.get(quantity)
    if values is None:
        return None
    known = np.isfinite(values)
    return Channel(table.time[known] - onset, values[known])


def _displacement(table: Table, onset: float) -> tuple[Channel | None, list[Finding]]:
    """Return the displacement without its drop-outs, and what is wrong with it."""
    values = table.get("displacement")
    if values is None:
        return None, []
    missing, notes = dropouts(values, "displacement", "m")
    channel = Channel(table.time[~missing] - onset, values[~missing])
    return channel, [*notes, *rest_drift(channel.time, channel.values, "displacement", "m")]


def _require_response(current: Channel, drive: PiecewiseLinear, name: str) -> None:
    """Raise InputError for a record without a transient: the voltage is constant and the current does not change."""
    if float(np.abs(current.values).max()) < _LEAST_READING:
        raise InputError(f"{name}: no step in the record: the current is zero throughout")
    jumps = drive.jumps(np.inf)
    if len(jumps) and drive.values[0] and not current.rest.any() and _steady(current.until(float(jumps[0]) * 0.999)):
        raise InputError(
            f"{name}: the record begins under {drive.values[0]:g} V with a steady current; a fit starts from rest: "
            "record from before the voltage was switched on"
        )
    if _step_height(drive) is None:
        return
    if _steady(current.until(np.inf)):
        raise InputError(
            f"{name}: no step in the record: the voltage is constant and the current does not change; "
            "record from before the step on"
        )


def _steady(current: Channel) -> bool:
    """Tell whether the current since the onset ends where it began, but for noise."""
    after = current.values[~current.rest]
    edge = max(len(after) // 20, 3)
    if len(after) < 2 * edge:
        return False
    change = abs(float(after[:edge].mean() - after[-edge:].mean()))
    return bool(change <= 4 * noise_level(after) / np.sqrt(edge) + 1e-12 * float(np.abs(after).max()))
