"""Presents an impedance spectrum."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray
from ..simulation.impedance import Impedance
from ..units import format_quantity
from .axes import BLUE, ORANGE, Axes, Figure, Panels, blank, heading, plain, scaled
from .look import narrow
from .page import Page, Prose, Section, picture

_OHM = "\N{OHM SIGN}"


def summary(result: Impedance) -> str:
    """Return a few lines: both ends of the spectrum, the reflection by the motion, the ladder if there is one."""
    ends = [
        f"{format_quantity(float(f), 'Hz', 4):>10}  abs(Z) {format_quantity(float(np.abs(z)), 'ohm', 5):>12}, "
        f"phase {_degrees(z):7.2f} deg"
        for f, z in zip(result.frequency[[0, -1]], result.impedance[[0, -1]], strict=True)
    ]
    cells = [f"cells: by their size within {result.cells_error:.1e}"] if result.actuator.electrodes else []
    return "\n".join([*ends, *_notes(result), *cells])


def headline(result: Impedance) -> str:
    """Return one line: the strip, the number of frequencies, the bias."""
    segment = f", segment {result.segment}" if result.segment is not None else ""
    return f"{result.actuator.name}: {len(result.frequency)} frequencies about {result.bias:g} V{segment}"


def text(result: Impedance) -> str:
    """Return all that a user sees."""
    return f"{headline(result)}\n{result.summary()}"


def figure(result: Impedance) -> Figure:
    """Return a Bode (size and phase over frequency) and a Nyquist plot; the electrical port's closed form dashed."""
    figure = blank((10.0, 4.8), stacked=8.0)
    if narrow():
        size, phase, plane = figure.subplots(3, 1, height_ratios=[1.0, 0.8, 1.6])
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.15, 1.0])
        size, phase, plane = (figure.add_subplot(grid[place]) for place in ((0, 0), (1, 0), (slice(None), 1)))
    bode(result, (size, phase))
    size.set_xlabel("")
    size.legend(frameon=False, fontsize="small")
    nyquist(result, plane)
    for panel in (size, phase, plane):
        plain(panel)
    heading(figure, f"{result.actuator.name}: impedance about {result.bias:g} V")
    return figure


def panels(result: Impedance) -> Panels:
    """Return the panels: Nyquist plot, Bode plot, magnitude, phase."""
    return {draw.__name__: partial(draw, result) for draw in (nyquist, bode, size, phase)}


def facts(result: Impedance) -> list[tuple[str, str]]:
    """Return both ends of the spectrum, the reflection by the motion, the smallest real part."""
    ends = list(zip(result.frequency.tolist(), result.impedance.tolist(), strict=True))
    return [
        *((format_quantity(f, "Hz", 4), f"abs(Z) {format_quantity(abs(z), 'ohm', 5)}, phase {_degrees(z):.2f} deg")
          for f, z in dict([ends[0], ends[-1]]).items()),
        ("smallest real part", format_quantity(result.least_resistance, "ohm", 4)),
        ("reflected by the motion", f"at most {result.reflected:.1e}"),
        ("engine", result.engine),
    ]  # fmt: skip


def bode(result: Impedance, ax: Any, **style: Any) -> tuple[Axes, Axes]:
    """Draw magnitude and phase on two axes; on a single one the phase is dotted, on a second scale at the right."""
    shared = np.size(ax) == 1
    upper, lower = (ax, ax.twinx()) if shared else np.ravel(ax)
    size(result, upper, **style)
    if shared:
        (z, look), _ = _curves(result, style)
        lower.semilogx(result.frequency, _degrees(z), **look | {"linestyle": ":"})
        lower.set_ylabel("phase (dotted) [deg]")
    else:
        phase(result, lower, **style)
    return upper, lower


def size(result: Impedance, panel: Axes, **style: Any) -> Axes:
    """Draw abs(Z) over frequency."""
    for z, look in _curves(result, style):
        panel.loglog(result.frequency, np.abs(z), **look)
    panel.set(xlabel="frequency [Hz]", ylabel=f"abs(Z) [{_OHM}]")
    return panel


def phase(result: Impedance, panel: Axes, **style: Any) -> Axes:
    """Draw the phase over frequency."""
    for z, look in _curves(result, style):
        panel.semilogx(result.frequency, _degrees(z), **look)
    panel.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    return panel


def nyquist(result: Impedance, panel: Axes, **style: Any) -> Axes:
    """Draw -Im Z over Re Z, with a mark at whole decades of the frequency."""
    factor, label = scaled(panel.xaxis, np.abs(result.impedance), _OHM)
    for z, look in _curves(result, style):
        panel.plot(factor * z.real, -factor * z.imag, **look)
    panel.set(xlabel=f"Re Z [{label}]", ylabel=f"-Im Z [{label}]")
    panel.set_aspect("equal", adjustable="datalim")
    labelled: list[complex] = []
    room = 0.06 * factor * float(np.ptp(result.impedance.real) + np.ptp(result.impedance.imag))
    for decade in _whole_decades(result.frequency):
        k = int(np.argmin(np.abs(np.log(result.frequency / decade))))
        z = result.impedance[k] * factor
        if any(abs(z - other) < room for other in labelled):
            continue  # a label there would lie on another
        labelled.append(z)
        panel.plot(z.real, -z.imag, "o", color=style.get("color", BLUE), markersize=4)
        name = format_quantity(float(decade), "Hz", 3)
        panel.annotate(name, (z.real, -z.imag), (4, 4), textcoords="offset points", fontsize="small")
    return panel


def _curves(result: Impedance, style: Mapping[str, Any]) -> list[tuple[ComplexArray, dict[str, Any]]]:
    """Return the curves with their styles: the impedance, and (dashed) the closed form of the electrical port."""
    form = {"color": ORANGE, "linestyle": "--", "linewidth": 1.2, "label": "closed form, no motion"}
    given = {"color": BLUE, "linewidth": 1.8, "label": f"netlist, {result.engine}"}
    return [(result.impedance, given | dict(style)), (result.port, form)]


def _degrees(z: Any) -> Any:
    return np.degrees(np.angle(z))


def page(result: Impedance) -> Page:
    """Return a page: the picture and notes on the spectrum."""
    shown = picture(figure(result), "size and phase over frequency, Nyquist plot")
    sections = [Section("Spectrum", [shown, *map(Prose, _notes(result))])]
    return Page(f"Impedance of {result.actuator.name}", headline(result), facts(result), result.warnings, sections)


def _notes(result: Impedance) -> list[str]:
    notes = [f"the motion reflects at most {result.reflected:.1e} of the impedance"]
    if result.ladder is not None:
        low, high = (format_quantity(f, "Hz", 4) for f in result.ladder.band)
        name = result.ladder.ions.title
        notes.append(
            f"{name} as a ladder of {len(result.ladder.sections)} sections, within {result.ladder.error:.1e} of it "
            f"from {low} to {high}"
        )
    return notes


def _whole_decades(frequency: Array) -> Array:
    """Return at most five powers of ten within the frequencies."""
    low, high = np.ceil(np.log10(frequency[0]) - 1e-9), np.floor(np.log10(frequency[-1]) + 1e-9)
    decades = np.arange(low, high + 1)
    return np.asarray(10.0 ** decades[:: max(-(-len(decades) // 5), 1)])
