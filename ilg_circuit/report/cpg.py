"""Presents the run of a network of neurons."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from ..arrays import Array
from ..oscillators.flow import Flow, sampled
from ..oscillators.network import Network
from ..oscillators.outcome import Rhythm
from ..oscillators.run import RhythmRun
from .axes import BLUE, COLOURS, GREY, ORANGE, STYLES, Axes, Figure, Panels, blank, heading, legend_above, plain
from .look import narrow

#: Most neurons drawn as curves; more are drawn as a map over time.
_MOST_LINES = 6
#: Most periods drawn.
_MOST_PERIODS = 40


def summary(result: RhythmRun) -> str:
    """Return outcome, period, amplitude, lags and states of rest as text."""
    end, network = result.rhythm, result.network
    lines = [headline(result), f"oscillates    {_oscillates(result)}: {end.reason}"]
    if result.period is not None:
        lines.append(f"period        {result.period:.7g} s ({1 / result.period:.5g} Hz)")
    lines.append(f"amplitude     {result.amplitude:.7g} (half the peak-to-peak of y_1 - y_2)")
    if end.cycle is not None and len(network.units) == 1:
        lags = ", ".join("silent" if math.isnan(v) else f"{v:.2f}" for v in end.phase_lags.tolist())
        lines.append(f"phase lags    {lags} degrees behind the first neuron")
    elif end.cycle is not None:
        lags = ", ".join(f"{v:.2f}" for v in end.unit_lags[1:].tolist())
        lines.append(f"unit lags     {lags} degrees behind the unit before")
    if end.rest is not None:
        outputs = ", ".join(f"{v:.5g}" for v in np.maximum(end.rest[: network.size], 0).tolist())
        lines.append(f"rests at      y = {outputs}")
    if result.engine == "ngspice":
        lines.append(f"solved by ngspice, estimated error {result.wave_error:.1e} of the waves")
        if result.period is not None:
            lines[-1] += f", {result.error:.1e} of period and amplitude"
    rests = end.rest_states
    lines.append(f"states of rest {len(rests.states)}, {len(rests.stable)} of them stable ({rests.how})")
    return "\n".join(lines)


def headline(result: RhythmRun) -> str:
    """Return one line: the number of neurons, the duration and the engine."""
    return f"{result.network.size} neurons, {result.time[-1]:g} s, engine {result.engine}"


def facts(result: RhythmRun) -> list[tuple[str, str]]:
    """Return whether it oscillates, period, amplitude and states of rest."""
    rests = result.rhythm.rest_states
    return [
        ("oscillates", f"{_oscillates(result)}: {result.rhythm.reason}"),
        *([("period", f"{result.period:.7g} s ({1 / result.period:.5g} Hz)")] if result.period else []),
        ("amplitude", f"{result.amplitude:.7g} (half the peak-to-peak of y_1 - y_2)"),
        ("states of rest", f"{len(rests.states)}, {len(rests.stable)} of them stable"),
    ]


def _oscillates(result: RhythmRun) -> str:
    return {True: "yes", False: "no", None: "not decided"}[result.rhythm.oscillates]


def figure(result: RhythmRun) -> Figure:
    """Return outputs over time, the drive output beneath, and its phase portrait with the limit cycle."""
    figure = blank((10.5, 4.8), stacked=8.0)
    if narrow():
        grid = figure.add_gridspec(3, 1, height_ratios=[1.25, 1.0, 1.8])
        right: Any = (2, 0)
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1.0], height_ratios=[1.25, 1.0])
        right = (slice(None), 1)
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    portrait = figure.add_subplot(grid[right])
    for panel in (upper, lower, portrait):
        plain(panel)
    _outputs(result, upper)
    upper.set_xlabel("")
    _drive(result, lower)
    upper.tick_params(labelbottom=False)
    _portrait(result, portrait)
    figure.align_ylabels([upper, lower])
    cycle = f"period {result.period:.6g} s, amplitude {result.amplitude:.6g}" if result.period else ""
    heading(figure, f"{result.network.size} neurons: {cycle or result.rhythm.outcome}")
    return figure


def panels(result: RhythmRun) -> Panels:
    """Return the panels: the neurons' outputs, the drive output, the phase portrait."""
    drawn = {"outputs": _outputs, "drive": _drive, "portrait": _portrait}
    return {name: partial(draw, result) for name, draw in drawn.items()}


