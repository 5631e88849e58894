"""Presents the run of neurons that feel the strip they drive."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..oscillators.loop_rhythm import LoopRhythm
from ..oscillators.loop_run import ReflexRun
from .axes import BLUE, COLOURS, ORANGE, STYLES, Axes, Figure, Panels, heading, legend_above, new_figure

#: Most units drawn, and most periods.
_MOST_UNITS, _MOST_PERIODS = 4, 12


def summary(run: ReflexRun) -> str:
    """Return rhythm, angle and phase with the reflex and without it as text."""
    lines = [headline(run)]
    lines += [f"{name:<16}{value}" for name, value in facts(run)]
    if run.engine == "ngspice":
        lines.append(f"solved by ngspice, estimated error {run.error:.1e} of the waves")
    return "\n".join(lines)


def headline(run: ReflexRun) -> str:
    """Return one line: neurons, strip, gain, duration and engine."""
    loop = run.loop
    felt = f"{loop.network.size} neurons feel strip {loop.strip.name} by {loop.gain:g} /rad"
    return f"{felt}, {run.time[-1]:g} s, engine {run.engine}"


def facts(run: ReflexRun) -> list[tuple[str, str]]:
    """Return the rhythm with the reflex, without it, and the largest angle of the run."""
    rows = []
    for name, rhythm in (("with reflex", run.rhythm), ("without it", run.without)):
        if rhythm is not None:
            rows.append((name, _told(rhythm)))
    if run.rhythm is None:
        rows.append(("period", f"{run.period:.6g} s" if run.period else "the run does not repeat itself"))
    rows.append(("largest angle", f"{np.abs(run.angles).max():.4g} rad in this run"))
    return rows


def _told(rhythm: LoopRhythm) -> str:
    """Return one line of a rhythm."""
    if rhythm.period is not None:
        angle, lag = rhythm.angle_amplitudes[0], rhythm.lags[0]
        return f"period {rhythm.period:.7g} s, angle +-{angle:.4g} rad, {lag:.1f} degrees behind the output"
    if rhythm.rest_angles is not None:
        return f"comes to rest at {rhythm.rest_angles[0]:.4g} rad"
    return "neither rest nor cycle was found"


def figure(run: ReflexRun) -> Figure:
    """Return neurons, voltage and angle over time."""
    figure, (upper, middle, lower) = new_figure(3, [1.7, 1.3, 1.7])
    for draw, panel in ((_neurons, upper), (_voltage, middle), (_angle, lower)):
        draw(run, panel)
        if panel is not lower:
            panel.set_xlabel("")
            panel.tick_params(labelbottom=False)
    figure.align_ylabels([upper, middle, lower])
    heading(figure, f"gain {run.loop.gain:g} /rad: " + (f"period {run.period:.5g} s" if run.period else "no rhythm"))
    return figure


def panels(run: ReflexRun) -> Panels:
    """Return the panels: outputs of the neurons, voltage, angle."""
    return {"outputs": partial(_neurons, run), "voltage": partial(_voltage, run), "angle": partial(_angle, run)}


def _drawn(run: ReflexRun, panel: Axes, columns: np.ndarray, names: list[str], style: dict[str, Any]) -> None:
    for k, (wave, name) in enumerate(zip(columns.T, names, strict=False)):
        look = {"color": COLOURS[k], "linestyle": STYLES[k], "linewidth": 1.2, "label": name} | style
        panel.plot(run.time, wave, **look)
    if min(len(names), columns.shape[1]) > 1:
        legend_above(panel)
    end = float(run.time[-1])
    panel.set_xlim(max(0.0, end - _MOST_PERIODS * (run.period or end)), end)
    panel.set_xlabel("time [s]")


def _units(run: ReflexRun) -> list[str]:
    return [f"unit {k + 1}" for k in range(min(run.loop.units, _MOST_UNITS))]


def _neurons(run: ReflexRun, panel: Axes, **style: Any) -> Axes:
    names = [f"neuron {k + 1}" for k in range(min(run.loop.network.size, _MOST_UNITS))]
    _drawn(run, panel, run.outputs, names, style)
    panel.set_ylabel("outputs y_k")
    return panel


def _voltage(run: ReflexRun, panel: Axes, **style: Any) -> Axes:
    _drawn(run, panel, run.voltages, _units(run), style)
    panel.set_ylabel("voltage [V]")
    return panel


def _angle(run: ReflexRun, panel: Axes, **style: Any) -> Axes:
    _drawn(run, panel, run.angles, _units(run), {"color": BLUE} | style if run.loop.units == 1 else style)
    if run.loop.gain:
        panel.axhline(run.loop.rest_angle, color=ORANGE, linewidth=0.8, linestyle="--")
    panel.set_ylabel("angle [rad]")
    return panel
