"""Pictures of a run and of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..report.axes import BLUE, GREY, ORANGE, new_figure, save
from .flow import Flow, sampled
from .sweep import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .report import Run

#: More neurons than these are drawn as a map over time.
_MOST_LINES = 6
#: Periods drawn, where there are more.
_MOST_PERIODS = 40
_COLOURS = (BLUE, ORANGE, "#3a8f4d", "#8b4fa8", "#b0892c", "#3f8f96")
_LABELS = {
    "inhibition": "mutual inhibition a",
    "adaptation": "adaptation d",
    "tonic": "tonic input e",
    "rise-time": "rise time $T_r$ [s]",
    "adaptation-time": "adaptation time $T_a$ [s]",
}


def plot_run(result: Run, path: str | Path) -> None:
    """Outputs over time, the drive output beneath, and its phase portrait with the limit cycle."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 4.8), dpi=150, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1.0], height_ratios=[1.25, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    portrait = figure.add_subplot(grid[:, 1])
    for panel in (upper, lower, portrait):
        panel.grid(alpha=0.25, linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
    _outputs(result, upper)
    units = len(result.network.units)
    lower.plot(result.time, result.unit_outputs[:, 0], color=BLUE, linewidth=1.2, label="unit 1 (tail)")
    if units > 1:
        lower.plot(result.time, result.unit_outputs[:, -1], color=ORANGE, linewidth=1.2, label=f"unit {units} (head)")
        _legend(lower)
    lower.set_ylabel("output $y_1 - y_2$" if units == 1 else "unit outputs")
    lower.set_xlabel("time [s]")
    upper.tick_params(labelbottom=False)
    end = float(result.time[-1])
    if result.rhythm.period and end > _MOST_PERIODS * result.rhythm.period:
        upper.set_xlim(end - _MOST_PERIODS * result.rhythm.period, end)
    else:
        upper.set_xlim(0, end)
    _portrait(result, portrait)
    figure.align_ylabels([upper, lower])
    told = f"period {result.period:.6g} s, amplitude {result.amplitude:.6g}" if result.period else result.rhythm.outcome
    figure.suptitle(f"{result.network.size} neurons: {told}", fontsize=10)
    save(figure, path)


def _outputs(result: Run, panel: Axes) -> None:
    n = result.network.size
    if n <= _MOST_LINES:
        for k in range(n):
            panel.plot(result.time, result.outputs[:, k], color=_COLOURS[k], linewidth=1.2, label=f"neuron {k + 1}")
        panel.set_ylabel("outputs $y_k$")
        _legend(panel)
        return
    units = len(result.network.units)
    shown, label = (result.unit_outputs, "unit") if units > 1 else (result.outputs, "neuron")
    count = shown.shape[1]
    thin = shown[:: max(1, len(shown) // 2000)]
    limit = float(np.abs(shown).max()) or 1.0
    low, colours = (-limit, "RdBu_r") if units > 1 else (0.0, "Blues")
    image = panel.imshow(
        thin.T,
        aspect="auto",
        origin="lower",
        interpolation="nearest",
        cmap=colours,
        vmin=low,
        vmax=limit,
        extent=(float(result.time[0]), float(result.time[-1]), 0.5, count + 0.5),
    )
    panel.grid(visible=False)
    panel.locator_params(axis="y", integer=True)
    panel.set_ylabel(f"{label}" + (" (1 = tail)" if units > 1 else ""))
    figure: Any = panel.figure
    figure.colorbar(image, ax=panel, label="output", pad=0.01)


def _portrait(result: Run, panel: Axes) -> None:
    """x_1 - x_2 against v_1 - v_2: the plane in which the drive output turns. The motion grey, the cycle on top."""
    network, rhythm = result.network, result.rhythm
    n = network.size
    extensor, flexor = network.units[0]

    def plane(states: Array) -> tuple[Array, Array]:
        return states[:, extensor] - states[:, flexor], states[:, n + extensor] - states[:, n + flexor]

    x, v = plane(result.states)
    if np.isnan(v).all():  # ngspice's run keeps x only
        x, v = plane(sampled(Flow(network), rhythm.start, result.time))
    panel.plot(x, v, color=GREY, linewidth=0.7, alpha=0.7, label="from the start")
    panel.plot(x[:1], v[:1], "o", color=GREY, markersize=4)
    if rhythm.cycle is not None:
        closed = sampled(Flow(network), rhythm.cycle.state, np.linspace(0, rhythm.cycle.period, 800))
        panel.plot(*plane(closed), color=BLUE, linewidth=1.8, label="cycle")
    labels = {True: "stable rest", False: "unstable rest"}
    for state in rhythm.rest_states.states[:50]:
        fill = "full" if state.stable else "none"
        spot = plane(state.state[None])
        panel.plot(*spot, "o", color=ORANGE, markersize=6, label=labels.pop(state.stable, None), fillstyle=fill)
    panel.set_xlabel(f"$x_{{{extensor + 1}}} - x_{{{flexor + 1}}}$")
    panel.set_ylabel(f"$v_{{{extensor + 1}}} - v_{{{flexor + 1}}}$")
    _legend(panel)


def _legend(panel: Axes) -> None:
    """Above the panel, where it hides nothing."""
    panel.legend(
        fontsize=7.5, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=6, handlelength=1.2,
        columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def plot_sweep(found: Sweep, path: str | Path) -> None:
    """Period and amplitude over the parameter; grey where it comes to rest, orange where that is not decided."""
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
    for k, outcome in enumerate(found.outcomes):
        if outcome in ("rest", "undecided"):
            colour = ORANGE if outcome == "undecided" else GREY
            for panel in (upper, lower):
                label = labels.pop(outcome, None) if panel is upper else None
                panel.axvspan(edges[k], edges[k + 1], color=colour, alpha=0.15, linewidth=0, label=label)
    if len(labels) < 2:
        _legend(upper)
    upper.set_ylabel("period [s]")
    lower.set_ylabel("amplitude")
    for panel in (upper, lower):
        panel.set_ylim(bottom=0)
    lower.set_xlabel(_LABELS[found.parameter])
    figure.align_ylabels([upper, lower])
    save(figure, path)
