"""Treats the delay and the rate of a camera's clock as unknown, with profiles that widen the fit's intervals.

A later clock resembles the beam's inertia. Where the displacement does not tell these apart, the profiles hold what
both beams admit.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arrays import Array
from ..errors import IlgError
from ..fit.bounded import LEVEL, BoundedProfile, likeliest_place, profile_bounded
from ..fit.estimate import Estimate
from ..fit.fitting import fit_near, with_starts
from ..fit.observation import Observation
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from .clock import MOST_RATE
from .motion import DisplacementData
from .port_model import Measured

#: (data, standard deviation of their residuals) -> observation with a model's prediction.
Observe = Callable[[Measured, float | Array], Observation]
#: A share, delay or rate -> the data with that value.
At = Callable[[float], Measured]
#: Range of a delay's profile about its first estimate, as a fraction of its bounds.
_NEAR = 0.15
#: Largest number of alternating searches for delay and rate; step of a delay, in sampling intervals, and of a rate.
_ROUNDS, _DELAY_STEP, _RATE_STEP = 6, 0.1, 1e-4


@dataclass(frozen=True, eq=False)
class ClockProfile:
    """The profiles of the delay [s] of one file's displacement and, if the data determine it, of its clock's rate.

    ``onset`` is the half-width [s] of the interval of the voltage's onset. ``alike`` is True if they hold what either
    beam admits, with inertia or without.
    """

    data: DisplacementData
    delay: BoundedProfile
    rate: BoundedProfile | None
    onset: float
    alike: bool = False

    @property
    def every(self) -> tuple[BoundedProfile, ...]:
        """The profiles that widen the coupling's intervals: with a rate, the delay is already a term of the fit."""
        return (self.delay if self.rate is None else self.rate,)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Delay [s] at the onset and rate, with intervals from the fit and from the bracket of the onset."""
        low, high = self.delay.admitted
        middle, errors = self.data.late, np.array([low, high]) - self.delay.middle
        found = {}
        if self.rate is not None:
            ends = self.rate.admitted
            found["displacement_clock_rate"] = Estimate(self.rate.middle, "", (ends[1] - ends[0]) / 3.92, ends)
        below, above = (errors + np.array([-self.onset, self.onset])).tolist()
        delay = Estimate(middle, "s", (above - below) / 3.92, (middle + below, middle + above))
        return {"displacement_delay": delay, **found}


def clocked(
    found: FitResult, k: int, observe: Observe, d: DisplacementData, onset: float, costly: bool, progress: Progress
) -> tuple[FitResult, ClockProfile]:
    """Return the fit with the delay and, if determined, the rate of displacement ``k`` in mid-range.

    ``onset`` is the half-width [s] of the interval of the voltage's onset.
    """
    if d.tells_rate:
        told = _rate(found, k, observe, d, costly, progress)
        if told is not None:
            found, d, rate = told
            # profile of the delay alone, with the rate free
            free = replace(d, loose=_slope(found, k, observe, d.at_rate, d.clock.rate, _RATE_STEP))
            delay = _delay(_refitted(found, k, observe, free, progress), k, observe, free, costly)
            return found, ClockProfile(d, delay, rate, onset)
        d = replace(d.at_rate(1.0), tells_rate=False)
        found = _refitted(found, k, observe, d, progress)
    tried = _delay(found, k, observe, d, costly)
    d = d.at_delay(tried.middle)
    found = _refitted(found, k, observe, d, progress)
    return found, ClockProfile(d, tried.knowing(tried.middle, found.coordinates), None, onset)


def _rate(
    found: FitResult, k: int, observe: Observe, d: DisplacementData, costly: bool, progress: Progress
) -> tuple[FitResult, DisplacementData, BoundedProfile] | None:
    """Return the fit, data and profile of the rate of a displacement's clock with its delay free; None for no rate."""
    delay, clock = d.clock.at_onset(d.delay)
    d = replace(d, delay=delay, clock=clock)
    step = _DELAY_STEP * float(np.median(np.diff(d.abscissa)))
    low, high = bounds = (d.clock.rate - MOST_RATE, d.clock.rate + MOST_RATE)
    for _ in range(_ROUNDS):
        d = replace(d, loose=_slope(found, k, observe, d.at_delay, d.delay, step))
        found = _refitted(found, k, observe, d, progress)
        at, start = partial(_with, found.problem, k, observe, d.at_rate), d.clock.rate
        if costly:
            place = profile_bounded(found, at, bounds, (k,), start=start, costly=True).middle
        else:
            place = likeliest_place(found, at, bounds, (k,), start=start)[0]
        if not low < place < high:
            return None
        d = d.at_rate(place)
        found = _refitted(found, k, observe, d, progress)
        more = float(found.nuisance_of(k)[-1])
        d = d.at_delay(d.delay + more)
        if abs(more) < step:
            break
    profile = profile_bounded(found, at, bounds, (k,), start=d.clock.rate, costly=costly)
    if profile.admitted[0] <= low or profile.admitted[1] >= high:
        return None
    d = d.at_rate(profile.middle)
    found = _refitted(found, k, observe, d, progress)
    profile = profile.knowing(profile.middle, found.coordinates)
    return found, d, profile


