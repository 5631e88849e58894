"""Presents a response: its waveforms as a table, a picture, a page."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..drive import Drives, by_current, each
from ..simulation.waveforms import WAVEFORMS, answers
from ..units import format_quantity
from .axes import (
    BLUE,
    COLOURS,
    GREY,
    ORANGE,
    Axes,
    Figure,
    Panels,
    caption,
    curve,
    drive_points,
    heading,
    jumps_of,
    legend_above,
    new_figure,
    with_jumps,
)
from .energy import section as energy_section
from .look import narrow
from .page import Grid, Page, Section, picture
from .tables import aligned

if TYPE_CHECKING:
    from ..simulation.compared import Compared
    from ..simulation.response import Response
    from ..simulation.waveforms import Simulated, Waveform

_NORMAL_95 = 1.96
#: Thickness of a line, relative to the height of its panel.
_LINE = 0.015
_HEADER = ("quantity", "at the end", "largest", "at")


def summary(response: Response) -> str:
    """Return a table: for each waveform the final value, the largest value and its time."""
    return "\n".join(aligned([_HEADER, *_rows(response)], "<>>>"))


def headline(response: Response) -> str:
    """Return one line: what was simulated."""
    return f"{response.netlist.title}: {response.drive.text}, {response.time[-1]:g} s, {len(response.time)} samples"


def text(response: Response) -> str:
    """Return all that a user sees: what was simulated, the waveforms, the energies, the error, the comparison."""
    lines = [headline(response), response.summary(), response.account.summary(), *solved_by(response)]
    lines += cells_line(response)
    lines += [note] if (note := swings(response)) else []
    return "\n".join([*lines, *(compared_line(part) for part in response.compared)])


def solved_by(result: Simulated) -> list[str]:
    """Return a line with the engine and its estimated error; none for the exact engine."""
    exact = result.engine != "ngspice"
    return [] if exact else [f"solved by ngspice, estimated error {result.error:.1e} of each maximum"]


def cells_line(response: Response) -> list[str]:
    """Return a line with the number of cells and what their size may change; none for one lump."""
    if response.actuator.electrodes is None:
        return []
    count = sum(name.startswith("curvature_") for name in (o.name for o in response.netlist.outputs))
    known = f"{count} cells of the free length" if count else "cells"
    return [f"{known}: by their size within {response.cells_error:.1e} of currents and displacement"]


def largest(result: Simulated, waveform: Waveform) -> tuple[str, str]:
    """Return the largest value of a waveform, and its time."""
    values = result.waveforms[waveform.name]
    peak = int(np.argmax(np.abs(values)))
    return format_quantity(float(values[peak]), waveform.unit, 5), format_quantity(float(result.time[peak]), "s", 4)


def figure(response: Response) -> Figure:
    """Return the waveforms that are not zero over time, the drive beneath.

    The 95 % band is drawn where the response has standard errors. A measurement is drawn as points beside the
    prediction that was compared with it.
    """
    shown = _shown(response)
    bent = _in_cells(response)
    figure, axes = new_figure(len(shown) + bent + 1, [1.5] * (len(shown) + bent) + [1.0])
    if bent:
        _curvature(response, axes[len(shown)])
    for panel, waveform in zip(axes, shown, strict=False):
        _waveform(response, waveform, panel)
        if waveform.name == "displacement" and (note := swings(response)):
            caption(panel, note)
    _legends(axes[: len(shown)])
    _drive(response, axes[-1])
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    heading(figure, f"{response.netlist.title}: {response.drive.text}")
    return figure


def _legends(axes: list[Axes]) -> None:
    """Draw a legend on the first panel that has labels, and on each one after it whose labels are others."""
    before: list[str] = []
    for panel in axes:
        labels = panel.get_legend_handles_labels()[1]
        if not labels or labels == before:
            continue
        before = labels
        if narrow() and panel.get_title(loc="left"):
            panel.legend(frameon=False, fontsize="small")  # a caption stands above
        else:
            legend_above(panel)


def panels(response: Response) -> Panels:
    """Return the panels: one per waveform, the displacement first if it is known."""
    shown = sorted(_shown(response), key=lambda waveform: waveform.name != "displacement")
    source = "current" if by_current(response.drive) else "voltage"
    drawn = {w.name: partial(_waveform, response, w) for w in shown}
    drawn.setdefault(source, partial(_drive, response))
    if _in_cells(response):
        drawn["curvature"] = partial(_curvature, response)
    return {name: partial(over_time, draw) for name, draw in drawn.items()}


def over_time(draw: Callable[..., None], panel: Axes, **style: Any) -> Axes:
    """Draw a panel whose abscissa is time."""
    draw(panel, **style)
    panel.set_xlabel("time [s]")
    return panel


def _shown(response: Response) -> list[Waveform]:
    return [w for w in answers(response.drive) if np.nanmax(np.abs(response.waveforms[w.name]), initial=0.0) > 0]


def _waveform(response: Response, waveform: Waveform, panel: Axes, **style: Any) -> None:
    """Draw a waveform with its band; if it was compared with a measurement, the prediction and the measurement."""
    part = next((part for part in response.compared if part.quantity == waveform.name), None)
    time, values, error = response.time, response.waveforms[waveform.name], response.stderr.get(waveform.name)
    if part is not None:  # its drive jumps where the record does
        time, values, error, style = part.time, part.predicted, part.stderr, {"label": "predicted"} | style
    at_once = waveform.name == ("voltage" if by_current(response.drive) else "current")
    jumps = jumps_of(response.drive, time) if at_once else np.empty(0)
    if error is not None:
        style = {"linewidth": 0.9} | style
    factor = curve(panel, *with_jumps(time, values, jumps), waveform.name, waveform.unit, **style)
    if part is not None:
        label = f"measured, {part.source}"
        panel.plot(time, factor * part.measured, ".", color=GREY, markersize=2.5, label=label, zorder=1)
    if error is not None:
        _band(panel, time, factor * values, factor * _NORMAL_95 * error, style.get("color", BLUE))


def swings(response: Response) -> str:
    """Return a note on why the displacement swings after jumps of the drive; empty if it does not.

    The tip's mass and the stiffness of beam, gravity and load are an inductor and capacitors in series.
    """
    moving = [element for element in response.netlist.elements if element.role.mechanical]
    mass = sum(element.value for element in moving if element.name.startswith("L"))
    if not mass or not len(jumps_of(response.drive, response.time)) + bool(response.voltage[0]):
        return ""
    stiffness = sum(1 / element.value for element in moving if element.name.startswith("C"))
    frequency = format_quantity(float(np.sqrt(stiffness / mass)) / (2 * np.pi), "Hz", 2)
    source = "current" if by_current(response.drive) else "voltage"
    return f"dynamic beam: swings at {frequency} after each {source} jump"


def _band(panel: Axes, time: Array, values: Array, reach: Array, colour: Any) -> None:
    """Draw a 95 % band with edges that can be seen in print, and say so where the curve's line hides all of it."""
    hidden = 2 * float(np.nanmax(reach)) < _LINE * float(np.ptp(values) or 1.0)
    label = f"95 % band of the fit{', within the line' if hidden else ''}"
    panel.fill_between(time, values - reach, values + reach, color=colour, alpha=0.3, linewidth=0, label=label)
    for edge in (values - reach, values + reach):
        panel.plot(time, edge, color=colour, linewidth=0.5, alpha=0.8, label="_")


