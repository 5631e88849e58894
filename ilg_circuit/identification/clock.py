"""Finds the delay and the rate of a displacement's separate clock, relative to the voltage's clock.

Initial guesses of both come from linear fits of d(s) at many delays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from ..errors import InputError
from ..fit.bounded import profile_bounded
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
#: Latest start of a camera whose record has no rest, as a fraction of that record.
_LATEST = 0.5
#: Largest relative difference of the rates of two clocks.
MOST_RATE = 0.03
#: Alternating search for delay and rate: rounds, tolerance of the delay and span about the previous one (both as
#: fractions of its bounds), refining passes.
_ROUNDS, _SAME, _SPAN, _PROFILE_LOOKS = 8, 0.005, 0.3, 2
#: Fraction of the tried span within which a result counts as inside it.
_INSIDE = 0.9
#: Number of parts of a record that are searched for motion.
_PARTS = 60


def in_step(record: Moving, delay: float | Literal["fit"]) -> tuple[Moving, RateOf | None]:
    """Return a record with its displacement on the voltage's clock, roughly where ``delay`` is to be fitted.

    The second answer is an approximate rate of the displacement's clock about the time where rate and delay are
    independent; None if the drive does not determine a rate.
    """
    channel = record.record.displacement
    assert channel is not None
    if delay != "fit":
        return _moved(record, record.record.onset + delay), None
    rests = int(channel.rest.sum()) >= _AT_REST
    span = float(channel.time[-1] - max(channel.time[0], 0.0))
    most = max(_NEAR * span, min(_NEAREST, span / 4))
    low, high = (-most, most) if rests else (-_LATEST * span, 0.0)
    gain = _gains(record, channel, span * (1 + MOST_RATE) + max(-low, high))
    late = _best(gain, low, high, RateOf())
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

    tried = profile_bounded(found, problem, (start - half, start + half), (0,), start=start, looks=_PROFILE_LOOKS)
    place = float(tried.places[int(np.argmin(tried.deviance))])
    return at(place), fit_near(problem(place), found.values)


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
