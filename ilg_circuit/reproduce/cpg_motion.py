"""Remakes CPG Figures 10-13: the arm moved by the rhythm without a circuit (coupling `ideal`), over e, Tr and a or d.

Imports the arm's kernels, and with them numba: `catalogue` names these items without importing them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arms import Motion, simulate, strip_arm
from ..arms.coupling import Coupled, couple
from ..arrays import Array
from ..oscillators.network import Network
from ..oscillators.rhythm import rhythm
from ..report.axes import BLUE, COLOURS, GREY, ORANGE, Figure, grid
from ..report.motion import SNAPSHOT_TIMES
from .cpg_rhythm import add_legends, draw_neurons, draw_portrait
from .items import Check, Reproduction, largest_difference
from .paper_runs import PaperRuns

#: Duration of the paper's motions [s].
DURATION = 1.5
#: Segments of the paper's arm.
SEGMENTS = 15
#: Tolerances of constant area and of the balance of energy.
_AREA, _ENERGY = 1e-6, 1e-5
#: Tolerance of exact laws of the rhythm.
_EXACT = 1e-8
#: Labels of a panel with the arm's shape.
_SHAPE = {"xlabel": "along the arm [mm]", "ylabel": "across [mm] (another scale)"}


@dataclass(frozen=True)
class Moved:
    """An arm's motion, its rhythm, and a label for pictures."""

    label: str
    coupled: Coupled
    motion: Motion

    @property
    def displacement(self) -> Array:
        """Return the displacement of the tip [m] (t, 2)."""
        return np.asarray(self.motion.tip - self.motion.tip[0])

    @property
    def largest(self) -> float:
        """Return the largest displacement of the tip [m]."""
        return float(np.linalg.norm(self.displacement, axis=1).max())


def move(runs: PaperRuns, network: Network, label: str = "", *, segments: int = SEGMENTS, mode: str = "ideal") -> Moved:
    """Return the motion of the paper's strip for 1.5 s, all segments driven equally by ``network``."""
    arm = strip_arm(segments=segments)
    reference = rhythm(runs.network()).amplitude
    coupled = couple(network, segments, DURATION, mode=mode, segment_length=arm.segment_length, reference=reference)
    motion = simulate(arm, coupled.activation(arm), np.linspace(0.0, DURATION, 301))
    return Moved(label, coupled, motion)


def mechanics(*moves: Moved) -> tuple[Check, Check]:
    """Return the checks of every motion: the cells' areas, and the balance of energy."""
    return (
        Check("areas of the cells", "their start", max(m.motion.area_drift for m in moves), _AREA),
        Check("balance of energy", "zero", max(m.motion.balance_error for m in moves), _ENERGY),
    )


def figure_10(runs: PaperRuns) -> Reproduction:
    moved = move(runs, runs.network(), "e = 1")
    run, motion = moved.coupled.run, moved.motion
    figure, ((outputs, phase), (shape, force)) = grid(2, 2, (11.0, 7.2))
    draw_neurons(outputs, run.time, run.outputs)
    draw_portrait(phase, run.rhythm, BLUE, "cycle")
    for time, nodes, colour in zip(*motion.snapshots(SNAPSHOT_TIMES), COLOURS, strict=False):
        shape.plot(*(1e3 * nodes.mean(axis=1)).T, color=colour, linewidth=1.6, label=f"{time:.1f} s")
    shape.set(**_SHAPE)
    one, other = 1e6 * motion.first_segment_force.T
    force.plot(motion.time, one, color=ORANGE, linewidth=1.4, label="face towards +normal")
    force.plot(motion.time, other, color=BLUE, linewidth=1.4, linestyle="--", label="other face")
    force.set(xlabel="time [s]", ylabel="tension in segment 1 [µN]")
    add_legends(figure, "abcd")
    forces = motion.edge_forces
    peaks = 1e6 * np.abs(forces).max(axis=(0, 2))
    correlation = float(np.atleast_2d(np.corrcoef(forces[1:, :, 0].T))[0].min())
    return Reproduction(
        checks=mechanics(moved),
        holds=(None, None),
        numbers={"first": peaks[0], "last": peaks[-1], "correlation": correlation, "moved": 1e3 * moved.largest},
        figure=figure,
    )


