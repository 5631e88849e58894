"""Shows an impedance over frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..simulation.impedance import Impedance
from ..units import format_quantity
from .axes import BLUE, ORANGE, Figure, blank, engineering, plain
from .page import Page, Prose, Section, picture

_OHM = "\N{OHM SIGN}"


def summary(result: Impedance) -> str:
    """Return a few lines: both ends of the spectrum, what the motion reflects, the ladder if there is one."""
    ends = [
        f"{format_quantity(float(f), 'Hz', 4):>10}  abs(Z) {format_quantity(float(np.abs(z)), 'ohm', 5):>12}, "
        f"phase {np.degrees(np.angle(z)):7.2f} deg"
        for f, z in zip(result.frequency[[0, -1]], result.impedance[[0, -1]], strict=True)
    ]
    return "\n".join([*ends, *_notes(result)])


def headline(result: Impedance) -> str:
    """Return in a line what was computed."""
    return f"{result.actuator.name}: {len(result.frequency)} frequencies about {result.bias:g} V"


def text(result: Impedance) -> str:
    """Return all that a user sees."""
    return f"{headline(result)}\n{result.summary()}"


def figure(result: Impedance) -> Figure:
    """Return a Bode (size and phase over frequency) and a Nyquist plot; the electrical port's closed form dashed."""
    figure = blank((10.0, 4.8))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.15, 1.0])
    size, phase, plane = (figure.add_subplot(grid[place]) for place in ((0, 0), (1, 0), (slice(None), 1)))
    factor, label = engineering(np.abs(result.impedance), _OHM)
    curves: tuple[tuple[Any, dict[str, Any], str], ...] = (
        (result.impedance, {"color": BLUE, "linewidth": 1.8}, f"netlist, {result.engine}"),
        (result.port, {"color": ORANGE, "linestyle": "--", "linewidth": 1.2}, "closed form, no motion"),
    )
    for z, style, name in curves:
        size.loglog(result.frequency, np.abs(z), **style, label=name)
        phase.semilogx(result.frequency, np.degrees(np.angle(z)), **style)
        plane.plot(factor * z.real, -factor * z.imag, **style)
    size.set_ylabel(f"abs(Z) [{_OHM}]")
    size.legend(frameon=False, fontsize=8)
    phase.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    plane.set(xlabel=f"Re Z [{label}]", ylabel=f"-Im Z [{label}]")
    plane.set_aspect("equal", adjustable="datalim")
    labelled: list[complex] = []
    room = 0.06 * factor * float(np.ptp(result.impedance.real) + np.ptp(result.impedance.imag))
    for decade in _whole_decades(result.frequency):
        k = int(np.argmin(np.abs(np.log(result.frequency / decade))))
        z = result.impedance[k] * factor
        if any(abs(z - other) < room for other in labelled):
            continue  # a label there would lie on another
        labelled.append(z)
        plane.plot(z.real, -z.imag, "o", color=BLUE, markersize=4)
        name = format_quantity(float(decade), "Hz", 3)
        plane.annotate(name, (z.real, -z.imag), (4, 4), textcoords="offset points", fontsize=8)
    for panel in (size, phase, plane):
        plain(panel)
    figure.suptitle(f"{result.actuator.name}: impedance about {result.bias:g} V", fontsize=10)
    return figure


def page(result: Impedance) -> Page:
    """Return a page: the picture and what is known of the spectrum."""
    facts = [("engine", result.engine), ("smallest real part", format_quantity(result.least_resistance, "ohm", 4))]
    shown = picture(figure(result), "size and phase over frequency, Nyquist plot")
    sections = [Section("Spectrum", [shown, *map(Prose, _notes(result))])]
    return Page(f"Impedance of {result.actuator.name}", headline(result), facts, result.warnings, sections)


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
    """At most five powers of ten within the frequencies."""
    low, high = np.ceil(np.log10(frequency[0]) - 1e-9), np.floor(np.log10(frequency[-1]) + 1e-9)
    decades = np.arange(low, high + 1)
    return np.asarray(10.0 ** decades[:: max(-(-len(decades) // 5), 1)])
