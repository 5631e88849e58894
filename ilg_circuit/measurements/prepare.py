"""From a measured table to what a fit needs: the onset of the drive, rest values, the drive itself, sound samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..drive import PiecewiseLinear
from ..errors import InputError
from ..units import format_quantity
from .quality import clipped_tops, current_drift, dropouts, rest_drift
from .record_files import read_columns
from .table import Table

Array = NDArray[np.float64]

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
#: Samples of a smooth curve bend alike: neighbouring second differences differ by less than this part.
_SMOOTH = 0.5
#: Parts into which the time between two samples of a smooth curve is divided.
_PARTS = 8
#: So many samples at rest and fewer tell nothing about its noise.
_FEW = 10
#: Below this part of the largest voltage the record counts as at rest.
_REST = 0.05


@dataclass(frozen=True)
class Channel:
    """One measured quantity: ``time`` [s] since the onset (negative: at rest), ``values`` [SI], blanks left out."""

    time: Array
    values: Array

    @property
    def rest(self) -> NDArray[np.bool_]:
        return np.asarray(self.time < 0)

    def without(self, samples: NDArray[np.bool_]) -> Channel:
        """The others than these (n,)."""
        return Channel(self.time[~samples], self.values[~samples])

    def until(self, end: float) -> Channel:
        """The samples up to ``end`` [s]."""
        keep = self.time <= end
        return Channel(self.time[keep], self.values[keep])


@dataclass(frozen=True)
class Record:
    """A record made ready: ``onset`` [s] in the file's time, the ``drive`` from the onset on, and the channels.

    ``step`` [V] is the height of a step that begins the record, None for another waveform.
    """

    source: str
    onset: float
    drive: PiecewiseLinear
    step: float | None
    current: Channel
    displacement: Channel | None
    notes: tuple[str, ...] = field(default=())

    @property
    def duration(self) -> float:
        return float(self.current.time[-1])


def read_record(path: str | Path) -> Record:
    """Read and prepare a record; see `prepare`, and `record_files.read_columns` for the formats."""
    return prepare(read_columns(path, ("time", "voltage", "current")))


def prepare(table: Table) -> Record:
    """Find the onset of the drive, the jumps in it, the rest stretch, and drop what is no measurement.

    Raises InputError when nothing was excited: no step or other change of the voltage, or too few samples after it.
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
        noise = format_quantity(smoothed, "V", 2)
        notes.append(f"noise on the voltage ({noise} rms about its levels) was averaged out")
    current = _channel(table, "current", onset)
    if current is None:
        raise InputError(f"{name}: the current column has no number in it")
    at_limit, told = clipped_tops(current.time, current.values, drive, noise_level(current.values))
    current = current.without(at_limit)
    notes += told
    count = int((~current.rest).sum())
    if count < 10:
        raise InputError(f"{name}: {count} current samples after the onset at {onset:g} s; 10 are needed")
    _require_response(current, drive, name)
    step = _step_height(drive)
    if step is not None:
        notes += current_drift(current.time, current.values, step)
    displacement = _displacement(table, onset, notes)
    if displacement is not None and (~displacement.rest).sum() < 20:
        notes.append("fewer than 20 displacement samples after the onset: no displacement fit")
        displacement = None
    unknown = [title for title in table.ignored if title]
    if unknown:
        notes.append(f"columns not understood and left out: {', '.join(unknown)}")
    return Record(name, onset, drive, step, current, displacement, tuple(notes))


def noise_level(values: Array) -> float:
    """Standard deviation of the white part of a smooth signal: robust, from its sixth differences."""
    if len(values) < 16:
        return 0.0
    sixth = np.abs(np.diff(values, 6))
    # white noise of unit size has sixth differences of size sqrt(924); the median of |x| of a normal x is 0.6745
    robust = float(np.median(sixth) / 0.6745 / np.sqrt(924))
    # coarse resolution makes more than half of them zero; a few jumps must not count as noise either
    return robust or float(np.sqrt(np.mean(np.sort(sixth)[: int(0.95 * len(sixth))] ** 2) / 924))


def _onset(u: Array, name: str) -> int:
    """Index of the first sample that belongs to the excitation."""
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
    return bool(k > 0 and k - 1 in set(_jumps(u)))


