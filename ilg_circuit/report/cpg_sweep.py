"""Presents rhythms over a parameter."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..oscillators.sweep import PARAMETERS, RhythmSweep
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, legend_above, new_figure

_LABELS = {
    "inhibition": "mutual inhibition a",
    "adaptation": "adaptation d",
    "tonic": "tonic input e",
    "rise-time": "rise time $T_r$ [s]",
    "adaptation-time": "adaptation time $T_a$ [s]",
}


def summary(found: RhythmSweep) -> str:
    """Return outcome, period and amplitude of every value as a table."""
    lines = [f"{found.parameter:<18}{'outcome':<12}{'period [s]':>12}{'amplitude':>12}"]
    for row in found.to_dict()["rows"]:
        period, amplitude = ("" if row[k] is None else f"{row[k]:.6g}" for k in ("period_s", "amplitude"))
        lines.append(f"{row[found.parameter]:<18.6g}{row['outcome']:<12}{period:>12}{amplitude:>12}")
    return "\n".join(lines)


def headline(found: RhythmSweep) -> str:
    """Return one line: the parameter that was varied, and its range."""
    low, high = found.values.min(), found.values.max()
    unit = PARAMETERS[found.parameter]
    return f"{len(found.values)} rhythms, {found.parameter} from {low:g} to {high:g} {unit}".rstrip()


def facts(found: RhythmSweep) -> list[tuple[str, str]]:
    """Return the number of values with each outcome, and the ranges of period and amplitude."""
    rows = [(outcome, f"{found.outcomes.count(outcome)}") for outcome in dict.fromkeys(found.outcomes)]
    for name, values, unit in (("period", found.period, " s"), ("amplitude", found.amplitude, "")):
        if np.isfinite(values).any():
            rows.append((name, f"{np.nanmin(values):.4g} to {np.nanmax(values):.4g}{unit}"))
    return rows


def figure(found: RhythmSweep) -> Figure:
    """Return a figure of period and amplitude; shaded grey where the network comes to rest, orange where undecided."""
    figure, (upper, lower) = new_figure(2, [1.9, 1.9])
    _period(found, upper)
    upper.set_xlabel("")
    _amplitude(found, lower)
    if legend := lower.get_legend():  # the upper panel has it
        legend.remove()
    figure.align_ylabels([upper, lower])
    return figure


def panels(found: RhythmSweep) -> Panels:
    """Return the panels: period and amplitude."""
    return {"period": partial(_period, found), "amplitude": partial(_amplitude, found)}


def _period(found: RhythmSweep, panel: Axes, **style: Any) -> Axes:
    panel.plot(found.values, found.period, **_look(found, BLUE, style))
    panel.set_ylabel("period [s]")
    return _outcomes(found, panel)


def _amplitude(found: RhythmSweep, panel: Axes, **style: Any) -> Axes:
    """Draw the amplitude; the curve is interrupted where the outcome changes."""
    look, moving = _look(found, ORANGE, style), found.oscillates
    panel.plot(found.values, np.where(moving, found.amplitude, np.nan), **look)
    panel.plot(found.values, np.where(moving, np.nan, found.amplitude), **look)
    panel.set_ylabel("amplitude")
    return _outcomes(found, panel)


def _look(found: RhythmSweep, colour: str, style: dict[str, Any]) -> dict[str, Any]:
    marker = "o" if len(found.values) <= 60 else None
    return {"color": colour, "marker": marker, "markersize": 3, "linewidth": 1.4} | style


def _outcomes(found: RhythmSweep, panel: Axes) -> Axes:
    """Shade where a network comes to rest, or is undecided, and name the axis of the parameter."""
    values = found.values
    middles = (values[1:] + values[:-1]) / 2
    edges = np.concatenate([values[:1], middles, values[-1:]])
    labels = {"rest": "comes to rest", "undecided": "not decided: just on an edge"}
    colours = {"rest": GREY, "undecided": ORANGE}
    for left, right, outcome in zip(edges, edges[1:], found.outcomes, strict=False):
        if outcome in colours:
            look: dict[str, Any] = {"color": colours[outcome], "alpha": 0.15, "linewidth": 0}
            panel.axvspan(left, right, label=labels.pop(outcome, None), **look)
    if len(labels) < 2:
        legend_above(panel)
    panel.set(xlabel=_LABELS[found.parameter], ylim=(0, None))
    return panel
