"""A design, a front and Sobol indices: text for a terminal, and their picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..study.constraints import ActiveConstraint, WithoutRequirement
from ..study.design import DesignReport, aim, design_drive
from ..study.pareto import Front
from ..study.problem import Design
from ..study.search import INITIAL_POINTS
from ..study.sensitivity import Sensitivity, SobolIndices
from ..units import format_quantity
from .tables import aligned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: A design is not unique if agreeing starts differ by more than this fraction of a parameter's range.
_UNIQUE = 0.02
#: A quantity that varies by less than this over the ranges does not depend on the varied parameters.
_SAME = 5e-3


def summary(report: DesignReport) -> str:
    """Return the design, its sensitivity, the front and the Sobol indices as text."""
    parts = []
    if report.design:
        parts.append(_design(report.design, report.active_constraints, report.without_requirement))
        if report.sensitivity:
            parts.append(_sensitivity(report.design, report.sensitivity, report.confidence))
    if report.front:
        parts.append(_front(report.front))
    if report.sobol:
        parts.append(_sobol(report.sobol))
    return "\n\n".join(parts)


def figure(report: DesignReport) -> Figure:
    """Return the picture of the front, or of the design without one. Raises InputError where there is neither."""
    from .design_figures import design_figure, front_figure

    if report.front:
        return front_figure(report.front, report.design)
    if report.design:
        return design_figure(report.design)
    raise InputError("there is neither a design nor a front to draw")


def _percent(part: float) -> str:
    return f"{100 * part:+.3g} %" if abs(part) < 10 else f"{1 + part:.3g} times"


def _design(design: Design, active: Sequence[ActiveConstraint], omitted: Sequence[WithoutRequirement]) -> str:
    problem = design.problem
    space = problem.space
    head = "best design" if design.feasible else "NO design meets all requirements; nearest"
    lines = [
        f"{head} of '{space.template.actuator.name}', {design_drive(design)}, "
        f"{format_quantity(space.template.duration, 's')}: {aim(design) if design.feasible else 'least worst margin'}",
        "",
    ]
    rows = []
    ends = {(constraint.parameter, constraint.end) for constraint in active}
    for interval in space.ranges:
        name, unit = interval.parameter.name, interval.parameter.unit
        at = next((w for w, end in (("lower", interval.low), ("upper", interval.high)) if (name, end) in ends), None)
        end = f"at its {at} end" if at else ""
        value, low, high = (format_quantity(x, unit, 6) for x in (design.values[name], interval.low, interval.high))
        rows.append([name, value, f"from {low} to {high}", end])
    lines += aligned(rows, "<<<<", indent="  ")
    if problem.objective:
        quantity = problem.objective.quantity
        value = format_quantity(design.simulated[quantity.name], quantity.unit, 5)
        lines += ["", f"{problem.objective.text}: {value}"]
    if problem.requirements:
        rows = [["requirement", space.engine, "ngspice again", "margin", "met"]]
        for r in problem.requirements:
            name, unit = r.quantity.name, r.quantity.unit
            values = [format_quantity(found[name], unit, 5) for found in (design.exact, design.simulated)]
            margin = "within 0.1 %" if r.relation == "=" and design.met(r) else _percent(design.margin(r))
            rows.append([r.text, *values, margin, "yes" if design.met(r) else "NO"])
        lines += ["", *aligned(rows, "<>>><", indent="  ")]
    lines += ["", *_active(design, active)]
    if not design.feasible:
        lines += _infeasible(design, omitted)
    lines += ["", _search(design)]
    lines.append(
        f"simulated again by ngspice: differs by at most {design.difference:.1e} (its own estimate {design.error:.1e})"
    )
    return "\n".join(lines)


def _active(design: Design, active: Sequence[ActiveConstraint]) -> list[str]:
    binding = [constraint for constraint in active if constraint.binds]
    idle = [constraint for constraint in active if not constraint.binds]
    objective = design.problem.objective if design.feasible else None
    what = objective.quantity.name if objective else "the worst margin"
    sign = -1 if objective and objective.sense > 0 else 1
    lines = []
    if binding:
        lines.append(f"active constraints, and the change of {what} if relaxed by 1 %")
        unit = "%" if objective else "percentage points"
        lines += aligned([[x.text, f"{100 * sign * x.gain:+.3g} {unit}"] for x in binding], "<>", indent="  ")
    if idle:
        lines.append("reached, but no gain in moving it: " + "; ".join(x.text for x in idle))
    return lines or ["no active constraints: no requirement or end of a range is reached"]


def _infeasible(design: Design, omitted: Sequence[WithoutRequirement]) -> list[str]:
    lines = []
    for r in design.problem.requirements:
        low, high = design.reach[r.quantity.name]
        if all((side.score(np.array([low, high])) >= 0).any() for side in r.sides()):
            continue
        least, most = (format_quantity(x, r.quantity.unit, 4) for x in (low, high))
        if abs(high - low) <= _SAME * max(abs(low), abs(high)):
            lines.append(f"{r.quantity.name} is {least} whatever is varied: vary something else")
        else:
            reach = f"over the ranges {r.quantity.name} goes from {least} to {most}"
            lines.append(f"{r.text} is out of reach by itself: {reach}")
    for omission in omitted:
        rest = "the others can be met" if omission.margin >= 0 else f"the others still miss by {-omission.margin:.1%}"
        lines.append(f"without {omission.requirement.text} {rest}")
    return ["", *lines] if lines else []


def _search(design: Design) -> str:
    search, space = design.search, design.problem.space
    text = (
        f"search: {INITIAL_POINTS[space.engine]} scattered designs, then {len(search.ends)} starts by the "
        f"{space.engine} engine, {search.agreeing} of which agree"
    )
    spread = [f"{n} by {x:.0%} of its range" for n, x in zip(space.names, search.spread, strict=True) if x > _UNIQUE]
    if spread:
        text += f"; the design is NOT unique, equally good ones differ in {', '.join(spread)}"
    return text


def _sensitivity(design: Design, found: Sensitivity, confidence: float | None) -> str:
    rows = [["uncertainty of the fit", "value", "standard error", "most of it from", "requirement met with"]]
    for q in design.problem.quantities:
        if not q.outputs:
            continue
        most = found.matters_most(q.name)
        source = f"{most} ({found.shares[q.name][most]:.0%})" if most else "nothing fitted"
        chances = [
            f"{found.met[r.text]:.1%} ({r.relation})" for r in design.problem.requirements if r.quantity.name == q.name
        ]
        value = format_quantity(design.exact[q.name], q.unit, 5)
        error = format_quantity(found.stderr[q.name], q.unit, 2)
        rows.append([q.name, value, error, source, ", ".join(chances)])
    lines = aligned(rows, "<>><<", indent="  ")
    asked = f" (asked for each: {confidence:.3g})" if confidence else ""
    lines.append(f"all requirements met: {found.all_met:.1%} of {found.drawn} strips drawn from the covariance{asked}")
    if found.failed:
        lines.append(f"{found.failed} of them could not be simulated and count as not met")
    return "\n".join(lines)


def _front(front: Front) -> str:
    names = list(dict.fromkeys([*(o.quantity.name for o in front.objectives), *front.columns]))
    columns = {**front.simulated, **front.columns}
    aims = ", ".join(("min " if o.sense > 0 else "max ") + o.quantity.name for o in front.objectives)
    shown = np.unique(np.linspace(0, len(front) - 1, min(len(front), 12)).round().astype(int))
    rows = [[format_quantity(float(columns[n][k]), front.units[n], 4) for n in names] for k in shown]
    amount = f" by more than {front.improvable:.1e} of the front's extent" if front.improvable else ""
    lines = [f"Pareto front: {aims}; {len(front)} designs, {len(shown)} of them"]
    lines += aligned([names, *rows], ">" * len(names), indent="  ")
    lines.append(f"no random design near a point is better in all objectives{amount}")
    lines.append(f"simulated again by ngspice: differs by at most {front.difference:.1e}")
    return "\n".join(lines)


def _sobol(found: SobolIndices) -> str:
    rows = [["Sobol indices", "parameter", "first-order", "total"]]
    for k, name in enumerate(found.quantities):
        for j, parameter in enumerate(found.parameters):
            cells = (
                "does not vary" if math.isnan(v) else f"{v:.3f} +- {e:.3f}"
                for v, e in ((found.first[k, j], found.first_error[k, j]), (found.total[k, j], found.total_error[k, j]))
            )
            rows.append([name if j == 0 else "", parameter, *cells])
    last = f"95 % intervals; {found.simulations} designs spread evenly over the ranges"
    return "\n".join([*aligned(rows, "<<>>", indent="  "), last])
