"""An impedance spectrum -> the strip: the Kramers-Kronig check, one model or the best of several, and what it says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import IlgError, InputError, SolveError
from ..fit.estimate import Parameter
from ..fit.identifiability import Identifiability, diagnose
from ..fit.intervals import require_method, uncertainties
from ..fit.residuals import information_criterion, structured
from ..measurements.read import read_spectrum
from ..measurements.spectrum import Spectrum
from ..strip.actuator import PAPER, Actuator
from ..strip.elements import lumped_elements
from ..strip.models import electrical_model
from .kramers_kronig import KramersKronig, kramers_kronig
from .spectrum_fit import SpectrumFit, Weighting, fit_spectrum, require_electrode_resistance

#: What --model auto chooses from, simple ones first.
AUTO_MODELS = ("rc", "rc2", "rc3", "warburg", "cpe")
#: A BIC less by this is worth another parameter; models nearer than that count as equal.
_WORTH = 2.0
#: A misfit beyond the spectrum's own noise by this factor, and of this size at least, is worth a word.
_MISFIT, _NEGLIGIBLE = 2.0, 1e-3


@dataclass(frozen=True)
class Candidate:
    """One model's outcome: its fit or the error instead; ``bic`` on independent readings; ``against`` its choice."""

    model: str
    fit: SpectrumFit | None
    bic: float
    against: str

    def to_json(self) -> dict[str, Any]:
        fit = self.fit
        return {
            "model": self.model,
            "parameters": fit.fit.count if fit else None,
            "relative_rms": fit.relative_rms if fit else None,
            "bic": self.bic if fit else None,
            "identifiability": diagnose(fit.fit, fit.port.branches).to_json() if fit else None,
            "against": self.against,
        }


@dataclass(frozen=True)
class SpectrumIdentification:
    """What a spectrum says of a strip; ``actuator`` has the fitted circuit, ``details`` tell of the intervals."""

    spectrum: Spectrum
    check: KramersKronig
    fit: SpectrumFit
    candidates: tuple[Candidate, ...]
    actuator: Actuator
    parameters: dict[str, Parameter]
    derived: dict[str, Parameter]
    warnings: tuple[str, ...]
    details: dict[str, Any] | None = None

    @property
    def model(self) -> str:
        return self.fit.model

    @property
    def statistics(self) -> dict[str, Any]:
        """Of the fit; ``n`` counts readings, two a frequency; rms values are of real and imaginary parts."""
        fit = self.fit.fit
        return {
            "rmse": self.fit.rmse,
            "rmse_unit": "ohm",
            "relative_rms": self.fit.relative_rms,
            "aic": fit.aic,
            "bic": fit.bic,
            "n": len(fit.residuals),
            "independent": self.fit.independent,
            "weighting": self.fit.weighting,
            "evaluations": fit.evaluations,
            "starts": self.fit.starts,
            "starts_agreeing": self.fit.agreeing,
            "relative_offset": fit.offset,
            "identifiability": self.identifiability.to_json(),
        } | ({"intervals": self.details} if self.details else {})

    @property
    def identifiability(self) -> Identifiability:
        """Which of the parameters that were free the spectrum determines."""
        return diagnose(self.fit.fit, self.fit.port.branches)

    @property
    def correlations(self) -> dict[str, float]:
        names, matrix = self.fit.fit.names, self.fit.fit.correlations()
        return {f"{names[b]}, {names[a]}": float(matrix[b, a]) for a in range(len(names)) for b in range(a)}

    def to_json(self) -> dict[str, Any]:
        """The contract's fit.json, with the Kramers-Kronig check and all candidates."""
        f = self.check.frequency
        return {
            "model": self.model,
            "source": self.spectrum.source,
            "engine": "closed form",
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "derived": {name: p.to_json() for name, p in self.derived.items()},
            "statistics": self.statistics,
            "correlations": self.correlations,
            "kramers_kronig": {
                "rms": self.check.rms,
                "terms": self.check.terms,
                "consistent": self.check.consistent,
                "bad_frequencies_Hz": f[self.check.bad].tolist(),
            },
            "candidates": [c.to_json() for c in self.candidates],
            "warnings": list(self.warnings),
        }


