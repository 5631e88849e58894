"""Presents sweeps: curves over one parameter, maps over two, scatter plots of random and listed designs."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..study.dataset import DESIGN
from ..study.outputs import OUTPUTS
from ..study.parameters import varied_parameter
from ..study.plan import Plan
from ..study.sweep import SweepResult
from ..units import format_quantity
from .axes import (
    COLOURS,
    GREY,
    ORANGE,
    STYLES,
    Axes,
    Figure,
    Panels,
    axis_label,
    engineering,
    grid,
    heading,
    legend_below,
    round_levels,
    scaled,
    tiles,
    wide,
)
from .look import narrow
from .tables import aligned

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

#: Outputs drawn by default: the first of these that the sweep has and that vary.
_PREFERRED = (
    "displacement_final",
    "force_final",
    "force_blocked",
    "settling_time",
    "current_peak",
    "energy",
    "displacement_peak",
)
_MOST_PANELS, _MOST_CURVES = 4, 6
_MOST_REASONS = 5
#: Up to this number of varied parameters a design is named by their values.
_MOST_NAMED = 3
#: Ratio of largest to smallest value from which an axis is logarithmic.
_WIDE = 30
#: Groups of equal size over which the medians of a scatter are taken.
_GROUPS = 12
#: Most designs in a scatter, evenly chosen.
_MOST_POINTS = 4000


def summary(result: SweepResult) -> str:
    """Return the totals of a sweep: designs solved and failed, and each output's lowest and highest value."""
    totals, plan = result.totals, result.spec.plan
    lines = [headline(result)]
    if result.resumed:
        lines.append(f"{result.resumed} of them by an earlier run, which this one continued")
    if result.leftover:
        lines.append(f"'{result.leftover}' holds an interrupted sweep with other settings; remove it if not needed")
    if totals.worst_error:
        lines.append(f"solved by ngspice, estimated error at most {totals.worst_error:.1e} of each maximum")
    if totals.failed:
        lines.append(f"{totals.failed} failed, with their reasons in the variable 'failure':")
        for times, example in sorted(totals.reasons.values(), reverse=True)[:_MOST_REASONS]:
            lines.append(f"  {times} x {example}" if times == 1 else f"  {times} like: {example}")
        if len(totals.reasons) > _MOST_REASONS:
            lines.append(f"  and {len(totals.reasons) - _MOST_REASONS} other reasons")
    rows = [("output", "lowest", "with", "highest", "with")]
    for name in result.spec.outputs:
        if name not in totals.lowest:
            rows.append((name, "not known", "", "", ""))
            continue
        (low, first), (high, last) = totals.lowest[name], totals.highest[name]
        least, most = (format_quantity(x, OUTPUTS[name].unit, 5) for x in (low, high))
        if math.isclose(low, high, rel_tol=1e-9):
            rows.append((name, least, "all alike", "", ""))
        else:
            rows.append((name, least, _design(plan, first), most, _design(plan, last)))
    return "\n".join([*lines, *aligned(rows, "<><><")])


def _design(plan: Plan, number: int) -> str:
    """Return a design's values, or its number where there are many parameters."""
    if len(plan.columns) > _MOST_NAMED:
        return f"design {number}"
    return ", ".join(_value(name, column[0]) for name, column in plan.designs(number, number + 1).items())


def _value(name: str, value: Any) -> str:
    """Return a parameter's name and value as text."""
    item = varied_parameter(name)
    return f"{name} {value if item.words else format_quantity(float(value), item.unit, 4)}"


def headline(result: SweepResult) -> str:
    """Return one line: the plan of the sweep, and how many designs were solved."""
    totals = result.totals
    where = f" into {result.path}" if result.path else ""
    return f"{result.spec.plan.text}: {totals.count - totals.failed} of {totals.count} designs solved{where}"