def _slope(found: FitResult, k: int, observe: Observe, at: At, place: float, step: float) -> Array:
    """Return the derivative (samples,) of observation ``k`` with respect to a place, at the values of a fit."""
    part, sigma = found.problem.slices[k], found.problem.observations[k].sigma
    ends = [_with(found.problem, k, observe, at, x) for x in (place - step, place + step)]
    low, high = (problem.predictions(found.coordinates[None])[0][part] for problem in ends)
    return np.asarray((high - low) / (2 * step) * sigma)


def _delay(found: FitResult, k: int, observe: Observe, d: DisplacementData, costly: bool) -> BoundedProfile:
    """Return the profile of the delay of a displacement near its estimate, or over its bounds if that is not enough."""
    assert d.delays is not None
    low, high = d.delays
    at = partial(_with, found.problem, k, observe, d.at_delay)
    near = (max(low, d.delay - _NEAR * (high - low)), min(high, d.delay + _NEAR * (high - low)))
    tried = profile_bounded(found, at, near, (k,), start=d.delay, costly=costly)
    ends = zip(tried.admitted, near, (low, high), strict=True)
    if all(end != reached or reached == last for end, reached, last in ends):
        return tried
    return profile_bounded(found, at, (low, high), (k,), start=d.delay, costly=costly)


def _refitted(found: FitResult, k: int, observe: Observe, data: DisplacementData, progress: Progress) -> FitResult:
    """Return the fit with other data of observation ``k``."""
    problem = _with(found.problem, k, observe, lambda _: data, 0.0)
    return with_starts(fit_near(problem, found.values, progress), found.starts)


def beside(
    found: FitResult,
    own: ClockProfile,
    k: int,
    rival: Observe,
    d: DisplacementData,
    costly: bool,
    progress: Progress,
) -> ClockProfile:
    """Return a clock's profile with what a ``rival`` prediction of displacement ``k`` admits, too.

    One that is clearly less likely, or cannot be fitted, admits nothing.
    """
    with suppress(IlgError):
        other, its = clocked(_refitted(found, k, rival, d, progress), k, rival, d, own.onset, costly, progress)
        ratio = max(other.rms_of(k), 1e-300) / max(found.rms_of(k), 1e-300)
        if 2 * found.independent_samples(k) * np.log(ratio) > LEVEL:
            return own
        rate = own.rate if own.rate is None or its.rate is None else own.rate.beside(its.rate)
        return replace(own, delay=own.delay.beside(its.delay), rate=rate, alike=True)
    return own


def _with(problem: Problem, k: int, observe: Observe, at: At, place: float) -> Problem:
    """Return the problem with observation ``k`` replaced by the data ``at`` a place."""
    observations = list(problem.observations)
    observations[k] = observe(at(place), observations[k].sigma)
    return replace(problem, observations=tuple(observations))
