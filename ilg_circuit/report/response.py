"""Shows a response: its waveforms as a table, a picture, a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..simulation.waveforms import ANSWERS, WAVEFORMS
from ..units import format_quantity
from .axes import BLUE, GREY, ORANGE, Figure, engineering, new_figure
from .energy import section as energy_section
from .page import Grid, Page, Section, picture
from .tables import aligned

if TYPE_CHECKING:
    from ..identification.comparison import Compared
    from ..simulation.response import Response
    from ..simulation.waveforms import Simulated, Waveform

_NORMAL_95 = 1.96
_HEADER = ("quantity", "at the end", "largest", "at")


def summary(response: Response) -> str:
    """Return a table: each waveform's value at the end, its largest value, and when that is."""
    return "\n".join(aligned([_HEADER, *_rows(response)], "<>>>"))


def headline(response: Response) -> str:
    """Return in a line what was simulated."""
    return f"{response.netlist.title}: {response.drive.text}, {response.time[-1]:g} s, {len(response.time)} samples"


def text(response: Response, measured: Sequence[Compared] = ()) -> str:
    """Return all that a user sees: what was simulated, the waveforms, the energies, the error, the comparison."""
    lines = [headline(response), response.summary(), response.account.summary(), *solved_by(response)]
    return "\n".join([*lines, *(compared_line(part) for part in measured)])


def solved_by(result: Simulated) -> list[str]:
    """Return the line that says what solved it and how well, none for the exact engine."""
    exact = result.engine != "ngspice"
    return [] if exact else [f"solved by ngspice, estimated error {result.error:.1e} of each maximum"]


def largest(result: Simulated, waveform: Waveform) -> tuple[str, str]:
    """Return the largest value of a waveform, and when that is."""
    values = result.waveforms[waveform.name]
    peak = int(np.argmax(np.abs(values)))
    return format_quantity(float(values[peak]), waveform.unit, 5), format_quantity(float(result.time[peak]), "s", 4)


def figure(response: Response, measured: Sequence[Compared] = ()) -> Figure:
    """Return the waveforms that are not zero over time, the drive beneath.

    The 95 % band is drawn where the response has standard errors; what was ``measured`` is drawn as points beside the
    prediction that was compared with it.
    """
    shown = [w for w in ANSWERS if np.nanmax(np.abs(response.waveforms[w.name]), initial=0.0) > 0]
    figure, axes = new_figure(len(shown) + 1, [1.5] * len(shown) + [1.0])
    beside = {part.quantity: part for part in measured}
    for panel, waveform in zip(axes, shown, strict=False):
        values, error = response.waveforms[waveform.name], response.stderr.get(waveform.name)
        factor, unit = engineering(values, waveform.unit)
        time, title = response.time, None
        if waveform.name in beside:  # the prediction that was compared: its drive jumps where the record does
            part = beside[waveform.name]
            time, values, error, title = part.time, part.predicted, part.stderr, "predicted"
            panel.plot(time, factor * part.measured, ".", color=GREY, markersize=2.5, label=f"measured, {part.source}")
        panel.plot(time, factor * values, color=BLUE, linewidth=1.4, label=title)
        if error is not None:
            half = _NORMAL_95 * error
            edges = (factor * (values - half), factor * (values + half))
            panel.fill_between(time, *edges, color=BLUE, alpha=0.25, linewidth=0, label="95 % band of the fit")
        panel.set_ylabel(f"{waveform.name} [{unit}]")
    if response.stderr or measured:
        axes[0].legend(frameon=False, fontsize=8)
    axes[-1].plot(response.time, response.voltage, color=ORANGE, linewidth=1.4)
    low, high = min(response.voltage.min(), 0.0), max(response.voltage.max(), 0.0)
    edge = 0.08 * (high - low or 1.0)
    axes[-1].set(xlabel="time [s]", ylabel="voltage [V]", ylim=(low - edge, high + edge))
    figure.align_ylabels(axes)
    figure.suptitle(f"{response.netlist.title}: {response.drive.text}", fontsize=10)
    return figure


def page(response: Response, measured: Sequence[Compared] = ()) -> Page:
    """Return a page: the picture, the table of waveforms, where the energy goes."""
    facts = [("engine", response.engine), ("estimated error", f"{response.error:.1e} of each maximum")]
    shown = [picture(figure(response, measured), "waveforms over time, the drive beneath")]
    rows = [(*row, "") if len(row) < 4 else row for row in _rows(response)]
    sections = [Section("Waveforms", [*shown, Grid(_HEADER, rows)]), energy_section(response.account)]
    return Page(f"Response of {response.actuator.name}", headline(response), facts, response.warnings, sections)


def _rows(response: Response) -> list[tuple[str, ...]]:
    """Name, value at the end, largest value and its time of each waveform; name and why for one that is not known."""
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
    """Return a prediction beside a measurement in a line."""
    unit = WAVEFORMS[part.quantity].unit
    line = f"{part.source}: {part.quantity} differs by {format_quantity(part.rms, unit, 3)} rms"
    line += f" ({part.rms / part.largest:.2%} of its largest, {len(part.time)} samples)"
    if part.covered is not None:
        line += f", {part.covered:.0%} of them within the 95% band and the data's noise"
    if part.reversed_axis:
        line += "; its axis was taken to point away from the anode"
    return line + ("; no rest was measured: the mean difference was taken off" if part.offset else "")