def _jumps(u: Array) -> NDArray[np.intp]:
    """Intervals k -> k + 1 in which the voltage jumps, though it is smooth before and after."""
    change = np.abs(np.diff(u))
    spread = float(np.ptp(u))
    found = []
    for k in np.flatnonzero((change > _JUMP * spread) & (change > _JUMP_OVER_NOISE * np.median(change))):
        around = np.r_[change[max(k - 4, 0) : k], change[k + 1 : k + 5]]
        if len(around) >= 2 and change[k] > _JUMP_OVER_NEIGHBOURS * np.median(around):
            found.append(k)
    return np.array(found, dtype=np.intp)


def _drive(t: Array, u: Array) -> tuple[PiecewiseLinear, float]:
    """The measured voltage from its onset: straight lines through the samples, jumps at the sample that shows them.

    Between jumps a voltage that is a constant level and white noise becomes that level, and one that varies keeps
    those samples that its noise and resolution do not explain. Returns the noise [V] of the levels too.
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
            tolerance = max(3 * noise_level(level), 1.5 * _resolution(level), _NEGLIGIBLE * float(np.abs(u).max()))
            fine_times, fine = between_samples(t[start:stop], level, tolerance)
            kept = simplified(fine_times, fine, tolerance)
            times.append(fine_times[kept])
            values.append(fine[kept])
        if stop < len(u):  # hold until the jump
            times.append(t[[stop]])
            values.append(values[-1][-1:])
    return PiecewiseLinear(np.concatenate(times), np.concatenate(values), "measured voltage"), noise


def between_samples(t: Array, u: Array, tolerance: float) -> tuple[Array, Array]:
    """Samples and, where the voltage is a smooth curve that sags beyond ``tolerance`` below its chords, points between.

    Straight lines through the samples of a sine make a smaller sine, which a fit would take for a smaller conductance.
    A curve is smooth where four samples bend alike twice; the points lie on the cubic through them.
    """
    if len(u) < 4:
        return t, u
    bend = np.diff(np.diff(u) / np.diff(t)) / (t[2:] - t[:-2])  # half the second derivative
    left, right = bend[:-1], bend[1:]
    alike = np.abs(left - right) <= _SMOOTH * np.maximum(np.abs(left), np.abs(right))
    width = np.diff(t)[1:-1]
    curved = 1 + np.flatnonzero(alike & (np.abs(left + right) * width**2 / 8 > tolerance))
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


def _resolution(u: Array) -> float:
    """Smallest difference between any two readings: the instrument's resolution, where it has one."""
    steps = np.diff(np.unique(u))
    return float(steps.min()) if len(steps) else 0.0


def simplified(t: Array, u: Array, tolerance: float) -> NDArray[np.intp]:
    """Indices of the samples whose straight connection stays within ``tolerance`` of all (Ramer, Douglas, Peucker)."""
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
    """Constant but for white noise: neighbours are not alike, and the second half is the first's."""
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
    """Height of a step: the voltage stays within 5 % of its first value."""
    start = float(drive.values[0])
    return start if start and float(np.abs(drive.values - start).max()) <= 0.05 * abs(start) else None


def _channel(table: Table, quantity: str, onset: float) -> Channel | None:
    values = table.get(quantity)
    if values is None:
        return None
    known = np.isfinite(values)
    return Channel(table.time[known] - onset, values[known])


def _displacement(table: Table, onset: float, notes: list[str]) -> Channel | None:
    """The displacement without its drop-outs, which ``notes`` are told of."""
    values = table.get("displacement")
    if values is None:
        return None
    gone, told = dropouts(values, "displacement", "m")
    channel = Channel(table.time[~gone] - onset, values[~gone])
    notes += [*told, *rest_drift(channel.time, channel.values, "displacement", "m")]
    return channel


def _require_response(current: Channel, drive: PiecewiseLinear, name: str) -> None:
    """A constant voltage with a current that does not change holds no transient: the step is not in the record."""
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
    """Whether the current since the onset ends where it began, but for noise."""
    after = current.values[~current.rest]
    edge = max(len(after) // 20, 3)
    if len(after) < 2 * edge:
        return False
    change = abs(float(after[:edge].mean() - after[-edge:].mean()))
    return bool(change <= 4 * noise_level(after) / np.sqrt(edge) + 1e-12 * float(np.abs(after).max()))
