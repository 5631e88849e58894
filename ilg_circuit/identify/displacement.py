"""The electromechanical fit: d(s) of EC (31) to a measured displacement, with rest position and drift set aside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..errors import InputError, SolveError
from ..fit.least_squares import Fit, fit_circuit
from ..fit.residuals import effective_samples, information_criterion, structured
from ..measurements.record import Channel, Record
from ..measurements.smoothing import noise_level
from ..solve.transient import DEFAULT_ACCURACY, transient
from ..strip.actuator import Actuator, Coupling
from ..strip.elements import lumped_elements
from ..strip.port import Port
from ..units import format_quantity
from .scout import Scouting
from .start import CouplingSearch

Array = NDArray[np.float64]

NAMES = ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency")

#: Residuals up to this part of the answer's span count as described by the model.
_DESCRIBED = 0.02
_OVER_NOISE = 1.5
#: Residuals below this part of the span are of no interest, whatever their structure.
_NEGLIGIBLE = 1e-4
#: Largest ringing [rad] of d(s) that a fit follows.
_MOST_RINGING = 300.0
#: Tolerance of a fit that only finds out how far d(s) goes.
_SCOUTING = 1e-5
#: A nuisance term must earn its place by this much BIC (very strong evidence).
_EVIDENCE = 10.0
#: Starts of the fit that is reported, the tolerance of those that confirm it, and which misfits are the same.
_STARTS, _CONFIRMING, _SAME_MISFIT = 3, 1e-7, 1e-4
_WINDOW_RATIO = 1.25
_FEWEST_SAMPLES = 40


@dataclass(frozen=True)
class DisplacementFit:
    """Fit of d(s). ``channel``: all samples, ``fitted`` [m] at all of them, ``window`` [s]: up to where the fit goes.

    ``rest`` [m] is the position at rest, ``drift`` [m/s] a slow linear one where the data show it, ``sign`` -1 where
    the camera's axis points away from the anode. The fit's residuals cover rest and window.
    """

    coupling: Coupling
    fit: Fit
    channel: Channel
    fitted: Array
    window: float
    rest: float
    drift: float | None
    sign: float
    per_volt: float
    beam: str
    scouting: Scouting
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Attempt:
    fit: Fit
    sign: float
    offset: bool
    drift: bool
    end: float
    beam: str
    described: bool


@dataclass(frozen=True)
class _Begin:
    beam: str
    start: Array
    sign: float


def fit_displacement(
    measurement: Record, actuator: Actuator, engine: str = "ngspice", progress: Callable[[], None] | None = None
) -> DisplacementFit:
    """Fit d(s) to the measured displacement of a strip whose circuit is known.

    The whole record if the model describes it; else the longest stretch from the onset that it does describe, because
    what comes later is drift. Raises InputError or SolveError when no stretch can be fitted.
    """
    assert measurement.displacement is not None
    problem = _Problem(measurement, actuator, engine, progress)
    end = float(problem.channel.time[-1])
    whole = best = problem.whole(end)
    while best is None or not best.described:
        end /= _WINDOW_RATIO
        if (problem.after <= end).sum() < _FEWEST_SAMPLES:
            if whole is None:
                raise InputError("the displacement does not follow the voltage as the coupling d(s) does")
            best = whole
            break
        with suppress(InputError, SolveError):
            best = problem.attempt(end)
    lean, scouting = problem.confirmed(problem.leanest(best))
    return problem.finish(lean, scouting, shortened=best is not whole)


def displacements(
    actuator: Actuator,
    drive: PiecewiseLinear,
    t: Array,
    values: Array,
    beam: str,
    engine: str,
    accuracy: float = DEFAULT_ACCURACY,
) -> Array:
    """Displacement [m] (m, samples) at ``t`` [s], zero before 0, of coupling constants ``values`` (m, 4).

    Raises SolveError for constants that ring for longer than any record resolves.
    """
    after = t >= 0
    zeta, wn = values[0, 2:]
    # radians of ringing to be followed: far more than any record shows, a fit has gone astray
    if min(wn * t[-1], 20 / zeta) > _MOST_RINGING:
        raise SolveError("the fit of d(s) left what the record can resolve")
    netlists = [strip_netlist(replace(actuator, coupling=Coupling(*v)), beam=beam) for v in values.tolist()]
    index = [o.name for o in netlists[0].outputs].index("displacement")
    result = np.zeros((len(values), len(t)))
    result[:, after] = transient(netlists, drive, t[after], engine=engine, accuracy=accuracy).values[:, index]
    return result


def moving_strip(actuator: Actuator, beam: str) -> Actuator:
    """The strip with as many ions as the displacement feels: none with the static beam and no electrode resistance."""
    lumped = lumped_elements(actuator)
    if beam != "static" or lumped.electrode_resistance:
        return actuator
    simplest = Port(lumped.dc_resistance, ((lumped.dynamic_resistance, lumped.capacitance),))
    return Actuator.from_port(actuator.geometry, simplest, base=actuator.material)


class _Problem:
    """One record, fitted over several windows and with several nuisance terms."""

    def __init__(
        self, measurement: Record, actuator: Actuator, engine: str, progress: Callable[[], None] | None
    ) -> None:
        assert measurement.displacement is not None
        self.channel = measurement.displacement
        self.drive = measurement.drive
        self.strips = {beam: moving_strip(actuator, beam) for beam in ("static", "dynamic")}
        self.engine = engine
        self.progress = progress
        self.ratio = lumped_elements(actuator).bending_ratio
        self.after = self.channel.time[~self.channel.rest]
        at_rest = self.channel.values[self.channel.rest]
        self.search = CouplingSearch(self.channel.time, self.drive, self.ratio)
        self.nuisance = np.column_stack([np.ones(len(self.channel.time)), self.channel.time])
        # data are fitted relative to a reference near rest, so that a rest position far away does not dominate
        self.reference = float(np.median(at_rest)) if len(at_rest) else 0.0

    def attempt(self, end: float, like: _Attempt | None = None) -> _Attempt:
        """A quick fit up to ``end`` [s] with every nuisance term: whether d(s) can describe this stretch at all.

        With the static beam, as the paper's own fit, or with the beam's mass and compliance from where ``like`` ended.
        """
        return self._fit(end, offset=True, drift=True, like=like, tolerance=_SCOUTING)

    def whole(self, end: float) -> _Attempt | None:
        """The attempt at the whole record, with the beam's inertia if it takes that; None where no fit comes about."""
        with suppress(InputError, SolveError):
            static = self.attempt(end)
            with suppress(InputError, SolveError):
                return static if static.described else self.attempt(end, like=static)
            return static
        return None

    def leanest(self, richest: _Attempt) -> _Attempt:
        """The same stretch with no more nuisance terms, and the dynamic beam only, if there is very strong evidence."""
        end = richest.end
        # where the rest was measured its uncertainty belongs into the intervals
        measured_rest = bool(self.channel.rest.any())
        best = self._first_that_fits(end, ((measured_rest, False), (True, False), (True, True)))
        best = self._better(best, partial(self._fit, end, offset=best.offset, drift=best.drift, like=best))
        for drift in (False, True):
            like = best if best.beam == "dynamic" else None
            best = self._better(best, partial(self._fit, end, offset=True, drift=drift, like=like))
            if richest.described and not best.described and drift:
                best = self._fit(end, offset=True, drift=True, like=like)
        return best

    def _first_that_fits(self, end: float, nuisances: Sequence[tuple[bool, bool]]) -> _Attempt:
        """The fit with the first of (offset, drift) that leads to one: a drift may hide d(s) unless it has a term.

        Raises what the last one raises.
        """
        for offset, drift in nuisances[:-1]:
            with suppress(InputError, SolveError):
                return self._fit(end, offset=offset, drift=drift)
        offset, drift = nuisances[-1]
        return self._fit(end, offset=offset, drift=drift)

    def _better(self, simple: _Attempt, make_rival: Callable[[], _Attempt]) -> _Attempt:
        try:
            rival = make_rival()
        except (InputError, SolveError):
            return simple
        samples = max(effective_samples(simple.fit.residuals), effective_samples(rival.fit.residuals))
        gain = information_criterion(simple.fit.residuals, simple.fit.count, samples)
        gain -= information_criterion(rival.fit.residuals, rival.fit.count, samples)
        return rival if gain > _EVIDENCE else simple

    def confirmed(self, best: _Attempt) -> tuple[_Attempt, Scouting]:
        """The attempt after others of the same kind from different starts; a better one of them takes its place."""
        agreeing = 1
        relative = self.channel.values - self.reference
        nuisance = self.nuisance[:, : best.offset + best.drift]
        others = self.search.starts(best.end, relative, nuisance, _STARTS)[1:]
        fit = partial(self._fit, best.end, offset=best.offset, drift=best.drift)
        for start, sign in others:
            with suppress(InputError, SolveError):
                rival = fit(begin=_Begin(best.beam, start, sign), tolerance=_CONFIRMING)
                if rival.fit.rmse < best.fit.rmse * (1 - _SAME_MISFIT):
                    again = _Begin(best.beam, rival.fit.values, sign)
                    best, agreeing = fit(begin=again), 1
                elif rival.fit.rmse < best.fit.rmse * (1 + _SAME_MISFIT):
                    agreeing += 1
        return best, Scouting(best.fit.values, 1 + len(others), agreeing)

    def model(self, t: Array, sign: float, beam: str, accuracy: float = DEFAULT_ACCURACY) -> Callable[[Array], Array]:
        """Displacement at ``t`` (zero at rest) as a function of (m, 4) coupling constants."""

        def waves(values: Array) -> Array:
            return sign * displacements(self.strips[beam], self.drive, t, values, beam, self.engine, accuracy)

        return waves

    def finish(self, best: _Attempt, scouting: Scouting, *, shortened: bool) -> DisplacementFit:
        t = self.channel.time
        coupling = Coupling(*best.fit.values, beam=best.beam)
        answer = self.model(t, best.sign, best.beam)(best.fit.values[None, :])[0]
        extra = list(best.fit.nuisance)
        rest = self.reference + (extra[0] if best.offset else 0.0)
        drift = float(extra[1]) if best.drift else None
        fitted = rest + answer + (drift or 0.0) * t
        return DisplacementFit(
            coupling=coupling,
            fit=best.fit,
            channel=self.channel,
            fitted=fitted,
            window=best.end,
            rest=float(rest),
            drift=drift,
            sign=best.sign,
            per_volt=best.sign * self.ratio * coupling.static,
            beam=best.beam,
            scouting=scouting,
            warnings=(
                *self._warnings(best, fitted, shortened),
                *([f"displacement: {scouting.doubt}: it may not be the least"] if scouting.doubt else []),
            ),
        )

    def _fit(
        self,
        end: float,
        *,
        offset: bool,
        drift: bool,
        like: _Attempt | None = None,
        begin: _Begin | None = None,
        tolerance: float = 1e-10,
    ) -> _Attempt:
        """One fit; with the static beam from the search's start, or with the dynamic one from where ``like`` ended.

        ``begin`` gives beam and start in place of either.
        """
        part = self.channel.until(end)
        t, data = part.time, part.values - self.reference
        nuisance = self.nuisance[: len(t), : offset + drift]
        if begin is not None:
            beam, start, sign = begin.beam, begin.start, begin.sign
        elif like is None:
            beam = "static"
            relative = self.channel.values - self.reference
            start, sign = self.search.start(end, relative, self.nuisance[:, : offset + drift])
        else:
            beam, start, sign = "dynamic", like.fit.values, like.sign
        model = self.model(t, sign, beam, max(0.1 * tolerance, DEFAULT_ACCURACY))
        fit = fit_circuit(model, data, NAMES, start, nuisance, self.progress, tolerance)
        span = float(np.ptp(data - fit.residuals - nuisance @ fit.nuisance))
        limit = max(_OVER_NOISE * noise_level(data), _DESCRIBED * span)
        # a fit that goes astray at its end has taken in the beginning of a drift
        last = fit.residuals[t > 0.9 * end]
        astray = len(last) > 0 and float(np.sqrt(np.mean(last**2))) > 1.5 * limit
        return _Attempt(fit, sign, offset, drift, end, beam, fit.rmse <= limit and not astray)

    def _warnings(self, best: _Attempt, fitted: Array, shortened: bool) -> tuple[str, ...]:
        found = []
        if shortened:
            away = float(np.abs(self.channel.values - fitted)[self.channel.time > best.end].max())
            found.append(
                f"displacement fitted over the first {best.end:.4g} s only: later it drifts up to "
                f"{format_quantity(away, 'm', 3)} away, which is not the model's"
            )
        elif not best.described:
            found.append("d(s) does not describe the displacement: its residuals are more than noise at any length")
        if best.sign < 0:
            found.append("the displacement falls as the voltage rises: its axis was taken to point away from the anode")
        if best.drift:
            rate = format_quantity(float(best.fit.nuisance[-1]), "m", 3)
            found.append(f"the displacement drifts by {rate} a second: fitted as a straight line beside d(s)")
        if best.beam == "dynamic":
            found.append("the displacement shows the beam's inertia: E, density, damping are the actuator's")
        uneasy = max(_OVER_NOISE * noise_level(self.channel.values), _NEGLIGIBLE * float(np.ptp(self.channel.values)))
        if structured(best.fit.residuals) and best.fit.rmse > uneasy:
            found.append(
                "neighbouring residuals of the displacement are alike: standard errors that take them as independent "
                "are too small, those of a block bootstrap are given"
            )
        loose = [n for n, v, e in zip(best.fit.names, best.fit.values, best.fit.errors, strict=True) if e > 0.5 * v]
        if loose:
            found.append(f"not determined by these data (standard error over 50%): {', '.join(loose)}")
        return tuple(found)
