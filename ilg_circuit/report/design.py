"""Presents a design, a Pareto front and Sobol indices as text and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..study.design import DesignReport, aim, design_drive
from ..study.problem import Design
from ..study.sensitivity import Sensitivity, SobolIndices
from ..units import format_quantity
from . import front as fronts
from .axes import (
    BLUE,
    COLOURS,
    DECADES,
    GREY,
    ORANGE,
    STYLES,
    Axes,
    Figure,
    Panels,
    axis_label,
    caption,
    engineering,
    heading,
    legend_below,
    logarithmic,
    tiles,
    wide,
)
from .tables import aligned

#: A design is not unique if agreeing starts differ by more than this fraction of a parameter's range.
_UNIQUE = 0.02
#: A quantity that varies by less than this over the ranges does not depend on the varied parameters.
_SAME = 5e-3
_SLICE = 61


def summary(report: DesignReport) -> str:
    """Return the design, its sensitivity, the front and the Sobol indices as text."""
    parts = []
    if report.design:
        parts.append(_design(report.design, report))
        if report.sensitivity:
            parts.append(_sensitivity(report.design, report.sensitivity, report.confidence))
    if report.front:
        parts.append(fronts.summary(report.front))
    if report.sobol:
        parts.append(_sobol(report.sobol))
    return "\n\n".join(parts)


def figure(report: DesignReport) -> Figure:
    """Return the picture of the front, or of the design if there is no front. Raises InputError if there is neither."""
    if report.front:
        return fronts.figure(report.front, report.design)
    if report.design:
        return design_figure(report.design)
    raise InputError("there is neither a design nor a front to draw")


def _percent(part: float) -> str:
    return f"{100 * part:+.3g} %" if abs(part) < 10 else f"{1 + part:.3g} times"


def _design(design: Design, report: DesignReport) -> str:
    problem = design.problem
    space = problem.space
    lines = [_headline(design), ""]
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
        rows = [["requirement", space.engine, f"{design.referee} again", "margin", "met"]]
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
    estimate = f"differs by at most {design.difference:.1e} (its own estimate {design.error:.1e})"
    lines.append(f"simulated again by {design.referee}: {estimate}")
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
        f"search: {space.scattered} scattered designs, then {len(search.ends)} starts by the "
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


def facts(report: DesignReport) -> list[tuple[str, str]]:
    """Return the design's parameters and requirements, and the number of designs of a front."""
    rows: list[tuple[str, str]] = []
    if report.front:
        rows.append(("Pareto front", fronts.headline(report.front)))
    if report.design:
        design, ranges = report.design, report.design.problem.space.ranges
        units = {r.parameter.name: r.parameter.unit for r in ranges}
        rows += [(name, format_quantity(design.values[name], unit, 6)) for name, unit in units.items()]
        asked = {r.text: r.quantity for r in design.problem.requirements}
        if design.problem.objective:
            asked = {design.problem.objective.text: design.problem.objective.quantity} | asked
        rows += [(text, format_quantity(design.simulated[q.name], q.unit, 5)) for text, q in asked.items()]
    if report.sobol:
        rows.append(("Sobol indices", f"of {', '.join(report.sobol.quantities)}"))
    return rows


def headline(report: DesignReport) -> str:
    """Return one line: the outcome of the search."""
    if report.design:
        return _headline(report.design)
    return fronts.headline(report.front) if report.front else "Sobol indices"


def _headline(design: Design) -> str:
    space = design.problem.space
    head = "best design" if design.feasible else "NO design meets all requirements; nearest"
    return (
        f"{head} of '{space.template.actuator.name}', {design_drive(design)}, "
        f"{format_quantity(space.template.duration, 's')}: {aim(design) if design.feasible else 'least worst margin'}"
    )


def panels(report: DesignReport) -> Panels:
    """Return the panels: the front, the requirements along each parameter, the Sobol indices."""
    drawn: dict[str, Callable[..., Axes]] = {}
    if report.front:
        drawn["front"] = partial(fronts.trade_off, report.front, report.design)
        drawn["parameters"] = partial(fronts.parameters, report.front)
    if report.design:
        names = report.design.problem.space.names
        drawn |= {name: partial(_one_slice, report.design, j) for j, name in enumerate(names)}
    if report.sobol:
        drawn |= {f"sobol {name}": partial(_bars, report.sobol, k) for k, name in enumerate(report.sobol.quantities)}
    return drawn


def _one_slice(design: Design, j: int, panel: Axes, **style: Any) -> Axes:
    _slice(design, j, panel, **style).legend(frameon=False, fontsize="small")
    return panel


