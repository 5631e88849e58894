"""Shows measured data: a record over time, a displacement alone, an impedance spectrum."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from ..measurements.film import Film
from ..measurements.record import Record
from ..measurements.spectrum import Spectrum
from ..result import Column
from ..units import format_quantity
from .axes import ORANGE, Axes, Figure, Panels, curve, heading, new_figure
from .tables import aligned

Data = Record | Spectrum | Film


def headline(data: Data) -> str:
    """Return one line: the source and what was measured."""
    if isinstance(data, Spectrum):
        ends = " to ".join(format_quantity(float(f), "Hz", 3) for f in data.frequency[[0, -1]])
        return f"{data.source}: impedance at {len(data.frequency)} frequencies, {ends}"
    if isinstance(data, Film):
        lasts = format_quantity(data.duration, "s", 4)
        return f"{data.source}: a displacement over {lasts} under {data.drive.text}, as stated"
    what = f"a step of {format_quantity(data.step, 'V', 3)}" if data.step is not None else "a waveform"
    return f"{data.source}: {what}, {format_quantity(data.duration, 's', 4)} from an onset at {data.onset:.6g} s"


def facts(data: Data) -> list[tuple[str, str]]:
    """Return range and number of readings of each quantity."""
    found = []
    for column in data.table()[1:]:
        values = np.asarray(column.values)
        known = values[np.isfinite(values)]
        low, high = (format_quantity(float(x), column.unit or "", 4) for x in (known.min(), known.max()))
        found.append((column.name, f"{low} to {high}, {len(known)} readings"))
    return found


def summary(data: Data) -> str:
    """Return the headline and the range of each quantity."""
    return "\n".join([headline(data), *aligned(facts(data), "<<", indent="  ")])


def panels(data: Data) -> Panels:
    """Return the panels: each quantity over time, or real and imaginary part of an impedance over frequency."""
    over, *columns = data.table()
    shown = sorted(columns, key=lambda column: column.name == "voltage")
    return {column.name: partial(_panel, over, column) for column in shown}


def figure(data: Data) -> Figure:
    """Return a figure of each quantity over time, the voltage last; for a spectrum both parts over frequency."""
    drawn = panels(data)
    figure, axes = new_figure(len(drawn), [1.0] * len(drawn))
    for draw, panel in zip(drawn.values(), axes, strict=True):
        draw(panel)
        if panel is not axes[-1]:
            panel.set_xlabel("")
    figure.align_ylabels(axes)
    heading(figure, headline(data))
    return figure


def _panel(over: Column, column: Column, panel: Axes, **style: Any) -> Axes:
    x, values = np.asarray(over.values), np.asarray(column.values)
    known = np.isfinite(values)
    look: Mapping[str, Any] = {"color": ORANGE} if column.name == "voltage" else {}
    curve(panel, x[known], values[known], column.name, column.unit or "", **{**look, **style})
    if over.name == "frequency":
        panel.set_xscale("log")
    panel.set_xlabel(f"{over.name} [{over.unit}]")
    return panel
