"""Fits a law of bending to stretches of one record's displacement, and finds the longest that it describes."""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError
from ..findings import Finding
from ..fit.bounded import likeliest_place
from ..fit.criteria import effective_samples, information_criterion, share_explained
from ..fit.fitting import fit, with_starts
from ..fit.multistart import StartSummary
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..fit.selection import EVIDENCE
from ..measurements.smoothing import noise_level
from ..solve.transient import DEFAULT_ACCURACY
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from .clock import TOLD, likeliest_clock
from .displacement_findings import displacement_findings
from .displacement_result import DisplacementFit
from .film import Moving
from .motion import DisplacementData, Motion, RateOf
from .motion_laws import EC31, MotionLaw
from .outliers import left_out, spikes
from .port_model import BRACKET
from .relaxation_search import RelaxationSearch, search_of
from .start import CouplingSearch, thinned

#: Largest residuals of a displacement that counts as described, as a fraction of the readings' span.
DESCRIBED = 0.02
#: The same as a multiple of the noise.
OVER_NOISE = 1.5
#: Tolerance of a fit that only determines the window, and of the reported fit.
TRIAL, _FINAL = 1e-5, 1e-10
#: Number of starts of the reported fit, tolerance of the confirming fits, relative tolerance for the same misfit.
_STARTS, _CONFIRMING, _SAME_MISFIT = 3, 1e-7, 1e-4
WINDOW_RATIO = 1.25
#: Largest number of fitted readings of a displacement, dense where it is fast.
_MOST_ROWS = 8000
FEWEST_SAMPLES = 40
#: Ratio of residuals above which a beam or a beginning is not chosen, even if few samples are independent.
CLEARLY_WORSE = 1.5


@dataclass(frozen=True)
class Begin:
    """Where a fit begins: ``values`` of the law, ``sign`` of the axis, ``end`` [s] of the longest stretch, ``beam``."""

    values: Array
    sign: float
    end: float
    beam: str


@dataclass(frozen=True)
class Attempt:
    """A fit up to ``data.window``; ``described`` is True if d(s) describes the data there.

    ``wanted`` [m/s] is the unconstrained drift, if the rest does not allow it.
    """

    data: DisplacementData
    motion: Motion
    fit: FitResult
    described: bool
    wanted: float | None = None

    @property
    def begin(self) -> tuple[Array, float]:
        return self.fit.values, self.data.sign

    def as_likely(self, other: Attempt, apart: float, worse: float) -> bool:
        """Return True if another fit, whose delay is ``apart`` [s] and more from this one's, is about as likely.

        It is where its residuals are less than ``worse`` times as large.
        """
        ratio = other.fit.rmse / self.fit.rmse if self.fit.rmse else np.inf
        likely = ratio < worse or (ratio**2 - 1) * self.fit.independent_samples(0) < TOLD
        return bool(likely and abs(other.data.late - self.data.late) > apart)


