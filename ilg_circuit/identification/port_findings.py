"""Findings on an identified port: its residuals, and parameters that the data do not determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isinf

import numpy as np

from ..arrays import Array
from ..findings import Finding
from ..fit.coarse import coarse_runs, coarse_step, rounding_covariance
from ..fit.criteria import structured
from ..fit.estimate import Estimate
from ..fit.identifiability import DETERMINED
from ..fit.misfit import WARN_SPECTRUM
from ..fit.quantiles import fisher
from ..fit.result import FitResult
from ..fit.selection import Candidate
from ..measurements.smoothing import noise_level
from ..strip.actuator import Actuator
from ..strip.specimen import Specimen
from .coupling_fit import CouplingFit
from .current import CurrentData
from .displacement_findings import start_findings
from .impedance import ImpedanceData
from .port_fit import PortFit
from .port_model import DC, PortData

#: Least residuals that may count as autocorrelated, relative to the white noise and to the size of the data.
_OVER_NOISE, _NEGLIGIBLE = 1.5, 1e-4
#: A spectrum's misfit is reported above this factor of its own noise and this fraction of abs(Z).
_MISFIT, _NEGLIGIBLE_MISFIT = 2.0, 1e-3
#: Quantile of the ratio of variances above which a misfit is no chance.
_SURE = 0.999
#: A model that "auto" does not try, since most spectra do not determine it; named where none of its candidates fits.
_UNTRIED = "randles"
#: Ratio to the chosen model's rms below which a rejected candidate of smallest rms is reported: more parameters always
#: reduce the rms slightly.
_CLOSER = 0.9
#: Difference below which BICs are equal, as for a model with a part that has no effect.
_SAME_BIC = 0.1


def port_findings(port: PortFit, candidates: Sequence[Candidate], parameters: Mapping[str, Estimate]) -> list[Finding]:
    """Return findings on the port's residuals, and on ``parameters`` that the data do not determine."""
    found: list[Finding] = []
    shares = []
    for k, d in enumerate(port.data):
        residuals, subject = port.fit.residuals_of(k), d.source
        if isinstance(d, ImpedanceData):
            found += spectrum_findings(d, residuals, port.kind.name, unknowns=float(port.fit.leverage[k]))
            found += _digits(d, port.fit, k)
            continue
        assert isinstance(d, CurrentData)
        if d.drifts:
            rate, error = port.fit.nuisance_of(k)[1], port.fit.nuisance_errors_of(k)[1]
            about = {"quantity": d.quantity, "unit": d.unit, "rate": float(rate), "stderr": float(error)}
            found.append(Finding("current-drifts", subject, about))
        rms = port.fit.rms_of(k)
        if structured(residuals) and rms > max(_OVER_NOISE * noise_level(d.data), _NEGLIGIBLE * d.size):
            shares.append(rms / d.size)
            found.append(Finding("residuals-autocorrelated", subject))
        found += _resolution(d, rms)
    if shares:
        code = "one-pole-not-enough" if port.kind.plain == "rc" else "residuals-structured"
        found.insert(0, Finding(code, values={"model": port.kind.name, "share": max(shares)}))
        failed = [c for c in candidates if c.status == "failed"]
        found += [Finding("model-not-fitted", values={"model": c.model, "reason": c.against}) for c in failed]
    elif port.lack is not None and port.lack.anything:
        share = port.misfit * port.lack.share**0.5
        if share > _NEGLIGIBLE:
            found.append(Finding("model-lacks", values={"model": port.kind.name, "share": share}))
    if DC in port.fixed:
        found.append(Finding("electron-path-open", values={"reason": port.fixed[DC], "given": port.values[DC]}))
    elif port.spared and (path := parameters[DC]).interval is not None:
        share = path.reported[0] / path.value
        if isinf(path.reported[1][1]) or (path.method == "mcmc" and share > DETERMINED):  # samples always end
            found.append(Finding("electron-path-vague", values={"share": share}))
    found += start_findings(port.fit.starts)
    chosen = next(c for c in candidates if c.chosen)
    if chosen.identifiability is not None and not chosen.identifiability.determined:
        found.append(Finding("not-determined", values={"reason": chosen.identifiability.reason}))
    if len(candidates) > 1 and all(c.against for c in candidates):
        found.append(Finding("no-model-determined"))
    misfit = any(f.code == "spectrum-misfit" and f.values["share"] > WARN_SPECTRUM for f in found)
    if misfit and len(candidates) > 1 and all(c.model.split("+")[0] != _UNTRIED for c in candidates):
        found.append(Finding("richer-model-untried"))
    return found + rejected_findings(candidates)


