"""Remakes CPG Section 6.3: the rhythm of two and three neurons, its limit cycle, and the range where it exists."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..oscillators.closed_forms import describing_frequency
from ..oscillators.flow import Flow, sampled
from ..oscillators.network import ADAPTATION, ADAPTATION_TIME, INHIBITION, RISE_TIME, Network, ring, unit
from ..oscillators.outcome import Rhythm
from ..oscillators.rhythm import rhythm
from ..oscillators.run import run
from ..report.axes import BLUE, COLOURS, GREY, ORANGE, Axes, Figure, caption, grid
from ..report.cpg import draw_cycle, plane
from .items import Check, Reproduction, largest_ratio, rows
from .paper_runs import PaperRuns, period_of

#: Tolerance of period and amplitude between ngspice's behavioural neurons and the exact flow.
_AGREE = 1e-5


def edge(build: Callable[[float], Network], inside: float, outside: float, within: float) -> float:
    """Return, by bisection, where between ``inside`` and ``outside`` the oscillation of ``build`` ends."""
    while abs(inside - outside) > within:
        middle = (inside + outside) / 2
        if rhythm(build(middle)).oscillates:
            inside = middle
        else:
            outside = middle
    return (inside + outside) / 2


def draw_portrait(panel: Axes, found: Rhythm, colour: str, label: str) -> None:
    """Draw the path from the start over five seconds, thin, and the cycle, if any."""
    path = sampled(Flow(found.network), found.start, np.linspace(0, 5.0, 800))
    panel.plot(*plane(found.network, path), color=colour, linewidth=0.6)
    draw_cycle(panel, found, colour, label)
    panel.set(xlabel="x$_1$ − x$_2$", ylabel="v$_1$ − v$_2$")


def draw_neurons(panel: Axes, time: Array, outputs: Array) -> None:
    """Draw the ``outputs`` (t, n) of all neurons over ``time`` [s]."""
    for k, (y, colour) in enumerate(zip(outputs.T, COLOURS, strict=False), 1):
        panel.plot(time, y, color=colour, linewidth=1.4, label=f"y$_{k}$")
    panel.set(xlabel="time [s]", ylabel="outputs of the neurons")


def add_legends(figure: Figure, letters: str = "") -> None:
    """Add a legend to each panel of ``figure`` that has labels, and the ``letters`` that the paper's panels have."""
    for panel in figure.axes:
        if panel.get_legend_handles_labels()[0]:
            panel.legend(frameon=False, fontsize="small")
    for letter, panel in zip(letters, figure.axes, strict=False):
        caption(panel, f"({letter})")


def by_ngspice(network: Network) -> tuple[Check, Check]:
    """Return checks of period and amplitude: behavioural sources in ngspice against the exact flow."""
    exact = rhythm(network)
    found = run(network, np.linspace(0.0, 3 * period_of(exact), 301), engine="ngspice")
    assert found.period is not None
    period, amplitude = largest_ratio(found.period, period_of(exact)), largest_ratio(found.amplitude, exact.amplitude)
    what = f"of {network.size} neurons by ngspice"
    return (
        Check(f"period {what}", "the exact flow", period, _AGREE),
        Check(f"amplitude {what}", "the exact flow", amplitude, _AGREE),
    )


