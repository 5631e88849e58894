"""Presents a frequency response."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..simulation.bode import QUANTITIES, Bode
from ..units import format_quantity
from .axes import BLUE, GREY, Axes, Figure, Panels, blank, heading, logarithmic, plain, scaled
from .look import narrow
from .page import Page, Section, picture

#: Ratio of the largest to the smallest magnitude below which an axis has more labels than the powers of ten.
_FEW_DECADES = 300.0


def headline(result: Bode) -> str:
    """Return one line: the strip, the number of frequencies, the bias."""
    return f"{result.actuator.name}: {len(result.frequency)} frequencies about {result.bias:g} V"


def summary(result: Bode) -> str:
    """Return a few lines: each quantity at both ends, the bandwidth."""
    lines = []
    for name, (unit, _) in QUANTITIES.items():
        for k in (0, -1):
            size, phase = result.magnitude(name)[k], result.phase(name)[k]
            at = format_quantity(float(result.frequency[k]), "Hz", 4)
            text = _per_volt(float(size), unit)
            error = f" +- {100 * result.stderr[name].real[k]:.2g} %" if name in result.stderr else ""
            lines.append(f"{name:<13}{at:>9}  {text:>14}{error}, phase {phase:8.2f} deg")
    return "\n".join([*lines, *(f"{name}: {value}" for name, value in _notes(result))])


def facts(result: Bode) -> list[tuple[str, str]]:
    """Return the bandwidth, the largest displacement per volt, the engine."""
    return [*_notes(result), ("engine", result.engine)]


def figure(result: Bode) -> Figure:
    """Return magnitude (above) and phase (below) of displacement, current and force over frequency."""
    names = list(QUANTITIES)
    figure = blank((11.0, 5.2), stacked=11.0)
    panels = figure.subplots(6, 1) if narrow() else figure.subplots(2, 3, sharex=True).T.ravel()
    for k, name in enumerate(names):
        size(result, panels[2 * k], name)
        phase(result, panels[2 * k + 1], name)
        panels[2 * k].set(xlabel="", title="force on a clamp" if name == "force" else name)
    for panel in panels:
        plain(panel)
    heading(figure, f"{result.actuator.name}: frequency response about {result.bias:g} V")
    return figure


def panels(result: Bode) -> Panels:
    """Return the panels: magnitude and phase of each quantity."""
    shown = {"magnitude": size, "phase": phase}
    return {
        f"{name}_{word}": partial(_panel, result, draw, name) for name in QUANTITIES for word, draw in shown.items()
    }


def _panel(result: Bode, draw: Any, name: str, panel: Axes, **style: Any) -> Axes:
    found: Axes = draw(result, panel, name, **style)
    return found


def size(result: Bode, panel: Axes, name: str, **style: Any) -> Axes:
    """Draw the magnitude of a quantity per volt over frequency, with its band of two standard errors."""
    unit, per = QUANTITIES[name][0].split("/")
    values = result.magnitude(name)
    factor, label = scaled(panel.yaxis, values, unit)
    if name in result.stderr:
        error = np.exp(2 * result.stderr[name].real)
        panel.fill_between(result.frequency, factor * values / error, factor * values * error, color=BLUE, alpha=0.25)
    panel.loglog(result.frequency, factor * values, **({"color": BLUE, "linewidth": 1.8} | style))
    if values.max() < _FEW_DECADES * values.min():
        logarithmic(panel, "y")
    if name == "displacement" and result.bandwidth is not None:
        panel.axvline(result.bandwidth, color=GREY, linestyle=":", linewidth=1.2, label="bandwidth")
        panel.legend(frameon=False, fontsize="small", loc="lower left")
    panel.set(xlabel="frequency [Hz]", ylabel=f"magnitude [{label}/{per}]")
    return panel


def phase(result: Bode, panel: Axes, name: str, **style: Any) -> Axes:
    """Draw the phase of a quantity over frequency, with its band of two standard errors."""
    values = result.phase(name)
    if name in result.stderr:
        error = 2 * np.degrees(result.stderr[name].imag)
        panel.fill_between(result.frequency, values - error, values + error, color=BLUE, alpha=0.25)
    panel.semilogx(result.frequency, values, **({"color": BLUE, "linewidth": 1.8} | style))
    panel.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    return panel


def page(result: Bode) -> Page:
    """Return a page: the picture."""
    shown = picture(figure(result), "magnitude and phase of displacement, current and force over frequency")
    title = f"Frequency response of {result.actuator.name}"
    return Page(title, headline(result), facts(result), result.warnings, [Section("Response", [shown])])


def _notes(result: Bode) -> list[tuple[str, str]]:
    width, (at, most) = result.bandwidth, result.peak
    lowest = format_quantity(float(result.frequency[0]), "Hz", 4)
    known = "beyond these frequencies" if width is None else f"{format_quantity(width, 'Hz', 4)}"
    return [
        ("bandwidth of the displacement", f"{known} (0.707 of that at {lowest})"),
        ("largest displacement", f"{_per_volt(most, 'm/V')} at {format_quantity(at, 'Hz', 4)}"),
    ]


def _per_volt(value: float, unit: str) -> str:
    return f"{format_quantity(value, unit.removesuffix('/V'), 5)}/V"
