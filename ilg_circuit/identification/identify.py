"""Identifies a strip: currents, impedances and displacements of one file or several are fitted as one problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np

from ..arrays import one_thread
from ..errors import InputError, SolveError, argument, unknown_name, wrong_choice
from ..findings import Finding
from ..fit.bootstrap import SEED
from ..fit.estimate import Estimates
from ..fit.identifiability import DETERMINED
from ..fit.intervals import require_method, uncertainties
from ..fit.problem import Progress
from ..fit.selection import Candidate
from ..measurements.film import Film
from ..measurements.prepare import LEAST_CURRENT
from ..measurements.proportion import proportion_findings
from ..measurements.record import Record
from ..measurements.spectrum import Spectrum
from ..provenance import Provenance
from ..strip.actuator import LONGEST_NAME, PAPER, PRESETS, Actuator
from ..strip.electrodes import require_lump
from ..strip.elements import lumped_port
from ..strip.models import electrical_model, registry
from ..strip.specimen import Specimen
from ..units import format_quantity
from .between_files import between_files
from .coupling_fit import decisions, fit_coupling
from .current import CurrentData
from .estimates import (
    correlations,
    parameter_estimates,
    port_quantities,
    scattered,
    uncertainty_of,
    with_signs,
)
from .film import FilmData, Moving, driven_strip, film_findings, require_films, with_known
from .identification import Identification
from .impedance import ImpedanceData, Weighting
from .joint import joined
from .motion import NAMES
from .motion_laws import LAWS
from .observation_fit import (
    consistency_findings,
    misfit_findings,
    residuals_of,
)
from .observations import all_observations
from .onset import clock_findings
from .outliers import without_outliers
from .port_findings import base_findings, port_findings
from .port_fit import PortFit, on_all_rows
from .port_model import PortData
from .selection import fit_best, fit_named
from .statistics import statistics_of, told
from .voltage import record_data

Data = Record | Spectrum | Film
#: Engines for predictions, and weightings of a spectrum's points.
ENGINES, WEIGHTINGS = ("ngspice", "exact"), ("modulus", "unit")

#: Part of its bracket by which an onset must move for decisions on displacements to be made anew.
_MOVED = 0.05


@one_thread()
def identify(
    data: Data | Sequence[Data],
    *,
    base: Actuator | Specimen | None = None,
    model: str = "auto",
    electrode_resistance: float | Literal["fit"] | None = None,
    own: Sequence[str] = (),
    bias: Sequence[float] | None = None,
    engine: str = "ngspice",
    intervals: str = "covariance",
    weighting: Weighting = "modulus",
    displacement_delay: float | Literal["fit"] | None = None,
    until: float | None = None,
    law: str = "auto",
    progress: Progress = None,
) -> Identification:
    """Return the strip fitted to its records, spectra and films.

    The port is fitted to all currents and impedances, the coupling d(s) to all displacements; the last step is a joint
    fit of all observations. With films alone the circuit is taken from ``base``.

    Parameters
    ----------
    data
        One record, spectrum or film, or several.
    base
        Geometry, E and density (default: the paper's, with a finding). The fitted strip takes its name, unless
        it is a preset.
    model
        Of `strip.models`, or auto: the simplest of the best by BIC.
    electrode_resistance
        Re [ohm], held, because no current or spectrum of a linear port fixes it (default: the base's); "fit" with
        nonlinear models.
    own
        Parameters that each file has for itself.
    bias
        Bias [V] of each file, ignored for records (default 0).
    intervals
        Method of the 95 % intervals, see `fit.intervals`.
    weighting
        Weighting of spectra, see `impedance.ImpedanceData`.
    displacement_delay
        Delay [s] of the displacement's clock relative to the voltage's, for a film relative to its drive's; "fit" to
        fit it (default: fitted if the displacement has a separate file, else 0).
    until
        Time [s] since the onset up to which records are fitted; later readings are not used.
    law
        Law of bending, of `motion_laws.LAWS`, or auto.

    Raises
    ------
    InputError
        The data cannot be fitted, or two files hold the same readings.
    SolveError
        A fit of the port does not converge.
    """
    method = require_method(intervals)
    if model != "auto":
        electrical_model(model)
    for what, given, allowed in (("engine", engine, ENGINES), ("weighting", weighting, WEIGHTINGS)):
        if given not in allowed:
            raise wrong_choice(argument(what), given, allowed)
    if law not in ("auto", *LAWS):
        raise wrong_choice(argument("coupling"), law, ("auto", *LAWS))
    files = [data] if isinstance(data, Record | Spectrum | Film) else list(data)
    every = tuple(_until(d, until) for d in _data(files, engine, bias, weighting))
    sources = [d.source for d in every]
    ports = tuple(d for d in every if not isinstance(d, FilmData))
    films = [d for d in every if isinstance(d, FilmData)]
    strip = base.stand_in() if isinstance(base, Specimen) else base or PAPER
    require_lump(strip, "identification")
    standing = lumped_port(strip).electrode_resistance if electrode_resistance is None else electrode_resistance
    held = None if isinstance(standing, str) else standing
    if not ports:
        require_films(model, own, held)
        strip = driven_strip(base, strip, held)
    if held is not None:
        for d in ports:
            d.require_electrode_resistance(held)
    ports, about_readings = _without_outliers(ports, held)
    names = frozenset(own)
    if ports and model == "auto":
        _require_known(names, ports)
    port, candidates, findings = _fit_port(ports, model, held, names - set(NAMES), progress)
    findings += [note.about(d.source) for d in films for note in d.notes]
    actuator = _actuator(port, strip, base, sources)
    records: list[Moving] = [*_at_placed_jumps(ports, port), *films]
    coupling, about_coupling = fit_coupling(records, actuator, names & set(NAMES), progress, displacement_delay, law)
    if port is None and coupling is None:
        raise InputError("; ".join(str(f) for f in about_coupling))
    names = names if len(files) > 1 else frozenset()  # with one file, parameters per file are meaningless
    try:
        joint = joined(port, coupling, actuator, names, progress)
    except SolveError as error:
        if coupling is None or port is None:
            raise
        about_coupling.append(Finding("displacements-inconsistent", values={"reason": str(error)}))
        joint = joined(port, None, actuator, names, progress)
    if joint.coupling is not None and joint.port is not None and (moved := _at_onsets(records, joint.port)):
        anew = partial(fit_coupling, moved, actuator, frozenset(own) & set(NAMES), progress, displacement_delay)
        settled = anew(joint.coupling.motion.law.name)
        if decisions(settled[0]) != decisions(joint.coupling):
            coupling, about_coupling = anew(law) if law == "auto" else settled
            joint = joined(joint.port, coupling, actuator, names, progress)
    fit, port, coupling, onsets = joint.fit, joint.port, joint.coupling, joint.onsets
    actuator = _actuator(port, strip, base, sources)
    if coupling is not None:
        coupling = replace(coupling, motion=replace(coupling.motion, actuator=actuator))
        actuator = replace(actuator, coupling=coupling.coupling)
    highest = max((abs(d.voltage) for d in records), default=None)
    circuit = port.kind if port is not None else strip.material.model
    rows, without = all_observations(port, coupling, fit, progress)
    uncertainty = uncertainty_of(circuit.name, fit, onsets.covariance(fit), highest)
    if scatter := between_files(port, fit, rows):
        uncertainty = scatter.added(uncertainty)
    if coupling is not None and coupling.spread is not None:
        uncertainty = scattered(uncertainty, coupling.motion.law, coupling.spread, len(coupling.individual))
    known = uncertainty if port is not None else with_known(uncertainty, strip.uncertainty)
    actuator = replace(actuator, uncertainty=known)
    estimated = onsets.widened(fit, uncertainties(fit, method, progress, cheap=joint.cheap))
    parameters, each = parameter_estimates(fit, port, estimated, uncertainty)
    parameters = scatter.widened(parameters)
    if coupling is not None:
        law_fitted = coupling.motion.law
        parameters = with_signs(parameters, law_fitted)
        each = {source: with_signs(part, law_fitted) for source, part in each.items()}
    derived = {}
    if port is not None:
        derived = port_quantities(port, fit, uncertainty, onsets, estimated.ends, scattered=bool(scatter))
    rows = [onsets.told(row) for row in rows]
    if actuator.uncertainty is not None:
        left = residuals_of(rows)
        actuator = replace(actuator, uncertainty=replace(actuator.uncertainty, residuals=left))
    if len(files) == 1:
        derived = {**{n: e for o in rows for n, e in o.derived.items()}, **derived}
    if until is not None and records:
        findings.append(Finding("fitted-until", values={"until": until}))
    findings += [*about_readings, *(port_findings(port, candidates, parameters) if port is not None else ())]
    findings += misfit_findings(rows)
    if len(files) > 1:
        findings += consistency_findings([r for r in rows if r.quantity != "displacement"], without)
    findings += [*about_coupling, *(base_findings(base, coupling) if port is not None else film_findings(base))]
    findings += clock_findings(records, onsets) if coupling is not None else []
    findings += estimated.findings
    findings += proportion_findings(
        files, _fitted_ends(port), strip.geometry.length * strip.geometry.width, strip.geometry.length
    )
    if len(files) == 1:
        findings = [replace(f, subject="") if f.subject == sources[0] else f for f in findings]
    return Identification(
        actuator=actuator,
        fit=fit,
        port=port,
        coupling=coupling,
        parameters=Estimates(parameters),
        own=each,
        derived=Estimates(derived),
        statistics=statistics_of(port, coupling, fit, rows, candidates, estimated) | told(joint.judgement),
        correlations=correlations(fit),
        observations=tuple(rows),
        candidates=candidates,
        findings=tuple(findings),
        engine=engine if records else ports[0].engine,
        films=tuple(d.source for d in films),
        seed=SEED if any(e.bootstrap is not None or e.ci95_mcmc for e in parameters.values()) else None,
        provenance=Provenance(call=f"identify({', '.join(sources)}, {_how(model, films)})"),
    )


def _require_known(own: frozenset[str], data: Sequence[PortData]) -> None:
    """Raise InputError for a parameter that no tried model has."""
    kinds = {"spectrum" if d.quantity == "impedance" else "record" for d in data}
    models = dict.fromkeys(name for kind in sorted(kinds) for name in registry.candidates(kind))
    known = dict.fromkeys([*(n for m in models for n in electrical_model(m).names), *NAMES])
    for name in sorted(own):
        if name not in known:
            raise unknown_name("parameter", name, known, f"{argument('own')}=")


def _how(model: str, films: Sequence[FilmData]) -> str:
    """Return the arguments of the call: the drives of films, or the model."""
    drives = dict.fromkeys(d.drive.text for d in films)
    return ", ".join(
        [*(f"drive={text!r}" for text in drives), *([] if drives and model == "auto" else [f"model={model!r}"])]
    )


def _fitted_ends(port: PortFit | None) -> tuple[float, float] | None:
    """Return resistance at high frequency [ohm] and capacitance [F] of a port, if one was fitted."""
    if port is None:
        return None
    made = port.port
    return made.high_frequency_resistance, made.capacitance if port.kind.ions.stores else 0.0


def _data(
    files: Sequence[Data], engine: str, bias: Sequence[float] | None, weighting: Weighting
) -> tuple[PortData | FilmData, ...]:
    """Return the data of every file. Raises InputError if two files hold the same readings, or there is no file."""
    if not files:
        raise InputError("an identification needs at least one record or spectrum")
    sources = [f.source for f in files]
    # files of the same name in different folders get a number
    labels = [s if sources.count(s) == 1 else f"{s} ({sources[: k + 1].count(s)})" for k, s in enumerate(sources)]
    found: list[PortData | FilmData] = []
    for file, label, volts in zip(files, labels, bias or [0.0] * len(files), strict=True):
        if isinstance(file, Spectrum):
            found.append(ImpedanceData.of(replace(file, source=label), volts, label, weighting))
        elif isinstance(file, Film):
            found.append(FilmData(file, engine, label))
        else:
            found.append(record_data(file, engine, label))
    for k, d in enumerate(found):
        for earlier in found[:k]:
            if np.array_equal(d.data, earlier.data) and np.array_equal(d.abscissa, earlier.abscissa):
                raise InputError(f"'{d.source}' repeats the readings of '{earlier.source}': give each record once")
    return tuple(found)


def _until(data: PortData | FilmData, until: float | None) -> PortData | FilmData:
    """Return the data up to ``until`` [s] since the onset. Raises InputError if too few readings remain."""
    if until is None or not isinstance(data, CurrentData | FilmData):
        return data
    if isinstance(data, FilmData):
        return replace(data, until=until)
    cut = replace(data, until=until)
    count = int((cut.abscissa >= 0).sum())
    if count < LEAST_CURRENT:
        raise InputError(
            f"{data.source}: {count} readings of the {data.quantity} up to {until:g} s after the onset; a fit needs "
            f"{LEAST_CURRENT}"
        )
    return cut


def _without_outliers(data: tuple[PortData, ...], held: float | None) -> tuple[tuple[PortData, ...], list[Finding]]:
    """Return the data without the readings of currents that are outliers, and findings on them."""
    kept, findings = [], []
    for d in data:
        if isinstance(d, CurrentData):
            d, said = without_outliers(d, held or 0.0)
            findings += said
        kept.append(d)
    return tuple(kept), findings


def _at_onsets(records: Sequence[Moving], port: PortFit) -> list[Moving]:
    """Return the records at the onsets and jumps of a fit; empty where none of a drive with later jumps has moved.

    What a displacement's own fit decides of its drift it decides at the middle of the brackets at first.
    """
    there = {d.source: d for d in port.data if isinstance(d, CurrentData)}
    placed: list[Moving] = []
    telling = False
    for d in records:
        at = there.get(d.source)
        moved = replace(d, share=at.share, places=at.places) if at is not None and isinstance(d, CurrentData) else d
        telling |= len(d.record.voltage.widths) > 1 and abs(moved.share - d.share) > _MOVED
        placed.append(moved)
    return placed if telling else []


def _at_placed_jumps(ports: Sequence[PortData], port: PortFit | None) -> list[CurrentData]:
    """Return the records with the jumps of their drives where the port's fit places them."""
    there = {d.source: d for d in port.data if isinstance(d, CurrentData) and d.places} if port is not None else {}
    records = [d for d in ports if isinstance(d, CurrentData)]
    placed = [(d, there.get(d.source, d)) for d in records]
    return [replace(d, share=at.share, places=at.places) for d, at in placed]


def _fit_port(
    data: tuple[PortData, ...], model: str, held: float | None, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit | None, tuple[Candidate, ...], list[Finding]]:
    """Return the port's fit to all rows (None without data of a port), the candidates and the first findings."""
    if not data:
        return None, (), []
    port, candidates, findings = _tried(tuple(d.trial() for d in data), model, held, per_record, progress)
    return on_all_rows(port, progress), candidates, findings


def _tried(
    data: tuple[PortData, ...], model: str, held: float | None, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit, tuple[Candidate, ...], list[Finding]]:
    """Return the port's fit, the candidates and the first findings; Re is held at zero if it is not determined."""
    notes = [note.about(d.source) for d in data for note in d.notes]
    if model == "auto":
        if held is None:
            raise InputError(
                f"Re is fitted with a model that is named, such as {argument('model', 'rc+sinh')}, not with auto"
            )
        return *fit_best(data, held, per_record, progress), notes
    if held is not None:
        return *fit_named(data, model, held, per_record, progress), notes
    try:
        found = fit_named(data, model, None, per_record, progress)
    except SolveError as error:
        why = str(error)
    else:
        fit = found[0].fit
        at = [k for k, p in enumerate(fit.problem.moved) if p.name == "electrode_resistance"]
        value, stderr = float(fit.values[at].min()), float(fit.errors[at].max())
        if stderr <= DETERMINED * value:
            return *found, notes
        why = f"it came out as {format_quantity(value, 'ohm', 2)} +- {format_quantity(stderr, 'ohm', 2)}"
    notes.append(Finding("electrode-resistance-not-determined", values={"reason": why}))
    return *fit_named(data, model, 0.0, per_record, progress), notes


def _actuator(
    port: PortFit | None, strip: Actuator, base: Actuator | Specimen | None, sources: Sequence[str]
) -> Actuator:
    name = sources[0].rsplit(".", 1)[0][:LONGEST_NAME] if len(sources) == 1 else "joint fit"
    if base is not None and base.name not in PRESETS:
        name = base.name
    coupling = strip.coupling if base is not None else None
    if port is None:
        return replace(strip, coupling=coupling, name=name, uncertainty=None)
    how: dict[str, Any] = {"coupling": coupling, "mounting": strip.mounting, "name": name, "layers": strip.layers}
    try:
        return Actuator.from_port(strip.geometry, port.port, base=strip.material, **how)
    except InputError as error:
        raise SolveError(f"the fit of model {port.kind.name} is impossible for a strip: {error}") from None
