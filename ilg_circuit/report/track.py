"""Presents a voltage for a path: what can be followed, the error, the limits."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..control.track import path_rate
from ..errors import argument
from ..units import format_quantity
from . import followed
from .axes import Axes, Figure, Panels
from .page import Listing, Page, Section, picture

if TYPE_CHECKING:
    from ..control.track import Tracked

_NORMAL_95 = 1.96


def headline(tracked: Tracked) -> str:
    """Return one line: the path, the strip, the limit."""
    limit = format_quantity(tracked.limits.voltage, "V", 4)
    return f"{tracked.response.netlist.title}: {tracked.path_text} within {limit}, {tracked.time[-1]:g} s"


def facts(tracked: Tracked) -> list[tuple[str, str]]:
    """Return whether the path can be followed, the strip's reach beside the path's, errors and limits."""
    worst, size, unit = float(np.abs(tracked.error).max()), max(tracked.size, 1e-300), tracked.unit
    need = f"path {format_quantity(tracked.size, unit, 4)}, strip {format_quantity(tracked.reach, unit, 4)} at rest"
    rates = f"path {_rate(path_rate(tracked), unit)}, strip {_rate(tracked.rate, unit)} after a step of the limit"
    volts = format_quantity(float(np.abs(tracked.voltage).max()), "V", 4)
    amps = format_quantity(float(np.abs(tracked.current).max()), "A", 3)
    found = [
        ("followed", "yes, within 1 %" if tracked.followed else "no"),
        ("largest", need),
        ("rate", rates),
        ("error", f"largest {format_quantity(worst, unit, 3)} ({worst / size:.2%}), rms "
                  f"{format_quantity(tracked.rms, unit, 3)} ({tracked.rms / size:.2%})"),
        ("drive", f"up to {volts}, {amps}; {format_quantity(tracked.energy, 'J', 4)}"),
        ("at a limit", f"{tracked.at_limit:.0%} of the time"),
    ]  # fmt: skip
    sheets = tracked.actuator.electrodes
    if sheets is not None and sheets.segments(1) > 1:
        found.append(("segments", f"all alike, by one voltage; {argument('quantity', 'shape')} gives each its own"))
    if tracked.bound is not None:
        sooner = format_quantity(tracked.bound, "s", 4)
        found.append(("soonest", f"no voltage settles at the path's largest {tracked.quantity} sooner than {sooner}"))
    if tracked.stderr is not None:
        spread = format_quantity(float(tracked.stderr.max()), unit, 3)
        found.append(("uncertainty", f"standard error of the {tracked.quantity} up to {spread}"))
    return found


def _rate(value: float, unit: str) -> str:
    return f"{1e3 * value:.4g} mm/s" if unit == "m" else f"{format_quantity(value, unit, 4)}/s"


def summary(tracked: Tracked) -> str:
    """Return the headline and the facts as lines."""
    return "\n".join([headline(tracked), *(f"{name:<12} {value}" for name, value in facts(tracked))])


def figure(tracked: Tracked) -> Figure:
    """Return path and displacement, or force, the error, the voltage over time."""
    return followed.figure(panels(tracked), headline(tracked))


def panels(tracked: Tracked) -> Panels:
    """Return the panels: path and displacement, or force, error, voltage, current."""
    wave = (tracked.quantity, tracked.output, tracked.unit)
    return followed.panels(tracked, wave, tracked.path, "path", tracked.limits.voltage, partial(_band, tracked))


def _band(tracked: Tracked, panel: Axes, factor: float) -> None:
    """Draw the band of what follows the path."""
    if tracked.stderr is not None:
        reach = _NORMAL_95 * tracked.stderr
        low, high = (factor * (tracked.output + sign * reach) for sign in (-1, 1))
        panel.fill_between(tracked.time, low, high, alpha=0.3, linewidth=0, label="95 % band of the fit")


def page(tracked: Tracked) -> Page:
    """Return a page: the picture and the summary."""
    drawn = picture(figure(tracked), f"path and {tracked.quantity}, error and voltage over time")
    sections = [Section("Path", [drawn, Listing(summary(tracked))])]
    return Page(f"A voltage for {tracked.path_text}", headline(tracked), facts(tracked), tracked.warnings, sections)
