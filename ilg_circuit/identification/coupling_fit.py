"""Fits one coupling d(s) to all records that have a displacement.

The window and the drift of each record are taken from its individual fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Array
from ..errors import IlgError
from ..findings import Finding
from ..fit.fitting import fit
from ..fit.parameter import Parameter
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..strip.actuator import Actuator, CouplingLaw
from ..strip.elements import lumped_port
from .coupling_contest import Contest, LawRow, chosen_law, strands_of
from .displacement import DisplacementFit, fit_displacement
from .film import Moving
from .motion import DisplacementData, Motion
from .motion_laws import EC31, LAWS, MotionLaw
from .port_model import sigma_of
from .port_start import combined

#: Contests of laws at most, each with the clocks of the law that the one before chose.
_ROUNDS = 3


@dataclass(frozen=True)
class CouplingFit:
    """The joint fit of d(s) to all records, each record's ``individual`` fit, and the ``laws`` that were compared.

    ``spread`` (p, p) is the covariance of the logarithms of the law's parameters between the files, where the files
    have values of their own that differ.
    """

    individual: tuple[DisplacementFit, ...]
    fit: FitResult
    motion: Motion
    laws: tuple[LawRow, ...] = ()
    spread: Array | None = None

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
    fitted: dict[str, DisplacementFit] = {}
    if coupling == "auto" and moving:
        contest, findings, fitted = _contest_of(moving, actuator, progress, delay)
        law = contest.law
    for record in moving:
        try:
            late = record.delay if delay is None else delay
            begin = None if contest is None or law == EC31 else contest.begins.get(record.source)
            known = fitted.get(record.source)
            fits.append(known or fit_displacement(record, actuator, progress, late, law, begin))
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
    spread = None
    if gains:
        own = frozenset(law.parameters[k].name for k in law.gains)
        per_record |= own
        scatter = float(np.std(np.log(gains), ddof=1))
        felt = np.array([p.name in own for p in law.parameters])
        spread = scatter**2 * np.outer(felt, felt)
        lowest, highest = min(gains), max(gains)
        values = {"lowest": lowest, "highest": highest, "scatter": float(np.expm1(scatter))}
        findings.append(Finding("coupling-gains-differ", values=values))
    found = CouplingFit(tuple(fits), fits[0].fit, Motion(actuator, beam, records[0].engine, law=law), rows, spread)
    pairs = zip(found.data, found.sigmas(), strict=True)
    observations = tuple(d.observation(found.motion, sigma) for d, sigma in pairs)
    problem = Problem(observations, law.parameters, per_record)
    start = combined(law.parameters, [i.fit for i in fits], [i.fit.independent_samples(0) for i in fits])
    at = dict(zip((p.name for p in law.parameters), start.tolist(), strict=True))
    try:
        if gains:  # far from their mean
            at |= {p.name: value for p, value in _begun(fits[0], law, contest)}
            at |= {f"{p.name}[{i.data.source}]": value for i in fits for p, value in _begun(i, law, contest)}
        first = np.array([at.get(label, at[p.name]) for label, p in zip(problem.labels, problem.moved, strict=True)])
        joint = fit(problem, first, progress)
    except IlgError as error:
        findings.append(Finding("displacements-inconsistent", values={"reason": str(error)}))
        apart = _apart(found, problem, progress)
        return apart, [*findings, *([Finding("displacements-apart")] if apart is not None else [])]
    return replace(found, fit=joint), findings


def decisions(found: CouplingFit | None) -> dict[str, tuple[float, float, frozenset[str]]]:
    """Return what the fits of displacements decided of each: its sign, a drift that is held, and the findings."""
    every = found.individual if found is not None else ()
    return {i.data.source: (i.data.sign, i.data.held, frozenset(f.code for f in i.findings)) for i in every}


def _apart(found: CouplingFit, problem: Problem, progress: Progress) -> CouplingFit | None:
    """Return the fit in which every file keeps all parameters for itself, None if that fails, too."""
    names = [p.name for p in problem.parameters]
    apart = replace(problem, per_record=frozenset(names))
    values = [i.fit.values.tolist() for i in found.individual]
    each = [(i.data.source, own) for i, own in zip(found.individual, values, strict=True)]
    at = {f"{name}[{source}]": value for source, own in each for name, value in zip(names, own, strict=True)}
    try:
        fitted = fit(apart, np.array([at[label] for label in apart.labels]), progress)
    except IlgError:
        return None
    return replace(found, fit=fitted, spread=np.cov(np.log(values), rowvar=False))


def _contest_of(
    records: Sequence[Moving], actuator: Actuator, progress: Progress, delay: float | Literal["fit"] | None
) -> tuple[Contest, list[Finding], dict[str, DisplacementFit]]:
    """Return the contest of laws for displacements, without rows where the strip is not linear, findings, and fits.

    A clock that is to be fitted is that of d(s) at first, and then of the law that was chosen by it, until the law is
    the same again. The fits, by source, are those with such clocks, if d(s) was chosen.
    """
    port = lumped_port(actuator)
    if port.electrode_resistance and not port.linear:
        return Contest(EC31, {}, ()), [Finding("coupling-not-chosen", records[0].source)], {}
    delays = [record.delay if delay is None else delay for record in records]
    found = Contest(EC31, {}, ())
    for _ in range(_ROUNDS):
        strands, fits = strands_of(records, actuator, delays, found)
        before, found = found, chosen_law(strands, actuator, progress)
        if "fit" not in delays or found.law.name == before.law.name:
            break
    subject = records[0].source if len(records) == 1 else ""
    about = _alike(found.rows, subject)
    if found.law == EC31:
        return found, about, fits if before.law == EC31 else {}
    rows = "; ".join(row.text for row in found.rows)
    windows = [begin.end for begin in found.begins.values()]
    values = {"law": found.law.text, "window": min(windows), "rows": rows}
    return found, [Finding("coupling-chosen", subject, values), *about], {}


def _alike(rows: Sequence[LawRow], subject: str) -> list[Finding]:
    """Return the finding that the data do not tell the chosen law from others, if they do not."""
    alike = [row for row in rows if row.alike]
    if not alike:
        return []
    (chosen,) = [row for row in rows if row.chosen]
    others = " and ".join(LAWS[row.law].text for row in alike)
    bics = ", ".join(f"{row.bic - chosen.bic:+.1f}" for row in alike)
    return [Finding("coupling-alike", subject, {"law": LAWS[chosen.law].text, "others": others, "bics": bics})]


def _begun(own: DisplacementFit, law: MotionLaw, contest: Contest | None) -> list[tuple[Parameter, float]]:
    """Return where the joint fit begins for a file's own parameters: at the contest's joint fit, or its own."""
    begin = contest.begins.get(own.data.source) if contest else None
    values = own.fit.values if begin is None or own.motion.law != law else begin.values
    return list(zip(law.parameters, values.tolist(), strict=True))


def _of_one_sign(fits: list[DisplacementFit]) -> tuple[list[DisplacementFit], list[Finding]]:
    """Return the records whose displacement has the majority's sign, and findings on the others."""
    sign = 1.0 if sum(i.data.sign for i in fits) >= 0 else -1.0
    against = [Finding("displacement-opposed", i.data.source) for i in fits if i.data.sign != sign]
    return [i for i in fits if i.data.sign == sign], against