def _in_cells(response: Response) -> bool:
    """Return True for a strip whose curvature differs from place to place."""
    return response.curvatures is not None and response.actuator.electrodes is not None


def _curvature(response: Response, panel: Axes, **style: Any) -> None:
    """Draw the curvature as colours over time and the place on the strip, with a scale at the right."""
    curvatures = response.curvatures
    assert curvatures is not None
    edges = np.append(0.0, np.cumsum(curvatures.lengths)) * 1e3
    middles = (response.time[1:] + response.time[:-1]) / 2
    times = np.concatenate([response.time[:1], middles, response.time[-1:]])
    most = float(np.abs(curvatures.values).max()) or 1.0
    look: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -most, "vmax": most, "rasterized": True} | style
    drawn = panel.pcolormesh(times, edges, curvatures.values.T, **look)
    # beside the panel, so that it stays as wide as those above it
    scale = panel.inset_axes((1.01, 0.0, 0.015, 1.0))
    figure = panel.get_figure()
    assert figure is not None
    figure.colorbar(drawn, cax=scale, label="curvature [1/m]")
    panel.grid(visible=False)
    panel.set_ylabel("place [mm]")


def _drive(response: Response, panel: Axes, **style: Any) -> None:
    """Draw the drive; the axis includes zero."""
    what = ("current", "A") if by_current(response.drive) else ("voltage", "V")
    parts = each(response.drive)
    for k, part in enumerate(parts):
        named = {"color": ORANGE} if len(parts) == 1 else {"color": COLOURS[k % len(COLOURS)]}
        if isinstance(response.drive, Drives):
            named |= {"label": f"segment {response.drive.named[k][0]}"}
        curve(panel, *drive_points(part, response.time), *what, **named | style)
    if len(parts) > 1:
        legend_above(panel)
    panel.use_sticky_edges = False
    panel.update_datalim([(response.time[0], 0.0)])
    panel.autoscale_view()


def facts(response: Response) -> list[tuple[str, str]]:
    """Return for each waveform the final value, the largest value and its time."""
    rows = [
        (name, f"{end} at the end, largest {last[0]} at {last[1]}" if len(last) == 2 else f"{end}: {last[0]}")
        for name, end, *last in _rows(response)
    ]
    return [*rows, *(("compared with", compared_line(part)) for part in response.compared)]


def page(response: Response) -> Page:
    """Return a page: the picture, the table of waveforms, where the energy goes."""
    facts = [("engine", response.engine), ("estimated error", f"{response.error:.1e} of each maximum")]
    shown = [picture(figure(response), "waveforms over time, the drive beneath")]
    rows = [(*row, "") if len(row) < 4 else row for row in _rows(response)]
    sections = [Section("Waveforms", [*shown, Grid(_HEADER, rows)]), energy_section(response.account)]
    return Page(f"Response of {response.actuator.name}", headline(response), facts, response.warnings, sections)


def _rows(response: Response) -> list[tuple[str, ...]]:
    """Return a row per waveform: name, final value, largest value, its time; name and reason if unknown."""
    rows: list[tuple[str, ...]] = []
    for waveform in WAVEFORMS.values():
        values = response.waveforms[waveform.name]
        if np.isnan(values).all():
            rows.append((waveform.name, "not known", "the actuator has no [coupling]"))
            continue
        end = format_quantity(float(values[-1]), waveform.unit, 5)
        rows.append((waveform.name, end, *largest(response, waveform)))
    return rows


def compared_line(part: Compared) -> str:
    """Return one line that compares a prediction with a measurement."""
    unit = WAVEFORMS[part.quantity].unit
    line = f"{part.source}: {part.quantity} differs by {format_quantity(part.rms, unit, 3)} rms"
    line += f" ({part.rms / part.largest:.2%} of its largest, {len(part.time)} samples)"
    if part.covered is not None:
        line += f", {part.covered:.0%} of them within the 95% band and the data's noise"
    if part.reversed_axis:
        line += "; its axis was taken to point away from the anode"
    return line + ("; no rest was measured: the mean difference was taken off" if part.offset else "")
