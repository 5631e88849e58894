"""Presents a Pareto front as text and pictures."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..study.design import aim
from ..study.pareto import Front
from ..study.problem import Design
from ..units import format_quantity
from .axes import (
    BLUE,
    COLOURS,
    DECADES,
    ORANGE,
    STYLES,
    Axes,
    Figure,
    Panels,
    axis_label,
    engineering,
    heading,
    logarithmic,
    scaled,
    tiles,
    wide,
)
from .tables import aligned

#: Marks of the parameters along a front, in the order of their colours.
_MARKS = "os^Dv<>p"


def headline(front: Front) -> str:
    """Return one line: the objectives and the number of designs."""
    aims = ", ".join(("min " if o.sense > 0 else "max ") + o.quantity.name for o in front.objectives)
    return f"{aims}; {len(front)} designs"


def facts(front: Front) -> list[tuple[str, str]]:
    """Return the range of every objective and parameter on the front."""
    columns = {o.quantity.name: front.simulated[o.quantity.name] for o in front.objectives} | front.parameters
    ends = {name: (float(values.min()), float(values.max())) for name, values in columns.items()}
    return [
        (name, " to ".join(format_quantity(end, front.units[name], 4) for end in pair)) for name, pair in ends.items()
    ]


def summary(front: Front) -> str:
    """Return a dozen designs of the front, and the results of the checks of its optimality."""
    names = list(dict.fromkeys([*(o.quantity.name for o in front.objectives), *front.parameters]))
    columns = {**front.simulated, **front.parameters}
    shown = np.unique(np.linspace(0, len(front) - 1, min(len(front), 12)).round().astype(int))
    rows = [[format_quantity(float(columns[n][k]), front.units[n], 4) for n in names] for k in shown]
    amount = f" by more than {front.improvable:.1e} of the front's extent" if front.improvable else ""
    lines = [f"Pareto front: {headline(front)}, {len(shown)} of them"]
    lines += aligned([names, *rows], ">" * len(names), indent="  ")
    lines.append(f"no random design near a point is better in all objectives{amount}")
    lines.append(f"simulated again by {front.referee}: differs by at most {front.difference:.1e}")
    return "\n".join(lines)


def figure(front: Front, design: Design | None = None) -> Figure:
    """Return a figure: the front (third objective as colour), parameters along it, ``design`` if comparable."""
    figure, (panel, beside) = tiles(2, 2, height=3.9, width=4.6)
    trade_off(front, design, panel)
    parameters(front, beside)
    aims, _, _ = headline(front).rpartition("; ")
    heading(figure, f"Pareto front of {len(front)} designs: {aims}")
    return figure


def panels(front: Front) -> Panels:
    """Return the panels: the front, and the parameters along it."""
    return {"front": partial(trade_off, front, None), "parameters": partial(parameters, front)}


def trade_off(front: Front, design: Design | None, panel: Axes, **style: Any) -> Axes:
    """Draw the front, a third objective as colour, and ``design`` if it has all objectives."""
    names = [o.quantity.name for o in front.objectives]
    axes = (panel.xaxis, panel.yaxis, None)
    scales = [_scale(front, name, axis) for name, axis in zip(names, axes, strict=False)]
    data = [factor * front.simulated[name] for name, (factor, _) in zip(names, scales, strict=True)]
    labels = [axis_label(name, unit) for name, (_, unit) in zip(names, scales, strict=True)]
    if len(names) == 2:
        look: dict[str, Any] = {"color": BLUE, "marker": "o", "markersize": 4, "linewidth": 1.0}
        panel.plot(*data, **(look | {"label": "Pareto front"} | style))
    else:
        colours: dict[str, Any] = {"c": data[2], "cmap": "viridis", "edgecolors": "white", "linewidths": 0.4}
        if wide(data[2], DECADES):
            colours["norm"] = "log"
        points = panel.scatter(data[0], data[1], s=26, **(colours | style))
        panel.figure.colorbar(points, ax=panel, label=labels[2])
    if design and all(name in design.simulated for name in names):
        mark = [factor * design.simulated[name] for name, (factor, _) in zip(names[:2], scales, strict=False)]
        label = f"best design: {aim(design)}"
        panel.plot(*mark, "*", color=ORANGE, markersize=13, markeredgecolor="black", label=label)
    for axis, values, label in zip("xy", data, labels, strict=False):
        getattr(panel, f"set_{axis}label")(label)
        if wide(values, DECADES):
            logarithmic(panel, axis)
    if panel.get_lines():
        panel.legend(frameon=False, fontsize="small")
    return panel


def parameters(front: Front, panel: Axes, **style: Any) -> Axes:
    """Draw each parameter along the front, relative to its largest value there."""
    name = front.objectives[0].quantity.name
    factor, unit = _scale(front, name, panel.xaxis)
    x, line = factor * front.simulated[name], "-" if len(front.objectives) == 2 else ""
    for k, (parameter, column) in enumerate(front.parameters.items()):
        factor, label = engineering(column, front.units[parameter])
        largest = float(np.abs(column).max()) or 1.0
        text = f"{parameter} / {factor * largest:.4g} {label}".rstrip()
        look: dict[str, Any] = {
            "color": COLOURS[k % len(COLOURS)],
            "linestyle": STYLES[k % len(STYLES)] if line else "",
            "marker": _MARKS[k % len(_MARKS)],
            "markersize": 3.5,
        }
        panel.plot(x, column / largest, **(look | {"linewidth": 1.0, "label": text} | style))
    if wide(x, DECADES):
        logarithmic(panel, "x")
    bottom = min(0.0, panel.get_ylim()[0])
    panel.set(xlabel=axis_label(name, unit), ylabel="parameter / its largest on the front", ylim=(bottom, 1.3))
    panel.legend(frameon=False, fontsize="small", loc="upper center", ncols=2)
    return panel


def _scale(front: Front, name: str, axis: Any) -> tuple[float, str]:
    values, unit = front.simulated[name], front.units[name]
    return engineering(values, unit) if axis is None else scaled(axis, values, unit)