def rhythms(runs: PaperRuns) -> Reproduction:
    two, three = (runs.network(n) for n in (2, 3))
    pair, trio = rhythm(two), rhythm(three)
    onset = edge(lambda a: ring(3, a, one_way=True), 2.5, 2.0, 2e-5)
    values = {
        "period": period_of(pair),
        "amplitude": pair.amplitude,
        "window_low": edge(unit, INHIBITION, 1.0, 1e-3),
        "window_high": edge(unit, INHIBITION, 5.0, 1e-3),
        "one_way_onset": onset,
        "one_way_period": period_of(rhythm(ring(3, onset + 2e-5, one_way=True))),
    }
    guess = 2 * np.pi / describing_frequency(INHIBITION, ADAPTATION, RISE_TIME, ADAPTATION_TIME)
    left = [abs(found.cycle.multiplier) if found.cycle else np.inf for found in (pair, trio)]
    described = Check("period of two neurons", "describing function", largest_ratio(guess, period_of(pair)), 0.02)
    return Reproduction(
        rows=rows("cpg_rhythm", values),
        checks=(*by_ngspice(two), *by_ngspice(three), described),
        holds=(max(left) < 1,),
        numbers={"two": left[0], "three": left[1], "period": trio.period, "amplitude": trio.amplitude},
        figure=_figure(pair, trio),
    )


def _figure(pair: Rhythm, trio: Rhythm) -> Figure:
    figure, axes = grid(2, 2, (11.0, 7.2))
    times = np.linspace(0.0, 5.0, 2001)
    for (left, right), found, name in zip(axes, (pair, trio), ("two neurons", "three neurons"), strict=True):
        states = sampled(Flow(found.network), found.start, times)
        draw_neurons(left, times, np.maximum(states[:, : found.network.size], 0))
        left.set_title(f"{name}: period {found.period:.4f} s", fontsize="medium")
        draw_portrait(right, found, BLUE, "cycle")
        right.set_title("phase portrait", fontsize="medium")
    add_legends(figure)
    return figure


def slower_rises(runs: PaperRuns) -> Reproduction:
    """Return the rhythm over Tr, without the arm: how its frequency falls, and where its limit cycle ends."""
    reach = np.arange(0.1, 1.05, 0.1)
    periods = {float(t): rhythm(runs.network(rise_time=float(t))).period for t in reach}
    cycling = {t: period for t, period in periods.items() if period is not None}
    end = edge(lambda t: runs.network(rise_time=t), 0.3, 0.6, 1e-3)
    pair = edge(lambda t: runs.network(2, rise_time=t), 0.3, 0.6, 1e-3)
    closed = ADAPTATION_TIME * (INHIBITION - 1)
    own, slow = rhythm(runs.network()), rhythm(runs.network().slowed(100))
    stretched = largest_ratio([period_of(slow) / 100, slow.amplitude], [period_of(own), own.amplitude])
    return Reproduction(
        rows=rows("cpg_rhythm", {"cycle_ends": end}, "three neurons in a ring"),
        checks=(Check("T_r at which the cycle of two neurons ends", "T_a (a − 1)", largest_ratio(pair, closed), 2e-3),),
        holds=(len(cycling) < len(periods) and end < 1.0,),
        numbers={
            "cycling": ", ".join(f"{t:.1f}" for t in cycling),
            "slowest": max(cycling.values(), default=0.0),
            "end": end,
            "stretched": stretched,
        },
        figure=_over_rise_time(runs, end),
    )


def _over_rise_time(runs: PaperRuns, end: float) -> Figure:
    """Draw period and amplitude of two and three neurons over Tr, grey from ``end`` [s] on."""
    figure, (panels,) = grid(1, 2, (11.0, 3.4))
    fine = np.linspace(0.02, 0.44, 43)
    for n, colour in ((2, ORANGE), (3, BLUE)):
        swept = [rhythm(runs.network(n, rise_time=float(t))) for t in fine]
        curves = [f.period or np.nan for f in swept], [f.amplitude for f in swept]
        for panel, values in zip(panels, curves, strict=True):
            panel.plot(fine, values, color=colour, linewidth=1.6, label=f"{n} neurons")
    for panel, name in zip(panels, ("period [s]", "amplitude of the output"), strict=True):
        panel.axvspan(end, 1.0, color=GREY, alpha=0.2, linewidth=0, label="comes to rest")
        panel.set(xlim=(0, 1), ylim=(0, None), xlabel="rise time T$_r$ [s]", ylabel=name)
    add_legends(figure)
    return figure
