"""Fits the law by which a strip senses to records of a moved tip: the motion in, a voltage or a current out.

Reciprocity is not assumed: how many times the measured signal is the reciprocal one is a result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, one_thread, plain
from ..circuit.strip import sensor_netlist
from ..errors import InputError, SolveError
from ..findings import Finding, Warned, by_importance
from ..fit.bootstrap import SEED
from ..fit.bounded import profile_bounded
from ..fit.criteria import effective_samples, information_criterion, share_explained
from ..fit.estimate import Estimate, Estimated
from ..fit.fitting import fit as fitted_by
from ..fit.fitting import fit_near
from ..fit.identifiability import DETERMINED
from ..fit.intervals import uncertainties
from ..fit.misfit import WARN, Misfit, misfit_over_time
from ..fit.observation import Observation
from ..fit.parameter import Parameter
from ..fit.problem import Problem
from ..fit.result import FitResult
from ..measurements.smoothing import noise_level
from ..measurements.waves import Sensed
from ..result import Column, Curve, Result
from ..simulation.response import transient_band
from ..solve.exact import modal_output
from ..solve.state_space import state_space
from ..strip.actuator import Actuator, Sensing
from ..strip.electrodes import require_lump
from ..strip.sensing import MOST_RELAXATIONS
from .jumps import errors_of, placed, unknown
from .onset import Onsets
from .port_model import BRACKET
from .sensed import SensedData

#: Time constants of the search, from so many sampling intervals to so many times the record; least ratio of two.
_GRID, _SHORTEST, _LONGEST, _APART = 13, 2.0, 2.0, 1.8
#: Number of other noises of a motion by which its errors are found.
_NOISES = 12


@dataclass(frozen=True, repr=False, eq=False)
class SensingFit(Warned, Estimated, Result):
    """The law of sensing of a strip, fitted to records, as `ilg_circuit.identify_sensing` returns it.

    Attributes
    ----------
    actuator : Actuator
        The strip with the fitted law as its ``sensing``.
    parameters : mapping of str to Estimate
        Gains [V] per strain and time constants [s].
    ratio : float or None
        The fitted signal over that by reciprocity, of the same motion (rms; the geometric mean of several records);
        None for a strip without a coupling.
    fit : FitResult
        The fit.
    records : tuple of Sensed
        Motion and signal of each record.
    reciprocal : tuple of ndarray
        The signal of each record by reciprocity; zeros without a coupling.
    misfits : tuple of Misfit or None
        Residuals beyond the noise, of each record.
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "sensing_fit"

    actuator: Actuator
    fit: FitResult
    parameters: Mapping[str, Estimate]
    records: tuple[Sensed, ...]
    reciprocal: tuple[Array, ...]
    misfits: tuple[Misfit | None, ...]
    ratio: float | None
    findings: tuple[Finding, ...] = ()

    @property
    def success(self) -> bool:
        """False if the misfit of a record is so large that the parameters are meaningless."""
        return not any(misfit is not None and misfit.fail for misfit in self.misfits)

    def estimate_tables(self) -> Mapping[str, Mapping[str, Estimate]]:
        """Return the parameters."""
        return {"parameter": self.parameters}

    def table(self) -> tuple[Column, ...]:
        """Return one row per estimate."""
        return Estimated.table(self)

    def curves(self) -> list[Curve]:
        """Return the measured and the fitted signal of each record."""
        return [
            Curve(r.quantity, r.unit, r.source, Column("time", r.time, "s"), r.signal, self.fitted(k))
            for k, r in enumerate(self.records)
        ]

    def fitted(self, k: int) -> Array:
        """Return the fitted signal (n,) of record ``k``."""
        return np.asarray(self.records[k].signal - self.fit.residuals_of(k))

    def write_strip(self, path: str | Path) -> None:
        """Write the strip with its law of sensing as a TOML file.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        self._shown("write_strip", path)

    def to_dict(self) -> dict[str, Any]:
        """Return estimates, the ratio, and the records with their fit as plain data."""
        return {
            "actuator": self.actuator.name,
            "success": self.success,
            "parameters": {name: e.to_dict() for name, e in self.parameters.items()},
            "measured_over_reciprocal": self.ratio,
            "records": [
                {
                    "source": r.source,
                    "terminals": r.terminals,
                    "quantity": r.quantity,
                    "rms": float(np.sqrt(np.mean(self.fit.residuals_of(k) ** 2))),
                    "size": float(np.ptp(r.signal)),
                    "misfit": None if misfit is None else misfit.to_dict(),
                    "time_s": plain(r.time),
                    f"{r.quantity}_{r.unit}": plain(r.signal),
                    f"fitted_{r.unit}": plain(self.fitted(k)),
                    f"reciprocal_{r.unit}": plain(self.reciprocal[k]),
                }
                for k, (r, misfit) in enumerate(zip(self.records, self.misfits, strict=True))
            ],
            "findings": [finding.to_dict() for finding in self.findings],
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True)
class _Law:
    """An instantaneous part and some ``relaxations``."""

    relaxations: int

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        found = [Parameter("sensing_instantaneous", unit="V", lower=-np.inf)]
        for k in range(1, self.relaxations + 1):
            found.append(Parameter(f"sensing_gain_{k}", unit="V", lower=-np.inf))
            found.append(Parameter(f"sensing_time_{k}", unit="s"))
        return tuple(found)

    def sensing(self, values: Array) -> Sensing:
        return Sensing(
            **{p.name.removeprefix("sensing_"): float(v) for p, v in zip(self.parameters, values, strict=True)}
        )


@one_thread()
def identify_sensing(records: Sequence[Sensed], actuator: Actuator) -> SensingFit:
    """Return the law of sensing of a strip whose circuit is known: as many relaxations as BIC asks for.

    Raises InputError for a nonlinear circuit, or records that tell nothing or whose motion explains nothing, SolveError
    where no law fits.
    """
    require_lump(actuator, "sensing")
    bare = replace(actuator, sensing=None, uncertainty=None)
    if not bare.linear:
        raise InputError(
            f"actuator '{actuator.name}' is nonlinear; sensing is fitted with a linear circuit, such as model rc"
        )
    every = tuple(SensedData.of(record) for record in records)
    found: list[FitResult] = []
    failure: SolveError | InputError | None = None
    laws = [_Law(count) for count in range(MOST_RELAXATIONS + 1)]
    tried = []
    for law in laws:
        try:
            found.append(fitted_by(_problem(law, every, bare), _start(law, every, bare)))
            tried.append(law)
        except (SolveError, InputError) as error:
            failure = error
    if not found:
        assert failure is not None
        raise failure
    for k, r in enumerate(records):
        residuals = min((f.residuals_of(k) for f in found), key=np.var)
        share, small = share_explained(residuals - residuals.mean(), r.signal - r.signal.mean())
        if small:
            raise InputError(
                f"{r.source}: the motion explains {share:.1%} of the measured {r.quantity}: look at its wires, its "
                "column, and whether its clock is the motion's"
            )
    samples = effective_samples(min(found, key=lambda f: f.rmse).residuals)
    criteria = [information_criterion(f.residuals, f.count, samples) for f in found]
    best = int(np.argmin(criteria))
    law = tried[best]
    fit, every, jumps = _with_jumps(found[best], law, every, bare)
    estimated = jumps.widened(fit, uncertainties(fit))
    parameters = dict(estimated.estimates)
    findings = list(estimated.findings) + [note.about(r.source) for r in records for note in r.notes]
    loose = [name for name, e in parameters.items() if e.stderr is not None and e.stderr > DETERMINED * abs(e.value)]
    if loose:
        reason = f"standard error over {DETERMINED:.0%}: {', '.join(loose)}"
        findings.append(Finding("not-determined", values={"reason": reason}))
    misfits = []
    for k, r in enumerate(records):
        misfit = misfit_over_time(r.time, fit.residuals_of(k), noise_level(r.signal), float(np.ptp(r.signal)))
        misfits.append(misfit)
        if misfit is not None and misfit.share > WARN:
            values = {"quantity": r.quantity, "size": "span", "share": misfit.share, "worst": misfit.worst}
            findings.append(Finding("misfit", r.source, {**values, "from": misfit.start, "to": misfit.end}))
    reciprocal = tuple(_signal(bare, d) if bare.coupling is not None else np.zeros(len(d.abscissa)) for d in every)
    # of the model's own signals: offset and noise of the readings are in neither
    own = replace(bare, sensing=law.sensing(fit.values))
    pairs = zip([_signal(own, d) for d in every], reciprocal, strict=True)
    ratios = [float(np.linalg.norm(x) / np.linalg.norm(y)) for x, y in pairs if y.any()]
    return SensingFit(
        actuator=replace(actuator, sensing=law.sensing(fit.values)),
        fit=fit,
        parameters=parameters,
        records=tuple(records),
        reciprocal=reciprocal,
        misfits=tuple(misfits),
        ratio=float(np.exp(np.mean(np.log(ratios)))) if ratios else None,
        findings=tuple(by_importance(findings)),
    )


def _signals(strips: Sequence[Actuator], data: SensedData) -> Array:
    """Return the signals (strips, n) of a record's motion."""
    record = data.record
    netlists = [sensor_netlist(strip, terminals=record.terminals, band=transient_band(record.time)) for strip in strips]
    return modal_output(state_space(netlists), record.quantity, data.drive, record.time)


