"""Presents the rhythm of neurons over the gain of their reflex."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..arrays import Array
from ..oscillators.loop_run import ReflexSweep
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, new_figure, wide


def summary(found: ReflexSweep) -> str:
    """Return outcome, period, angle and phase of every gain as a table."""
    head = f"{'gain [1/rad]':<14}{'outcome':<11}{'period [s]':>12}{'output':>10}{'angle [rad]':>13}{'lag [deg]':>11}"
    lines = [head]
    for row in found.to_dict()["rows"]:
        cells = ("" if row[k] is None else f"{row[k]:.6g}" for k in ("period_s", "amplitude", "angle_rad"))
        period, output, angle = cells
        lag = "" if row["angle_lag_deg"] is None else f"{row['angle_lag_deg']:.1f}"
        lines.append(f"{row['reflex_per_rad']:<14.6g}{row['outcome']:<11}{period:>12}{output:>10}{angle:>13}{lag:>11}")
    return "\n".join(lines)


def headline(found: ReflexSweep) -> str:
    """Return one line: how many gains, and their range."""
    return f"{len(found.gain)} rhythms, reflex from {found.gain.min():g} to {found.gain.max():g} /rad"


def facts(found: ReflexSweep) -> list[tuple[str, str]]:
    """Return the number of gains with each outcome, and the ranges of period and angle."""
    rows = [(outcome, f"{found.outcomes.count(outcome)}") for outcome in dict.fromkeys(found.outcomes)]
    for name, values, unit in (("period", found.period, "s"), ("angle", found.angle, "rad")):
        if np.isfinite(found.period).any():
            moving = values[np.isfinite(found.period)]
            rows.append((name, f"{moving.min():.4g} to {moving.max():.4g} {unit}"))
    return rows


def figure(found: ReflexSweep) -> Figure:
    """Return period and amplitude of the angle over the gain; shaded grey where the loop comes to rest."""
    figure, (upper, lower) = new_figure(2, [1.9, 1.9])
    _period(found, upper)
    upper.set_xlabel("")
    _angle(found, lower)
    figure.align_ylabels([upper, lower])
    return figure


def panels(found: ReflexSweep) -> Panels:
    """Return the panels: period and angle."""
    return {"period": partial(_period, found), "angle": partial(_angle, found)}


def _period(found: ReflexSweep, panel: Axes, **style: Any) -> Axes:
    return _drawn(found, panel, found.period, "period [s]", {"color": BLUE} | style)


def _angle(found: ReflexSweep, panel: Axes, **style: Any) -> Axes:
    moving = np.where(np.isfinite(found.period), found.angle, np.nan)
    return _drawn(found, panel, moving, "angle, half\npeak-to-peak [rad]", {"color": ORANGE} | style)


def _drawn(found: ReflexSweep, panel: Axes, values: Array, label: str, style: dict[str, Any]) -> Axes:
    marker = "o" if len(found.gain) <= 60 else None
    panel.plot(found.gain, values, **{"marker": marker, "markersize": 3, "linewidth": 1.4} | style)
    panel.set(xlabel="gain of the reflex h [1/rad]", ylabel=label)
    known = values[np.isfinite(values)]
    if len(known) and wide(known, 8.0):
        panel.set_yscale("log")
    elif len(known):
        panel.set_ylim(0, None)
    middles = (found.gain[1:] + found.gain[:-1]) / 2
    edges = np.concatenate([found.gain[:1], middles, found.gain[-1:]])
    for left, right, outcome in zip(edges, edges[1:], found.outcomes, strict=False):
        if outcome != "cycle":
            panel.axvspan(left, right, color=GREY, alpha=0.15, linewidth=0)
    return panel
