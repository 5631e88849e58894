"""Finds the delay and the rate of a displacement's separate clock, relative to the voltage's clock.

Initial guesses of both come from linear fits of d(s) at many delays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument
from ..fit.bounded import likeliest_place
from ..fit.criteria import structured
from ..fit.fitting import fit_near
from ..fit.problem import Problem
from ..fit.result import FitResult
from ..measurements.record import Channel
from .film import FilmData, Moving
from .motion import DisplacementData, Motion, RateOf
from .start import CouplingSearch, thinned

#: Rough search: number of readings, of delays in each pass, of refining passes, and factor by which each is narrower.
_ROWS, _PLACES, _LOOKS, _CLOSER = 200, 13, 3, 0.25
#: Number of times at which the basis functions of d(s) are computed.
_GRID = 500
#: Least number of readings at rest for finding the beginning of the motion; uncertainty of that, as a fraction of the
#: record and at most [s].
_AT_REST, _NEAR, _NEAREST = 5, 0.05, 2.0
#: Farthest beginning of the voltage before or after the first reading where no rest is seen, as a fraction of the
#: record; the same before it where the voltage's record is longer; least number of places that are looked at on either
#: side, and most that are tried.
_FARTHEST, _LONGEST, _FEWEST_PLACES, _MOST_PLACES = 0.5, 4.0, 20, 8
#: Ratios of residual squares up to which another place may be as good as that of a rest, and as the best of all, by
#: rough fits.
_AS_GOOD, _MAY_BE = 2.0, 10.0
#: Difference of deviances that tells one delay from another.
TOLD = 10.0
#: Steps of a delay, in sampling intervals, and of a rate for derivatives; part of a change by which it is like others.
_STEP, _RATE_STEP, _ROUNDING, _ALIKE = 0.1, 1e-4, 1e-10, 1e-3
NOT_TOLD = (
    "it shows no rest before the voltage, and its clock's delay, on which the gain depends, cannot be told: "
    f"give {argument('displacement_delay')}, or a displacement that begins at rest"
)
#: Largest relative difference of the rates of two clocks.
MOST_RATE = 0.03
#: Alternating search for delay and rate: rounds, tolerance of the delay and span about the previous one (both as
#: fractions of its bounds), refining passes.
_ROUNDS, _SAME, _SPAN = 8, 0.005, 0.3
#: Fraction of the tried span within which a result counts as inside it.
_INSIDE = 0.9
#: Number of parts of a record that are searched for motion.
_PARTS = 60


def in_step(record: Moving, delay: float) -> Moving:
    """Return a record whose displacement's clock is behind by ``delay`` [s] with its times on the voltage's clock."""
    return _moved(record, record.record.onset + delay)


def beginnings(record: Moving) -> list[tuple[Moving, RateOf | None]]:
    """Return a record with its displacement roughly on the voltage's clock, once for each place where it may begin.

    Where a rest is seen it begins near the end of that; a displacement without one may begin anywhere, and a rest under
    a drive of several levels may be that before a later one. The likeliest are given, the best first. Beside each is an
    approximate rate of the displacement's clock about the time where rate and delay are independent; None if the drive
    does not determine a rate.
    """
    channel = record.record.displacement
    assert channel is not None
    span = float(channel.time[-1] - max(channel.time[0], 0.0))
    most = max(_NEAR * span, min(_NEAREST, span / 4))
    earliest = min(max(_FARTHEST * span, record.record.duration - span + most), _LONGEST * span)
    wide = (-earliest, _FARTHEST * span)

    def gains(farthest: float) -> Callable[..., float]:
        return _gains(record, channel, span * (1 + MOST_RATE) + farthest)

    lates, found = [], []
    if int(channel.rest.sum()) >= _AT_REST:
        near = gains(most)
        lates = [_best(near, -most, most, RateOf())]
        found = [_rated(record, near, lates[0], most)]
        if record.level is not None:
            return found
    gain = gains(earliest + most)
    others = _likeliest_places(gain, wide, most, lates, _spread(channel))[len(lates) :]
    return found + [_rated(record, gain, late, most) for late in others]


def _likeliest_places(
    gain: Callable[..., float], wide: tuple[float, float], most: float, near: list[float], total: float
) -> list[float]:
    """Return delays [s] within ``wide`` that explain the displacement best, apart by more than ``most``.

    They leave not much more of the ``total`` squares than the best, or than the place ``near`` a rest.
    """
    spacing = most / 2
    grid = np.linspace(*wide, max(int((wide[1] - wide[0]) / spacing), 2 * _FEWEST_PLACES))
    gains = np.array([gain(float(late), RateOf()) for late in grid])
    tops = gains >= np.maximum(np.append(-np.inf, gains[:-1]), np.append(gains[1:], -np.inf))
    order = [k for k in np.argsort(-gains, kind="stable").tolist() if tops[k] and np.isfinite(gains[k])]
    if near:
        least = total - _AS_GOOD * (total - gain(near[0], RateOf()))
    else:
        least = total - _MAY_BE * (total - float(gains.max()))
    found, likely = list(near), [k for k in order if gains[k] >= least]
    sides = [] if near else [[k for k in order if (grid[k] > 0) == rests][:1] for rests in (True, False)]
    order = [*(k for side in sides for k in side), *likely]
    for k in order:
        if len(found) == _MOST_PLACES:
            break
        if all(abs(grid[k] - late) > most for late in found):
            found.append(_best(gain, float(grid[k]) - spacing, float(grid[k]) + spacing, RateOf()))
    return found or [0.0]


def _rated(record: Moving, gain: Callable[..., float], late: float, most: float) -> tuple[Moving, RateOf | None]:
    """Return the record that begins ``late`` [s], and the approximate rate of its displacement's clock."""
    channel = record.record.displacement
    assert channel is not None
    if record.level is not None:
        return _moved(record, channel.zero + late), None

    def rated(place: float, rate: RateOf, begin: float) -> float:
        return gain(begin, replace(rate, rate=place))

    rate = RateOf(1.0, _pivot(channel, late))
    for part in (1.0, 0.2):
        half = part * MOST_RATE
        rate = replace(rate, rate=_best(rated, rate.rate - half, rate.rate + half, rate, late))
        late = _best(gain, late - part * most, late + part * most, rate)
    return _moved(record, channel.zero + late), replace(rate, pivot=rate.pivot - late)


