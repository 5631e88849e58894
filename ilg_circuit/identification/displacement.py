"""The fit of d(s) to one record's displacement: how far d(s) describes it, whether it drifts, which beam it shows.

The window is the longest stretch from the onset that d(s) describes; what lies outside counts in no fit and no BIC.
"""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError
from ..findings import Finding
from ..fit.bounded import profile_bounded
from ..fit.criteria import effective_samples, information_criterion
from ..fit.fitting import fit, with_starts
from ..fit.multistart import StartSummary
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..fit.selection import EVIDENCE
from ..measurements.smoothing import noise_level
from ..solve.transient import DEFAULT_ACCURACY
from ..strip.actuator import Actuator, Coupling
from ..strip.elements import lumped_elements
from .clock import in_step, likeliest_clock
from .displacement_findings import displacement_findings
from .film import Moving
from .motion import COUPLING, DisplacementData, Motion, RateOf
from .outliers import left_out, spikes
from .port_model import BRACKET
from .rest import Rest
from .start import CouplingSearch, thinned

#: Residuals up to this part of the readings' span count as described by the model.
DESCRIBED = 0.02
#: The same up to this multiple of the noise.
OVER_NOISE = 1.5
#: Tolerance of a fit that only finds out how far d(s) goes, and of the one that is reported.
_TRIAL, _FINAL = 1e-5, 1e-10
#: Starts of the fit that is reported, the tolerance of those that confirm it, and which misfits are the same.
_STARTS, _CONFIRMING, _SAME_MISFIT = 3, 1e-7, 1e-4
_WINDOW_RATIO = 1.25
#: Delays that are tried at first, the part of the record within which they lie, and the longest [s].
_DELAYS, _MOST_DELAY, _LONGEST_DELAY = 9, 0.05, 2.0
#: Largest number of fitted readings of a displacement, dense where it is fast.
_MOST_ROWS = 8000
_FEWEST_SAMPLES = 40
#: A beam whose residuals are this many times the other's is not chosen, even if few of them are independent.
_CLEARLY_WORSE = 1.5


@dataclass(frozen=True)
class DisplacementFit:
    """Fit of d(s) to one record.

    ``data`` says how far the fit goes; ``fitted`` [m] (samples,) is the model at all samples; ``per_volt`` [m/V] the
    static displacement. The fit's residuals cover rest and window. ``at_rest`` is what the rest says by itself, and
    ``supported`` whether that tells a drift over the window; ``wanted`` [m/s] is the drift that the fit would have,
    where the rest does not allow it. ``bic_gain`` is the BIC of the static beam less that of the dynamic one, None
    where only one of them could be fitted.
    """

    data: DisplacementData
    motion: Motion
    fit: FitResult
    fitted: Array
    per_volt: float
    at_rest: Rest
    supported: bool
    findings: tuple[Finding, ...]
    wanted: float | None = None
    bic_gain: float | None = None

    @property
    def coupling(self) -> Coupling:
        return Coupling(*self.fit.values.tolist(), beam=self.motion.beam)

    @property
    def rest(self) -> float:
        """Position at rest [m] by the readings before the onset; where there are none, the first reading."""
        return self.at_rest.onset if self.supported else self.at_rest.middle

    @property
    def level(self) -> float:
        """Position [m] from which the model moves: the fit's constant."""
        return self.data.reference + float(self.fit.nuisance[0])

    @property
    def drift(self) -> float | None:
        """Slow linear drift [m/s] in addition to d(s), None if the rest does not support one."""
        if self.data.drift:
            return float(self.fit.nuisance[1])
        return self.data.held if self.supported else None


@dataclass(frozen=True)
class _Attempt:
    """A fit up to ``data.window``; ``described`` if d(s) holds there.

    ``wanted`` [m/s] is the drift that it would have, where the rest does not allow it.
    """

    data: DisplacementData
    motion: Motion
    fit: FitResult
    described: bool
    wanted: float | None = None

    @property
    def begin(self) -> tuple[Array, float]:
        return self.fit.values, self.data.sign


def fit_displacement(
    record: Moving, actuator: Actuator, progress: Progress = None, delay: float | Literal["fit"] = 0.0
) -> DisplacementFit:
    """Return the fit of d(s) to the displacement of a strip whose circuit is known.

    The whole record if the model describes it; else the longest stretch from the onset that it does describe, or the
    whole record after all where it describes none. The camera's clock is behind by ``delay`` [s], or that is fitted.
    Raises InputError or SolveError where no stretch can be fitted.
    """
    rate = None
    if record.record.own_clock:
        record, rate = in_step(record, delay)
        delay = "fit" if delay == "fit" else 0.0
    if delay == "fit":
        search = _likeliest_delay(record, actuator, progress, delay_bounds(record), rate)
    else:
        search = _WindowSearch(record, actuator, progress, delay)
    best, bic_gain = search.by_evidence(search.longest())
    if delay == "fit" and best.motion.beam == "dynamic" and best.motion.linear:  # its delay is not the static beam's
        search = search.at_clock(*likeliest_clock(best.data, best.motion, best.fit))
        best = search.attempt("dynamic", best.data.window, replace(best, wanted=None)) or best
    return search.finish(*search.confirmed(best), bic_gain)