class WindowSearch:
    """Fits of one record over several windows with both beams; failed fits are not repeated."""

    def __init__(
        self,
        record: Moving,
        actuator: Actuator,
        progress: Progress,
        delay: float,
        delays: tuple[float, float] | None = None,
        rate: RateOf | None = None,
        law: MotionLaw = EC31,
        begin: Begin | None = None,
    ) -> None:
        self.begin = begin
        whole = record.record.displacement
        assert whole is not None
        named = spikes(whole, record.drive)
        self.about_readings = left_out(whole, np.flatnonzero(named), "", "displacement", "m")
        channel = whole.without(named)
        if len(channel.time) > _MOST_ROWS:
            thin = np.ones(len(channel.time), dtype=bool)
            thin[thinned(channel.time, _MOST_ROWS)] = False
            self.about_readings.append(Finding("displacement-thinned", values={"of": len(thin), "kept": _MOST_ROWS}))
            channel = channel.without(thin)
        self.rest = channel.at_rest
        channel = channel.until(record.until)
        end = float(channel.time[-1])
        # data are fitted relative to a reference near rest, so that a large rest position does not dominate
        reference = self.rest.middle if self.rest.count else 0.0
        measured, source = replace(record.record.voltage, places=record.places), record.source
        self.base = DisplacementData(
            channel, measured, source, record.voltage, end, reference, record.engine,
            share=record.share, delay=delay, delays=delays, ahead=whole.zero - record.record.onset,
            clock=rate or RateOf(), tells_rate=rate is not None, own_clock=record.record.own_clock,
        )  # fmt: skip
        self.law, self.actuator = law, actuator
        self.progress = progress
        self.ratio = lumped_elements(actuator).bending_ratio
        self.after = channel.time[~channel.rest]
        self.search = self._coupling_search(self.base)
        self.linear = np.column_stack([np.ones(len(channel.time)), channel.time])
        if isinstance(self.search, RelaxationSearch) and not law.signs:
            self.law = self.search.law = self.search.signed(end, *self._data(self.base))
        self.motions = {beam: Motion(actuator, beam, record.engine, law=self.law) for beam in ("static", "dynamic")}
        self.failed: set[tuple[str, float]] = set()

    def at_clock(self, delay: float, clock: RateOf) -> WindowSearch:
        """Return the search with another delay and rate of the displacement's clock."""
        again, delays = copy(self), self.base.delays
        if delays is not None and self.base.own_clock:  # bounds are centred on this delay
            most = (delays[1] - delays[0]) / 2
            delays = (delay - most, delay + most)
        again.base, again.failed = replace(self.base, delay=delay, delays=delays, clock=clock), set()
        again.search = self._coupling_search(again.base)
        return again

    def again(self, found: Attempt) -> Attempt:
        """Return the fit of an attempt's beam and stretch by this search's clock, the attempt where it fails."""
        return self.attempt(found.motion.beam, found.data.window, replace(found, wanted=None)) or found

    def _coupling_search(self, data: DisplacementData) -> CouplingSearch | RelaxationSearch:
        return search_of(self.law, data.since(data.channel), data.drive.from_rest(), self.actuator, self.ratio)

    def longest(self) -> Attempt:
        """Return a quick fit of the longest stretch that d(s) describes, or of the whole record if there is none.

        The static beam is used, as in the paper; for the whole record the dynamic beam too, if only it describes that.
        """
        end = float(self.base.channel.time[-1])
        if self.begin is not None:
            end = min(end, self.begin.end)
        whole = best = self.attempt(self.begin.beam if self.begin else "static", end, tolerance=TRIAL)
        if whole is not None and not whole.described:
            rival = self.attempt("dynamic", end, whole, TRIAL)
            best = rival if rival is not None and rival.described else whole
        while best is None or not best.described:
            end /= WINDOW_RATIO
            if (self.after <= end).sum() < FEWEST_SAMPLES:
                if whole is None:
                    raise InputError("the displacement does not follow the voltage as the coupling d(s) does")
                return whole
            best = self.attempt("static", end, best, TRIAL)
        return best

    def by_evidence(self, found: Attempt) -> tuple[Attempt, float | None]:
        """Return the fit of the same stretch by the static beam, or by the dynamic one on very strong evidence.

        Both beams have the same parameters, since E, density and damping are the actuator's. The BIC therefore depends
        on the residuals only; the number of independent samples is taken from the better fit. If the onset or a delay
        is uncertain, it is fitted for each beam: a later onset of a static beam resembles inertia.
        """
        end = found.data.window
        if self.begin is not None and (best := self.attempt(self.begin.beam, end, found)) is not None:
            return best, None
        static = self.attempt("static", end, found)
        dynamic = self.attempt("dynamic", end, static or found)
        if static is None or dynamic is None:
            return static or dynamic or found, None
        fits = [_at_its_onset(a) for a in (static, dynamic)]
        samples = effective_samples(min(fits, key=lambda found: found.rmse).residuals)
        bics = [information_criterion(found.residuals, found.count, samples) for found in fits]
        gain = bics[0] - bics[1]
        clear = gain > EVIDENCE or fits[0].rmse > CLEARLY_WORSE * fits[1].rmse
        return (dynamic if clear else static), gain

    def confirmed(self, best: Attempt) -> tuple[Attempt, StartSummary]:
        """Return the best of the attempt and of further fits from different starts, and a summary of the starts."""
        agreeing = 1
        negligible = DEFAULT_ACCURACY * best.data.size
        others = self.search.starts(best.data.window, *self._data(best.data), _STARTS)[1:]
        for values, sign in others:
            data = replace(best.data, sign=sign)
            try:
                rival = self._fitted(data, best.motion, values, _CONFIRMING)
                if not self._allowed(rival):
                    continue
                if negligible < rival.fit.rmse < best.fit.rmse * (1 - _SAME_MISFIT):
                    better = self._fitted(data, best.motion, rival.fit.values, _FINAL)
                    best, agreeing = replace(better, wanted=best.wanted), 1
                elif rival.fit.rmse < max(best.fit.rmse * (1 + _SAME_MISFIT), negligible):
                    agreeing += 1
            except (InputError, SolveError):
                continue
        return best, StartSummary(1 + len(others), agreeing)

    def attempt(self, beam: str, end: float, like: Attempt | None = None, tolerance: float = _FINAL) -> Attempt | None:
        """Return the fit up to ``end`` [s], started from the fit ``like`` or the initial guess; None if it fails.

        If the rest bounds a drift, it is fitted. A slope outside the rest's interval is held at the interval's end, so
        that a misfit of d(s) is not taken for drift. A drift once held stays held for this beam and stretch.
        """
        if (beam, end) in self.failed:
            return None
        motion, data = self.motions[beam], replace(self.base, window=end)
        try:
            held = like is not None and like.data.window == end and like.motion == motion and like.wanted is not None
            if like is not None and held:
                data = replace(data, held=like.data.held)
                return replace(self._fitted(data, motion, None, tolerance, like), wanted=like.wanted)
            data = replace(data, drift=self.rest.bounds_drift)
            found = self._fitted(data, motion, None, tolerance, like)
            if not self._allowed(found):
                wanted = float(found.fit.nuisance[1])
                data = replace(data, drift=False, held=self.rest.nearest(wanted))
                found = replace(self._fitted(data, motion, None, tolerance, found), wanted=wanted)
        except (InputError, SolveError):
            self.failed.add((beam, end))
            return None
        return found

    def _allowed(self, found: Attempt) -> bool:
        """Return True if the fit's drift, if any, lies within the interval of the slope at rest."""
        return not found.data.drift or self.rest.nearest(slope := float(found.fit.nuisance[1])) == slope

    def finish(self, best: Attempt, starts: StartSummary, bic_gain: float | None) -> DisplacementFit:
        channel, data, motion = self.base.channel, best.data, best.motion
        found = best.fit
        share, small = share_explained(found.residuals, found.problem.projected(found.problem.data))
        if small:
            begin, end = data.abscissa[[0, -1]].tolist()
            raise InputError(
                f"the voltage explains {share:.1%} of it from {begin:.4g} s to {end:.4g} s after the onset: look at "
                "its column and its clock, and whether the tip moves while it is filmed"
            )
        accuracy = None if motion.linear else DEFAULT_ACCURACY
        answer = motion.displacements(data.drive, data.since(channel), found.values[None], accuracy)[0]
        drifting = self.linear[:, : 1 + data.drift] @ found.nuisance + data.held * channel.time
        result = DisplacementFit(
            data=data,
            motion=motion,
            fit=with_starts(found, starts),
            fitted=data.reference + data.sign * answer + drifting,
            per_volt=data.sign * self.ratio * motion.law.coupling(found.values).static,
            at_rest=self.rest,
            wanted=best.wanted,
            findings=(),
            bic_gain=bic_gain,
        )
        return replace(result, findings=(*self.about_readings, *displacement_findings(result, best.described)))

    def _data(self, data: DisplacementData) -> tuple[Array, Array]:
        """Return displacements (samples,) of the whole record and the linear terms (samples, k) of its fit."""
        t = data.channel.time
        return data.channel.values - data.reference - data.held * t, self.linear[:, : 1 + data.drift]

    def _fitted(
        self,
        data: DisplacementData,
        motion: Motion,
        start: Array | None,
        tolerance: float,
        like: Attempt | None = None,
    ) -> Attempt:
        """Return one fit of ``data`` from ``start`` (4,), from the initial guess or from the fit ``like``.

        The start with the smaller residuals is taken; for the same beam and stretch the fit ``like`` is continued.
        """
        starts = [] if like is None else [like.begin]
        if start is not None:
            starts = [(start, data.sign)]
        elif like is None or (like.data.window, like.data.held, like.motion) != (data.window, data.held, motion):
            starts += [(self.begin.values, self.begin.sign)] if self.begin is not None else []
            with suppress(*([InputError] if starts else [])):
                starts.append(self.search.start(data.window, *self._data(data)))
        accuracy = max(0.1 * tolerance, DEFAULT_ACCURACY)
        tried = []
        for values, sign in starts:
            signed = replace(data, sign=sign)
            problem = Problem((signed.observation(motion, accuracy=accuracy),), motion.law.parameters)
            squares = problem.sum_of_squares(problem.scales.coordinates(values[None]))[0] if len(starts) > 1 else 0.0
            tried.append((float(squares), signed, problem, values))
        _, data, problem, values = min(tried, key=lambda each: each[0])
        found = fit(problem, values, self.progress, tolerance)
        return Attempt(data, motion, found, describes(found.residuals, data.abscissa, data.window, data.data))


