"""Turns a measured voltage into a drive: levels, straight lines where it varies, and jumps between readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from .curves import between_samples
from .jumps import staircase, voltage_jumps
from .kinks import Seen, with_kinks
from .onset import Onset
from .smoothing import digit, noise_beside_kinks, resolution, smoothed

#: Deviation of a measured voltage that is neglected, as a fraction of its largest value.
_NEGLIGIBLE = 1e-6
#: Largest change of the current by thinning the voltage, as a fraction of the current's noise.
_OF_CURRENT_NOISE = 0.1
#: Largest digit of the instrument, as a fraction of the voltage's range.
_DIGIT = 0.01
#: Number of readings that are too few to tell a level by its noise.
_SHORT = 20
#: Largest fluctuation of the readings of a level, in steps of the instrument, and most changes that are steps.
_WOBBLE, _FEW_CHANGES = 2.5, 3
#: Least ratio of current noise to voltage noise, relative to the conductance, and its significance in standard errors,
#: from which the strip responds to the voltage's noise.
_ANSWERS, _SURE = 0.3, 6.0
#: Largest difference of readings with noise that is no jump, in medians.
_QUIET = 12.0
#: Distance of a jump behind the last reading before it, as a fraction of the interval, if it is moved there.
_BEHIND = 1e-6


@dataclass(frozen=True)
class MeasuredDrive:
    """The voltage since the onset at 0, jumps in the middle of the intervals [s] in which they were read.

    ``widths`` (j,) are the widths of the intervals of all jumps, the onset's first, zero for an onset at a known time;
    ``noise`` [V] is the noise of the levels. ``stated`` (-0.5 to 0.5) is where jumps are instead, in parts of the
    interval from its middle, if the onset was stated to be there: an instrument that steps as it samples does so every
    time. None if it is unknown. ``places`` [s] (j - 1,) are distances of the later jumps from there, none if empty.
    """

    drive: PiecewiseLinear
    widths: Array
    noise: float = 0.0
    places: tuple[float, ...] = ()
    stated: float | None = None

    @property
    def ends(self) -> tuple[float, float]:
        """Distances of the ends of an interval from its jump, in parts of the interval."""
        return (-0.5 - (self.stated or 0.0), 0.5 - (self.stated or 0.0))

    def moved(self, share: float, width: float) -> PiecewiseLinear:
        """Return the drive since an onset at the position ``share`` (-0.5 to 0.5) in a bracket of ``width`` [s].

        The other jumps have the same relative position in their intervals, beside their own ``places``.
        """
        drive, onset = self.drive, share * width
        if not (share or any(self.places)) or not (width or self.widths.any()):
            return drive
        at = 1 + np.flatnonzero(np.diff(drive.times) == 0)
        widths = self.widths[1 : len(at) + 1]  # none of jumps behind the last reading
        later = widths * share + (np.array(self.places[: len(at)]) if self.places else 0.0)
        first, last = self.ends
        later = np.clip(later, widths * (_BEHIND + first), widths * last)
        times = drive.times - onset
        times[at] += later
        times[at - 1] += later
        times = np.maximum(times, _BEHIND * width)  # the first reading after the onset is none before it
        times[0] = 0.0
        return replace(drive, times=times)


def measured_drive(t: Array, u: Array, onset: Onset, conductance: float, noise: float, answered: bool) -> MeasuredDrive:
    """Return the drive for readings ``u`` [V] at ``t`` [s] (n,) in the file.

    A level with noise or changes of the last digit only is one value. Elsewhere readings are left out if that changes
    the current through ``conductance`` [S] by a small part of its ``noise`` [A]. If the strip ``answered`` the
    voltage's noise, the noise is part of the drive, else it is smoothed.
    """
    first, zero = onset.first, onset.time
    time, v = t[first:] - zero, u[first:]
    largest = float(np.abs(u).max())
    allowed = _OF_CURRENT_NOISE * noise / conductance if conductance else 0.0
    allowed = max(allowed, _NEGLIGIBLE * largest)
    jumps, within = voltage_jumps(u), staircase(u)[1]
    inner = jumps[jumps >= first] + 1 - first
    edges = [0, *inner.tolist(), len(v)]
    widths = np.array([onset.between[1] - onset.between[0], *(time[inner] - time[inner - 1])])
    share = max(onset.share or 0.0, _BEHIND - 0.5)
    begins = [0.0, *((time[inner - 1] + time[inner]) / 2 + share * widths[1:]).tolist()]
    if onset.share is not None:
        widths[0] = 0.0
    times: list[Array] = []
    values: list[Array] = []
    level_noise = 0.0
    for (start, stop), begin in zip(pairwise(edges), begins, strict=True):
        part, at = v[start:stop], time[start:stop]
        stands = len(part) < _SHORT and float(np.ptp(part)) <= within
        if not answered and (stands or is_level(part, _DIGIT * float(np.ptp(u)))):
            level_noise = max(level_noise, float(part.std()))
            knots, kept = np.array([begin]), np.array([part.mean()])
        else:
            noise_here = noise_beside_kinks(part, digit(u))
            curve = part if answered else smoothed(at, part, noise_here).values
            seen = Seen(allowed, noise_here)
            still = onset.rest if not times and onset.first and not onset.jumps else None
            knots, kept = _curved(*with_kinks(at, curve, seen, still), at, allowed)
            chosen = simplified(knots, kept, allowed)
            knots, kept = knots[chosen], kept[chosen]
            if knots[0] > begin:
                knots, kept = np.append(begin, knots), np.append(kept[0], kept)
            else:
                knots[0] = begin
        if times:  # hold until the jump
            times.append(np.array([begin]))
            values.append(values[-1][-1:])
        times.append(knots)
        values.append(kept)
    drive = PiecewiseLinear(np.concatenate(times), np.concatenate(values), "measured voltage", onset.rest)
    return MeasuredDrive(drive, widths, level_noise, stated=None if onset.share is None else share)


def _curved(t: Array, u: Array, readings: Array, tolerance: float) -> tuple[Array, Array]:
    """Return times and voltages with points between samples, see `between_samples`, from kink to kink.

    Those of the times ``t`` (n,) that are no ``readings`` (m,) are kinks.
    """
    kinks = np.flatnonzero(~np.isin(t, readings))
    ends = [0, *kinks[(kinks > 0) & (kinks < len(t) - 1)].tolist(), len(t) - 1]
    pieces = [between_samples(t[a : b + 1], u[a : b + 1], tolerance) for a, b in pairwise(ends)]
    times, values = (np.concatenate([p[k][int(i > 0) :] for i, p in enumerate(pieces)]) for k in (0, 1))
    return times, values


def answers_noise(t: Array, u: Array, current: Array, conductance: float) -> bool:
    """Return True if a strip of ``conductance`` [S] responded to the noise of the voltage ``u`` [V].

    Applied noise appears in the ``current`` [A]; noise of the readings does not. All are (n,), blanks left out.
    """
    if len(u) < 2 * _SURE**2 or not conductance:
        return False
    slope, error = answer_to_noise(u, current, order=2, correlated=3.0, least=3 * digit(u))
    return slope > _ANSWERS * conductance and slope > _SURE * error


def answer_to_noise(x: Array, y: Array, order: int, correlated: float, least: float = 0.0) -> tuple[float, float]:
    """Return by how much readings ``y`` (n,) follow the noise of ``x`` (n,), and the standard error of that.

    Differences of an ``order`` show the noise; they are ``correlated``, by which squares of errors are larger. Where
    they are large beside most others, and beyond ``least``, x jumps, and they do not count. Without noise 0 and 0.
    """
    fast, answer = np.diff(x, order), np.diff(y, order)
    quiet = np.abs(fast) <= max(_QUIET * float(np.median(np.abs(fast))), least)
    fast, answer = fast[quiet], answer[quiet]
    power = float(fast @ fast)
    if not power:
        return 0.0, 0.0
    slope = float(fast @ answer) / power
    rest = answer - slope * fast
    return slope, float(np.sqrt(rest @ rest / max(len(rest) - 1, 1) / power * correlated))


def is_level(u: Array, largest_digit: float = np.inf) -> bool:
    """Return True if a voltage (n,) is constant apart from white noise or its last digit, without drift.

    A reading that fluctuates between neighbouring digits is a level, for any pattern of many changes. Steps above
    ``largest_digit`` [V] are none of the instrument.
    """
    spread = float(np.ptp(u))
    if len(u) < 2 or not spread:
        return True
    half = len(u) // 2
    if len(u) < _SHORT:
        return bool(spread < 1e-3 * abs(u.mean()))
    grain = resolution(u)
    levels = len(np.unique(u))
    wobbles = np.count_nonzero(np.diff(u)) > _FEW_CHANGES and grain <= largest_digit
    if wobbles and spread <= _WOBBLE * grain and levels < len(u) / 4:
        return bool(abs(u[:half].mean() - u[half:].mean()) <= grain)
    deviation = u - u.mean()
    variance = float(deviation @ deviation)
    if not variance:  # the squares of readings below 1e-162
        return True
    correlation = float(deviation[1:] @ deviation[:-1]) / variance
    shift = abs(u[:half].mean() - u[half:].mean()) / np.sqrt(variance / len(u) * 4 / len(u))
    return bool(correlation < 3 / np.sqrt(len(u)) and shift < 4)


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
