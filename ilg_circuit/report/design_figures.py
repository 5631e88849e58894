"""Pictures of designs: requirements along each parameter, a Pareto front, Sobol indices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..study.design import aim
from ..study.pareto import Front
from ..study.problem import Design
from ..study.sensitivity import SobolIndices
from .axes import BLUE, GREY, ORANGE, engineering
from .panels import COLOURS, axis_label, legend_below, logarithmic, tiles, wide

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Line styles by which coinciding lines can be told apart.
_STYLES = ("-", (0, (5, 2)), "-.", (0, (1, 1)))
_SLICE = 61
#: Axes over more than this ratio are logarithmic.
_DECADES = 8.0


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
        panel.set_ylim(low, high)
        panel.axhspan(low, 1.0, color="#d9534f", alpha=0.09, linewidth=0)
        panel.axhline(1.0, color="#d9534f", linewidth=0.8)
        panel.set_xlabel(axis_label(interval.parameter.name, unit))
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


def _parameters(panel: Axes, front: Front, x: Array, label: str) -> None:
    """Draw each parameter along the front, relative to its largest value there."""
    style = "o-" if len(front.objectives) == 2 else "o"
    for k, (name, column) in enumerate(front.columns.items()):
        factor, unit = engineering(column, front.units[name])
        largest = float(np.abs(column).max()) or 1.0
        text = f"{name} / {factor * largest:.4g} {unit}".rstrip()
        panel.plot(x, column / largest, style, color=COLOURS[k % len(COLOURS)], markersize=3, linewidth=1.0, label=text)
    if wide(x, _DECADES):
        logarithmic(panel, "x")
    panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]), top=1.3)
    panel.set_xlabel(label)
    panel.set_ylabel("parameter / its largest on the front")
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
        panel.set_xlim(0, max(1.0, panel.get_xlim()[1]))
        panel.set_title(name, fontsize=9, loc="left")
        panel.set_xlabel("part of the variance")
    legend_below(figure, axes)
    figure.suptitle("Sobol indices over the ranges, 95 % intervals", fontsize=10)
    return figure
