"""Each measured quantity of each file: residuals of its individual fit, of the joint fit, and of the prediction from
the other files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import IlgError
from ..findings import Finding
from ..fit.criteria import ResidualWindow, autocorrelation, residual_windows
from ..fit.estimate import Estimate
from ..fit.fitting import fit_without
from ..fit.misfit import Misfit, deviations_over_time, misfit_of_spectrum, misfit_over_time
from ..fit.problem import Progress
from ..fit.result import FitResult
from ..measurements.smoothing import noise_level
from ..strip.uncertainty import RESIDUAL_UNITS, Residuals
from .displacement_metrics import DisplacementMetrics
from .kramers_kronig import KramersKronig
from .port_fit import PortFit, levels_differ
from .port_model import Measured

Numbers = NDArray[Any]

#: Ratio of joint to individual residuals above which the joint fit does not hold for all files.
WORSE = 1.5
#: Relative residuals above which an individual fit does not describe the data.
_NOT_DESCRIBED = 0.15
#: Reference sizes for residuals, by quantity.
SIZE = {"current": "peak", "voltage": "peak", "impedance": "abs(Z)", "displacement": "span"}
#: Misfits below this fraction of a record's size are ignored, whatever their ratio.
_NEGLIGIBLE = 1e-4
ONLY_ONE = "there is no other file of this quantity"


@dataclass(frozen=True, eq=False)
class ObservationFit:
    """One measured quantity of one file, and three fits of it.

    ``abscissa``: time since the onset [s], of an impedance frequency [Hz]. ``data``, ``fitted`` (by the fit of all),
    ``individually`` (by the individual fit, of model ``individual_model``) and ``predicted`` (from the other files;
    None, and ``not_predicted_because`` says why) in A, m, or complex ohm. ``rms_individual``, ``rms_joint``,
    ``rms_predicted`` are of residuals [unit], of an impedance over abs(Z); ``size`` is what these are compared with:
    peak current, span of the displacement, one. ``derived`` are quantities of this file alone.
    """

    source: str
    quantity: str
    unit: str
    engine: str
    voltage: float
    abscissa: Array
    data: Numbers
    fitted: Numbers
    individually: Numbers
    predicted: Numbers | None
    individual_model: str
    rms_individual: float
    rms_joint: float
    rms_predicted: float | None
    size: float
    statistics: Mapping[str, float]
    not_predicted_because: str = ""
    derived: Mapping[str, Estimate] = field(default_factory=dict)
    check: KramersKronig | None = None
    metrics: DisplacementMetrics | None = None
    misfit: Misfit | None = None

    @property
    def residuals(self) -> Numbers:
        """data - joint fit."""
        return self.data - self.fitted

    @property
    def inconsistent(self) -> bool:
        """True if the joint fit's residuals are much larger than the individual fit's."""
        return self.rms_joint > max(WORSE * self.rms_individual, _NEGLIGIBLE * self.size)

    @property
    def not_described(self) -> bool:
        """True if the individual fit's residuals are a large part of the data."""
        return self.rms_individual > _NOT_DESCRIBED * self.size

    def windows(self, last: float | None = None) -> tuple[ResidualWindow, ...]:
        """Return the residuals' rms by windows of time up to ``last`` [s]; none of an impedance."""
        if self.quantity == "impedance":
            return ()
        return residual_windows(self.abscissa, self.residuals, float(self.abscissa[-1]) if last is None else last)

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of fit.json; waveforms are left to the picture."""
        return {
            "source": self.source,
            "quantity": self.quantity,
            "engine": self.engine,
            "voltage": self.voltage,
            "own_model": self.individual_model,
            "rms_own": self.rms_individual,
            "rms_joint": self.rms_joint,
            "rms_predicted": self.rms_predicted,
            "rms_unit": self.unit,
            "peak": self.size,
            "n": len(self.data),
            "misfit": self.misfit and self.misfit.to_dict(),
            "derived": {name: e.to_dict() for name, e in self.derived.items()},
            "not_predicted": self.not_predicted_because or None,
            "kramers_kronig": self.check.to_dict() if self.check else None,
            "figures": self.metrics.to_dict() if self.metrics else None,
        }


#: For each observation of a fit, the fit without its file, or the reason why there is none.
LeftOut = Sequence[FitResult | str]


def leave_one_out(found: FitResult, progress: Progress, against: Mapping[str, str] | None = None) -> LeftOut:
    """Return for each observation the fit of all other files.

    A file with a reason ``against`` it, by its source, is not left out.
    """
    sources = [o.source for o in found.problem.observations]
    fits: dict[str, FitResult | str] = {}
    for source in dict.fromkeys(sources):
        why = (against or {}).get(source, "")
        left_out = [k for k, other in enumerate(sources) if other == source]
        if len(left_out) == len(sources):
            why = ONLY_ONE
        try:
            fits[source] = why or fit_without(found, left_out, progress)
        except IlgError as error:
            fits[source] = f"fit of the other files: {error}"
    return [fits[source] for source in sources]


def leave_one_port_out(found: PortFit, progress: Progress) -> LeftOut:
    """Return the same for a port, whose model may need several voltages."""
    against = {}
    for k, left_out in enumerate(found.data):
        others = [d for j, d in enumerate(found.data) if j != k]
        if others and not found.kind.linear and not levels_differ(others):
            against[left_out.source] = f"without {left_out.source} the others are all at one voltage"
    return leave_one_out(found.fit, progress, against)


def predicted_by(found: FitResult, k: int, others: FitResult | str) -> tuple[Array | None, str]:
    """Return the prediction of observation ``k`` from the others, with its own linear terms; or why there is none."""
    if isinstance(others, str):
        return None, others
    observation = found.problem.observations[k]
    if not others.means.keys() >= set(observation.names):
        return None, ONLY_ONE
    try:
        return observation.fitted(np.array([others.means[name] for name in observation.names])), ""
    except IlgError as error:
        return None, f"the prediction from the others cannot be solved: {error}"


def observation_fits(
    data: Sequence[Measured],
    individual: Sequence[tuple[str, Measured, FitResult]],
    staged: FitResult,
    without: LeftOut,
    fit: FitResult,
    first: int,
) -> list[ObservationFit]:
    """Return the rows of ``data``, which are the observations of ``fit`` from ``first`` on.

    ``individual`` gives the model, data and result of each individual fit; ``staged`` is the fit of these data that
    ``without`` leaves one file out of; it may be ``fit`` itself.
    """
    rows = []
    before = first if len(staged.problem.observations) == len(fit.problem.observations) else 0
    for k, (d, (model, alone, own)) in enumerate(zip(data, individual, strict=True)):
        predicted, why = predicted_by(staged, before + k, without[before + k])
        rows.append(
            ObservationFit(
                source=d.source,
                quantity=d.quantity,
                unit=d.unit,
                engine=d.engine,
                voltage=d.voltage,
                abscissa=d.abscissa,
                data=d.shown(d.data),
                fitted=d.shown(fit.fitted(first + k)),
                individually=alone.shown(own.fitted(0)),
                predicted=None if predicted is None else d.shown(predicted),
                individual_model=model,
                rms_individual=own.rms_of(0),
                rms_joint=fit.rms_of(first + k),
                rms_predicted=None if predicted is None else staged.problem.observations[before + k].rms(predicted),
                size=d.size,
                statistics=fit.statistics_of(first + k),
                not_predicted_because=why,
                misfit=_misfit(d, fit.residuals_of(first + k)),
            )
        )
    return rows


def _misfit(d: Measured, residuals: Array) -> Misfit | None:
    if d.channel is None:
        measured, left = d.shown(d.data), d.shown(residuals)
        return misfit_of_spectrum(d.abscissa, np.abs(left) / np.abs(measured))
    return misfit_over_time(d.abscissa, residuals, noise_level(d.data), d.size)


def residuals_of(rows: Sequence[ObservationFit]) -> tuple[Residuals, ...]:
    """Return the misfit of currents and displacements by the time since the onset, per volt, of all records."""
    found = []
    for quantity in RESIDUAL_UNITS:
        parts = []
        for r in (r for r in rows if r.quantity == quantity and r.voltage and r.abscissa[-1] > 0):
            times, deviations = deviations_over_time(r.abscissa, r.residuals, noise_level(r.data))
            parts.append((times, deviations / abs(r.voltage), autocorrelation(r.residuals)))
        if not any(d.any() for _, d, _ in parts):
            continue
        grid = np.unique(np.concatenate([times for times, _, _ in parts]))
        # every record that reaches a time counts there
        squares = np.array([np.interp(grid, t, d, right=np.nan) ** 2 for t, d, _ in parts])
        mean = np.sqrt(np.nanmean(squares, axis=0))
        correlation = float(np.clip(np.mean([c for _, _, c in parts]), -1.0, 1.0))
        found.append(Residuals(quantity, tuple(grid.tolist()), tuple(mean.tolist()), correlation))
    return tuple(found)


def misfit_findings(rows: Sequence[ObservationFit]) -> list[Finding]:
    """Return a finding on every observation with a large misfit."""
    found = []
    for r in rows:
        m = r.misfit
        if m is None or not (m.fail or (m.warn and r.quantity != "impedance")):
            continue  # for a spectrum the port's findings report it
        code = "not-a-success" if m.fail else "misfit"
        values = {"quantity": r.quantity, "size": SIZE[r.quantity], "share": m.share, "worst": m.worst}
        found.append(Finding(code, r.source, {**values, "from": m.start, "to": m.end}))
    return found


def consistency_findings(rows: Sequence[ObservationFit], without: LeftOut) -> list[Finding]:
    """Return findings on files that no port describes, and on files that are inconsistent with one port."""
    found = []
    lost = [f"{r.source} ({r.rms_individual / r.size:.0%} of its {SIZE[r.quantity]})" for r in rows if r.not_described]
    if lost:
        found.append(Finding("file-not-described", values={"files": lost}))
    outlying = [r.source for r in rows if r.inconsistent]
    if outlying:
        found.append(Finding("files-inconsistent", values={"ratio": WORSE, "files": outlying}))
        found += _outlying_file(rows, without)
    return found


def _outlying_file(rows: Sequence[ObservationFit], without: LeftOut) -> list[Finding]:
    """Return the finding on a single file without which one port holds for all others, if there is one."""
    if len(rows) < 3:
        return []
    found = []
    for k, others in enumerate(without):
        if isinstance(others, str):
            continue
        rest = [r for j, r in enumerate(rows) if j != k]
        limits = [max(WORSE * r.rms_individual, _NEGLIGIBLE * r.size) for r in rest]
        if all(others.rms_of(j) <= limit for j, limit in enumerate(limits)):
            found.append(rows[k].source)
    return [Finding("file-outlying", values={"file": found[0]})] if len(found) == 1 else []