def spectrum_findings(data: ImpedanceData, residuals: Array, model: str, unknowns: float = 0.0) -> list[Finding]:
    """Return findings on the ``residuals`` (2 f,) that a ``model`` of so many ``unknowns`` leaves of a spectrum.

    They are compared with those of the measurement model, which determines as many unknowns as the points support.
    """
    found: list[Finding] = []
    share = data.relative_rms(residuals)
    sure = share > WARN_SPECTRUM or _beyond_chance(data, share, unknowns)
    if sure and share > max(_MISFIT * data.check.rms, _NEGLIGIBLE_MISFIT):
        low, high, worst = data.worst_window(residuals)
        values = {"model": model, "share": share, "noise": data.check.rms}
        values |= {"complex": data.complex_rms(residuals), "from": low, "to": high, "worst": worst}
        found.append(Finding("spectrum-misfit", data.source, values))
    if structured(residuals) and share > _NEGLIGIBLE_MISFIT:
        found.append(Finding("residuals-autocorrelated", data.source))
    return found


def _beyond_chance(data: ImpedanceData, share: float, unknowns: float) -> bool:
    """Return True if a variance of residuals exceeds the noise's by more than few degrees of freedom explain."""
    readings, told = 2 * len(data.abscissa), 2 * int((~data.check.bad).sum())
    left, spare = readings - unknowns, told - data.check.freedom
    if min(left, spare) < 1:
        return False
    ratio = (share**2 * readings / left) / max(data.check.rms**2 * told / spare, np.finfo(float).tiny)
    return bool(ratio > fisher(_SURE, left, spare))


def _digits(d: ImpedanceData, fit: FitResult, k: int) -> list[Finding]:
    """Return a finding if the digits that a spectrum was written with are the larger part of a value's error."""
    steps = d.shown(coarse_runs(fit, k)[0])
    step = float(np.abs(np.concatenate([steps.real, steps.imag])).max())
    if not step or not (np.diag(rounding_covariance(fit)) > fit.errors**2).any():
        return []
    return [Finding("digits-coarse", d.source, {"step": step})]


def rejected_findings(candidates: Sequence[Candidate]) -> list[Finding]:
    """Return findings on the candidates of lowest BIC and of clearly lowest rms, if they were not chosen."""
    found: list[Finding] = []
    chosen = next(c for c in candidates if c.chosen)
    fitted = [c for c in candidates if c.bic is not None and c.misfit is not None]
    least = min(fitted, key=lambda c: c.bic or 0.0)
    if least.bic is not None and chosen.bic is not None and least.bic < chosen.bic - _SAME_BIC:
        below = {"model": least.model, "chosen": chosen.model, "less": chosen.bic - least.bic}
        found.append(Finding("least-bic-not-chosen", values={**below, "reason": least.verdict}))
    closest = min(fitted, key=lambda c: c.misfit or 0.0)
    share, chosen_share = closest.misfit or 0.0, chosen.misfit or 0.0
    if closest not in (least, chosen) and share < _CLOSER * chosen_share:
        values = {"model": closest.model, "chosen": chosen.model, "share": share, "chosen_share": chosen_share}
        found.append(Finding("least-rms-not-chosen", values={**values, "reason": closest.verdict}))
    return found


def _resolution(d: PortData, rms: float) -> list[Finding]:
    """Return a finding if the instrument's resolution is so coarse that errors are larger for its rounding."""
    step = coarse_step(d.data, rms)
    return [Finding("resolution-coarse", d.source, {"step": step})] if step else []


def base_findings(base: Actuator | Specimen | None, coupling: CouplingFit | None) -> list[Finding]:
    if base is None:
        return [Finding("no-actuator-coupling" if coupling is not None else "no-actuator")]
    if isinstance(base, Specimen):
        modulus = base.stand_in().material.youngs_modulus
        return [] if base.modulus_known else [Finding("modulus-assumed", values={"modulus": modulus})]
    return [Finding("coupling-not-fitted")] if coupling is None and base.coupling is not None else []
