"""Presents a measured frequency response: points with their bands, the model's curve beside them."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..identification.frequency_response import BodeOfRecords
from ..simulation.bode import QUANTITIES
from ..units import format_quantity
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, blank, heading, logarithmic, plain, scaled
from .look import narrow
from .page import Page, Section, picture

#: How points are drawn.
_POINTS: dict[str, Any] = {"fmt": "o", "markersize": 3.5, "linewidth": 1.0, "color": BLUE}
_LINE: dict[str, Any] = {"color": ORANGE, "linewidth": 1.5}


def headline(result: BodeOfRecords) -> str:
    """Return one line: the records, how they were excited, the number of frequencies, the bias."""
    records = ", ".join(f"{source} ({how})" for source, how in result.excited.items())
    return f"{records}: {len(result.frequency)} frequencies about {format_quantity(result.bias, 'V', 3)}"


def facts(result: BodeOfRecords) -> list[tuple[str, str]]:
    """Return the bandwidth, the coherences and, of each quantity, how the model fits."""
    width = result.bandwidth
    notes = []
    if "displacement" in result.responses:
        known = "not among these frequencies" if width is None else format_quantity(width, "Hz", 4)
        notes.append(("bandwidth of the displacement", known))
    for name in result.responses:
        coherence = result.coherence[name][np.isfinite(result.coherence[name])]
        notes.append((f"coherence of the {name}", f"{coherence.min():.3g} to {coherence.max():.3g}"))
    if result.model is not None:
        for name in result.responses:
            count = int(np.isfinite(result.magnitude(name)).sum())
            notes.append(
                (f"{name} of {result.model.actuator.name}", f"outside the band at {_outside(result, name)} of {count}")
            )
    return notes


def summary(result: BodeOfRecords) -> str:
    """Return a line for each quantity and frequency: magnitude and phase with their 95 % bands, and the coherence."""
    lines = [headline(result)]
    for name in result.responses:
        unit = QUANTITIES[name][0].removesuffix("/V")
        sizes, angles = result.band(name)
        rows = zip(result.frequency, result.magnitude(name), sizes, result.phase(name), angles, result.coherence[name],
                   result.outside(name), strict=True)  # fmt: skip
        for f, size, reach, phase, angle, coherence, outside in rows:
            if np.isfinite(size):
                at, text = format_quantity(float(f), "Hz", 4), f"{format_quantity(float(size), unit, 4)}/V"
                line = (
                    f"{name:<13}{at:>10}  {text:>14} +- {100 * reach / size:<6.2g} %  {phase:8.2f} +- {angle:<6.2g} deg"
                )
                lines.append(f"{line}  coherence {coherence:.3f}{'  model outside' if outside else ''}")
    return "\n".join([*lines, *(f"{name}: {value}" for name, value in facts(result))])


def figure(result: BodeOfRecords) -> Figure:
    """Return magnitude, phase and coherence of each quantity over frequency, the model's curve beside them."""
    names = list(result.responses)
    height = 6.4
    figure = blank((3.8 * len(names) + 0.6, height), stacked=4.6 * len(names))
    rows = [1.5, 1.2, 0.6]
    if narrow():
        panels = figure.subplots(3 * len(names), 1, height_ratios=rows * len(names))
    else:
        panels = figure.subplots(3, len(names), sharex=True, height_ratios=rows, squeeze=False).T.ravel()
    for k, name in enumerate(names):
        upper, middle, lower = panels[3 * k : 3 * k + 3]
        size(result, upper, name)
        phase(result, middle, name)
        coherence(result, lower, name)
        upper.set(xlabel="", title=name)
        middle.set_xlabel("")
    if result.model is not None:
        panels[0].legend(frameon=False, fontsize="small", loc="lower left")
    for panel in panels:
        plain(panel)
    heading(figure, headline(result))
    return figure


def panels(result: BodeOfRecords) -> Panels:
    """Return the panels: magnitude, phase and coherence of each quantity."""
    shown = {"magnitude": size, "phase": phase, "coherence": coherence}
    return {
        f"{name}_{word}": partial(_panel, result, draw, name)
        for name in result.responses
        for word, draw in shown.items()
    }


def _panel(result: BodeOfRecords, draw: Any, name: str, panel: Axes, **style: Any) -> Axes:
    found: Axes = draw(result, panel, name, **style)
    return found


def size(result: BodeOfRecords, panel: Axes, name: str, **style: Any) -> Axes:
    """Draw the magnitude per volt with its 95 % band, and the model's."""
    unit, per = QUANTITIES[name][0].split("/")
    values, reach = result.magnitude(name), result.band(name)[0]
    factor, label = scaled(panel.yaxis, values, unit)
    below = np.minimum(reach, 0.999 * values)  # a logarithmic axis has no zero
    panel.errorbar(
        result.frequency,
        factor * values,
        factor * np.array([below, reach]),
        **_POINTS | {"label": "measured, 95 % band"} | style,
    )
    panel.set(xlabel="frequency [Hz]", ylabel=f"magnitude [{label}/{per}]")
    lowest = float(np.nanmin(values))
    if result.curve is not None:
        shown = result.curve.magnitude(name)
        panel.plot(result.curve.frequency, factor * shown, label=f"model, {result.curve.actuator.name}", **_LINE)
        lowest = min(lowest, float(shown.min()))
    panel.set_ylim(bottom=factor * lowest / 2)
    logarithmic(panel, "x")
    logarithmic(panel, "y")
    return panel


def phase(result: BodeOfRecords, panel: Axes, name: str, **style: Any) -> Axes:
    """Draw the phase with its 95 % band, and the model's."""
    values, reach = result.phase(name), result.band(name)[1]
    if result.curve is not None and result.model is not None:  # by whole turns nearest to the model
        shown = result.curve.phase(name)
        beside = np.interp(np.log(result.frequency), np.log(result.curve.frequency), shown)
        values = values + 360 * np.rint((beside - values) / 360)
        panel.plot(result.curve.frequency, shown, **_LINE)
    certain = reach < 180
    panel.errorbar(result.frequency[certain], values[certain], reach[certain], **_POINTS | style)
    panel.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    logarithmic(panel, "x")
    return panel


def coherence(result: BodeOfRecords, panel: Axes, name: str, **style: Any) -> Axes:
    """Draw the coherence."""
    look: dict[str, Any] = {"marker": "o", "markersize": 3, "color": GREY} | style
    panel.plot(result.frequency, result.coherence[name], **look)
    panel.set(xlabel="frequency [Hz]", ylabel="coherence", ylim=(-0.05, 1.05))
    logarithmic(panel, "x")
    return panel


def page(result: BodeOfRecords) -> Page:
    """Return a page: the picture."""
    shown = picture(figure(result), "measured magnitude, phase and coherence over frequency")
    title = "Measured frequency response"
    return Page(title, headline(result), facts(result), result.warnings, [Section("Response", [shown])])


def _outside(result: BodeOfRecords, name: str) -> int:
    return int(result.outside(name).sum())