def design_figure(design: Design) -> Figure:
    """Return a figure: margin of each requirement along each parameter, the other parameters as designed."""
    n = len(design.problem.space.ranges)
    columns = min(n, 3)
    figure, axes = tiles(n, columns, height=2.7, width=3.4)
    for j, panel in enumerate(axes):
        _slice(design, j, panel)
        if j % columns:
            panel.set_ylabel("")
    legend_below(figure, axes[:1])
    title = "design" if design.feasible else "nearest design (not all requirements are met)"
    heading(figure, f"{title}: shaded, a requirement is missed")
    return figure


@lru_cache(maxsize=4)
def _slices(design: Design) -> tuple[Array, dict[str, Array]]:
    """Return points (n, slice, n) along each parameter through the design, and all quantities there (n, slice)."""
    n, space = len(design.problem.space.ranges), design.problem.space
    points = np.tile(design.search.best.point, (n, _SLICE, 1))
    points[range(n), :, range(n)] = np.linspace(0, 1, _SLICE)
    values = space.at(points.reshape(-1, n), design.problem.quantities)
    return points, {name: column.reshape(n, _SLICE) for name, column in values.items()}


def _slice(design: Design, j: int, panel: Axes, **style: Any) -> Axes:
    """Draw the factor by which each requirement is met along parameter ``j``."""
    problem, interval = design.problem, design.problem.space.ranges[j]
    points, values = _slices(design)
    x = problem.space.columns(points[j])[interval.parameter.name]
    factor, unit = engineering(x, interval.parameter.unit)
    for k, r in enumerate(problem.requirements):
        column = values[r.quantity.name][j]
        # for an equality the ratio to the limit: its tolerance would be too narrow to see
        score = np.log(np.abs(column / r.limit)) if r.relation == "=" else r.score(column)
        met = np.exp(np.clip(score, -4, 4))
        look: dict[str, Any] = {"color": COLOURS[k % len(COLOURS)], "linestyle": STYLES[k % len(STYLES)]}
        panel.plot(factor * x, met, **(look | {"linewidth": 1.6, "label": r.text} | style))
    if problem.objective:
        name = problem.objective.quantity.name
        here = design.exact[name]
        if here > 0:
            look = {"color": GREY, "linewidth": 1.2, "label": f"{name} / at the design"}
            panel.plot(factor * x, values[name][j] / here, "--", **look)
    panel.axvline(factor * design.values[interval.parameter.name], color="black", linewidth=0.9, label="design")
    if wide(x, DECADES) and interval.log:
        logarithmic(panel, "x")
    logarithmic(panel, "y")
    low, high = panel.get_ylim()
    low, high = min(low, 0.8), max(high, 1.25)
    panel.set(xlabel=axis_label(interval.parameter.name, unit), ylabel="factor by which it is met", ylim=(low, high))
    panel.axhspan(low, 1.0, color="#d9534f", alpha=0.09, linewidth=0)
    panel.axhline(1.0, color="#d9534f", linewidth=0.8)
    return panel


def sobol_figure(found: SobolIndices) -> Figure:
    """Return first-order and total indices of each quantity as bars with their 95 % intervals."""
    n = len(found.quantities)
    figure, axes = tiles(n, min(n, 2), height=0.9 + 0.42 * len(found.parameters), width=4.4)
    for k, panel in enumerate(axes):
        _bars(found, k, panel)
    legend_below(figure, axes)
    heading(figure, "Sobol indices over the ranges, 95 % intervals")
    return figure


def _bars(found: SobolIndices, k: int, panel: Axes, **style: Any) -> Axes:
    """Draw the indices of quantity ``k``."""
    y = np.arange(len(found.parameters), dtype=float)
    for shift, values, errors, colour, label in (
        (-0.19, found.first[k], found.first_error[k], BLUE, "first-order: alone"),
        (0.19, found.total[k], found.total_error[k], ORANGE, "total: with all interactions"),
    ):
        if np.isfinite(values).all():
            look: dict[str, Any] = {"color": colour, "error_kw": {"elinewidth": 1}, "label": label} | style
            panel.barh(y + shift, values, 0.36, xerr=errors, **look)
    if not np.isfinite(found.first[k]).all():
        panel.text(0.5, 0.5, "does not vary, or is missing for some design", transform=panel.transAxes, ha="center")
    panel.set_yticks(y, found.parameters)
    panel.invert_yaxis()
    panel.set(xlabel="part of the variance", xlim=(0, max(1.0, panel.get_xlim()[1])))
    caption(panel, found.quantities[k])
    return panel
