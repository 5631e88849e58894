"""Presents a strip as a sensor."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..simulation.sensing import Sensed
from ..simulation.waveforms import WAVEFORMS
from .axes import ORANGE, Axes, Figure, Panels, curve, heading, new_figure
from .page import Grid, Page, Section, picture
from .response import largest, over_time, solved_by


def summary(sensed: Sensed) -> str:
    """Return a table: the largest value of each waveform, and its time."""
    return "\n".join(_table(sensed).lines("<>>"))


def headline(sensed: Sensed) -> str:
    """Return one line: what was simulated."""
    return (
        f"{sensed.actuator.name}, {sensed.terminals} terminals: {sensed.motion.text}, {sensed.time[-1]:g} s, "
        f"{len(sensed.time)} samples"
    )


def text(sensed: Sensed) -> str:
    """Return all that a user sees: what was simulated, the waveforms, the error."""
    return "\n".join([headline(sensed), sensed.summary(), *solved_by(sensed)])


def figure(sensed: Sensed) -> Figure:
    """Return a figure: voltage or current of the terminals, elastic force, imposed motion."""
    shown = _shown(sensed)
    figure, axes = new_figure(len(shown), [1.5, 1.5, 1.0])
    for panel, name in zip(axes, shown, strict=True):
        _waveform(sensed, name, panel)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    heading(figure, f"{sensed.actuator.name}, {sensed.terminals} terminals: {sensed.motion.text}")
    return figure


def panels(sensed: Sensed) -> Panels:
    """Return the panels: one per waveform, the voltage or current of the terminals first."""
    return {name: partial(over_time, partial(_waveform, sensed, name)) for name in _shown(sensed)}


def facts(sensed: Sensed) -> list[tuple[str, str]]:
    """Return the largest value of each waveform, and its time."""
    return [(name, f"largest {value} at {time}") for name, value, time in _table(sensed).rows]


def _shown(sensed: Sensed) -> tuple[str, str, str]:
    return ("voltage" if sensed.terminals == "open" else "current", "force", "displacement")


def _waveform(sensed: Sensed, name: str, panel: Axes, **style: Any) -> None:
    values, colour = sensed.waveforms[name], {"color": ORANGE} if name == "displacement" else {}
    factor = curve(panel, sensed.time, values, name, WAVEFORMS[name].unit, **colour | style)
    if np.ptp(values) < 1e-3 * np.abs(values).max():  # all but constant: shown against zero
        panel.set_ylim(*sorted((0.0, 1.08 * factor * float(values[np.argmax(np.abs(values))]))))


def page(sensed: Sensed) -> Page:
    """Return a page: the picture and the table of waveforms."""
    facts = [("engine", sensed.engine), ("estimated error", f"{sensed.error:.1e} of each maximum")]
    drawn = picture(figure(sensed), "the terminals' answer and the force over time, the motion beneath")
    sections = [Section("Waveforms", [drawn, _table(sensed)])]
    return Page(f"{sensed.actuator.name} as a sensor", headline(sensed), facts, sensed.warnings, sections)


def _table(sensed: Sensed) -> Grid:
    rows = [(name, *largest(sensed, WAVEFORMS[name])) for name in sensed.waveforms]
    return Grid(("quantity", "largest", "at"), rows)
