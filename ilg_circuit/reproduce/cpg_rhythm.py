"""CPG Section 6.3: the rhythm of two and of three neurons, its limit cycle and the window in which there is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..cpg.closed_forms import describing_frequency
from ..cpg.flow import Flow, sampled
from ..cpg.network import ADAPTATION, ADAPTATION_TIME, INHIBITION, RISE_TIME, Network, ring, unit
from ..cpg.outcome import Rhythm
from ..cpg.rhythm import rhythm
from ..cpg.run import run
from ..report.axes import BLUE, GREY, ORANGE
from ..report.panels import COLOURS, grid
from .items import Check, Claim, Reproduction, rows
from .paper_runs import PaperRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What the text does not say about the rhythm.
LOST = (
    "The mutual inhibition a is lost with the paper's formulas: 2.5 is taken.",
    "The wiring of the three neurons is lost: a ring in which all inhibit one another is taken, and y₁ − y₂ as output.",
)
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


def plane(network: Network, states: Array) -> tuple[Array, Array]:
    """Return x_1 - x_2 and v_1 - v_2 of ``states`` (t, 2 n): the plane of the output."""
    return states[:, 0] - states[:, 1], states[:, network.size] - states[:, network.size + 1]


def draw_cycle(panel: Axes, found: Rhythm, colour: str, label: str, duration: float) -> None:
    """Draw the path from the start over ``duration`` [s], thin, and the cycle, if any."""
    flow = Flow(found.network)
    panel.plot(*plane(found.network, sampled(flow, found.start, np.linspace(0, duration, 800))), color=colour, lw=0.6)
    if found.cycle is not None:
        closed = sampled(flow, found.cycle.state, np.linspace(0, found.cycle.period, 800))
        panel.plot(*plane(found.network, closed), color=colour, linewidth=1.8, label=label)
    panel.set_xlabel("x$_1$ − x$_2$")
    panel.set_ylabel("v$_1$ − v$_2$")


def add_legends(*panels: Axes) -> None:
    """Add a legend to each of ``panels`` that has labels."""
    for panel in panels:
        if panel.get_legend_handles_labels()[0]:
            panel.legend(frameon=False, fontsize=8)


def figure_grid(rows_: int, columns: int, width: float = 11.0, height: float = 3.6) -> tuple[Figure, Any]:
    """Return a figure of ``rows_`` by ``columns`` panels."""
    return grid(rows_, columns, (width, height * rows_))


def by_ngspice(network: Network) -> tuple[Check, Check]:
    """Period and amplitude of the neurons as behavioural sources in ngspice against the exact flow."""
    period = rhythm(network).period
    assert period is not None
    found = run(network, np.linspace(0.0, 3 * period, 301), engine="ngspice")
    assert found.period is not None
    what = f"of {network.size} neurons by ngspice"
    return (
        Check(f"period {what}", "the exact flow", float(abs(found.period / period - 1)), _AGREE),
        Check(f"amplitude {what}", "the exact flow", float(abs(found.amplitude / found.rhythm.amplitude - 1)), _AGREE),
    )


def rhythms(runs: PaperRuns) -> Reproduction:
    two, three = (runs.network(n) for n in (2, 3))
    pair, trio = rhythm(two), rhythm(three)
    assert pair.period is not None
    assert trio.period is not None
    onset = edge(lambda a: ring(3, a, one_way=True), 2.5, 2.0, 2e-5)
    at_onset = rhythm(ring(3, onset + 2e-5, one_way=True))
    values = {
        "period": pair.period,
        "amplitude": pair.amplitude,
        "window_low": edge(unit, INHIBITION, 1.0, 1e-3),
        "window_high": edge(unit, INHIBITION, 5.0, 1e-3),
        "one_way_onset": onset,
        "one_way_period": float(at_onset.period or np.nan),
    }
    guess = 2 * np.pi / describing_frequency(INHIBITION, ADAPTATION, RISE_TIME, ADAPTATION_TIME)
    multipliers = [abs(found.cycle.multiplier) if found.cycle else np.inf for found in (pair, trio)]
    return Reproduction(
        rows=rows("cpg_rhythm", values),
        checks=(
            *by_ngspice(two),
            *by_ngspice(three),
            Check("period of two neurons", "describing function", float(abs(guess / pair.period - 1)), 0.02),
        ),
        claims=(
            Claim(
                "the phase diagram is a limit cycle",
                max(multipliers) < 1,
                f"of a disturbance {multipliers[0]:.1e} (two neurons) and {multipliers[1]:.1e} (three) is left after a "
                f"period; three neurons have a period of {trio.period:.4f} s and an amplitude of {trio.amplitude:.4f}",
            ),
        ),
        unknown=LOST,
        figure=_figure(pair, trio),
    )


def _figure(pair: Rhythm, trio: Rhythm) -> Figure:
    figure, axes = figure_grid(2, 2)
    times = np.linspace(0.0, 5.0, 2001)
    for (left, right), found, name in zip(axes, (pair, trio), ("two neurons", "three neurons"), strict=True):
        states = sampled(Flow(found.network), found.start, times)
        for k in range(found.network.size):
            left.plot(times, np.maximum(states[:, k], 0), color=COLOURS[k], linewidth=1.4, label=f"y$_{k + 1}$")
        left.set_ylabel("outputs")
        left.set_xlabel("time [s]")
        left.set_title(f"{name}: period {found.period:.4f} s", fontsize=10)
        draw_cycle(right, found, BLUE, "cycle", 5.0)
        right.set_title("phase portrait", fontsize=10)
        add_legends(left, right)
    return figure


def slower_rises(runs: PaperRuns) -> Reproduction:
    """The rhythm without the arm, over Tr: how its frequency falls, and where its cycle ends."""
    reach = np.arange(0.1, 1.05, 0.1)
    found = [rhythm(runs.network(rise_time=float(t))) for t in reach]
    cycling = [(t, f) for t, f in zip(reach, found, strict=True) if f.period is not None]
    end = edge(lambda t: runs.network(rise_time=t), 0.3, 0.6, 1e-3)
    pair = edge(lambda t: runs.network(2, rise_time=t), 0.3, 0.6, 1e-3)
    slowest = max(float(f.period or 0.0) for _, f in cycling)
    figure, axes = figure_grid(1, 2, height=3.4)
    fine = np.linspace(0.02, 0.44, 43)
    for n, colour in ((2, ORANGE), (3, BLUE)):
        swept = [rhythm(runs.network(n, rise_time=float(t))) for t in fine]
        axes[0, 0].plot(fine, [f.period or np.nan for f in swept], color=colour, linewidth=1.6, label=f"{n} neurons")
        axes[0, 1].plot(fine, [f.amplitude for f in swept], color=colour, linewidth=1.6, label=f"{n} neurons")
    for panel, name in zip(axes[0], ("period [s]", "amplitude of the output"), strict=True):
        panel.axvspan(end, 1.0, color=GREY, alpha=0.2, linewidth=0, label="comes to rest")
        panel.set_xlim(0, 1)
        panel.set_ylim(bottom=0)
        panel.set_xlabel("rise time T$_r$ [s]")
        panel.set_ylabel(name)
        add_legends(panel)
    return Reproduction(
        rows=rows("cpg_rhythm", {"cycle_ends": end}, cycle_ends="three neurons in a ring"),
        checks=(
            Check(
                "T_r at which the cycle of two neurons ends",
                "T_a (a − 1)",
                abs(pair / (ADAPTATION_TIME * (INHIBITION - 1)) - 1),
                2e-3,
            ),
        ),
        claims=(
            Claim(
                "a smaller frequency destroys the limit cycle",
                len(cycling) < len(reach) and end < 1.0,
                f"of the paper's T_r = 0.1 to 1 s, {', '.join(f'{t:.1f}' for t, _ in cycling)} s cycle, with periods "
                f"up to {slowest:.3f} s; from {end:.3f} s on all comes to rest. What ends it is T_r beside T_a: with "
                "both a hundred times as large the cycle is the same, but for its pace, to "
                f"{_stretched(runs):.0e}",
            ),
        ),
        unknown=LOST,
        figure=figure,
    )


def _stretched(runs: PaperRuns) -> float:
    """Return the deviation of amplitude and period from their scaling when both time constants grow a hundredfold."""
    base = runs.network()
    slow = rhythm(replace(base, rise_time=100 * base.rise_time, adaptation_time=100 * base.adaptation_time))
    own = rhythm(base)
    assert slow.period is not None
    assert own.period is not None
    return max(abs(slow.period / own.period / 100 - 1), abs(slow.amplitude / own.amplitude - 1))
