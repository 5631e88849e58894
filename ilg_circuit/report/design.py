"""A design, a front and Sobol indices: text for a terminal; pictures of requirements, front and indices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..study.design import DesignReport, aim, design_drive
from ..study.pareto import Front
from ..study.problem import Design
from ..study.search import INITIAL_POINTS
from ..study.sensitivity import Sensitivity, SobolIndices
from ..units import format_quantity
from .axes import BLUE, COLOURS, GREY, ORANGE, Figure, axis_label, engineering, legend_below, logarithmic, tiles, wide
from .tables import aligned

#: A design is not unique if agreeing starts differ by more than this fraction of a parameter's range.
_UNIQUE = 0.02
#: A quantity that varies by less than this over the ranges does not depend on the varied parameters.
_SAME = 5e-3
#: Line styles by which coinciding lines can be told apart.
_STYLES = ("-", (0, (5, 2)), "-.", (0, (1, 1)))
_SLICE = 61
#: Axes over more than this ratio are logarithmic.
_DECADES = 8.0


def summary(report: DesignReport) -> str:
    """Return the design, its sensitivity, the front and the Sobol indices as text."""
    parts = []
    if report.design:
        parts.append(_design(report.design, report))
        if report.sensitivity:
            parts.append(_sensitivity(report.design, report.sensitivity, report.confidence))
    if report.front:
        parts.append(_front(report.front))
    if report.sobol:
        parts.append(_sobol(report.sobol))
    return "\n\n".join(parts)


def figure(report: DesignReport) -> Figure:
    """Return the picture of the front, or of the design without one. Raises InputError where there is neither."""
    if report.front:
        return front_figure(report.front, report.design)
    if report.design:
        return design_figure(report.design)
    raise InputError("there is neither a design nor a front to draw")


def _percent(part: float) -> str:
    return f"{100 * part:+.3g} %" if abs(part) < 10 else f"{1 + part:.3g} times"


def _design(design: Design, report: DesignReport) -> str:
    problem = design.problem
    space = problem.space
    head = "best design" if design.feasible else "NO design meets all requirements; nearest"
    lines = [
        f"{head} of '{space.template.actuator.name}', {design_drive(design)}, "
        f"{format_quantity(space.template.duration, 's')}: {aim(design) if design.feasible else 'least worst margin'}",
        "",
    ]
    rows = []
    ends = {(constraint.parameter, constraint.end) for constraint in report.active_constraints}
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
    lines += ["", *_active(design, report)]
    if not design.feasible:
        lines += _infeasible(design, report)
    lines += ["", _search(design)]
    lines.append(
        f"simulated again by ngspice: differs by at most {design.difference:.1e} (its own estimate {design.error:.1e})"
    )
    return "\n".join(lines)


def _active(design: Design, report: DesignReport) -> list[str]:
    binding = [constraint for constraint in report.active_constraints if constraint.binds]
    idle = [constraint for constraint in report.active_constraints if not constraint.binds]
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


def _infeasible(design: Design, report: DesignReport) -> list[str]:
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
    for omission in report.without_requirement:
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


def design_figure(design: Design) -> Figure:
    """Return the factor by which each requirement is met along each parameter, the others as designed."""
    problem, space = design.problem, design.problem.space
    n = len(space.ranges)
    columns = min(n, 3)
    figure, axes = tiles(n, columns, height=2.7, width=3.4)
    shares = np.linspace(0, 1, _SLICE)
    points = np.tile(design.search.best.point, (n, _SLICE, 1))
    points[range(n), :, range(n)] = shares
    values = space.at(points.reshape(-1, n), problem.quantities)
    values = {name: column.reshape(n, _SLICE) for name, column in values.items()}
    for j, (panel, interval) in enumerate(zip(axes, space.ranges, strict=True)):
        x = space.columns(points[j])[interval.parameter.name]
        factor, unit = engineering(x, interval.parameter.unit)
        for k, r in enumerate(problem.requirements):
            column = values[r.quantity.name][j]
            # of an equality how far off, instead of a tolerance's sliver
            score = np.log(np.abs(column / r.limit)) if r.relation == "=" else r.score(column)
            met = np.exp(np.clip(score, -4, 4))
            style: Any = {"color": COLOURS[k % len(COLOURS)], "linestyle": _STYLES[k % len(_STYLES)]}
            panel.plot(factor * x, met, linewidth=1.6, label=r.text, **style)
        if problem.objective:
            name = problem.objective.quantity.name
            here = design.exact[name]
            if here > 0:
                style = {"color": GREY, "linewidth": 1.2, "label": f"{name} / at the design"}
                panel.plot(factor * x, values[name][j] / here, "--", **style)
        panel.axvline(factor * design.values[interval.parameter.name], color="black", linewidth=0.9, label="design")
        if wide(x, _DECADES) and interval.log:
            logarithmic(panel, "x")
        logarithmic(panel, "y")
        low, high = panel.get_ylim()
        low, high = min(low, 0.8), max(high, 1.25)
        panel.set(xlabel=axis_label(interval.parameter.name, unit), ylim=(low, high))
        panel.axhspan(low, 1.0, color="#d9534f", alpha=0.09, linewidth=0)
        panel.axhline(1.0, color="#d9534f", linewidth=0.8)
        if j % columns == 0:
            panel.set_ylabel("factor by which it is met")
    legend_below(figure, axes[:1])
    title = "design" if design.feasible else "nearest design (not all requirements are met)"
    figure.suptitle(f"{title}: shaded, a requirement is missed", fontsize=10)
    return figure


def front_figure(front: Front, design: Design | None = None) -> Figure:
    """Return the front, its third objective as colour, the parameters along it, and ``design`` where comparable."""
    names = [o.quantity.name for o in front.objectives]
    figure, (panel, beside) = tiles(2, 2, height=3.9, width=4.6)
    scales = [engineering(front.simulated[name], front.units[name]) for name in names]
    data = [factor * front.simulated[name] for name, (factor, _) in zip(names, scales, strict=True)]
    labels = [axis_label(name, unit) for name, (_, unit) in zip(names, scales, strict=True)]
    if len(names) == 2:
        panel.plot(*data, "o-", color=BLUE, markersize=4, linewidth=1.0, label="Pareto front")
    else:
        colours: dict[str, Any] = {"c": data[2], "cmap": "viridis"}
        if wide(data[2], _DECADES):
            colours["norm"] = "log"
        points = panel.scatter(data[0], data[1], s=26, edgecolors="white", linewidths=0.4, **colours)
        figure.colorbar(points, ax=panel, label=labels[2])
    if design and all(name in design.simulated for name in names):
        mark = [factor * design.simulated[name] for name, (factor, _) in zip(names[:2], scales, strict=False)]
        label = f"best design: {aim(design)}"
        panel.plot(*mark, "*", color=ORANGE, markersize=13, markeredgecolor="black", label=label)
    for axis, values, label in zip("xy", data, labels, strict=False):
        getattr(panel, f"set_{axis}label")(label)
        if wide(values, _DECADES):
            logarithmic(panel, axis)
    if panel.get_lines():
        panel.legend(frameon=False, fontsize=8)
    _parameters(beside, front, data[0], labels[0])
    aims = ", ".join(("min " if o.sense > 0 else "max ") + o.quantity.name for o in front.objectives)
    figure.suptitle(f"Pareto front of {len(front)} designs: {aims}", fontsize=10)
    return figure


def _parameters(panel: Any, front: Front, x: Array, label: str) -> None:
    """Draw each parameter along the front, relative to its largest value there."""
    style = "o-" if len(front.objectives) == 2 else "o"
    for k, (name, column) in enumerate(front.columns.items()):
        factor, unit = engineering(column, front.units[name])
        largest = float(np.abs(column).max()) or 1.0
        text = f"{name} / {factor * largest:.4g} {unit}".rstrip()
        panel.plot(x, column / largest, style, color=COLOURS[k % len(COLOURS)], markersize=3, linewidth=1.0, label=text)
    if wide(x, _DECADES):
        logarithmic(panel, "x")
    panel.set(xlabel=label, ylabel="parameter / its largest on the front", ylim=(min(0.0, panel.get_ylim()[0]), 1.3))
    panel.legend(frameon=False, fontsize=8, loc="upper center", ncols=2)


def sobol_figure(found: SobolIndices) -> Figure:
    """Return first-order and total indices of each quantity as bars with their 95 % intervals."""
    n = len(found.quantities)
    figure, axes = tiles(n, min(n, 2), height=0.9 + 0.42 * len(found.parameters), width=4.4)
    y = np.arange(len(found.parameters), dtype=float)
    for k, (panel, name) in enumerate(zip(axes, found.quantities, strict=True)):
        for shift, values, errors, colour, label in (
            (-0.19, found.first[k], found.first_error[k], BLUE, "first-order: alone"),
            (0.19, found.total[k], found.total_error[k], ORANGE, "total: with all interactions"),
        ):
            if np.isfinite(values).all():
                panel.barh(y + shift, values, 0.36, xerr=errors, color=colour, error_kw={"elinewidth": 1}, label=label)
        if not np.isfinite(found.first[k]).all():
            panel.text(0.5, 0.5, "does not vary, or is missing for some design", transform=panel.transAxes, ha="center")
        panel.set_yticks(y, found.parameters)
        panel.invert_yaxis()
        panel.set(xlabel="part of the variance", xlim=(0, max(1.0, panel.get_xlim()[1])))
        panel.set_title(name, fontsize=9, loc="left")
    legend_below(figure, axes)
    figure.suptitle("Sobol indices over the ranges, 95 % intervals", fontsize=10)
    return figure
