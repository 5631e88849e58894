"""Finds out how a record was excited: by sines, one after another or together, by a sweep, or by noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError
from ..measurements.jumps import voltage_jumps
from ..measurements.smoothing import noise_level
from ..units import format_quantity

#: Part of the voltage's span by which it leaves its rest, and the same in noise levels.
_LEAVES, _CLEAR = 1e-3, 6.0
#: Span [V] that is an excitation, whatever the noise; and part of the span that noise may be.
_EXCITED, _MOST_NOISE = 0.02, 0.1
#: Distance of readings, in median ones, from which on some are missing.
GAP = 2.5
#: Most jumps of a voltage, which lie between readings.
_JUMPS = 2
#: Least number of readings over which a voltage moves.
_FEWEST = 8
#: Most sines; what they may leave of the voltage (rms); least distance of two, in lines of the record.
_MOST, _LEFT, _APART = 40, 0.1, 2.0
#: Samples above which a voltage is thinned, and part of its power that may be lost.
_MANY, _FAST = 6000, 1e-5
#: Deviation of a sine's half periods; fewest of them; least part of the record that such sines fill.
_ALIKE, _FEWEST, _FILLED = 0.15, 4, 0.8
#: Least correlation with time of a sweep's half periods, and fewest of them.
_SWEEPS, _SWEPT = 0.95, 6
#: Deviation [cycles] of a common period from whole cycles, and number of periods tried.
_WHOLE, _TRIED = 0.02, 200
#: Part of the largest power, in each interval of the logarithm, down to which noise excites.
_EXCITES = 1e-3


@dataclass(frozen=True)
class Sines:
    """Sines of ``frequency`` [Hz] (f,) with a common ``period`` [s], in the samples of ``part``."""

    part: slice
    frequency: Array
    period: float


@dataclass(frozen=True)
class Sweep:
    """A sweep of frequencies from ``low`` to ``high`` [Hz], or noise between these, from ``start`` on."""

    start: int
    low: float
    high: float
    sweeps: bool


def excitation(t: Array, u: Array, source: str) -> tuple[Sines, ...] | Sweep:
    """Return what excites a voltage ``u`` (n,) at times ``t`` [s] (n,). Raises InputError for a constant one."""
    span, noise = float(np.ptp(u)), noise_level(u)
    if not span > min(_CLEAR * noise, _EXCITED):
        level = format_quantity(float(np.median(u)), "V", 3)
        raise InputError(
            f"{source}: no excitation: the voltage stays at {level}; give a record of a sine, a chirp or a sum of sines"
        )
    if (jumps := len(voltage_jumps(_evenly(t, u)[1]))) > _JUMPS:
        raise InputError(
            f"{source}: the voltage jumps {jumps} times, between readings, so that its phase is not known; give a "
            "record of a sine, a chirp or a sum of sines, or fit this one with identify"
        )
    limit = max(_LEAVES * span, min(_CLEAR * noise, _MOST_NOISE * span))
    first = max(int(np.flatnonzero(np.abs(u - u[0]) > limit)[0]) - 1, 0)
    last = int(np.flatnonzero(np.abs(u - u[-1]) > limit)[-1]) + 2
    if last - first < _FEWEST:
        raise InputError(
            f"{source}: the voltage moves within {last - first} readings only, as in a step, which excites no "
            "frequency by itself; give a record of a sine, a chirp or a sum of sines, or fit this one with identify"
        )
    if len(found := _sines(t[first:last], u[first:last])):
        return (Sines(slice(first, last), found, common_period(found, float(t[last - 1] - t[first]))),)
    times = crossings(t[first:last], u[first:last])
    if steps := tuple(_steps(t, u, first, times)):
        return steps
    halves = np.diff(times)
    if len(halves) >= _SWEPT and abs(_rank_correlation(halves)) > _SWEEPS:
        begins, ends = _instantaneous(times, float(t[first])), _instantaneous(times[::-1], float(t[last - 1]))
        return Sweep(first, min(begins, ends), max(begins, ends), True)
    return Sweep(first, *_band(t[first:last], u[first:last]), False)


def common_period(frequency: Array, duration: float) -> float:
    """Return the shortest period [s] that has whole cycles of all frequencies, or else one that tells them apart."""
    if len(frequency) == 1:
        return float(1 / frequency[0])
    for count in range(1, _TRIED):
        period = count / float(frequency[0])
        if period > duration / 2:
            break
        cycles = frequency * period
        if np.abs(cycles - np.rint(cycles)).max() < _WHOLE * min(1.0, 2 * period / duration):
            return period
    return max(_APART / float(np.diff(frequency).min()), _APART / float(frequency[0]))


def _evenly(t: Array, u: Array) -> tuple[Array, Array]:
    """Return even times [s] at the median step, and the voltage there."""
    step = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1] + step / 2, step)
    return even, np.interp(even, t, u)


def _resampled(t: Array, u: Array) -> tuple[Array, Array, Mask]:
    """Return even times [s] from 0 on, the voltage less its mean, and where there are readings.

    There are no more times than its frequencies need. The voltage is zero where readings are missing.
    """
    even, signal = _evenly(t, u)
    place = np.clip(np.searchsorted(t, even), 1, len(t) - 1)
    known = t[place] - t[place - 1] < GAP * float(np.median(np.diff(t)))
    signal = np.where(known, signal - signal[known].mean(), 0.0)
    while len(signal) > _MANY:
        power = np.abs(np.fft.rfft(signal * np.hanning(len(signal)))) ** 2
        if power[len(power) // 4 :].sum() > _FAST * power.sum():
            break
        signal, even = _thinned(signal).mean(axis=1), _thinned(even).mean(axis=1)
        known = np.asarray(_thinned(known).all(axis=1))
    return even - t[0], signal, known


def _thinned(row: Any) -> Any:
    """Return samples (n,) by pairs (n / 2, 2)."""
    return row[: len(row) // 2 * 2].reshape(-1, 2)


def _sines(t: Array, u: Array) -> Array:
    """Return the frequencies [Hz], ascending, of the sines that make up a voltage; none if sines do not."""
    place, signal, known = _resampled(t, u)
    step, duration = float(place[1] - place[0]), float(t[-1] - t[0])
    size = float(np.sqrt(np.mean(signal[known] ** 2)))
    fade = np.hanning(len(place))
    found, left = np.zeros(0), signal
    while len(found) < _MOST:
        power = np.abs(np.fft.rfft(left * fade, 4 * len(left)))
        lines = np.fft.rfftfreq(4 * len(left), step)
        power[lines < 1 / duration] = 0.0
        new = float(lines[int(np.argmax(power))])
        if not new or (len(found) and np.abs(found - new).min() < _APART / duration):
            return np.zeros(0)
        found, rest = _refined(place[known], signal[known], np.sort(np.append(found, new)))
        left = np.zeros(len(signal))
        left[known] = rest
        if np.sqrt(np.mean(rest**2)) < _LEFT * size:
            return found if found[0] * duration >= 1 else np.zeros(0)
    return np.zeros(0)


def _refined(t: Array, signal: Array, frequency: Array) -> tuple[Array, Array]:
    """Return frequencies after three Gauss-Newton steps, and what their sines leave of the signal."""
    for _ in range(4):
        turns = np.exp(2j * np.pi * frequency * t[:, None])
        sines = np.column_stack([np.ones(len(t)), turns.real, turns.imag])
        amounts = np.linalg.lstsq(sines, signal, rcond=None)[0]
        left = signal - sines @ amounts
        a, b = np.split(amounts[1:], 2)
        slopes = 2 * np.pi * t[:, None] * (b * turns.real - a * turns.imag)
        step = np.linalg.lstsq(np.column_stack([sines, slopes]), left, rcond=1e-12)[0][-len(frequency) :]
        moved = frequency + np.clip(step, -0.3 / t[-1], 0.3 / t[-1])
        frequency = np.sort(np.abs(moved))
    return frequency, left


def crossings(t: Array, u: Array) -> Array:
    """Return the times [s] at which a voltage crosses the middle of its range, each time after a tenth of it."""
    middle = (float(u.max()) + float(u.min())) / 2
    away = u - middle
    side = np.where(np.abs(away) > 0.1 * np.abs(away).max(), np.sign(away), 0.0)
    known = np.flatnonzero(side)
    turns = np.flatnonzero(np.diff(side[known]))
    times = []
    for before, after in zip(known[turns], known[turns + 1], strict=True):
        k = before + int(np.flatnonzero(np.diff(np.sign(away[before : after + 1])))[0])
        share = away[k] / (away[k] - away[k + 1])
        times.append(t[k] + share * (t[k + 1] - t[k]))
    return np.array(times)


def _steps(t: Array, u: Array, first: int, times: Array) -> Iterator[Sines]:
    """Yield sines that follow one another, if they fill the record."""
    halves = np.diff(times)
    groups: list[list[int]] = []
    for k, half in enumerate(halves.tolist()):
        if groups and abs(half / float(np.median(halves[groups[-1]])) - 1) < _ALIKE:
            groups[-1].append(k)
        else:
            groups.append([k])
    found = []
    for group in (g for g in groups if len(g) >= _FEWEST):
        begin, end = np.searchsorted(t, [times[group[0]], times[group[-1] + 1]])
        lines = _sines(t[begin:end], u[begin:end]) if end - begin > 2 * _FEWEST else np.zeros(0)
        if len(lines) == 1:
            found.append(Sines(slice(int(begin), int(end)), lines, float(1 / lines[0])))
    filled = sum(float(t[s.part.stop - 1] - t[s.part.start]) for s in found)
    if len(found) > 1 and filled > _FILLED * float(t[-1] - t[first]):
        yield from found


def _rank_correlation(values: Array) -> float:
    """Return the rank correlation of values with their order."""
    from scipy.stats import spearmanr

    return float(spearmanr(np.arange(len(values)), values).statistic)


def _instantaneous(times: Array, at: float) -> float:
    """Return the frequency [Hz] ``at`` the time before the first of some crossings, by the first two half periods."""
    halves = np.abs(np.diff(times[:3]))
    middles = np.abs(times[:2] + np.diff(times[:3]) / 2 - at)
    slope = np.log(halves[1] / halves[0]) / (middles[1] - middles[0])
    return float(0.5 / (halves[0] * np.exp(-slope * middles[0])))


def _band(t: Array, u: Array) -> tuple[float, float]:
    """Return the lowest and the highest frequency [Hz] that noise excites."""
    even, signal = _evenly(t, u)
    step = float(even[1] - even[0])
    power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(even)))) ** 2
    lines = np.fft.rfftfreq(len(even), step)
    edges = np.geomspace(lines[1], lines[-1], max(int(10 * np.log10(lines[-1] / lines[1])), 2))
    place = np.digitize(lines[1:], edges)
    each = np.bincount(place, power[1:], minlength=len(edges) + 1)
    strong = np.flatnonzero(each > _EXCITES * each.max())
    return float(edges[max(strong[0] - 1, 0)]), float(edges[min(strong[-1], len(edges) - 1)])
