"""Curves that change in place: waveforms over time and an impedance over frequency, with axes, units and legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, HoverTool, LogTicker
from bokeh.plotting import figure

from ..arrays import Array
from ..report.axes import BLUE, GREY, ORANGE, engineering
from .look import shown


@dataclass(frozen=True)
class Curve:
    """One curve of every picture: what it is, its colour, and how its line is drawn ("" for points)."""

    name: str
    label: str
    colour: str
    line: str = "solid"


#: The strip as it is now, as it was before its sliders moved, solved by the other engine, and what was measured.
NOW = Curve("now", "now, exact engine", BLUE)
BEFORE = Curve("before", "before the sliders moved", GREY, "dashed")
OTHER = Curve("ngspice", "ngspice", ORANGE, "")
MEASURED = Curve("measured", "measured", "#222222", "")
CURVES = (MEASURED, BEFORE, NOW, OTHER)
_HEIGHT = 250
#: Most points that are drawn as points.
_POINTS = 120


@dataclass(frozen=True)
class Panel:
    """One picture: ``y`` over ``x``, each a column with its SI unit; ``logarithmic`` axes by letter."""

    x: str
    y: str
    units: tuple[str, str]
    labels: tuple[str, str]
    logarithmic: str = ""
    equal: bool = False


class Curves:
    """Pictures that share curves; ``view`` is what Panel shows.

    Each curve has one source of data: its columns in SI units by their names, and beside them ``shown_NAME``, in the
    units of the axes.
    """

    def __init__(self, panels: Sequence[Panel], tag: str) -> None:
        self.panels = panels
        names = sorted({name for panel in panels for name in (panel.x, panel.y)})
        empty = {key: np.zeros(0) for name in names for key in (name, f"shown_{name}")}
        self.sources = {c.name: ColumnDataSource(dict(empty), name=f"{tag}_{c.name}", tags=[tag]) for c in CURVES}
        self.values: dict[str, dict[str, Array]] = {}
        self.figures = [self._figure(panel) for panel in panels]
        self.legend = shown()
        grid = {"display": "grid", "grid-template-columns": "repeat(auto-fit, minmax(min(100%, 340px), 1fr))"}
        self.panes = [pn.pane.Bokeh(each, sizing_mode="stretch_width", height=_HEIGHT) for each in self.figures]
        self.view = pn.Column(
            self.legend,
            pn.Column(*self.panes, sizing_mode="stretch_width", styles=grid),
            sizing_mode="stretch_width",
        )

    def _figure(self, panel: Panel) -> Any:
        made = figure(
            height=_HEIGHT,
            sizing_mode="stretch_width",
            x_axis_type="log" if "x" in panel.logarithmic else "linear",
            y_axis_type="log" if "y" in panel.logarithmic else "linear",
            match_aspect=panel.equal,
            tools="pan,box_zoom,reset,save",
            toolbar_location="above",
        )
        made.toolbar.logo = None
        made.toolbar.autohide = True
        x, y = f"shown_{panel.x}", f"shown_{panel.y}"
        for curve in CURVES:
            source = self.sources[curve.name]
            if curve.line:
                made.line(x, y, source=source, color=curve.colour, line_width=2, line_dash=curve.line, name=curve.name)
            else:
                made.scatter(x, y, source=source, color=curve.colour, size=4, fill_alpha=0.5, name=curve.name)
        for letter, axis in (("x", made.xaxis[0]), ("y", made.yaxis[0])):
            if letter in panel.logarithmic:
                axis.ticker = LogTicker(desired_num_ticks=5, num_minor_ticks=0)
        over = [each for each in made.renderers if each.name == NOW.name]
        made.add_tools(HoverTool(renderers=over, tooltips=[(panel.labels[0], f"@{x}"), (panel.labels[1], f"@{y}")]))
        made.xaxis.axis_label, made.yaxis.axis_label = (
            f"{label} [{unit}]" for label, unit in zip(panel.labels, panel.units, strict=True)
        )
        return made

    def set(self, curve: Curve, columns: Mapping[str, Array] | None) -> None:
        """Take the values of a curve in SI units, a column each (n,); None takes it away."""
        if columns is None:
            self.values.pop(curve.name, None)
        else:
            every = max(1, len(next(iter(columns.values()))) // _POINTS) if not curve.line else 1
            self.values[curve.name] = {name: np.asarray(column)[::every] for name, column in columns.items()}

    def draw(self) -> None:
        """Draw what was set: one scale for an axis, whatever the curves."""
        scales: dict[str, float] = {}
        for panel, each, pane in zip(self.panels, self.figures, self.panes, strict=True):
            for name, unit, label, axis in zip((panel.x, panel.y), panel.units, panel.labels, "xy", strict=True):
                found = [c[name] for c in self.values.values() if name in c]
                known = np.concatenate(found) if found else np.zeros(0)
                keep = axis in panel.logarithmic or unit in ("s", "deg", "ohm")
                scales[name], text = (1.0, unit) if keep else engineering(known[np.isfinite(known)], unit)
                shown_unit = text.replace("ohm", "\N{GREEK CAPITAL LETTER OMEGA}")
                getattr(each, f"{axis}axis").axis_label = f"{label} [{shown_unit}]"
            pane.visible = any(
                np.nanmax(np.abs(c[panel.y]), initial=0.0) > 0 for c in self.values.values() if panel.y in c
            )
        for curve in CURVES:
            columns = self.values.get(curve.name)
            source = self.sources[curve.name]
            names = [name for name in source.data if not name.startswith("shown_")]
            size = len(next(iter(columns.values()))) if columns else 0
            given = {name: np.asarray((columns or {}).get(name, np.full(size, np.nan)), dtype=float) for name in names}
            source.data = given | {f"shown_{name}": scales[name] * values for name, values in given.items()}
        self.legend.object = "".join(
            f'<span class="key" style="border-top-color:{c.colour};border-top-style:'
            f'{"dotted" if not c.line else c.line}"></span>{escape(c.label)}'
            for c in CURVES
            if c.name in self.values
        )
