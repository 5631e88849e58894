"""Finds the onset of a record's excitation: the jumps of its voltage, the rest before them, the channels' brackets.

The time of a jump between the last reading at rest and the first reading of the response is not known. This bracket is
stored in the record, so that a fit can vary the onset within it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fit.criteria import effective_samples
from .jumps import voltage_jumps
from .smoothing import noise_level, resolution

#: Largest number of samples at rest that is too small to find their noise.
_FEW = 10
#: Test for a decaying current: order of the polynomial; least difference of its ends in standard errors by the
#: polynomial's residuals, or in units of the noise between neighbours.
_SMOOTH_ORDER, _WANDERS, _FAR = 3, 7.0, 25.0
#: Fraction of an interval by which a stated onset may lie beyond a reading and still be at that reading (rounding).
_ROUNDED = 1e-6
#: Largest deviation that counts as rest, as a fraction of the voltage's range.
_REST = 0.05
#: Number of noise levels above which a deviation is not noise.
_SEEN = 6.0
#: Fraction of the first peak at which a response has begun, and number of rows within which the peak lies.
_ANSWER, _ANSWER_ROWS = 0.5, 4
#: Least height of a first peak, as a fraction of the largest later current; below it the current had not begun.
_FIRST_PEAK = 0.2

Bracket = tuple[float, float]
#: State before the record: at rest, at rest under 0 V until a step at its first reading, or within a longer run.
Beginning = Literal["rest", "step", "run"]
#: A user's statement of the onset: a time [s] in the file, its last reading at rest, or its first one at the level.
Stated = float | Literal["last-rest", "first-level"] | None


@dataclass(frozen=True)
class Onset:
    """The onset of a record's voltage.

    ``first`` is the index of the first reading after it, ``between`` [s] are the times in the file of the readings
    between which it lies; ``stated`` [s] is its time if that is known, and ``share`` (-0.5 to 0.5) is then its
    distance from the middle in sampling intervals, None if unknown. ``rest`` [V] is the level before it, and ``jumps``
    is True if the voltage jumps there.
    """

    first: int
    between: Bracket
    rest: float
    beginning: Beginning
    jumps: bool
    stated: float | None = None
    share: float | None = None

    def bracket(self, between: Bracket) -> Bracket:
        """Return the bracket [s] of the onset for a channel whose response begins ``between`` two of its readings."""
        if self.stated is not None and between[0] <= self.stated <= between[1]:
            return (self.stated, self.stated)
        return between

    @property
    def time(self) -> float:
        """The middle of its bracket [s]."""
        return sum(self.bracket(self.between)) / 2


def find_onset(t: Array, u: Array, current: Array, name: str, stated: Stated = None) -> Onset:
    """Return the onset of a voltage ``u`` [V] at ``t`` [s], both (n,); ``current`` [A] (n,) may hold blanks.

    Raises InputError if there is no excitation.
    """
    largest = float(np.abs(u).max())
    if not largest and not np.ptp(u):
        raise InputError(f"{name}: the voltage is zero throughout; a record needs a step or another waveform")
    first, jump = _first_moved(u)
    beginning: Beginning = "rest" if first else "step"
    # a stated onset implies that a nonzero first voltage was zero before it
    begun: Beginning = "step" if stated is not None and abs(u[0]) > _REST * float(np.ptp(u)) else "run"
    here = first and not isinstance(stated, str | None) and t[first - 1] <= stated <= t[first]
    if first and jump and not here and not _rests(current[:first]):
        first, jump, beginning = 0, False, begun
    elif not first and float(np.ptp(u)) > _REST * largest:
        beginning = begun if _runs(u, current) else "rest"
    rest = float(np.mean(u[:first])) if first else 0.0
    if first and not jump:
        first, bracket = first - 1, (float(t[first - 1]),) * 2
    elif first:
        bracket = (float(t[first - 1]), float(t[first]))
    else:
        # with a clock that starts at the step the first reading is one interval later
        early = float(t[0]) if len(t) > 1 and 0 < t[0] <= 1.5 * (t[1] - t[0]) and beginning == "step" else 0.0
        bracket = (float(t[0]) - early, float(t[0]))
    found = Onset(first, bracket, rest, beginning, jump or (not first and beginning == "step"))
    return found if stated is None else _stated(found, stated)


def _stated(found: Onset, stated: float | str) -> Onset:
    low, high = found.between
    if not isinstance(stated, str):
        at, rounded = float(stated), _ROUNDED * (high - low)
        at = low if abs(at - low) <= rounded else high if abs(at - high) <= rounded else at
        share = (at - (low + high) / 2) / (high - low) if low <= at <= high and high > low else None
        return replace(found, stated=at, share=share)
    late = stated == "first-level"
    return replace(found, stated=high if late else low, share=0.5 if late else -0.5)


def _first_moved(u: Array) -> tuple[int, bool]:
    """Return the index of the first reading of the excitation, 0 without rest, and True if a jump leads to it."""
    spread = float(np.ptp(u))
    if spread <= _REST * float(np.abs(u).max()) and not len(voltage_jumps(u)):
        return 0, False
    for k in voltage_jumps(u).tolist():
        before = u[: k + 1]
        if float(np.abs(before - np.median(before)).max()) <= max(_SEEN * noise_level(before), _REST * spread):
            return k + 1, True
        break
    moved = np.abs(u - u[0]) > _REST * spread
    first = int(np.argmax(moved))
    rest = u[:first]
    if len(rest) <= _FEW:
        return 0, False  # a slow waveform: an early onset is harmless, a late one cuts off the beginning
    # it left rest before it reached 5 %: go back to the point where it left the noise
    level, noise = float(np.median(rest[:5])), noise_level(rest)
    quiet = np.abs(rest - level) <= max(4 * noise, 1e-6 * spread)
    if quiet[: len(rest) // 3].mean() < 0.8:
        return 0, False  # it moves from its first sample on: there is no rest in the record
    return int(np.flatnonzero(quiet)[-1]) + 1, False


def _rests(current: Array) -> bool:
    """Return True if the current before the onset does not decay, so that the strip was at rest."""
    known = current[np.isfinite(current)]
    edge = max(len(known) // 4, 1)
    if len(known) < _FEW:
        return True
    # autocorrelated noise is not a decay: the residuals of a smooth curve give the standard error of the difference
    x = np.linspace(-1.0, 1.0, len(known))
    left = known - np.polynomial.Polynomial.fit(x, known, _SMOOTH_ORDER)(x)
    spare = max(effective_samples(left) - _SMOOTH_ORDER - 1, 1.0)
    deviation = float(np.linalg.norm(left)) / np.sqrt(len(known) - _SMOOTH_ORDER - 1)
    fast = max(noise_level(known), resolution(known) / 2)
    limit = _WANDERS * max(deviation, fast) * np.sqrt(2 / (spare * edge / len(known)))
    change = abs(float(known[:edge].mean() - known[-edge:].mean()))
    far = _FAR * fast if noise_level(known) else np.inf
    return bool(change <= min(limit, far) + 0.02 * float(np.abs(known).max()))


def _runs(u: Array, current: Array) -> bool:
    """Return True if a waveform that begins with the record was running before it: voltage or current are not zero."""
    known = current[np.isfinite(current)]
    noise = _SEEN * noise_level(known) if len(known) else 0.0
    limits = (_REST * float(np.ptp(u)), max(_REST * float(np.abs(known).max(initial=0.0)), noise))
    return bool(abs(u[0]) > limits[0] or (len(known) and abs(known[0]) > limits[1]))


def answer_bracket(t: Array, values: Array, onset: Onset, until: float) -> tuple[Bracket, int] | None:
    """Return the bracket [s] of the current's response to the voltage's jump, and its lag in rows.

    ``t`` [s] and ``values`` [A] (n,) are the current's readings; ``until`` [s] is the voltage's next change. None if no
    response exceeds the noise, or the voltage does not jump.
    """
    rows = np.flatnonzero(t >= onset.between[0])
    if not onset.jumps or len(rows) < 3:
        return None
    rest = values[t <= onset.between[0]] if onset.first else np.empty(0)
    size = np.abs(values - (float(np.median(rest)) if len(rest) else 0.0))
    here = rows[t[rows] < until]
    later = size[here].max(initial=0.0)
    at = int(
        np.searchsorted(t, onset.between[1])
    )  # the current's reading at the time of the first voltage at the level
    near = np.arange(max(at - 1, 0), min(at + _ANSWER_ROWS, len(t)))
    peak = float(size[near].max(initial=0.0))
    if later <= _SEEN * max(noise_level(values), resolution(values) / 2):
        return None
    if peak < _FIRST_PEAK * later:
        near, peak = here, later
    first = int(near[np.argmax(size[near] > _ANSWER * peak)])
    if first == at:
        return onset.between, 0
    if not first:
        return None
    return (float(t[first - 1]), float(t[first])), first - at