def facts(result: SweepResult) -> list[tuple[str, str]]:
    """Return each output's lowest and highest value, and how many designs failed."""
    low, high = result.totals.lowest, result.totals.highest
    ends = {name: (low[name][0], high[name][0]) for name in result.spec.outputs if name in low}
    rows = [(n, " to ".join(format_quantity(x, OUTPUTS[n].unit, 5) for x in pair)) for n, pair in ends.items()]
    return ([("failed", f"{result.totals.failed} designs")] if result.totals.failed else []) + rows


def figure(result: SweepResult, outputs: tuple[str, ...] = ()) -> Figure:
    """Return a picture of ``outputs`` (at most six; default: up to four that vary). Raises InputError without any."""
    with result.to_xarray() as data:
        return dataset_figure(data, outputs)


def panels(result: SweepResult) -> Panels:
    """Return the panels: one per output that varies, the most informative first."""
    with result.to_xarray() as data:
        varied = _interesting(data)
    names = dict.fromkeys((*varied, *result.spec.outputs)) if varied else ()
    return {name: partial(_output, result, name) for name in names}


def _output(result: SweepResult, name: str, panel: Axes, **style: Any) -> Axes:
    """Draw one output: curves, a map, or a scatter over the parameter that it depends on most."""
    with result.to_xarray() as data:
        chosen = data[[name]].load()
    if DESIGN in chosen.dims:
        _dots(chosen, name, _strongest(chosen, name), panel, **style).legend(frameon=False, fontsize="small")
        return panel
    axes = _axes(chosen)
    if _few(chosen, axes):
        lines = _curves(chosen, name, axes, panel, **style)
        for family in axes[1:]:
            title, texts = _members(chosen[family])
            panel.legend(lines, texts, title=title, fontsize="small", title_fontsize="small", frameon=False)
        return panel
    chosen, named = _held(chosen, axes)
    _map(chosen, name, axes, panel, **style)
    if named:
        panel.set_title(f"{panel.get_title()} at {named}", fontsize="small")
    return panel


def dataset_figure(data: Dataset, outputs: tuple[str, ...] = ()) -> Figure:
    """Return the picture of a sweep's dataset, as `figure`. Raises InputError where there is nothing to draw."""
    wanted = outputs or _interesting(data)
    if not wanted:
        raise InputError("no design has any of these outputs: there is nothing to draw")
    if len(wanted) > 6:
        raise InputError(f"{len(wanted)} outputs are too many for one picture; draw at most 6")
    chosen = data[list(wanted)].load()
    names = [str(n) for n in chosen.data_vars]
    if DESIGN in chosen.dims:
        drawn = _scatter(chosen, names)
    else:
        axes = _axes(chosen)
        drawn = _lines(chosen, names, axes) if _few(chosen, axes) else _maps(chosen, names, axes)
    failed = int((data["failure"] != "").sum())
    note = f"; {failed} designs failed" if failed else ""
    tip = "" if data.attrs["tip"] == "free" else ", clamped tip"
    name = data.attrs["title"].partition(": ")[2]
    heading(drawn, f"{name}, {data.attrs['duration_s']:g} s{tip}{note}")
    return drawn


def _interesting(data: Dataset) -> tuple[str, ...]:
    """Return up to four outputs that vary, the most informative first; where none does, up to four that are known."""
    found: list[str] = []
    same: list[str] = []
    for name in (*_PREFERRED, *(str(n) for n in data.data_vars)):
        if name not in data or name in found or name in ("failure", "error") or "time" in data[name].dims:
            continue
        values = data[name].values[np.isfinite(data[name].values)]
        if len(values):
            (found if np.ptp(values) > 1e-9 * np.abs(values).max() else same).append(name)
    return tuple((found or same)[:_MOST_PANELS])


def _axes(data: Dataset) -> list[str]:
    """Return the dimensions that vary, the longest first."""
    return sorted((str(d) for d in data.dims if data.sizes[d] > 1), key=lambda d: -data.sizes[d])


def _few(data: Dataset, axes: list[str]) -> bool:
    """Return True if a grid is drawn as curves: one axis, or a second one with few values or text."""
    return len(axes) < 2 or (len(axes) == 2 and (data.sizes[axes[1]] <= _MOST_CURVES or _is_words(data[axes[1]])))