def _likeliest_delay(
    record: Moving, actuator: Actuator, progress: Progress, delays: tuple[float, float], rate: RateOf | None
) -> _WindowSearch:
    """Return the search with the one of a few delays that leaves least of the longest stretch."""
    tried: list[tuple[float, float, _Attempt, _WindowSearch]] = []
    places = np.linspace(*delays, _DELAYS).tolist()
    for delay in [0.0, *places] if record.record.own_clock else places:
        search = _WindowSearch(record, actuator, progress, delay, delays, rate)
        with suppress(InputError):
            found = search.longest()
            tried.append((-found.data.window, found.fit.rmse, found, search))
            if found.described and record.record.own_clock:
                break  # it was looked for already
    if not tried:
        raise InputError("the displacement does not follow the voltage as the coupling d(s) does, at any delay")
    *_, found, search = min(tried, key=lambda each: each[:2])
    return search.at_clock(*likeliest_clock(found.data, found.motion, found.fit)) if found.motion.linear else search


def delay_bounds(record: Moving) -> tuple[float, float]:
    """Return between which delays [s] of a camera one is looked for."""
    most = min(_MOST_DELAY * record.record.duration, _LONGEST_DELAY)
    return -most, most


class _WindowSearch:
    """One record, fitted over several windows and by both beams; what has failed is not tried again."""

    def __init__(
        self,
        record: Moving,
        actuator: Actuator,
        progress: Progress,
        delay: float,
        delays: tuple[float, float] | None = None,
        rate: RateOf | None = None,
    ) -> None:
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
        self.rest = Rest.of(channel)
        channel = channel.until(record.until)
        end = float(channel.time[-1])
        # data are fitted relative to a reference near rest, so that a rest position far away does not dominate
        reference = self.rest.middle if self.rest.count else 0.0
        measured, source = record.record.voltage, record.source
        self.base = DisplacementData(
            channel, measured, source, record.voltage, end, reference, record.engine,
            share=record.share, delay=delay, delays=delays, ahead=whole.zero - record.record.onset,
            clock=rate or RateOf(), tells_rate=rate is not None, own_clock=record.record.own_clock,
        )  # fmt: skip
        self.motions = {beam: Motion(actuator, beam, record.engine) for beam in ("static", "dynamic")}
        self.progress = progress
        self.ratio = lumped_elements(actuator).bending_ratio
        self.after = channel.time[~channel.rest]
        self.search = self._coupling_search(self.base)
        self.linear = np.column_stack([np.ones(len(channel.time)), channel.time])
        self.failed: set[tuple[str, float]] = set()

    def at_clock(self, delay: float, clock: RateOf) -> _WindowSearch:
        """Return the search with another delay and rate of the displacement's clock."""
        again, delays = copy(self), self.base.delays
        if delays is not None and self.base.own_clock:  # it is looked for about where it is
            most = (delays[1] - delays[0]) / 2
            delays = (delay - most, delay + most)
        again.base, again.failed = replace(self.base, delay=delay, delays=delays, clock=clock), set()
        again.search = self._coupling_search(again.base)
        return again

    def _coupling_search(self, data: DisplacementData) -> CouplingSearch:
        return CouplingSearch(data.since(data.channel), data.drive.from_rest(), self.ratio)

    def longest(self) -> _Attempt:
        """Return a quick fit of the longest stretch that d(s) describes, or of the whole record where there is none.

        By the static beam, as the paper's own fit, and for the whole record by the dynamic one too if it takes that.
        """
        end = float(self.base.channel.time[-1])
        whole = best = self.attempt("static", end, tolerance=_TRIAL)
        if whole is not None and not whole.described:
            rival = self.attempt("dynamic", end, whole, _TRIAL)
            best = rival if rival is not None and rival.described else whole
        while best is None or not best.described:
            end /= _WINDOW_RATIO
            if (self.after <= end).sum() < _FEWEST_SAMPLES:
                if whole is None:
                    raise InputError("the displacement does not follow the voltage as the coupling d(s) does")
                return whole
            best = self.attempt("static", end, best, _TRIAL)
        return best

    def by_evidence(self, found: _Attempt) -> tuple[_Attempt, float | None]:
        """Return the fit of the same stretch by the static beam, or by the dynamic one on very strong evidence.

        Both beams have the same parameters, since E, density and damping are the actuator's: the BIC tells them apart
        by their residuals alone, on as many samples as the better one's are independent. Where the readings leave the
        onset or a delay open each beam has its own: a static strip that began later looks like one with inertia.
        """
        end = found.data.window
        static = self.attempt("static", end, found)
        dynamic = self.attempt("dynamic", end, static or found)
        if static is None or dynamic is None:
            return static or dynamic or found, None
        fits = [_at_its_onset(a) for a in (static, dynamic)]
        samples = effective_samples(min(fits, key=lambda found: found.rmse).residuals)
        bics = [information_criterion(found.residuals, found.count, samples) for found in fits]
        gain = bics[0] - bics[1]
        clear = gain > EVIDENCE or fits[0].rmse > _CLEARLY_WORSE * fits[1].rmse
        return (dynamic if clear else static), gain

    def confirmed(self, best: _Attempt) -> tuple[_Attempt, StartSummary]:
        """Return the attempt after others of the same kind from different starts; a better one takes its place."""
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

    def attempt(
        self, beam: str, end: float, like: _Attempt | None = None, tolerance: float = _FINAL
    ) -> _Attempt | None:
        """Return the fit up to ``end`` [s], from where ``like`` ended or the search's start; None where it fails.

        Where the rest supports a drift over that stretch it is fitted; a slope beyond the rest's own interval is held
        at its end, so that what d(s) does not describe is not a drift. What this beam held over that stretch stays so.
        """
        if (beam, end) in self.failed:
            return None
        motion, data = self.motions[beam], replace(self.base, window=end)
        try:
            held = like is not None and like.data.window == end and like.motion == motion and like.wanted is not None
            if like is not None and held:
                data = replace(data, held=like.data.held)
                return replace(self._fitted(data, motion, None, tolerance, like), wanted=like.wanted)
            data = replace(data, drift=self.rest.supports(end, data.size))
            found = self._fitted(data, motion, None, tolerance, like)
            if not self._allowed(found):
                wanted = float(found.fit.nuisance[1])
                data = replace(data, drift=False, held=self.rest.nearest(wanted))
                found = replace(self._fitted(data, motion, None, tolerance, found), wanted=wanted)
        except (InputError, SolveError):
            self.failed.add((beam, end))
            return None
        return found

    def _allowed(self, found: _Attempt) -> bool:
        """Return True if the fit's drift, where it has one, lies within the interval of the rest's own slope."""
        return not found.data.drift or self.rest.nearest(slope := float(found.fit.nuisance[1])) == slope

    def finish(self, best: _Attempt, starts: StartSummary, bic_gain: float | None) -> DisplacementFit:
        channel, data, motion = self.base.channel, best.data, best.motion
        found = best.fit
        accuracy = None if motion.linear else DEFAULT_ACCURACY
        answer = motion.displacements(data.drive, data.since(channel), found.values[None], accuracy)[0]
        drifting = self.linear[:, : 1 + data.drift] @ found.nuisance + data.held * channel.time
        result = DisplacementFit(
            data=data,
            motion=motion,
            fit=with_starts(found, starts),
            fitted=data.reference + data.sign * answer + drifting,
            per_volt=data.sign * self.ratio * Coupling(*found.values.tolist()).static,
            at_rest=self.rest,
            supported=self.rest.supports(data.window, data.size),
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
        like: _Attempt | None = None,
    ) -> _Attempt:
        """Return one fit of ``data`` from ``start`` (4,), or from the search's start or where ``like`` ended.

        The one of these that leaves less is taken; the same beam over the same stretch only goes on.
        """
        starts = [] if like is None else [like.begin]
        if start is not None:
            starts = [(start, data.sign)]
        elif like is None or (like.data.window, like.data.held, like.motion) != (data.window, data.held, motion):
            starts.append(self.search.start(data.window, *self._data(data)))
        accuracy = max(0.1 * tolerance, DEFAULT_ACCURACY)
        tried = []
        for values, sign in starts:
            signed = replace(data, sign=sign)
            problem = Problem((signed.observation(motion, accuracy=accuracy),), COUPLING)
            squares = problem.sum_of_squares(problem.scales.coordinates(values[None]))[0] if len(starts) > 1 else 0.0
            tried.append((float(squares), signed, problem, values))
        _, data, problem, values = min(tried, key=lambda each: each[0])
        found = fit(problem, values, self.progress, tolerance)
        limit = max(OVER_NOISE * noise_level(data.data), DESCRIBED * data.size)
        # a fit that goes astray at its end has taken in the beginning of something else
        last = found.residuals[data.abscissa > 0.9 * data.window]
        astray = len(last) > 0 and float(np.sqrt(np.mean(last**2))) > 1.5 * limit
        return _Attempt(data, motion, found, found.rmse <= limit and not astray)


def _at_its_onset(found: _Attempt) -> FitResult:
    """Return the fit with onset and clock where this beam makes them likeliest; the same fit where they are known."""
    data, motion = found.data, found.motion
    if data.delays is not None and motion.linear:
        delay, clock = likeliest_clock(data, motion, found.fit)
        moved = replace(data, delay=delay, clock=clock)
        with suppress(SolveError):
            return fit(Problem((moved.observation(motion),), COUPLING), found.fit.values, tolerance=_TRIAL)
        return found.fit
    if not (data.bracketed and motion.linear):
        return found.fit

    def at(share: float) -> Problem:
        return Problem((data.at_share(share).observation(motion),), COUPLING)

    profile = profile_bounded(found.fit, at, BRACKET, (0,), start=data.share)
    best = int(np.argmin(profile.deviance))
    problem = at(float(profile.places[best]))
    try:
        return fit(problem, problem.scales.values(profile.coordinates[best]), tolerance=_TRIAL)
    except SolveError:
        return found.fit