def _signal(strip: Actuator, data: SensedData) -> Array:
    return _signals([strip], data)[0]


def _problem(law: _Law, every: Sequence[SensedData], bare: Actuator) -> Problem:
    return Problem(tuple(_observation(law, data, bare, len(every) > 1) for data in every), law.parameters)


def _observation(law: _Law, data: SensedData, bare: Actuator, several: bool) -> Observation:
    record = data.record

    def predict(values: Array) -> Array:
        return _signals([replace(bare, sensing=law.sensing(v)) for v in values], data)

    return Observation(
        source=record.source,
        quantity=record.quantity,
        unit=record.unit,
        x=record.time,
        data=record.signal,
        names=tuple(p.name for p in law.parameters),
        predict=predict,
        nuisance=np.ones((len(record.time), 1)),
        # voltages and currents of one fit count alike, relative to their spans
        sigma=float(np.ptp(record.signal)) if several else 1.0,
        size=float(np.ptp(record.signal)),
    )


def _with_jumps(
    found: FitResult, law: _Law, every: Sequence[SensedData], bare: Actuator
) -> tuple[FitResult, tuple[SensedData, ...], Onsets]:
    """Return the fit with the tip's jumps where the readings place them, the data, and what that leaves unknown.

    What all places have in common is profiled besides; what the noise of the motion adds is that of other such noise.
    """

    def observe(k: int, data: SensedData) -> Observation:
        return _observation(law, data, bare, len(every) > 1)

    moved, errors, profiles = list(every), [], []
    files = [((data,), (k,)) for k, data in enumerate(every) if unknown(data)]
    if files:
        found, there, left = placed(found, files, observe)
        for of_file, members in there:
            moved[members[0]] = of_file[0]
        errors.append(errors_of(found, left))
    jumping = [k for k, data in enumerate(moved) if data.jumps]
    if jumping:

        def at(share: float) -> Problem:
            shifted = [d.at_share(share) for d in moved]
            return replace(found.problem, observations=tuple(observe(k, d) for k, d in enumerate(shifted)))

        profile = profile_bounded(found, at, BRACKET, jumping)
        again = fit_near(at(profile.middle), found.values)
        profiles.append(profile.knowing(profile.middle, again.coordinates))
        found, moved = again, [d.at_share(profile.middle) for d in moved]
    if any(data.noise for data in moved):
        random, before = np.random.default_rng(SEED), found.problem.predictions(found.coordinates[None])[0]
        others = []
        for _ in range(_NOISES):
            noisy = tuple(observe(k, data.again(random)) for k, data in enumerate(moved))
            others.append(replace(found.problem, observations=noisy).predictions(found.coordinates[None])[0] - before)
        errors.append(errors_of(found, np.array(others).T / np.sqrt(_NOISES)))
    return found, tuple(moved), Onsets(jumps=tuple(errors), others=tuple(profiles))