def require_told(data: DisplacementData, motion: Motion, found: FitResult, level: float | None) -> None:
    """Raise InputError for a fit whose delay the displacement does not tell from others, which have other gains.

    Readings that all come after a step, of a ``level`` [V], tell no delay. Under another drive they tell it unless a
    later clock has the effect of other parameters, or they are not described without a rest: another delay may then be
    a better one.
    """
    rests = float(data.clock.times(data.channel.time[:1])[0]) < data.delay
    if level is not None or (not rests and structured(found.residuals)):
        told = level is not None and rests
    else:
        assert data.delays is not None
        step = _STEP * float(np.median(np.diff(data.abscissa)))
        moves = [_change(data.at_delay, data.delay, step, motion, found)]
        if data.tells_rate:
            moves.append(_change(data.at_rate, data.clock.rate, _RATE_STEP, motion, found))
        later, *beside = moves
        known = np.column_stack([found.slopes / np.linalg.norm(found.slopes, axis=0), *beside])
        own = later - known @ np.linalg.lstsq(known, later, rcond=_ROUNDING)[0]
        seen = (data.delays[1] - data.delays[0]) / 2 * float(np.linalg.norm(own))
        share = found.independent_samples(0) / len(own)
        told = bool(np.linalg.norm(own) > _ALIKE * np.linalg.norm(later) and seen**2 * share > TOLD * found.rmse**2)
    if not told:
        raise InputError(NOT_TOLD)


def _change(
    at: Callable[[float], DisplacementData], place: float, step: float, motion: Motion, found: FitResult
) -> Array:
    """Return the derivative (samples,) of the prediction of a fit with respect to a clock's delay or rate."""
    ends = (Problem((at(x).observation(motion),), motion.law.parameters) for x in (place - step, place + step))
    low, high = (problem.predictions(found.coordinates[None])[0] for problem in ends)
    return np.asarray((high - low) / (2 * step))


