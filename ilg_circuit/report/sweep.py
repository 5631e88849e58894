"""Sweeps: text; pictures as curves over one parameter, maps over two, scatter for random and listed designs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..study.dataset import DESIGN
from ..study.outputs import OUTPUTS
from ..study.parameters import PARAMETERS
from ..study.plan import Plan
from ..study.sweep import SweepResult
from ..units import format_quantity
from .axes import COLOURS, GREY, ORANGE, Figure, axis_label, engineering, grid, legend_below, round_levels, tiles, wide
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
#: Line styles by which coinciding curves can be told apart.
_DASHES = ("-", "--", ":", "-.")
#: Groups of equal size over which the medians of a scatter are taken.
_GROUPS = 12
#: Most designs in a scatter, evenly chosen.
_MOST_POINTS = 4000


def summary(result: SweepResult) -> str:
    """Return the totals of a sweep: designs solved and failed, and each output's lowest and highest value."""
    totals, plan = result.totals, result.spec.plan
    where = f" into {result.path}" if result.path else ""
    lines = [f"{plan.text}: {totals.count - totals.failed} of {totals.count} designs solved{where}"]
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
    item = PARAMETERS[name]
    return f"{name} {value if item.words else format_quantity(float(value), item.unit, 4)}"


def figure(result: SweepResult, outputs: tuple[str, ...] = ()) -> Figure:
    """Return the picture of ``outputs``, at most six; by default up to four that differ. Raises InputError."""
    with result.to_xarray() as data:
        return dataset_figure(data, outputs)


def dataset_figure(data: Dataset, outputs: tuple[str, ...] = ()) -> Figure:
    """Return the picture of a sweep's dataset, as `figure`. Raises InputError where there is nothing to draw."""
    wanted = outputs or _interesting(data)
    if not wanted:
        raise InputError("every output is the same for all designs: there is nothing to draw")
    if len(wanted) > 6:
        raise InputError(f"{len(wanted)} outputs are too many for one picture; draw at most 6")
    chosen = data[list(wanted)].load()
    names = [str(n) for n in chosen.data_vars]
    if DESIGN in chosen.dims:
        drawn = _scatter(chosen, names)
    else:
        axes = sorted((str(d) for d in chosen.dims if chosen.sizes[d] > 1), key=lambda d: -chosen.sizes[d])
        drawn = _lines(chosen, names, axes) if _few(chosen, axes) else _maps(chosen, names, axes)
    failed = int((data["failure"] != "").sum())
    note = f"; {failed} designs failed" if failed else ""
    tip = "" if data.attrs["tip"] == "free" else ", clamped tip"
    name = data.attrs["title"].partition(": ")[2]
    drawn.suptitle(f"{name}, {data.attrs['duration_s']:g} s{tip}{note}", fontsize=10)
    return drawn


def _interesting(data: Dataset) -> tuple[str, ...]:
    found = []
    for name in (*_PREFERRED, *(str(n) for n in data.data_vars)):
        if name not in data or name in found or name in ("failure", "error") or "time" in data[name].dims:
            continue
        values = data[name].values[np.isfinite(data[name].values)]
        if len(values) and np.ptp(values) > 1e-9 * np.abs(values).max():
            found.append(name)
    return tuple(found[:_MOST_PANELS])


def _few(data: Dataset, axes: list[str]) -> bool:
    """Return True if a grid is drawn as curves: with one axis, or a second one of few values or of words."""
    return len(axes) < 2 or (len(axes) == 2 and (data.sizes[axes[1]] <= _MOST_CURVES or _is_words(data[axes[1]])))


def _is_words(axis: DataArray) -> bool:
    return axis.dtype.kind not in "fiu"


def _scaled(axis: DataArray) -> tuple[Any, str]:
    """Return values for drawing and their label."""
    name = str(axis.name).replace("_", " ")
    if _is_words(axis):
        return axis.values.astype(str), name
    unit = axis.attrs["units"]
    factor, label = engineering(axis.values, unit) if unit in _PREFIXED else (1.0, unit)
    return axis.values * factor, axis_label(name, "" if unit == "1" else label)


#: Units that take a prefix; "Pa s" or "1/s" would read wrong with one.
_PREFIXED = ("m", "V", "A", "F", "N", "C", "J", "Pa", "kg/m^3", "ohm", "Hz")


