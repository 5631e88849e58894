"""Fits d(s) to one record's displacement, and chooses the window, the drift, the beam and where a clock begins.

The window is the longest stretch from the onset that d(s) describes; readings outside count in no fit and no BIC.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Literal

import numpy as np

from ..errors import InputError
from ..fit.problem import Progress
from ..strip.actuator import Actuator
from .clock import NOT_TOLD, beginnings, in_step, likeliest_clock, require_told
from .displacement_result import DisplacementFit as DisplacementFit
from .film import Moving
from .motion import RateOf
from .motion_laws import EC31, MotionLaw
from .window_search import CLEARLY_WORSE, TRIAL, Attempt, Begin, WindowSearch

#: Number of initial delays, their largest value as a fraction of the record, and in [s].
_DELAYS, _MOST_DELAY, _LONGEST_DELAY = 9, 0.05, 2.0


def fit_displacement(
    record: Moving,
    actuator: Actuator,
    progress: Progress = None,
    delay: float | Literal["fit"] = 0.0,
    law: MotionLaw = EC31,
    begin: Begin | None = None,
) -> DisplacementFit:
    """Return the fit of a ``law``, d(s) by default, to the displacement of a strip whose circuit is known.

    The window is the whole record if the model describes it; else the longest described stretch from the onset; or the
    whole record if there is none. A contest of laws says where to ``begin``, and to which end. The camera's clock is
    behind by ``delay`` [s], or the delay is fitted. Raises InputError or SolveError if no stretch can be fitted.
    """
    if delay == "fit":
        search = _likeliest_beginning(record, actuator, progress, law, begin)
    else:
        if record.record.own_clock:
            record, delay = in_step(record, delay), 0.0
        search = WindowSearch(record, actuator, progress, delay, law=law, begin=begin)
    best, bic_gain = search.by_evidence(search.longest())
    if (
        delay == "fit" and best.motion.beam == "dynamic" and best.motion.linear
    ):  # its delay differs from the static beam's
        search = search.at_clock(*likeliest_clock(best.data, best.motion, best.fit))
        best = search.again(best)
    return search.finish(*search.confirmed(best), bic_gain)


def _likeliest_beginning(
    record: Moving, actuator: Actuator, progress: Progress, law: MotionLaw, begin: Begin | None
) -> WindowSearch:
    """Return the search with the likeliest delay, of a separate clock with that of the likeliest beginning.

    Raises InputError if the displacement does not tell the delay of such a clock.
    """
    if not record.record.own_clock:
        return _likeliest_delay(record, actuator, progress, delay_bounds(record), None, law, begin)[0]
    places = beginnings(record)
    moved, rate = places[0]
    if len(places) > 1:
        tried = [
            _at_beginning(WindowSearch(m, actuator, progress, 0.0, delay_bounds(m), r, law, begin)) for m, r in places
        ]
        fitted = [(found, place) for found, place in zip(tried, places, strict=True) if found is not None]
        if not fitted:
            raise InputError(NOT_TOLD)
        (best, (moved, rate)), *others = sorted(fitted, key=lambda each: each[0].fit.rmse)
        worse = CLEARLY_WORSE if record.level is None else 1.0  # a step has one beginning, and no minima beside it
        if any(best.as_likely(other, delay_bounds(record)[1], worse) for other, _ in others):
            raise InputError(NOT_TOLD)
    search, found = _likeliest_delay(moved, actuator, progress, delay_bounds(moved), rate, law, begin)
    if len(places) > 1:
        require_told(search.base, found.motion, search.again(found).fit, record.level)
    return search


def _at_beginning(search: WindowSearch) -> Attempt | None:
    """Return a quick fit of the whole record with the likeliest clock near the search's, None if there is none."""
    found = search.attempt("static", float(search.base.channel.time[-1]), tolerance=TRIAL)
    if found is None or not found.motion.linear:
        return found
    return search.at_clock(*likeliest_clock(found.data, found.motion, found.fit)).again(found)


def _likeliest_delay(
    record: Moving,
    actuator: Actuator,
    progress: Progress,
    delays: tuple[float, float],
    rate: RateOf | None,
    law: MotionLaw,
    begin: Begin | None,
) -> tuple[WindowSearch, Attempt]:
    """Return the search with the delay, out of a few, that gives the smallest residuals over the longest stretch."""
    tried: list[tuple[float, float, Attempt, WindowSearch]] = []
    places = np.linspace(*delays, _DELAYS).tolist()
    for delay in [0.0, *places] if record.record.own_clock else places:
        search = WindowSearch(record, actuator, progress, delay, delays, rate, law, begin)
        with suppress(InputError):
            found = search.longest()
            tried.append((-found.data.window, found.fit.rmse, found, search))
            if found.described and record.record.own_clock:
                break  # it was searched already
    if not tried:
        raise InputError("the displacement does not follow the voltage as the coupling d(s) does, at any delay")
    *_, found, search = min(tried, key=lambda each: each[:2])
    if not found.motion.linear:
        return search, found
    return search.at_clock(*likeliest_clock(found.data, found.motion, found.fit)), found


def delay_bounds(record: Moving) -> tuple[float, float]:
    """Return the bounds [s] within which a camera's delay is searched.

    Where the current is late, the displacement begins with the voltage, with the current or between them.
    """
    moved = record.record.displacement
    assert moved is not None
    most = min(_MOST_DELAY * record.record.duration, _LONGEST_DELAY)
    if record.late:
        most = abs(record.late) + moved.width
    return -most, most
