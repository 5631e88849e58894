"""The fit of d(s) to one record's displacement: how far d(s) describes it, whether it drifts, which beam it shows."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError
from ..findings import Finding
from ..fit.criteria import effective_samples, information_criterion, structured
from ..fit.fitting import fit, with_starts
from ..fit.identifiability import DETERMINED
from ..fit.multistart import StartSummary
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..fit.selection import EVIDENCE
from ..measurements.smoothing import noise_level
from ..solve.transient import DEFAULT_ACCURACY
from ..strip.actuator import Actuator, Coupling
from ..strip.elements import lumped_elements
from .current import CurrentData
from .motion import COUPLING, DisplacementData, Motion
from .start import CouplingSearch

#: Residuals up to this part of the answer's span count as described by the model.
_DESCRIBED = 0.02
_OVER_NOISE = 1.5
#: Residuals below this part of the span are of no interest, whatever their structure.
_NEGLIGIBLE = 1e-4
#: Tolerance of a fit that only finds out how far d(s) goes.
_TRIAL = 1e-5
#: Starts of the fit that is reported, the tolerance of those that confirm it, and which misfits are the same.
_STARTS, _CONFIRMING, _SAME_MISFIT = 3, 1e-7, 1e-4
_WINDOW_RATIO = 1.25
_FEWEST_SAMPLES = 40


@dataclass(frozen=True)
class DisplacementFit:
    """Fit of d(s) to one record.

    ``data`` says how far the fit goes; ``fitted`` [m] (samples,) is the model at all samples; ``per_volt`` [m/V] the
    static displacement. The fit's residuals cover rest and window.
    """

    data: DisplacementData
    motion: Motion
    fit: FitResult
    fitted: Array
    per_volt: float
    findings: tuple[Finding, ...]

    @property
    def coupling(self) -> Coupling:
        return Coupling(*self.fit.values.tolist(), beam=self.motion.beam)

    @property
    def rest(self) -> float:
        """Position at rest [m]."""
        return self.data.reference + float(self.fit.nuisance[0])

    @property
    def drift(self) -> float | None:
        """Slow linear drift [m/s], None where the data show none."""
        return float(self.fit.nuisance[1]) if self.data.drift else None

    @property
    def full_span(self) -> float:
        """Span of the fit over the whole record [m]."""
        return float(np.ptp(self.fitted))

    @property
    def span(self) -> float:
        """Span of the fit over its window [m]."""
        return float(np.ptp(self.fitted[: len(self.data.part.time)]))


@dataclass(frozen=True)
class _Attempt:
    """A fit up to ``data.window``; ``described`` if d(s) holds there."""

    data: DisplacementData
    motion: Motion
    fit: FitResult
    described: bool


@dataclass(frozen=True)
class _Begin:
    beam: str
    start: Array
    sign: float


def fit_displacement(record: CurrentData, actuator: Actuator, progress: Progress = None) -> DisplacementFit:
    """Return the fit of d(s) to the displacement of a strip whose circuit is known.

    The whole record if the model describes it; else the longest stretch from the onset that it does describe, because
    what comes later is drift. Raises InputError or SolveError where no stretch can be fitted.
    """
    search = _WindowSearch(record, actuator, progress)
    end = float(search.base.channel.time[-1])
    whole = best = search.whole(end)
    while best is None or not best.described:
        end /= _WINDOW_RATIO
        if (search.after <= end).sum() < _FEWEST_SAMPLES:
            if whole is None:
                raise InputError("the displacement does not follow the voltage as the coupling d(s) does")
            best = whole
            break
        with suppress(InputError, SolveError):
            best = search.attempt(end)
    return search.finish(*search.confirmed(search.leanest(best)), shortened=best is not whole)


class _WindowSearch:
    """One record, fitted over several windows, with and without drift, by both beams."""

    def __init__(self, record: CurrentData, actuator: Actuator, progress: Progress) -> None:
        channel = record.record.displacement
        assert channel is not None
        at_rest = channel.values[channel.rest]
        # data are fitted relative to a reference near rest, so that a rest position far away does not dominate
        reference = float(np.median(at_rest)) if len(at_rest) else 0.0
        drive, voltage = record.record.drive, record.voltage
        end, engine = float(channel.time[-1]), record.engine
        self.base = DisplacementData(channel, drive, record.source, voltage, end, reference, engine)
        self.motions = {beam: Motion(actuator, beam, record.engine) for beam in ("static", "dynamic")}
        self.progress = progress
        self.ratio = lumped_elements(actuator).bending_ratio
        self.after = channel.time[~channel.rest]
        self.search = CouplingSearch(channel.time, drive, self.ratio)
        self.relative = channel.values - reference
        self.linear = np.column_stack([np.ones(len(channel.time)), channel.time])

    def attempt(self, end: float, like: _Attempt | None = None) -> _Attempt:
        """Return a quick fit up to ``end`` [s] with a drift: whether d(s) can describe this stretch at all.

        With the static beam, as the paper's own fit, or with the beam's mass and compliance from where ``like`` ended.
        """
        return self._fit(end, drift=True, like=like, tolerance=_TRIAL)

    def whole(self, end: float) -> _Attempt | None:
        """Return the attempt at the whole record, with the beam's inertia if it takes that; None where none fits."""
        with suppress(InputError, SolveError):
            static = self.attempt(end)
            with suppress(InputError, SolveError):
                return static if static.described else self.attempt(end, like=static)
            return static
        return None

    def leanest(self, richest: _Attempt) -> _Attempt:
        """Return the fit of the same stretch with a drift, and the dynamic beam, only on very strong evidence."""
        end = richest.data.window
        try:
            best = self._fit(end, drift=False)
        except (InputError, SolveError):  # a drift may hide d(s) unless it has a term
            best = self._fit(end, drift=True)
        best = self._better(best, partial(self._fit, end, drift=best.data.drift, like=best))
        like = best if best.motion.beam == "dynamic" else None
        best = self._better(best, partial(self._fit, end, drift=True, like=like))
        if richest.described and not best.described:
            best = self._fit(end, drift=True, like=like)
        return best

    def _better(self, simple: _Attempt, make_rival: Callable[[], _Attempt]) -> _Attempt:
        try:
            rival = make_rival()
        except (InputError, SolveError):
            return simple
        residuals = [a.fit.residuals for a in (simple, rival)]
        samples = max(map(effective_samples, residuals))
        costs = [
            information_criterion(r, a.fit.count, samples) for r, a in zip(residuals, (simple, rival), strict=True)
        ]
        return rival if costs[0] - costs[1] > EVIDENCE else simple

    def confirmed(self, best: _Attempt) -> tuple[_Attempt, StartSummary]:
        """Return the attempt after others of the same kind from different starts; a better one takes its place."""
        agreeing = 1
        linear = self.linear[:, : 1 + best.data.drift]
        others = self.search.starts(best.data.window, self.relative, linear, _STARTS)[1:]
        again = partial(self._fit, best.data.window, drift=best.data.drift)
        for start, sign in others:
            with suppress(InputError, SolveError):
                rival = again(begin=_Begin(best.motion.beam, start, sign), tolerance=_CONFIRMING)
                if rival.fit.rmse < best.fit.rmse * (1 - _SAME_MISFIT):
                    best, agreeing = again(begin=_Begin(best.motion.beam, rival.fit.values, sign)), 1
                elif rival.fit.rmse < best.fit.rmse * (1 + _SAME_MISFIT):
                    agreeing += 1
        return best, StartSummary(1 + len(others), agreeing)

    def finish(self, best: _Attempt, starts: StartSummary, *, shortened: bool) -> DisplacementFit:
        channel, data = self.base.channel, best.data
        answer = best.motion.displacements(data.drive, channel.time, best.fit.values[None], DEFAULT_ACCURACY)[0]
        linear = self.linear[:, : 1 + data.drift] @ best.fit.nuisance
        fitted = data.reference + data.sign * answer + linear
        coupling = Coupling(*best.fit.values.tolist())
        return DisplacementFit(
            data=data,
            motion=best.motion,
            fit=with_starts(best.fit, starts),
            fitted=fitted,
            per_volt=data.sign * self.ratio * coupling.static,
            findings=(*self._findings(best, fitted, shortened), *start_findings(starts, "displacement")),
        )

    def _fit(
        self,
        end: float,
        *,
        drift: bool,
        like: _Attempt | None = None,
        begin: _Begin | None = None,
        tolerance: float = 1e-10,
    ) -> _Attempt:
        """Return one fit; with the static beam from the search's start, or the dynamic one from where ``like`` ended.

        ``begin`` gives beam and start in place of either.
        """
        if begin is None and like is None:
            start, sign = self.search.start(end, self.relative, self.linear[:, : 1 + drift])
            begin = _Begin("static", start, sign)
        elif begin is None:
            assert like is not None
            begin = _Begin("dynamic", like.fit.values, like.data.sign)
        data = replace(self.base, window=end, sign=begin.sign, drift=drift)
        motion = self.motions[begin.beam]
        observation = data.observation(motion, accuracy=max(0.1 * tolerance, DEFAULT_ACCURACY))
        found = fit(Problem((observation,), COUPLING), begin.start, self.progress, tolerance)
        t, values = observation.x, observation.data
        span = float(np.ptp(values - found.residuals - data.nuisance @ found.nuisance))
        limit = max(_OVER_NOISE * noise_level(values), _DESCRIBED * span)
        # a fit that goes astray at its end has taken in the beginning of a drift
        last = found.residuals[t > 0.9 * end]
        astray = len(last) > 0 and float(np.sqrt(np.mean(last**2))) > 1.5 * limit
        return _Attempt(data, motion, found, found.rmse <= limit and not astray)

    def _findings(self, best: _Attempt, fitted: Array, shortened: bool) -> list[Finding]:
        channel, data, found = self.base.channel, best.data, []
        if shortened:
            away = float(np.abs(channel.values - fitted)[channel.time > data.window].max())
            found.append(Finding("displacement-shortened", values={"window": data.window, "away": away}))
        elif not best.described:
            found.append(Finding("displacement-not-described"))
        if data.sign < 0:
            found.append(Finding("displacement-axis-reversed"))
        if data.drift:
            found.append(Finding("displacement-drifts", values={"rate": float(best.fit.nuisance[-1])}))
        if best.motion.beam == "dynamic":
            found.append(Finding("displacement-shows-inertia"))
        uneasy = max(_OVER_NOISE * noise_level(channel.values), _NEGLIGIBLE * float(np.ptp(channel.values)))
        if structured(best.fit.residuals) and best.fit.rmse > uneasy:
            found.append(Finding("displacement-autocorrelated"))
        errors = zip(best.fit.labels, best.fit.values, best.fit.errors, strict=True)
        loose = [label for label, value, error in errors if error > DETERMINED * value]
        if loose:
            reason = f"standard error over {DETERMINED:.0%}: {', '.join(loose)}"
            found.append(Finding("not-determined", values={"reason": reason}))
        return found


def start_findings(starts: StartSummary, quantity: str = "") -> list[Finding]:
    """Return the finding on a best minimum that was reached from one start only."""
    if starts.confirmed:
        return []
    return [Finding("start-not-confirmed", quantity, {"starts": starts.starts})]