def likeliest_clock(data: DisplacementData, motion: Motion, found: FitResult) -> tuple[float, RateOf]:
    """Return the most likely delay [s] and rate near the values of a fit of ``data``."""
    assert data.delays is not None
    span = (data.delays[1] - data.delays[0]) / 2
    for _ in range(_ROUNDS):
        before = data
        if data.tells_rate:
            data, found = _likeliest(data, motion, found, data.at_rate, data.clock.rate, MOST_RATE / 3)
        data, found = _likeliest(data, motion, found, data.at_delay, data.delay, _SPAN * span)
        moved = abs(data.delay - before.delay)
        if moved < _SAME * span or (not data.tells_rate and moved < _INSIDE * _SPAN * span):
            break
    return data.delay, data.clock


def _likeliest(
    data: DisplacementData,
    motion: Motion,
    found: FitResult,
    at: Callable[[float], DisplacementData],
    start: float,
    half: float,
) -> tuple[DisplacementData, FitResult]:
    """Return the data at the most likely delay within ``half`` of ``start``, and their fit."""

    def problem(place: float) -> Problem:
        return Problem((at(place).observation(motion),), motion.law.parameters)

    place, coordinates = likeliest_place(found, problem, (start - half, start + half), start=start)
    return at(place), fit_near(problem(place), found.problem.scales.values(coordinates))


def _moved(record: Moving, zero: float) -> Moving:
    """Return a record whose displacement begins where its clock reads ``zero`` [s]."""
    channel = record.record.displacement
    assert channel is not None
    moved = replace(channel, time=channel.time + (channel.zero - zero), zero=zero)
    if not (moved.time >= 0).any():
        raise InputError("the displacement ends before the voltage begins: is its delay right?")
    if isinstance(record, FilmData):
        return replace(record, record=replace(record.record, displacement=moved))
    return replace(record, record=replace(record.record, displacement=moved))


def _gains(record: Moving, channel: Channel, end: float) -> Callable[[float, RateOf], float]:
    """Return the sum of squares that d(s) explains as a function of a clock's delay and rate.

    ``end`` [s] is the last time at which it is evaluated.
    """
    keep = thinned(channel.time, _ROWS)
    time, values, level = channel.time[keep], channel.values[keep], np.ones((len(keep), 1))
    search = CouplingSearch(np.linspace(0.0, end, _GRID), record.drive.from_rest(), 1.0)

    def gain(late: float, rate: RateOf) -> float:
        t = rate.times(time) - late
        return search.at(t).gain(values, level) if (t > 0).sum() > _AT_REST else -np.inf

    return gain


def _spread(channel: Channel) -> float:
    """Return the sum of squares of the readings that `_gains` explains, about their mean."""
    values = channel.values[thinned(channel.time, _ROWS)]
    return float(np.sum((values - values.mean()) ** 2))


def _best(gain: Callable[..., float], low: float, high: float, *beside: object) -> float:
    """Return the argument that maximises a gain with further arguments ``beside``, by successive refinement."""
    for _ in range(_LOOKS):
        places = np.linspace(low, high, _PLACES)
        best = float(places[int(np.argmax([gain(float(x), *beside) for x in places]))])
        half = _CLOSER * (high - low) / 2
        low, high = best - half, best + half
    return best


def _pivot(channel: Channel, late: float) -> float:
    """Return the mean time [s] of the motion, about which delay and rate are independent."""
    after = channel.time >= late
    t, y = channel.time[after], channel.values[after]
    edges = np.linspace(t[0], t[-1], _PARTS + 1)
    part = np.clip(np.digitize(t, edges) - 1, 0, _PARTS - 1)
    count = np.bincount(part, minlength=_PARTS)
    filled = count > 0
    means = np.bincount(part, weights=y, minlength=_PARTS)[filled] / count[filled]
    middles = ((edges[1:] + edges[:-1]) / 2)[filled]
    weights = np.diff(means) ** 2
    total = float(weights.sum())
    return float(weights @ ((middles[1:] + middles[:-1]) / 2) / total) if total else float(t.mean())
