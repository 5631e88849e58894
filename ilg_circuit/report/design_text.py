"""A design, a front and Sobol indices as text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..units import format_quantity
from .constraints import ActiveConstraint, WithoutRequirement
from .design import DesignReport, aim, design_drive
from .pareto import Front
from .plan import Range
from .problem import Design
from .requirements import Requirement
from .search import INITIAL_POINTS
from .sensitivity import Sensitivity
from .sobol import SobolIndices

#: Designs of starts that agree lie together if no parameter differs by more than this part of its range.
_UNIQUE = 0.02
#: A quantity that differs by less than this over the ranges does not depend on what is varied.
_SAME = 5e-3


def describe(findings: DesignReport) -> str:
    """All that was found out, for a terminal."""
    parts = []
    if findings.design:
        parts.append(_design(findings.design, findings.active_constraints, findings.omissions))
        if findings.sensitivity:
            parts.append(_sensitivity(findings.design, findings.sensitivity, findings.confidence))
    if findings.front:
        parts.append(_front(findings.front))
    if findings.sobol:
        parts.append(_sobol(findings.sobol))
    return "\n\n".join(parts)


def _value(value: float, requirement: Requirement) -> str:
    return format_quantity(value, requirement.quantity.unit, 5)


def _percent(part: float) -> str:
    return f"{100 * part:+.3g} %" if abs(part) < 10 else f"{1 + part:.3g} times"


def _design(design: Design, limits: Sequence[ActiveConstraint], omissions: Sequence[WithoutRequirement]) -> str:
    problem = design.problem
    template = problem.space.template
    head = "best design" if design.feasible else "NO design meets all requirements; nearest"
    lines = [
        f"{head} of '{template.actuator.name}', {design_drive(design)}, "
        f"{format_quantity(template.duration, 's')}: {aim(design) if design.feasible else 'least worst margin'}",
        "",
    ]
    rows = []
    ends = {(limit.parameter, limit.end) for limit in limits}
    for interval in problem.space.ranges:
        name, unit = interval.parameter.name, interval.parameter.unit
        at = next((w for w, end in (("lower", interval.low), ("upper", interval.high)) if (name, end) in ends), None)
        rows.append(
            [name, format_quantity(design.values[name], unit, 6), _range(interval), f"at its {at} end" if at else ""]
        )
    lines += _aligned(rows)
    if problem.objective:
        quantity = problem.objective.quantity
        lines += [
            "",
            f"{problem.objective.text}: {format_quantity(design.simulated[quantity.name], quantity.unit, 5)}",
        ]
    if problem.requirements:
        rows = [["requirement", f"{problem.space.engine}", "ngspice again", "margin", "met"]]
        for r in problem.requirements:
            ours, theirs = design.exact[r.quantity.name], design.simulated[r.quantity.name]
            margin = "within 0.1 %" if r.relation == "=" and design.met(r) else _percent(design.margin(r))
            rows.append([r.text, _value(ours, r), _value(theirs, r), margin, "yes" if design.met(r) else "NO"])
        lines += ["", *_aligned(rows, right=(1, 2, 3))]
    lines += ["", *_limits(design, limits)]
    if not design.feasible:
        lines += _infeasible(design, omissions)
    lines += ["", _search(design)]
    lines.append(
        f"simulated again by ngspice: differs by at most {design.difference:.1e} (its own estimate {design.error:.1e})"
    )
    return "\n".join(lines)


def _limits(design: Design, limits: Sequence[ActiveConstraint]) -> list[str]:
    binding = [limit for limit in limits if limit.binds]
    idle = [limit for limit in limits if not limit.binds]
    objective = design.problem.objective if design.feasible else None
    what = objective.quantity.name if objective else "the worst margin"
    sign = -1 if objective and objective.sense > 0 else 1
    lines = []
    if binding:
        lines.append(f"what holds it back, and what 1 % more room there does to {what}")
        unit = "%" if objective else "percentage points"
        lines += _aligned([[x.text, f"{100 * sign * x.gain:+.3g} {unit}"] for x in binding], right=(1,))
    if idle:
        lines.append("reached, but no gain in moving it: " + "; ".join(x.text for x in idle))
    return lines or ["nothing holds it back: no requirement or end of a range is reached"]


def _infeasible(design: Design, omissions: Sequence[WithoutRequirement]) -> list[str]:
    lines = []
    for r in design.problem.requirements:
        low, high = design.reach[r.quantity.name]
        within = [side.score(np.array([low, high])) for side in r.sides()]
        if all((score >= 0).any() for score in within):
            continue
        unit = r.quantity.unit
        if abs(high - low) <= _SAME * max(abs(low), abs(high)):
            lines.append(
                f"{r.quantity.name} is {format_quantity(low, unit, 4)} whatever is varied: vary something else"
            )
        else:
            lines.append(
                f"{r.text} is out of reach by itself: over the ranges {r.quantity.name} goes from "
                f"{format_quantity(low, unit, 4)} to {format_quantity(high, unit, 4)}"
            )
    for omission in omissions:
        rest = "the others can be met" if omission.margin >= 0 else f"the others still miss by {-omission.margin:.1%}"
        lines.append(f"without {omission.requirement.text} {rest}")
    return ["", *lines] if lines else []


def _search(design: Design) -> str:
    search = design.search
    space = design.problem.space
    scouts, ends = INITIAL_POINTS[space.engine], len(search.ends)
    spread = [(n, x) for n, x in zip(space.names, search.spread, strict=True) if x > _UNIQUE]
    text = f"search: {scouts} scattered designs, then {ends} starts by the {space.engine} engine, {search.agreeing} "
    text += "of which agree"
    if spread:
        alike = ", ".join(f"{n} by {x:.0%} of its range" for n, x in spread)
        text += f"; the design is NOT unique, equally good ones differ in {alike}"
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
        error = format_quantity(found.stderr[q.name], q.unit, 2)
        rows.append([q.name, format_quantity(design.exact[q.name], q.unit, 5), error, source, ", ".join(chances)])
    lines = _aligned(rows, right=(1, 2))
    said = f" (asked for each: {confidence:.3g})" if confidence else ""
    lines.append(f"all requirements met: {found.all_met:.1%} of {found.drawn} strips drawn from the covariance{said}")
    if found.failed:
        lines.append(f"{found.failed} of them could not be simulated and count as not met")
    return "\n".join(lines)


def _front(front: Front) -> str:
    names = list(dict.fromkeys([*(o.quantity.name for o in front.objectives), *front.columns]))
    columns = {**front.simulated, **front.columns}
    aims = ", ".join(("min " if o.sense > 0 else "max ") + o.quantity.name for o in front.objectives)
    shown = np.unique(np.linspace(0, len(front) - 1, min(len(front), 12)).round().astype(int))
    rows = [[format_quantity(float(columns[n][k]), front.units[n], 4) for n in names] for k in shown]
    lines = [
        f"Pareto front: {aims}; {len(front)} designs, {len(shown)} of them",
        *_aligned([names, *rows], right=range(len(names))),
    ]
    amount = f" by more than {front.improvable:.1e} of the front's extent" if front.improvable else ""
    lines.append(f"no random design near a point betters it in all objectives{amount}")
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
    lines = [*_aligned(rows, right=(2, 3))]
    return "\n".join([*lines, f"95 % intervals; {found.simulations} designs spread evenly over the ranges"])


def _range(interval: Range) -> str:
    low, high = (format_quantity(x, interval.parameter.unit, 6) for x in (interval.low, interval.high))
    return f"from {low} to {high}"


def _aligned(rows: list[list[str]], right: Any = ()) -> list[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = [
        "  "
        + "  ".join(c.rjust(w) if k in right else c.ljust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True)))
        for row in rows
    ]
    return [line.rstrip() for line in lines]