def describes(residuals: Array, t: Array, window: float, readings: Array) -> bool:
    """Return whether ``residuals`` (samples,) at ``t`` [s] are small against noise or span of ``readings`` [m].

    ``readings`` are all up to the ``window`` [s], of which residuals may be some.
    """
    limit = max(OVER_NOISE * noise_level(readings), DESCRIBED * float(np.ptp(readings)))
    # residuals that grow at the end of the window show the beginning of a different process
    last = residuals[t > 0.9 * window]
    astray = len(last) > 0 and float(np.sqrt(np.mean(last**2))) > 1.5 * limit
    return float(np.sqrt(np.mean(residuals**2))) <= limit and not astray


def _at_its_onset(found: Attempt) -> FitResult:
    """Return the fit with the most likely onset and clock for this beam; the same fit if they are known."""
    data, motion = found.data, found.motion
    if data.delays is not None and motion.linear:
        delay, clock = likeliest_clock(data, motion, found.fit)
        moved = replace(data, delay=delay, clock=clock)
        with suppress(SolveError):
            return fit(Problem((moved.observation(motion),), motion.law.parameters), found.fit.values, tolerance=TRIAL)
        return found.fit
    if not (data.bracketed and motion.linear):
        return found.fit

    def at(share: float) -> Problem:
        return Problem((data.at_share(share).observation(motion),), motion.law.parameters)

    place, coordinates = likeliest_place(found.fit, at, BRACKET, start=data.share)
    problem = at(place)
    try:
        return fit(problem, problem.scales.values(coordinates), tolerance=TRIAL)
    except SolveError:
        return found.fit
