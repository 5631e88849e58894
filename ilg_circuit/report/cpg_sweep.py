"""Rhythms over a parameter: text, and their picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..oscillators.sweep import RhythmSweep
from .axes import BLUE, GREY, ORANGE, Figure, legend_above, new_figure

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


def figure(found: RhythmSweep) -> Figure:
    """Return period and amplitude over the parameter; grey where it comes to rest, orange where undecided."""
    figure, (upper, lower) = new_figure(2, [1.9, 1.9])
    values = found.values
    mark: dict[str, Any] = {"marker": "o" if len(values) <= 60 else None, "markersize": 3, "linewidth": 1.4}
    moving = found.oscillates
    upper.plot(values, found.period, color=BLUE, **mark)
    lower.plot(values, np.where(moving, found.amplitude, np.nan), color=ORANGE, **mark)
    lower.plot(values, np.where(moving, np.nan, found.amplitude), color=ORANGE, **mark)
    middles = (values[1:] + values[:-1]) / 2
    edges = np.concatenate([values[:1], middles, values[-1:]])
    labels = {"rest": "comes to rest", "undecided": "not decided: just on an edge"}
    colours = {"rest": GREY, "undecided": ORANGE}
    for left, right, outcome in zip(edges, edges[1:], found.outcomes, strict=False):
        if outcome in colours:
            look: dict[str, Any] = {"color": colours[outcome], "alpha": 0.15, "linewidth": 0}
            upper.axvspan(left, right, label=labels.pop(outcome, None), **look)
            lower.axvspan(left, right, **look)
    if len(labels) < 2:
        legend_above(upper)
    upper.set(ylabel="period [s]", ylim=(0, None))
    lower.set(xlabel=_LABELS[found.parameter], ylabel="amplitude", ylim=(0, None))
    figure.align_ylabels([upper, lower])
    return figure