def _start(law: _Law, every: Sequence[SensedData], bare: Actuator) -> Array:
    """Return starting values: the best linear fit on a grid of time constants."""
    records = [data.record for data in every]
    shortest = _SHORTEST * min(float(np.median(np.diff(r.time))) for r in records)
    longest = _LONGEST * max(float(r.time[-1]) for r in records)
    times = np.geomspace(shortest, longest, _GRID)
    waves, data = [], []
    for d in every:
        r = d.record
        size = float(np.ptp(r.signal))
        direct = _signals([replace(bare, sensing=Sensing(instantaneous=1.0))], d)
        slow = _signals([replace(bare, sensing=Sensing(gain_1=1.0, time_1=float(time))) for time in times], d)
        rows = np.concatenate([direct, slow])
        waves.append((rows - rows.mean(axis=1, keepdims=True)) / size)
        data.append((r.signal - r.signal.mean()) / size)
    basis, signal = np.concatenate(waves, axis=1), np.concatenate(data)
    best: tuple[float, Array] | None = None
    for chosen in combinations(range(_GRID), law.relaxations):
        if any(times[b] / times[a] < _APART for a, b in pairwise(chosen)):
            continue
        rows = basis[[0, *(k + 1 for k in chosen)]].T
        amounts = np.linalg.lstsq(rows, signal, rcond=1e-12)[0]
        squares = float(np.sum((signal - rows @ amounts) ** 2))
        if best is None or squares < best[0]:
            pairs = [x for gain, k in zip(amounts[1:], chosen, strict=True) for x in (gain, times[k])]
            best = squares, np.array([amounts[0], *pairs])
    assert best is not None
    return best[1]