def _is_words(axis: DataArray) -> bool:
    return axis.dtype.kind not in "fiu"


def _scaled(axis: DataArray, drawn: Any = None) -> tuple[Any, str]:
    """Return values for drawing and their label; in the unit of what was ``drawn`` along an axis before."""
    name = str(axis.name).replace("_", " ")
    if _is_words(axis):
        return axis.values.astype(str), name
    unit = axis.attrs["units"]
    factor, label = 1.0, unit
    if unit in _PREFIXED:
        factor, label = engineering(axis.values, unit) if drawn is None else scaled(drawn, axis.values, unit)
    return axis.values * factor, axis_label(name, "" if unit == "1" else label)


#: Units that take a prefix; with one, "Pa s" or "1/s" would be ambiguous.
_PREFIXED = ("m", "V", "A", "F", "N", "C", "J", "Pa", "kg/m^3", "ohm", "Hz")


def _lines(data: Dataset, names: list[str], axes: list[str]) -> Figure:
    """Return a figure: one panel per output over the first axis, one curve per value of a second axis."""
    figure, panels = grid(len(names), 1, (6.5, 0.6 + 1.9 * len(names)), sharex=True)
    for panel, name in zip(panels[:, 0], names, strict=True):
        _curves(data, name, axes, panel)
        panel.label_outer()
    for family in axes[1:]:
        title, texts = _members(data[family])
        style: dict[str, Any] = {"title": title, "fontsize": "small", "title_fontsize": "small", "frameon": False}
        place = {"loc": "outside lower center", "ncols": 3} if narrow() else {"loc": "outside right upper"}
        figure.legend(panels[0, 0].get_lines(), texts, **place, **style)
    figure.align_ylabels(panels[:, 0])
    return figure


def _curves(data: Dataset, name: str, axes: list[str], panel: Any, **style: Any) -> list[Any]:
    """Draw an output over the first axis, a curve for each value of a second one, and return the curves."""
    over = axes[0] if axes else str(next(iter(data.dims)))
    x, label = _scaled(data[over], panel.xaxis)
    marks: dict[str, Any] = {"marker": "o", "markersize": 3} if len(x) <= 40 else {}
    values, title = _scaled(data[name], panel.yaxis)
    table = np.moveaxis(values, data[name].dims.index(over), 0).reshape(len(x), -1)
    curves = []
    for k, curve in enumerate(table.T):
        look = marks | {"color": COLOURS[k % len(COLOURS)], "linestyle": STYLES[k % len(STYLES)]} | style
        curves += panel.plot(x, curve, **look)
    panel.set(xlabel=label, ylabel=title.replace(" [", "\n["))
    _logarithmic(panel, "x", x)
    return curves


def _members(family: DataArray) -> tuple[str, list[str]]:
    """Return the title and labels of a legend for the values of an axis."""
    members, title = _scaled(family)
    return title, [str(m) if _is_words(family) else f"{m:.4g}" for m in members]