def identify_spectrum(
    spectrum: Spectrum,
    *,
    base: Actuator | None = None,
    model: str = "auto",
    electrode_resistance: float | None = None,
    weighting: Weighting = "modulus",
    intervals: str = "covariance",
    seed: int = 0,
    progress: Callable[[], None] | None = None,
) -> SpectrumIdentification:
    """Check a spectrum, fit ``model`` (auto: the best of `AUTO_MODELS`) and make the strip of it.

    ``base`` gives geometry, E and density (default: the paper's); ``electrode_resistance`` [ohm] is held, default the
    base's; ``intervals`` is the method of the 95 % intervals, see `intervals`. Points that break the Kramers-Kronig
    relations are left out of the fit. Raises InputError and SolveError as `fit_spectrum`; with auto SolveError where no
    model can be fitted.
    """
    method = require_method(intervals)
    strip = base or PAPER
    held = lumped_elements(strip).electrode_resistance if electrode_resistance is None else electrode_resistance
    if model != "auto":
        electrical_model(model)
    check = kramers_kronig(spectrum)
    sound = spectrum.without(check.bad)
    require_electrode_resistance(sound, held)
    names = AUTO_MODELS if model == "auto" else (model,)
    outcomes: list[tuple[str, SpectrumFit | None, str]] = []
    for name in names:
        try:
            fit = fit_spectrum(sound, name, held, weighting=weighting, seed=seed, progress=progress)
            outcomes.append((name, fit, fit.unreliable))
        except IlgError as error:
            if model != "auto":
                raise
            outcomes.append((name, None, str(error)))
    candidates = _compared(outcomes)
    chosen = _chosen(candidates, spectrum.source)
    units = {p.name: p.unit for p in electrical_model(chosen.model).parameters}
    found = uncertainties(chosen.fit, units, method, progress)
    warnings = [*map(str, spectrum.notes), *check.warnings, *_warnings(chosen, check, candidates), *found.warnings]
    if base is None:
        warnings.append(
            "no --actuator given: geometry and Young's modulus are the paper's; resistances and capacitances do not "
            "depend on them"
        )
    elif base.coupling is not None:
        warnings.append("the coupling was not fitted: it is that of the given actuator")
    actuator = Actuator.from_port(
        strip.geometry,
        chosen.port,
        base=strip.material,
        coupling=base.coupling if base else None,
        mounting=strip.mounting,
        name=spectrum.source.rsplit(".", 1)[0],
    )
    return SpectrumIdentification(
        spectrum=spectrum,
        check=check,
        fit=chosen,
        candidates=candidates,
        actuator=actuator,
        parameters=_parameters(chosen, found.parameters, held),
        details=found.details,
        derived=_derived(chosen),
        warnings=tuple(dict.fromkeys(warnings)),
    )


@dataclass(frozen=True)
class Outcome:
    """One file of a batch and one model asked for: its ``result``, or the ``error`` that it ended in."""

    path: Path
    model: str
    result: SpectrumIdentification | None
    error: str


def identify_spectra(
    paths: Sequence[str | Path],
    models: Sequence[str] = ("auto",),
    *,
    base: Actuator | None = None,
    electrode_resistance: float | None = None,
    weighting: Weighting = "modulus",
    seed: int = 0,
    progress: bool = True,
) -> tuple[Outcome, ...]:
    """Fit every spectrum by every model; a file or fit that fails does not stop the others.

    ``progress`` shows a bar in a terminal. Outcomes are in the order of ``paths``, each with all ``models``.
    """
    from tqdm import tqdm

    for model in models:
        if model != "auto":
            electrical_model(model)
    outcomes = []
    silent = None if progress else True  # None: only in a terminal
    with tqdm(total=len(paths) * len(models), disable=silent, leave=False, unit="fit", desc="spectra") as bar:
        for path in map(Path, paths):
            try:
                spectrum, error = read_spectrum(path), ""
            except InputError as problem:
                spectrum, error = None, str(problem)
            for model in models:
                result, told = None, error
                if spectrum is not None:
                    try:
                        result = identify_spectrum(
                            spectrum,
                            base=base,
                            model=model,
                            electrode_resistance=electrode_resistance,
                            weighting=weighting,
                            seed=seed,
                        )
                    except IlgError as problem:
                        told = str(problem)
                outcomes.append(Outcome(path, model, result, told))
                bar.update()
    return tuple(outcomes)


