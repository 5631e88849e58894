"""Fits one coupling d(s) to all records that have a displacement.

The window and the drift of each record are taken from its individual fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..errors import IlgError
from ..findings import Finding
from ..fit.fitting import fit
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..strip.actuator import Actuator, CouplingLaw
from ..strip.elements import lumped_port
from .coupling_contest import Contest, LawRow, chosen_law
from .displacement import DisplacementFit, fit_displacement
from .film import Moving
from .motion import DisplacementData, Motion
from .motion_laws import EC31, LAWS
from .port_model import sigma_of
from .port_start import combined


@dataclass(frozen=True)
class CouplingFit:
    """The joint fit of d(s) to all records, each record's ``individual`` fit, and the ``laws`` that were compared.

    ``scatter`` is the standard deviation of the logarithms of the files' gains, where they differ and each has its own.
    """

    individual: tuple[DisplacementFit, ...]
    fit: FitResult
    motion: Motion
    laws: tuple[LawRow, ...] = ()
    scatter: float = 0.0

    @property
    def coupling(self) -> CouplingLaw:
        """The coupling, with the geometric mean of parameters that each record has for itself."""
        law = self.motion.law
        return law.coupling(np.array([self.fit.means[p.name] for p in law.parameters]), self.motion.beam)

    @property
    def data(self) -> tuple[DisplacementData, ...]:
        """The fitted displacements, each relative to the initial position of its individual fit."""
        if len(self.individual) == 1:
            return (self.individual[0].data,)
        return tuple(replace(i.data, reference=i.level) for i in self.individual)

    def sigmas(self) -> tuple[float, ...]:
        """Return the standard deviations [m] by which the residuals of each record are divided."""
        return tuple(sigma_of(i.fit, i.data.size) for i in self.individual)


def fit_coupling(
    records: Sequence[Moving],
    actuator: Actuator,
    per_record: frozenset[str],
    progress: Progress = None,
    delay: float | Literal["fit"] | None = None,
    coupling: str = "auto",
) -> tuple[CouplingFit | None, list[Finding]]:
    """Return the joint fit of d(s) to all records that have a displacement, and findings on it.

    ``delay`` [s] is the camera's; by default it is fitted if the camera has a separate clock. The fit is None if no
    displacement can be fitted, or the joint fit fails. ``coupling`` is the law, of `LAWS`, or "auto", which chooses
    it, see `coupling_contest`.
    """
    fits: list[DisplacementFit] = []
    findings: list[Finding] = []
    moving = [record for record in records if record.record.displacement is not None]
    law, contest = (EC31, None) if coupling == "auto" else (LAWS[coupling], None)
    if coupling == "auto" and moving:
        contest, findings = _contest_of(moving, actuator, progress, delay)
        law = contest.law
    for record in moving:
        try:
            late = record.delay if delay is None else delay
            begin = None if contest is None or law == EC31 else contest.begins.get(record.source)
            fits.append(fit_displacement(record, actuator, progress, late, law, begin))
            law = fits[0].motion.law  # with the signs of its gains
        except IlgError as error:
            findings.append(Finding("displacement-not-fitted", record.source, {"reason": str(error)}))
    rows = contest.rows if contest else ()
    fits, against = _of_one_sign(fits)
    findings += against
    findings += [finding.about(i.data.source) for i in fits for finding in i.findings]
    if len(fits) < 2:
        return (CouplingFit((fits[0],), fits[0].fit, fits[0].motion, rows) if fits else None), findings
    # the dynamic beam if the individual fit of any record shows inertia
    beam = "dynamic" if any(i.motion.beam == "dynamic" for i in fits) else "static"
    gains = contest.gains if contest else ()
    scatter = float(np.std(np.log(gains), ddof=1)) if gains else 0.0
    if gains:
        per_record |= frozenset(law.parameters[k].name for k in law.gains)
        lowest, highest = min(gains), max(gains)
        values = {"lowest": lowest, "highest": highest, "scatter": float(np.expm1(scatter))}
        findings.append(Finding("coupling-gains-differ", values=values))
    found = CouplingFit(tuple(fits), fits[0].fit, Motion(actuator, beam, records[0].engine, law=law), rows, scatter)
    pairs = zip(found.data, found.sigmas(), strict=True)
    observations = tuple(d.observation(found.motion, sigma) for d, sigma in pairs)
    problem = Problem(observations, law.parameters, per_record)
    start = combined(law.parameters, [i.fit for i in fits], [i.fit.independent_samples(0) for i in fits])
    at = dict(zip((p.name for p in law.parameters), start.tolist(), strict=True))
    try:
        first = np.array([at[p.name] for p in problem.moved])
        joint = fit(problem, first, progress)
    except IlgError as error:
        findings.append(Finding("displacements-inconsistent", values={"reason": str(error)}))
        return None, findings
    return replace(found, fit=joint), findings


def _contest_of(
    records: Sequence[Moving], actuator: Actuator, progress: Progress, delay: float | Literal["fit"] | None
) -> tuple[Contest, list[Finding]]:
    """Return the contest of laws for displacements; without rows for d(s) where a clock is to be fitted first."""
    delays = [record.delay if delay is None else delay for record in records]
    clocked = [(r, d) for r, d in zip(records, delays, strict=True) if d != "fit" and not r.record.own_clock]
    port = lumped_port(actuator)
    if not clocked or (port.electrode_resistance and not port.linear):
        return Contest(EC31, {}, ()), [Finding("coupling-not-chosen", records[0].source)]
    known = [float(d) for _, d in clocked]
    found = chosen_law([r for r, _ in clocked], actuator, known, progress)
    if found.law == EC31:
        return found, []
    rows = "; ".join(row.text for row in found.rows)
    windows = [begin.end for begin in found.begins.values()]
    values = {"law": found.law.text, "window": min(windows), "rows": rows}
    return found, [Finding("coupling-chosen", records[0].source if len(records) == 1 else "", values)]


def _of_one_sign(fits: list[DisplacementFit]) -> tuple[list[DisplacementFit], list[Finding]]:
    """Return the records whose displacement has the majority's sign, and findings on the others."""
    sign = 1.0 if sum(i.data.sign for i in fits) >= 0 else -1.0
    against = [Finding("displacement-opposed", i.data.source) for i in fits if i.data.sign != sign]
    return [i for i in fits if i.data.sign == sign], against