def _held(data: Dataset, axes: list[str]) -> tuple[Dataset, str]:
    """Return the data over the two longest axes, the others held at their middle, and where that is."""
    held = {axis: data.sizes[axis] // 2 for axis in axes[2:]}
    named = ", ".join(_value(axis, data[axis].values[k]) for axis, k in held.items()).replace("_", " ")
    return data.isel(held).squeeze(), named


def _maps(data: Dataset, names: list[str], axes: list[str]) -> Figure:
    """Return one map per output over the two longest axes, the others at their middle."""
    data, named = _held(data, axes)
    figure, panels = tiles(len(names), min(len(names), 2), height=3.3, width=4.4)
    for panel, name in zip(panels, names, strict=True):
        _map(data, name, axes, panel)
    if named:
        figure.supxlabel(f"at {named}", fontsize="small")
    return figure


def _map(data: Dataset, name: str, axes: list[str], panel: Any, **style: Any) -> None:
    across, up = axes[:2]
    x, x_label = _scaled(data[across], panel.xaxis)
    y, y_label = _scaled(data[up], panel.yaxis)
    from matplotlib.patheffects import withStroke

    table, title = _scaled(data[name].transpose(up, across))
    panel.grid(False)
    is_wide = wide(table, _WIDE)
    look: dict[str, Any] = {"cmap": "viridis", "norm": "log" if is_wide else None} | style
    shaded = panel.pcolormesh(x, y, table, shading="nearest", rasterized=True, **look)
    words = _is_words(data[across]) or _is_words(data[up])
    if np.isfinite(table).all() and np.ptp(table) > 0 and not words:
        levels = round_levels(table) if is_wide else 7
        lines = panel.contour(x, y, table, levels=levels, colors="white", linewidths=0.8)
        for label in panel.clabel(lines, fontsize="small", fmt="%.4g"):
            label.set_path_effects([withStroke(linewidth=1.5, foreground="#404040")])  # white on yellow, too, is read
    panel.figure.colorbar(shaded, ax=panel)
    panel.set_title(title, fontsize="small")
    panel.set(xlabel=x_label, ylabel=y_label)
    _logarithmic(panel, "x", x)
    _logarithmic(panel, "y", y)


def _scatter(data: Dataset, names: list[str]) -> Figure:
    """Return a figure: a row per output, a column per parameter; each design, and medians over the other parameters."""
    parameters = _varied(data)
    size = (max(2.4 * len(parameters), 6.5), 0.6 + 1.9 * len(names))
    figure, panels = grid(len(names), len(parameters), size, sharey="row", sharex="col")
    for j, parameter in enumerate(parameters):
        for i, name in enumerate(names):
            _dots(data, name, parameter, panels[i, j])
            panels[i, j].label_outer()
    figure.align_ylabels(panels[:, 0])
    legend_below(figure, panels.flat)
    return figure


def _varied(data: Dataset) -> list[str]:
    return [str(c) for c in data.coords if str(c) != DESIGN]


def _strongest(data: Dataset, name: str) -> str:
    """Return the parameter with the largest rank correlation with the output."""

    def correlation(parameter: str) -> float:
        x, y = (np.argsort(np.argsort(data[n].values[known])) for n in (parameter, name))
        return abs(float(np.corrcoef(x, y)[0, 1])) if len(x) > 1 and not _is_words(data[parameter]) else 0.0

    known = np.isfinite(data[name].values)
    return max(_varied(data), key=correlation)


def _dots(data: Dataset, name: str, parameter: str, panel: Any, **style: Any) -> Axes:
    """Draw each design over one parameter, and medians over the other parameters."""
    x, x_label = _scaled(data[parameter], panel.xaxis)
    y, y_label = _scaled(data[name], panel.yaxis)
    every = slice(None, None, max(1, data.sizes[DESIGN] // _MOST_POINTS))
    points: dict[str, Any] = {"color": GREY, "alpha": 0.35, "markersize": 2.5, "rasterized": True, "label": "a design"}
    panel.plot(x[every], y[every], ".", **(points | style))
    if not _is_words(data[parameter]):
        panel.plot(*_medians(x, y), color=ORANGE, linewidth=1.6, label="median of neighbours")
    _logarithmic(panel, "y", y[np.isfinite(y)])
    panel.set(xlabel=x_label, ylabel=y_label.replace(" [", "\n["))
    return panel


def _medians(x: Array, y: Array) -> Array:
    """Return medians (2, groups) of ``x`` and ``y`` in groups of equal size, sorted by ``x``."""
    known = np.flatnonzero(np.isfinite(y))
    groups = np.array_split(known[np.argsort(x[known], kind="stable")], min(_GROUPS, max(len(known) // 8, 1)))
    return np.array([[np.median(values[g]) for g in groups if len(g)] for values in (x, y)])


def _logarithmic(panel: Any, axis: str, values: Any) -> None:
    """Make an axis logarithmic for positive values over more than a decade and a half."""
    if wide(values, _WIDE):
        getattr(panel, f"set_{axis}scale")("log")