def series(moves: list[Moved]) -> Figure:
    """Draw (a) outputs, (b) phase portraits, (c) the arm where its tip is farthest, with the tip's path."""
    figure, ((outputs, phase, shape),) = grid(1, 3, (11.0, 3.9))
    for moved, colour in zip(moves, COLOURS, strict=False):
        run, motion = moved.coupled.run, moved.motion
        outputs.plot(run.time, run.unit_outputs[:, 0], color=colour, linewidth=1.3, label=moved.label)
        draw_portrait(phase, run.rhythm, colour, moved.label)
        far = int(np.linalg.norm(moved.displacement, axis=1).argmax())
        label = f"{moved.label}: {1e3 * moved.largest:.2f} mm at {motion.time[far]:.2f} s"
        shape.plot(*(1e3 * motion.centreline[far]).T, color=colour, linewidth=1.6, label=label)
        shape.plot(*(1e3 * motion.tip).T, color=colour, linewidth=0.7, linestyle=":")
    outputs.set(xlabel="time [s]", ylabel="output y$_1$ − y$_2$")
    shape.set(**_SHAPE)
    add_legends(figure, "abcd")
    return figure


def figure_11(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(tonic=float(e)), f"e = {e}") for e in range(1, 5)]
    values = np.arange(1.0, 51.0)
    found = [rhythm(runs.network(tonic=float(e))) for e in values]
    amplitudes = np.array([f.amplitude for f in found])
    periods = np.array([f.period for f in found], dtype=float)
    in_proportion = largest_difference(amplitudes, amplitudes[0] * values)
    strong = [move(runs, runs.network(tonic=e), f"e = {e:g}") for e in (10.0, 20.0, 50.0)]
    crossing = [m.label for m in strong if any(e.finding.code == "arm-crosses-itself" for e in m.motion.events)]
    return Reproduction(
        checks=(
            Check("amplitude at e = 1 to 50", "that of e = 1, times e", in_proportion, _EXACT),
            Check("period at e = 1 to 50", "that of e = 1", largest_difference(periods, periods[:1]), _EXACT),
            *mechanics(*moves, *strong),
        ),
        holds=(None, bool(crossing) or None),
        numbers={
            "extents": ", ".join(f"{1e3 * m.largest:.1f} mm at {m.label}" for m in strong),
            "crosses": f"crosses itself at {', '.join(crossing)}" if crossing else "does not cross itself",
        },
        figure=series(moves),
    )


def figure_12(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(rise_time=t), f"T$_r$ = {t:g} s") for t in (0.1, 0.2, 0.3, 0.4, 0.5)]
    resting = [moved.label.replace("$", "") for moved in moves if not moved.coupled.run.rhythm.oscillates]
    return Reproduction(
        checks=mechanics(*moves),
        holds=(None, bool(resting)),
        numbers={"resting": ", ".join(resting)},
        figure=series(moves),
    )


def figure_13(runs: PaperRuns) -> Reproduction:
    by_a = [move(runs, runs.network(inhibition=a, rise_time=0.1), f"a = {a:g}") for a in (2.0, 3.0, 4.0)]
    by_d = [move(runs, runs.network(adaptation=d, rise_time=0.1), f"d = {d:g}") for d in (2.0, 50.0)]
    return Reproduction(
        checks=mechanics(*by_a, *by_d),
        holds=(None, None),
        numbers={"by_a": _cycling(runs, "inhibition"), "by_d": _cycling(runs, "adaptation")},
        figure=series([*by_a, *by_d]),
    )


def _cycling(runs: PaperRuns, name: str) -> str:
    """Return the integers up to 50 for which the rhythm persists, as a range if consecutive."""
    settings: list[dict[str, Any]] = [{name: float(value)} for value in range(1, 51)]
    values = [int(s[name]) for s in settings if rhythm(runs.network(rise_time=0.1, **s)).oscillates]
    if len(values) > 2 and values[-1] - values[0] == len(values) - 1:
        return f"{values[0]} to {values[-1]}"
    return ", ".join(map(str, values)) or "none"


def segments(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(), f"{n} segments", segments=n) for n in (15, 30, 60)]
    largest = moves[-1].largest
    figure, ((way, difference),) = grid(1, 2, (11.0, 3.6))
    for moved, colour in zip(moves, COLOURS, strict=False):
        way.plot(moved.motion.time, 1e3 * moved.displacement[:, 1], color=colour, linewidth=1.4, label=moved.label)
    apart = []
    for coarse, fine, colour in zip(moves, moves[1:], (BLUE, ORANGE), strict=False):
        gap = np.linalg.norm(coarse.displacement - fine.displacement, axis=1) / largest
        label = f"{coarse.label} against {fine.label.split()[0]}"
        difference.plot(coarse.motion.time, 100 * gap, color=colour, label=label)
        apart.append(float(gap.max()))
    difference.axhline(0, color=GREY, linewidth=0.6)
    way.set(xlabel="time [s]", ylabel="tip's displacement across [mm]")
    difference.set(xlabel="time [s]", ylabel="difference of the tips [% of the largest]")
    add_legends(figure)
    return Reproduction(
        checks=(Check("tip with 30 segments", "60 segments", apart[1], 0.01), *mechanics(*moves)),
        holds=(apart[0] < 0.02,),
        numbers={"apart": apart[0], "finer": apart[1]},
        figure=figure,
    )