def _last_periods(result: RhythmRun, panel: Axes) -> Axes:
    end = float(result.time[-1])
    panel.set_xlim(max(0.0, end - _MOST_PERIODS * (result.rhythm.period or end)), end)
    panel.set_xlabel("time [s]")
    return panel


def _drive(result: RhythmRun, panel: Axes, **style: Any) -> Axes:
    """Draw the outputs of the first and the last unit."""
    units = len(result.network.units)
    look: dict[str, Any] = {"color": BLUE, "linewidth": 1.2, "label": "unit 1 (tail)"} | style
    panel.plot(result.time, result.unit_outputs[:, 0], **look)
    if units > 1:
        panel.plot(result.time, result.unit_outputs[:, -1], color=ORANGE, linewidth=1.2, label=f"unit {units} (head)")
        legend_above(panel)
    panel.set_ylabel("output y_1 − y_2" if units == 1 else "unit outputs")
    return _last_periods(result, panel)


def _outputs(result: RhythmRun, panel: Any, **style: Any) -> Axes:
    """Draw each neuron's output as a curve, many neurons or units as a map over time."""
    n = result.network.size
    if n <= _MOST_LINES:
        for k in range(n):
            look = {"color": COLOURS[k], "linestyle": STYLES[k], "linewidth": 1.2, "label": f"neuron {k + 1}"} | style
            panel.plot(result.time, result.outputs[:, k], **look)
        panel.set_ylabel("outputs y_k")
        legend_above(panel)
        return _last_periods(result, panel)
    units = len(result.network.units)
    shown, label = (result.unit_outputs, "unit") if units > 1 else (result.outputs, "neuron")
    count = shown.shape[1]
    thin = shown[:: max(1, len(shown) // 2000)]
    limit = float(np.abs(shown).max()) or 1.0
    low, colours = (-limit, "RdBu_r") if units > 1 else (0.0, "Blues")
    extent = (float(result.time[0]), float(result.time[-1]), 0.5, count + 0.5)
    how: dict[str, Any] = {"aspect": "auto", "origin": "lower", "interpolation": "nearest"} | style
    image = panel.imshow(thin.T, cmap=colours, vmin=low, vmax=limit, extent=extent, **how)
    panel.grid(visible=False)
    panel.locator_params(axis="y", integer=True)
    panel.set_ylabel(f"{label}" + (" (1 = tail)" if units > 1 else ""))
    panel.figure.colorbar(image, ax=panel, label="output", pad=0.01)
    return _last_periods(result, panel)


def _portrait(result: RhythmRun, panel: Axes) -> Axes:
    """Draw x_1 - x_2 against v_1 - v_2, the plane of the drive output: the motion in grey, the cycle on top."""
    network, rhythm = result.network, result.rhythm
    x, v = plane(network, result.states)
    if np.isnan(v).all():  # ngspice's run keeps x only
        x, v = plane(network, sampled(Flow(network), rhythm.start, result.time))
    panel.plot(x, v, color=GREY, linewidth=0.7, alpha=0.7, label="from the start")
    panel.plot(x[:1], v[:1], "o", color=GREY, markersize=4)
    draw_cycle(panel, rhythm, BLUE, "cycle")
    labels = {True: "stable rest", False: "unstable rest"}
    for state in rhythm.rest_states.states[:50]:
        fill = "full" if state.stable else "none"
        panel.plot(
            *plane(network, state.state[None]),
            "o",
            color=ORANGE,
            markersize=6,
            label=labels.pop(state.stable, None),
            fillstyle=fill,
        )
    extensor, flexor = network.units[0]
    across, up = (f"{state}_{extensor + 1} − {state}_{flexor + 1}" for state in "xv")
    panel.set(xlabel=across, ylabel=up)
    legend_above(panel)
    return panel


def plane(network: Network, states: Array) -> tuple[Array, Array]:
    """Return the first unit's x_1 - x_2 and v_1 - v_2 of ``states`` (t, 2 n): the plane of the drive output."""
    extensor, flexor = network.units[0]
    x, v = np.split(states, 2, axis=1)
    return x[:, extensor] - x[:, flexor], v[:, extensor] - v[:, flexor]


def draw_cycle(panel: Axes, found: Rhythm, colour: str, label: str) -> None:
    """Draw the limit cycle in its plane, if there is one."""
    if found.cycle is not None:
        closed = sampled(Flow(found.network), found.cycle.state, np.linspace(0, found.cycle.period, 800))
        panel.plot(*plane(found.network, closed), color=colour, linewidth=1.8, label=label)
