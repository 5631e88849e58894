"""Computes single modes under a drive, from rest: the terms of which exact answers are sums."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import ON_EDGE, Drive
from .modes import Numbers, fallen, phi_pair, phi_slopes, recursion

#: Number of intervals, or of samples, whose states are held at once.
BLOCK = 2000
#: Samples per edge of the drive above which a run is solved from edge to edge, not from sample to sample.
_FEW_EDGES = 2
#: Most samples of a course that is kept for the next call: a fit asks for the same times again and again.
_MOST_SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class _Course:
    """A drive in lines over intervals of ``widths`` [s], which it begins at ``start`` and runs along by ``slopes``.

    Sample k lies ``since`` [s] after the begin of interval ``places`` [k], or, without ``since``, at it.
    """

    widths: Array
    start: Array
    slopes: Array
    places: NDArray[np.intp]
    since: Array | None


def mode_waves(poles: Numbers, drive: Drive, times: Array) -> Numbers:
    """Return W' = pole W + u, from rest at 0, for each of ``poles`` [1/s] (k,); shape (k, times).

    The drive is piecewise linear; ``times`` [s] ascend from 0 or later. Real poles are computed in real numbers, and
    one of each pair of conjugates.
    """
    found = np.zeros((len(poles), len(times)), dtype=np.result_type(poles, float))
    real = poles.imag == 0
    for some, own in ((real, poles.real[real]), (~real, poles[~real])):
        single, place = np.unique(np.where(own.imag < 0, own.conj(), own), return_inverse=True)
        if len(single):
            made = np.empty((len(single), len(times)), dtype=single.dtype)
            for part, waves in waves_under_lines(single[None], drive, times):
                made[:, part] = waves[:, 0].T
            found[some] = made[place]
    below = poles.imag < 0
    found[below] = found[below].conj()
    return found


def waves_under_lines(
    poles: Numbers, drive: Drive, times: Array, *, slopes: bool = False
) -> Iterator[tuple[slice, Numbers]]:
    """Return modes W' = pole W + u from rest at parts of ``times`` [s], (times, *poles), one part after the other.

    With ``slopes`` single modes (1, s) and their derivatives by their poles, (times, 2, s).
    """
    course = _kept(drive, times.tobytes()) if len(times) <= _MOST_SAMPLES else _course(drive, times)
    over, after = (_over_with_slopes, _after_with_slopes) if slopes else (_over, _after)
    few = course.since is not None
    state = np.zeros((1 + slopes, *poles.shape[1:]) if slopes else poles.shape, dtype=poles.dtype)
    for first in range(0, len(course.widths), BLOCK):
        part = slice(first, first + BLOCK)
        width = course.widths[part]
        states = state[None]
        if not few or len(course.widths) > 1:  # else samples follow the state that the only interval begins with
            ends = over(poles, state, course.start[part, None, None], course.slopes[part, None, None], width)
            states = np.concatenate([states, ends])
            state = states[-1]
        # the last state of a block is the first of the next one, to which only what follows an edge belongs
        last = first + len(width)
        bounds = [first, last] if few else [first + bool(first), last + 1]
        begin, end = np.searchsorted(course.places, bounds).tolist()
        if course.since is None:
            yield slice(begin, end), states[course.places[begin:end] - first]
            continue
        for at in range(begin, end, BLOCK):
            some = slice(at, min(at + BLOCK, end))
            k = course.places[some]
            yield some, after(poles, states[k - first], course.start[k], course.slopes[k], course.since[some])


def waves_under_sine(poles: Numbers, drive: Drive, times: Array) -> Iterator[tuple[slice, Numbers]]:
    """Return modes as `waves_under_lines`, under a sine: the steady answer, and the mode that takes it from rest."""
    omega = drive.angular_frequency()
    begin, values = drive_at(drive, np.zeros(1)), drive_at(drive, times)
    share = -1 / (poles**2 + omega**2)
    for first in range(0, len(times), BLOCK):
        part = slice(first, first + BLOCK)
        u, later = values[:, part, None, None]
        grown = np.exp(poles * times[part, None, None])
        steady, start = poles * u + omega * later, poles * begin[0] + omega * begin[1]
        yield part, share * (steady - grown * start)


@lru_cache(maxsize=16)
def _kept(drive: Drive, times: bytes) -> _Course:
    """Return the course of a drive at times that are given as the bytes of their array, and keep it."""
    return _course(drive, np.frombuffer(times))


def values_at(drive: Drive, times: Array) -> Array:
    """Return the values of a drive at ``times`` [s], kept as its course is."""
    return _kept_values(drive, times.tobytes()) if len(times) <= _MOST_SAMPLES else drive.value(times)


@lru_cache(maxsize=16)
def _kept_values(drive: Drive, times: bytes) -> Array:
    return drive.value(np.frombuffer(times))


def _course(drive: Drive, times: Array) -> _Course:
    edges = interval_grid(drive, times[-1:])
    few = len(edges) * _FEW_EDGES <= len(times)
    grid = edges if few else interval_grid(drive, times)
    widths = np.diff(grid)
    start, slopes = drive_lines(drive, grid[:-1], widths)
    places = np.searchsorted(grid, times, side="right") - 1 if few else np.searchsorted(grid, times)
    np.minimum(places, len(widths) - few, out=places)
    return _Course(widths, start, slopes, places, times - grid[places] if few else None)


def _over(poles: Numbers, state: Numbers, starts: Array, slopes: Array, widths: Array) -> Numbers:
    """Return modes x' = pole x + u (m, *poles) at the ends of intervals of ``widths`` [s] (m,), from ``state``.

    u begins at ``starts`` (m, 1, 1) and rises by ``slopes`` (m, 1, 1).
    """
    width = widths[:, None, None]
    z = poles * width
    once, twice = phi_pair(z)
    return recursion(np.exp(z), width * (starts * once + slopes * width * twice), state)


def _over_with_slopes(poles: Numbers, state: Numbers, starts: Array, slopes: Array, widths: Array) -> Numbers:
    """Return modes as `_over` and their derivatives by their poles (m, 2, s), from a ``state`` (2, s) of both."""
    width = widths[:, None, None]
    z = poles * width
    once, twice = phi_pair(z)
    steeper = phi_slopes(z, once, twice)
    kept = np.exp(z)
    x = recursion(kept, width * (starts * once + slopes * width * twice), state[:1])
    before = np.concatenate([state[None, :1], x[:-1]])
    gained = width * kept * before + width**2 * (starts * steeper[0] + slopes * width * steeper[1])
    return np.concatenate([x, recursion(kept, gained, state[1:])], axis=1)


def _after(poles: Numbers, states: Numbers, starts: Array, slopes: Array, times: Array) -> Numbers:
    """Return modes x' = pole x + u (m, *poles) at ``times`` (m,) after their ``states`` (m, *poles).

    u begins at ``starts`` (m,) and rises by ``slopes`` (m,).
    """
    rising = slopes != 0
    starts, slopes, after = (part[:, None, None] for part in (starts, slopes, times))
    if rising.all() or not poles.all():
        once, twice = phi_pair(poles * after)
        return states + after * (once * (poles * states + starts) + slopes * after * twice)
    found = states + fallen(poles, times) * (states + starts / poles)
    if rising.any():
        after = after[rising]
        found[rising] += slopes[rising] * after**2 * phi_pair(poles * after)[1]
    return found


def _after_with_slopes(poles: Numbers, states: Numbers, starts: Array, slopes: Array, times: Array) -> Numbers:
    """Return modes as `_after` and their derivatives by their poles (m, 2, s), after ``states`` (m, 2, s) of both."""
    rising = slopes != 0
    starts, slopes, after = (part[:, None, None] for part in (starts, slopes, times))
    x, turned = states[:, :1], states[:, 1:]
    if rising.all() or not poles.all():
        z = poles * after
        once, twice = phi_pair(z)
        steeper = phi_slopes(z, once, twice)
        push = poles * x + starts
        found = x + after * (once * push + slopes * after * twice)
        turning = once * (poles * turned + x) + after * (steeper[0] * push + slopes * after * steeper[1])
        return np.concatenate([found, turned + after * turning], axis=1)
    steady, fell = starts / poles, fallen(poles, times)
    found = np.concatenate(
        [x + fell * (x + steady), turned + fell * (turned - steady / poles) + after * (1 + fell) * (x + steady)], axis=1
    )
    if rising.any():
        after, slopes = after[rising], slopes[rising]
        z = poles * after
        once, twice = phi_pair(z)
        found[rising, :1] += slopes * after**2 * twice
        found[rising, 1:] += slopes * after**3 * phi_slopes(z, once, twice)[1]
    return found


def interval_grid(drive: Drive, times: Array) -> Array:
    """Return start, breakpoints of the drive and ``times`` [s], ascending: between them the drive is smooth."""
    end = float(times[-1]) if len(times) else 0.0
    return np.union1d(np.concatenate([[0.0], drive.breakpoints(end)]), times)


def jumps_until(drive: Drive, end: float) -> Array:
    """Return the times [s] of the onset and of the jumps of a drive up to the ``end`` [s], a jump there included."""
    return np.append(0.0, np.minimum(drive.jumps(end * (1 + ON_EDGE)), end))


def drive_lines(drive: Drive, starts: Array, widths: Array) -> Array:
    """Return the drive at the ``starts`` [s] (m,) of smooth intervals and its companion there; shape (2, m).

    The companion of a line is its slope; the companion of a sine is its value a quarter of a period later.
    """
    if drive.angular_frequency():
        return drive_at(drive, starts)
    value = drive.value(starts)
    # the left limit at the interval's end: halfway plus half of the rise, exact on a line
    return np.stack([value, 2 * (drive.value(starts + widths / 2) - value) / widths])


def drive_at(drive: Drive, t: Array) -> Array:
    """Return the drive at ``t`` and a sine's companion there, zero for a line, whose slope is not needed."""
    omega = drive.angular_frequency()
    value = drive.value(t)
    return np.stack([value, drive.value(t + np.pi / 2 / omega) if omega else np.zeros_like(value)])
