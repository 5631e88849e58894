"""Presents learning over trials: what converges, the learning curves, the worst sample's first and last trial."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..units import format_quantity
from .axes import (
    BLUE,
    GREY,
    ORANGE,
    Axes,
    Figure,
    Panels,
    blank,
    curve,
    heading,
    legend_above,
    logarithmic,
    plain,
    scaled,
)
from .followed import at_limit
from .page import Listing, Page, Section, picture
from .response import over_time

if TYPE_CHECKING:
    from ..control.learn import Learned


#: A contraction that is no more than the rounding of its matrices.
_ROUNDING = 1e-9


def headline(learned: Learned) -> str:
    """Return one line: the path, the strip, what is learnt."""
    most = format_quantity(learned.bandwidth, "Hz", 4)
    return f"{learned.actuator.name}: {learned.path_text} learnt up to {most}, {learned.time[-1]:g} s a trial"


def facts(learned: Learned) -> list[tuple[str, str]]:
    """Return what converges and how fast, the errors of the first and the last trial, the limit, the voltage."""
    good, samples, factors = learned.promised, len(learned.contraction), learned.contraction
    last, size = learned.errors.shape[1] - 1, max(float(np.abs(learned.path).max()), 1e-300)
    of = f"in {good.sum()} of {samples} strips" if samples > 1 else "on the nominal strip" if good[0] else "no"
    falls = f"nominal {factors[0] if factors[0] > _ROUNDING else 0:.3g}"
    if samples > 1:
        falls += f", largest of the samples {factors[1:].max():.3g}"
    found = [
        ("promised", f"the error falls towards its end at every trial {of}" if good.any() else "nothing"),
        ("contraction", f"{falls} a trial"),
        *((name, _errors(learned.errors[:, k], size)) for name, k in (("trial 0", 0), (f"trial {last}", last))),
    ]
    if np.isfinite(learned.limits).any():
        end = float(np.nanmax(learned.limits))
        found.append(("ends at", f"{format_quantity(end, 'm', 3)} rms, largest, which the bandwidth leaves"))
    if learned.trial_error is not None:
        found.append(("measured", f"error {format_quantity(learned.trial_error, 'm', 3)} rms"))
    volts = format_quantity(float(np.abs(learned.drive.values).max()), "V", 4)
    limit = format_quantity(learned.voltage_limit, "V", 4)
    return [*found, ("next trial", f"up to {volts} of {limit}")]


def _errors(errors: Any, size: float) -> str:
    most = float(errors.max())
    middle = f"median {format_quantity(float(np.median(errors)), 'm', 3)}, " if len(errors) > 1 else ""
    return f"error {middle}largest {format_quantity(most, 'm', 3)} rms ({100 * most / size:.2g} % of the path)"


def summary(learned: Learned) -> str:
    """Return the headline and the facts as lines."""
    return "\n".join([headline(learned), *(f"{name:<12} {value}" for name, value in facts(learned))])


def figure(learned: Learned) -> Figure:
    """Return the learning curves, and the worst sample's error and voltage in the first and last trial."""
    figure = blank((7.5, 6.0), stacked=8.0)
    axes = figure.subplots(3, height_ratios=[1.8, 1.5, 1.1])
    for panel, draw in zip(axes, panels(learned).values(), strict=True):
        plain(panel)
        draw(panel)
    axes[1].sharex(axes[2])
    axes[1].tick_params(labelbottom=False)
    axes[1].set_xlabel("")
    figure.align_ylabels(axes)
    heading(figure, headline(learned))
    return figure


def panels(learned: Learned) -> Panels:
    """Return the panels: learning curves, error, voltage."""
    return {
        "learning": partial(_learning, learned),
        "error": partial(over_time, partial(_error, learned)),
        "voltage": partial(over_time, partial(_voltage, learned)),
    }


def _learning(learned: Learned, panel: Axes, **style: Any) -> Axes:
    """Draw the error of each trial on a logarithmic scale: all strips, the nominal one, what is promised."""
    trials = np.arange(learned.errors.shape[1], dtype=float)
    look = {"label": "nominal strip", "marker": "o", "markersize": 3.5} | style
    factor, _ = scaled(panel.yaxis, learned.errors, "m")
    if len(learned.errors) > 1:
        low, high = (factor * part(learned.errors[1:], axis=0) for part in (np.min, np.max))
        panel.fill_between(trials, low, high, color=ORANGE, alpha=0.25, linewidth=0, label="samples of the fit")
        panel.plot(trials, factor * np.median(learned.errors[1:], axis=0), color=ORANGE, label="their median")
    curve(panel, trials, learned.errors[0], "error, rms", "m", **look)
    if np.isfinite(learned.bounds).all():
        panel.plot(trials, factor * learned.bounds, color=GREY, linestyle="--", label="promised, at most")
    logarithmic(panel, "y")
    panel.set_xlabel("trial")
    panel.locator_params(axis="x", integer=True)
    legend_above(panel)
    return panel


def _error(learned: Learned, panel: Axes, **style: Any) -> None:
    """Draw the worst sample's error in the first and the last trial."""
    first, last = learned.path - learned.displacements
    factor, _ = scaled(panel.yaxis, first, "m")
    panel.plot(learned.time, factor * first, color=ORANGE, linewidth=1.0, label="trial 0, largest")
    curve(panel, learned.time, last, "error", "m", **{"label": _last(learned)} | style)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    legend_above(panel)


def _voltage(learned: Learned, panel: Axes, **style: Any) -> None:
    first, last = learned.voltages
    times = learned.drive.times
    factor = curve(panel, times, last, "voltage", "V", **{"color": BLUE, "label": _last(learned)} | style)
    panel.plot(times, factor * first, color=ORANGE, linewidth=1.0, label="trial 0")
    at_limit(panel, factor * learned.voltage_limit)


def _last(learned: Learned) -> str:
    return f"trial {learned.errors.shape[1] - 1}"


def page(learned: Learned) -> Page:
    """Return a page: the picture and the summary."""
    drawn = picture(figure(learned), "error over trials; error and voltage of the first and the last trial")
    sections = [Section("Learning", [drawn, Listing(summary(learned))])]
    return Page(f"Learning {learned.path_text}", headline(learned), facts(learned), learned.warnings, sections)