def _compared(outcomes: Sequence[tuple[str, SpectrumFit | None, str]]) -> tuple[Candidate, ...]:
    """All with a BIC on as many readings as are independent by the residuals of the model that leaves fewest."""
    samples = max((fit.independent for _, fit, _ in outcomes if fit), default=5.0)
    rows = []
    for name, fit, against in outcomes:
        bic = information_criterion(fit.fit.residuals, fit.fit.count, samples) if fit else float("inf")
        rows.append(Candidate(name, fit, bic, against))
    return tuple(rows)


def _chosen(candidates: Sequence[Candidate], source: str) -> SpectrumFit:
    """The fewest parameters among the reliable models of (nearly) least BIC; failing these the simplest fit."""
    fitted = [c for c in candidates if c.fit]
    if not fitted:
        why = "; ".join(f"{c.model}: {c.against}" for c in candidates)
        raise SolveError(f"{source}: no model could be fitted ({why})")
    sound = [c for c in fitted if not c.against] or fitted[:1]
    least = min(c.bic for c in sound)
    near = [c for c in sound if c.bic <= least + _WORTH]
    best = min(near, key=lambda c: (c.fit.fit.count if c.fit else 0, c.bic))
    assert best.fit is not None
    return best.fit


def _warnings(fit: SpectrumFit, check: KramersKronig, candidates: Sequence[Candidate]) -> list[str]:
    found = []
    if fit.open_circuit:
        given = fit.values["dc_resistance"]
        found.append(f"dc_resistance: {fit.held['dc_resistance']}; the strip is given {given:.3g} ohm")
    if fit.undetermined:
        loose = ", ".join(fit.undetermined)
        found.append(f"not determined by this spectrum (not felt, or standard error over 50%): {loose}")
    if fit.agreeing < 2:
        found.append(f"the best of {fit.starts} fits was not reached a second time: it may not be the least")
    if fit.relative_rms > max(_MISFIT * check.rms, _NEGLIGIBLE):
        found.append(
            f"model {fit.model} leaves {fit.relative_rms:.2%} rms of abs(Z), the spectrum's own noise is "
            f"{check.rms:.2%}: the model is not all that is there"
        )
    if structured(fit.fit.residuals) and fit.relative_rms > _NEGLIGIBLE:
        found.append(
            "residuals of neighbouring frequencies are alike: standard errors that take them as independent are too "
            "small, those of a block bootstrap are given"
        )
    if len(candidates) > 1 and all(c.against for c in candidates):
        found.append("no model is fully determined by this spectrum: the simplest that could be fitted is given")
    return found


def _parameters(fit: SpectrumFit, fitted: dict[str, Parameter], electrode_resistance: float) -> dict[str, Parameter]:
    found = {}
    for p in electrical_model(fit.model).parameters:
        held = fit.held.get(p.name)
        found[p.name] = fitted[p.name] if held is None else Parameter(fit.values[p.name], p.unit, held=held)
    what = "a spectrum shows Re + Rs, not each" if fit.port.ladder else "a spectrum fixes three of four elements"
    how = "held at the value given" if electrode_resistance else "held at zero, since nothing else is known of it"
    return found | {"electrode_resistance": Parameter(electrode_resistance, "ohm", held=f"{what}: {how}")}


def _derived(fit: SpectrumFit) -> dict[str, Parameter]:
    f, port = fit.spectrum.frequency, fit.port
    derived = {"lowest_frequency": Parameter(float(f[0]), "Hz"), "highest_frequency": Parameter(float(f[-1]), "Hz")}
    for k, (r, c) in enumerate(port.branches, 1):
        ending = f"_{k}" if len(port.branches) > 1 else ""
        derived[f"time_constant{ending}"] = Parameter(r * c, "s")
    if "diffusion_time" in fit.values:
        capacitance = fit.values["diffusion_time"] / fit.values["warburg_resistance"]
        derived["diffusion_capacitance"] = Parameter(capacitance, "F")
    if len(port.branches) > 1:
        derived["total_capacitance"] = Parameter(float(np.sum([c for _, c in port.branches])), "F")
    return {name: replace(p, value=float(p.value)) for name, p in derived.items()}