def _lines(data: Dataset, names: list[str], axes: list[str]) -> Figure:
    """A panel for each output over the first axis, a curve for each value of a second one."""
    figure, panels = grid(len(names), 1, (6.5, 0.6 + 1.9 * len(names)), sharex=True)
    over = axes[0] if axes else str(next(iter(data.dims)))
    x, label = _scaled(data[over])
    style: dict[str, Any] = {"marker": "o", "markersize": 3} if len(x) <= 40 else {}
    for panel, name in zip(panels[:, 0], names, strict=True):
        values, title = _scaled(data[name])
        table = np.moveaxis(values, data[name].dims.index(over), 0).reshape(len(x), -1)
        for k, curve in enumerate(table.T):
            panel.plot(x, curve, color=COLOURS[k % len(COLOURS)], linestyle=_DASHES[k % len(_DASHES)], **style)
        panel.set_ylabel(title.replace(" [", "\n["))
        _logarithmic(panel, "x", x)
    panels[-1, 0].set_xlabel(label)
    for family in axes[1:]:
        members, title = _scaled(data[family])
        texts = [str(m) if _is_words(data[family]) else f"{m:.4g}" for m in members]
        style = {"title": title, "fontsize": 8, "title_fontsize": 8, "frameon": False}
        figure.legend(panels[0, 0].get_lines(), texts, loc="outside right upper", **style)
    figure.align_ylabels(panels[:, 0])
    return figure


def _maps(data: Dataset, names: list[str], axes: list[str]) -> Figure:
    """A map for each output over the two longest axes, the others held at their middle."""
    across, up, *others = axes
    held = {axis: data.sizes[axis] // 2 for axis in others}
    named = ", ".join(_value(axis, data[axis].values[k]) for axis, k in held.items()).replace("_", " ")
    data = data.isel(held).squeeze()
    figure, panels = tiles(len(names), min(len(names), 2), height=3.3, width=4.4)
    x, x_label = _scaled(data[across])
    y, y_label = _scaled(data[up])
    for panel, name in zip(panels, names, strict=True):
        table, title = _scaled(data[name].transpose(up, across))
        panel.grid(False)
        is_wide = wide(table, _WIDE)
        norm = "log" if is_wide else None
        shaded = panel.pcolormesh(x, y, table, cmap="viridis", norm=norm, shading="nearest", rasterized=True)
        words = _is_words(data[across]) or _is_words(data[up])
        if np.isfinite(table).all() and np.ptp(table) > 0 and not words:
            levels = round_levels(table) if is_wide else 7
            lines = panel.contour(x, y, table, levels=levels, colors="white", linewidths=0.8)
            panel.clabel(lines, fontsize=7, fmt="%.4g")
        figure.colorbar(shaded, ax=panel)
        panel.set_title(title, fontsize=9)
        panel.set(xlabel=x_label, ylabel=y_label)
        _logarithmic(panel, "x", x)
        _logarithmic(panel, "y", y)
    if named:
        figure.supxlabel(f"at {named}", fontsize=8)
    return figure


def _scatter(data: Dataset, names: list[str]) -> Figure:
    """A row for each output, a column for each parameter: every design, and the median over the others."""
    parameters = [str(c) for c in data.coords if str(c) != DESIGN]
    size = (max(2.4 * len(parameters), 6.5), 0.6 + 1.9 * len(names))
    figure, panels = grid(len(names), len(parameters), size, sharey="row", sharex="col")
    every = slice(None, None, max(1, data.sizes[DESIGN] // _MOST_POINTS))
    for j, parameter in enumerate(parameters):
        x, x_label = _scaled(data[parameter])
        for i, name in enumerate(names):
            panel = panels[i, j]
            y, y_label = _scaled(data[name])
            points: dict[str, Any] = {"color": GREY, "alpha": 0.35, "markersize": 2.5, "rasterized": True}
            panel.plot(x[every], y[every], ".", label="a design", **points)
            if not _is_words(data[parameter]):
                panel.plot(*_medians(x, y), color=ORANGE, linewidth=1.6, label="median of neighbours")
            _logarithmic(panel, "y", y[np.isfinite(y)])
            if j == 0:
                panel.set_ylabel(y_label.replace(" [", "\n["))
        panels[-1, j].set_xlabel(x_label)
    figure.align_ylabels(panels[:, 0])
    legend_below(figure, panels.flat)
    return figure


def _medians(x: Array, y: Array) -> Array:
    """Medians (2, groups) of ``x`` and ``y`` over groups of neighbours in ``x``, of equal size."""
    known = np.flatnonzero(np.isfinite(y))
    groups = np.array_split(known[np.argsort(x[known], kind="stable")], min(_GROUPS, max(len(known) // 8, 1)))
    return np.array([[np.median(values[g]) for g in groups if len(g)] for values in (x, y)])


def _logarithmic(panel: Any, axis: str, values: Any) -> None:
    """Make an axis logarithmic for positive values over more than a decade and a half."""
    if wide(values, _WIDE):
        getattr(panel, f"set_{axis}scale")("log")
