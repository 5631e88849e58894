"""The inverse problem in one call: `design` returns a `DesignReport`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from ..arrays import one_thread
from ..circuit.load import Hung
from ..drive import Drive, drive_findings
from ..errors import InputError, argument, checked
from ..findings import Finding, Warned
from ..result import Column, Result
from ..strip.actuator import Actuator
from ..strip.file import save_actuator
from ..strip.layered import thickness_findings
from ..strip.validity import largest_voltage, run_warnings
from ..units import format_quantity, parse
from .constraints import ActiveConstraint, WithoutRequirement, active_constraints, without_each_requirement
from .parameters import DRIVE_KEYS, FIRST_IS_VOLTAGE, require_layers, rewritten, scenario_template
from .pareto import Front, pareto_front, parse_objectives
from .plan import Vary, range_texts
from .problem import Design, DesignProblem, Objective, best_design, distinct
from .requirements import nothing_asked, parse_requirements, quantity
from .sensitivity import Sensitivity, SobolIndices, confident_design, sobol_indices
from .sensitivity import sensitivity as sensitivity_of
from .space import Counter, Space, parse_ranges, resolve_engine, uncounted

#: A whole number, which needs no .0.
_WHOLE = re.compile(r"(\d)\.0(?=\D|$)")


@dataclass(frozen=True, repr=False, eq=False)
class DesignReport(Result, Warned):
    """The answer to a design problem, as `ilg_circuit.design` and `ilg_circuit.pareto` return it.

    A part that was not asked for is None.

    Attributes
    ----------
    feasible : bool
        True if the design meets all requirements.
    design : Design or None
        The best design.
    active_constraints : sequence of ActiveConstraint
        The limits of the design, and the gain from relaxing each by 1 %.
    without_requirement : sequence of WithoutRequirement
        For an infeasible design: the effect of omitting each requirement.
    front : Front or None
        The Pareto front.
    sensitivity : Sensitivity or None
        Propagated uncertainty of the fitted strip.
    confidence : float or None
        Probability with which each requirement must be met.
    sobol : SobolIndices or None
        Sobol indices of the quantities.
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "design"

    design: Design | None = None
    active_constraints: Sequence[ActiveConstraint] = ()
    without_requirement: Sequence[WithoutRequirement] = ()
    sensitivity: Sensitivity | None = None
    confidence: float | None = None
    front: Front | None = None
    sobol: SobolIndices | None = None

    @property
    def feasible(self) -> bool:
        """False if a best design was asked for and does not meet every requirement."""
        return self.design is None or self.design.feasible

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings: assumptions of the model that fail at the design or on the front, and failed simulations."""
        design, texts, failed = self.design, [], []
        told: tuple[Finding, ...] = ()
        if design:
            told = drive_findings(design.scenario.drive)
            space = design.problem.space
            chosen = {name: [float(x)] for name, x in {**space.fixed, **design.values}.items() if name == "thickness"}
            told += thickness_findings(space.template.actuator, chosen)
            scenario, peak = design.scenario, abs(design.simulated.get("displacement_peak", math.nan))
            run = scenario.drive, scenario.duration, largest_voltage(scenario.actuator, scenario.drive)
            texts += run_warnings(scenario.actuator, *run, peak if math.isfinite(peak) else None)
            if design.failures:
                numbers = {"failures": design.failures, "total": space.scattered}
                failed = [Finding("designs-failed", values=numbers)]
        told += tuple(Finding("assumption-fails", values={"text": text}) for text in texts)
        return (*told, *(self.front.findings if self.front else ()), *failed)

    def table(self) -> tuple[Column, ...]:
        """Return the front, a row a design; without one the best design in a row, or else the Sobol indices."""
        if self.front:
            return self.front.table()
        if self.design:
            problem, values = self.design.problem, self.design.values
            units = dict(zip(problem.space.names, (r.parameter.unit for r in problem.space.ranges), strict=True))
            found = {q.name: self.design.simulated[q.name] for q in problem.quantities}
            units |= {q.name: q.unit for q in problem.quantities}
            return tuple(Column(name, [value], units[name]) for name, value in {**values, **found}.items())
        return self.sobol.table() if self.sobol else ()

    def to_dict(self) -> dict[str, Any]:
        """Return JSON-ready values in SI units; what was not asked for is None."""
        return {
            "design": _design(self.design, self) if self.design else None,
            "front": self.front.to_dict() if self.front else None,
            "sobol": _sobol(self.sobol) if self.sobol else None,
            "warnings": list(self.warnings),
        }

    def write_strip(self, path: str | Path) -> None:
        """Write the best strip as a TOML file, whose comment gives aim, drive, requirements and provenance.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            There is no feasible design, or the file cannot be written.
        """
        design = self.design
        if design is None or not design.feasible:
            raise InputError("no design meets all requirements, so there is no strip to write")
        actuator, space = design.scenario.actuator, design.problem.space
        written, *more = self.provenance.lines()
        lines = [
            f"designed by {written.removeprefix('written by ')} from '{actuator.name}': {aim(design)}",
            f"drive {design_drive(design)}, {format_quantity(space.template.duration, 's')}, tip {design.scenario.tip}",
        ]
        for r in design.problem.requirements:
            value = format_quantity(design.simulated[r.quantity.name], r.quantity.unit, 6)
            lines.append(f"{r.text}: {value} by {design.referee}")
        save_actuator(replace(actuator, name=f"{actuator.name}, designed"), Path(path), "\n".join(lines + more))


@checked
def design(
    strip: str | Path | Actuator,
    drive: str | Drive,
    duration: str | float,
    vary: Vary,
    *,
    require: str | Iterable[str] = (),
    minimise: str | None = None,
    maximise: str | None = None,
    pareto: str | Iterable[str] | None = None,
    points: int | None = None,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
    engine: str = "auto",
    seed: int = 0,
    sensitivity: bool = False,
    confidence: str | float | None = None,
    sobol: bool = False,
    count: Counter = uncounted,
    progress: Callable[[int, int], None] | None = None,
) -> DesignReport:
    """Return the best strip, within the ranges of ``vary``, that meets the requirements, or a Pareto front.

    Parameters
    ----------
    strip : Actuator, str or Path
        Strip that is varied: an object, the path of a TOML file or a preset's name.
    drive : str or Drive
        A text such as "step:4V", whose values can be varied too, or a drive.
    duration : float or str
        Duration of the run [s].
    vary : mapping or iterable of str
        ``{"thickness": ("0.2 mm", "1 mm")}`` or texts such as "thickness=0.2mm:1mm"; one value fixes it. Names as in
        `sweep`.
    require : str or iterable of str
        Requirements on outputs (the names are listed in `sweep`), on varied parameters or on the model's validity:
        "displacement_final>=4mm", "settling_time<=20s", "relative_deflection<=0.2"; slenderness, window and gravity
        are validity numbers, and "valid" stands for all of them.
    minimise : str, optional
        Name of the output that is minimised.
    maximise : str, optional
        Name of the output that is maximised (default: the worst margin of the requirements).
    pareto : str or iterable of str, optional
        Two or three objectives of a front, such as ``["displacement_final", "force_blocked", "min:energy"]``.
    points : int, optional
        Number of points of the front (default: 25 for two objectives, 60 for three).
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    engine : {"auto", "exact", "ngspice"}
        Solver of the search; auto is exact for linear circuits. ngspice always simulates the answer once more.
    seed : int
        Seed of the starting points of the search.
    sensitivity : bool
        Propagates the uncertainty of the fitted strip to the design.
    confidence : float or str, optional
        Probability with which each requirement must be met.
    sobol : bool
        Adds Sobol indices: the share of each quantity's variance that each parameter causes over its range.
    count : callable
        Function that is called with the number of simulations since its last call.
    progress : callable, optional
        Function that is called with (done, total) points of the front.

    Returns
    -------
    DesignReport
        ``report.design.values`` are the varied parameters [SI], ``report.feasible`` says if all requirements are met,
        ``report.save("strip.toml")`` writes the strip. See `ilg.results`.

    Raises
    ------
    InputError
        A name, a range or a requirement is not understood, or options contradict one another.
    SolveError
        No design within the ranges can be simulated, or there is no front.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> wanted = {"require": "displacement_final>=4mm", "minimise": "energy"}
    >>> report = ilg.design("paper", "step:4V", "300 s", {"thickness": ("0.2 mm", "1 mm")}, **wanted)
    >>> report.feasible
    True
    """
    wishes = (require,) if isinstance(require, str) else tuple(require)
    probability = parse(confidence, "", argument("confidence")) if isinstance(confidence, str) else confidence
    for wrong, advice in (
        (
            minimise and maximise,
            f"{argument('minimise')} and {argument('maximise')}: give one of them, or {argument('pareto')} for several",
        ),
        (
            not (wishes or minimise or maximise or pareto),
            f"{nothing_asked()}, or {argument('pareto')}",
        ),
        (
            probability and not wishes,
            f"{argument('confidence')} is the probability of meeting requirements; give {argument('require')}",
        ),
        (points is not None and not pareto, f"{argument('points')} goes with {argument('pareto')}"),
    ):
        if wrong:
            raise InputError(advice)
    template = scenario_template(strip, drive, duration, tip=tip, beam=beam, load=load)
    template.parsed_drive()  # raises for a text that is not a drive, before any work
    ranges, fixed = parse_ranges(range_texts(vary))
    require_layers(template.actuator, (*fixed, *(r.parameter.name for r in ranges)))
    space = Space(template, ranges, fixed, resolve_engine(template, ranges, fixed, engine), count)
    named, sense = (minimise, 1) if minimise else (maximise, -1)
    objective = Objective(quantity(named, space.names), sense) if named else None
    aims = pareto if isinstance(pareto, str) else ",".join(pareto or ())
    front_of = parse_objectives(aims, space.names) if aims else ()
    requirements = parse_requirements(wishes, space.names, template.actuator)
    problem = DesignProblem(space, requirements, objective or (front_of[0] if front_of else None), seed)
    best, report = None, DesignReport(confidence=probability)
    with one_thread():
        if objective or not front_of or any(r.maximised for r in requirements):
            extra = [o.quantity for o in front_of]
            if template.actuator.coupling is not None:
                extra.append(quantity("displacement_peak", space.names))
            wanted = replace(problem, objective=objective)
            best = confident_design(wanted, probability, extra) if probability else best_design(wanted, extra)
            report = replace(
                report,
                design=best,
                active_constraints=active_constraints(best),
                without_requirement=[] if best.feasible else without_each_requirement(best),
                sensitivity=sensitivity_of(best) if sensitivity or probability else None,
            )
            problem = replace(problem, requirements=best.problem.requirements)
        if front_of and report.feasible:
            report = replace(report, front=pareto_front(problem, front_of, points=points, progress=progress))
        if sobol:
            asked = [q for q in distinct((*problem.quantities, *(o.quantity for o in front_of))) if q.outputs]
            report = replace(report, sobol=sobol_indices(space, asked, seed=seed))
    return report


def aim(design: Design) -> str:
    """Return the objective of the design, as text."""
    objective = design.problem.objective
    return objective.text if objective else "largest margin to all requirements"


def design_drive(design: Design) -> str:
    """Return the text of the design's drive; a description if a voltage scales a square wave or a file."""
    space = design.problem.space
    drive = space.template.drive
    values = {**space.fixed, **design.values}
    changed = {name: float(values[name]) for name in DRIVE_KEYS if name in values}
    if not changed:
        return space.template.drive_text
    if not isinstance(drive, str) or ("voltage" in changed and drive.partition(":")[0] not in FIRST_IS_VOLTAGE):
        return design.scenario.drive.text
    return _WHOLE.sub(r"\1", rewritten(drive, changed).replace(" ", ""))


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _design(design: Design, report: DesignReport) -> dict[str, Any]:
    problem, search = design.problem, design.search
    objective, uncertainty = problem.objective, report.sensitivity
    return {
        "feasible": design.feasible,
        "aim": aim(design),
        "drive": design_drive(design),
        "parameters": {
            name: {"value": design.values[name], "unit": r.parameter.unit, "low": r.low, "high": r.high}
            for name, r in zip(problem.space.names, problem.space.ranges, strict=True)
        },
        "objective": {
            "quantity": objective.quantity.name,
            "unit": objective.quantity.unit,
            "sense": "minimise" if objective.sense > 0 else "maximise",
            "value": _number(design.exact[objective.quantity.name]),
            "ngspice": _number(design.simulated[objective.quantity.name]),
        }
        if objective
        else None,
        "requirements": [
            {
                "text": r.text,
                "quantity": r.quantity.name,
                "relation": r.relation,
                "limit": r.limit,
                "unit": r.quantity.unit,
                "value": _number(design.exact[r.quantity.name]),
                "ngspice": _number(design.simulated[r.quantity.name]),
                "margin": _number(design.margin(r)),
                "met": design.met(r),
                "range": list(map(_number, design.reach[r.quantity.name])),
                "probability": uncertainty.met[r.text] if uncertainty else None,
            }
            for r in problem.requirements
        ],
        "worst_margin": _number(design.worst_margin),
        "limits": [
            {"what": x.text, "parameter": x.parameter, "end": x.end, "binds": x.binds, "gain_per_percent": x.gain}
            for x in report.active_constraints
        ],
        "omissions": [{"without": x.requirement.text, "worst_margin": x.margin} for x in report.without_requirement],
        "search": {
            "engine": problem.space.engine,
            "scattered": problem.space.scattered,
            "starts": len(search.ends),
            "agreeing": search.agreeing,
            "spread": dict(zip(problem.space.names, search.spread.tolist(), strict=True)),
        },
        "ngspice": {"largest_difference": design.difference, "estimated_error": design.error},
        "uncertainty": {
            **{name: getattr(uncertainty, name) for name in ("stderr", "shares", "all_met", "drawn", "failed")},
            "confidence": report.confidence,
        }
        if uncertainty
        else None,
    }


def _sobol(indices: SobolIndices) -> dict[str, Any]:
    keys = ("first", "first_ci95", "total", "total_ci95")
    tables = (indices.first, indices.first_error, indices.total, indices.total_error)
    return {
        name: {
            parameter: {key: _number(table[k, j]) for key, table in zip(keys, tables, strict=True)}
            for j, parameter in enumerate(indices.parameters)
        }
        for k, name in enumerate(indices.quantities)
    }
