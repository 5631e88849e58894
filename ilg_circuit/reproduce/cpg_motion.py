"""CPG Figures 10-13: the arm that the rhythm moves, without a circuit in between (`ideal`), over e, Tr and a or d.

Imports the arm's kernels, and with them numba: `catalogue` names these items without importing them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arm import Motion, simulate, strip_arm
from ..arm.coupling import Coupled, couple
from ..arrays import Array
from ..cpg.network import Network
from ..cpg.rhythm import rhythm
from ..report.axes import BLUE, GREY, ORANGE
from ..report.motion import SNAPSHOT_TIMES
from ..report.panels import COLOURS
from .cpg_rhythm import LOST, add_legends, draw_cycle, figure_grid
from .items import Check, Claim, Reproduction, largest_difference
from .paper_runs import VOLTAGE, PaperRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Duration of the paper's motions [s].
DURATION = 1.5
#: Segments of the paper's arm.
SEGMENTS = 15
#: Tolerances of constant area and of the balance of energy.
_AREA, _ENERGY = 1e-6, 1e-5
#: Tolerance of exact laws of the rhythm.
_EXACT = 1e-8
ASSUMED = (
    *LOST,
    "The arm's size, stiffness and mass are not given: the free part of EC's strip is taken (30 × 5 × 0.5 mm, "
    "7.6 kPa), without weight, which it could not carry.",
    "How one rhythm drives 15 segments is not said: all alike is taken, and that the output's amplitude at e = 1, "
    f"T_r = 0.12 s makes the strain that {VOLTAGE:g} V make in the end.",
)
PLACE = Claim(
    "the actuators reach the specified location in a smooth way",
    None,
    "no location is specified; the tip's way is drawn, and its extent is in the legend",
)


@dataclass(frozen=True)
class Moved:
    """An arm's motion, its rhythm, and a label for pictures."""

    label: str
    coupled: Coupled
    motion: Motion

    @property
    def displacement(self) -> Array:
        """Of the tip [m] (t, 2)."""
        tip: Array = self.motion.tip - self.motion.tip[0]
        return tip

    @property
    def largest(self) -> float:
        """Largest displacement of the tip [m]."""
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
    motion = moved.motion
    peaks = np.abs(motion.edge_forces).max(axis=(0, 2))
    correlation = float(np.atleast_2d(np.corrcoef(motion.edge_forces[1:, :, 0].T))[0].min())
    return Reproduction(
        checks=mechanics(moved),
        claims=(
            Claim(
                "the internal force of each segment is similar to that of the first section",
                None,
                "in what is not said. In a beam clamped at its base the largest tension falls from "
                f"{1e6 * peaks[0]:.3g} µN in the first segment to {1e6 * peaks[-1]:.3g} µN in the last; over time they "
                f"correlate with the first by {correlation:.2f} or more",
            ),
            Claim(
                "the motion can be used to simulate the soft actuator",
                None,
                f"without a circuit the tip moves by up to {1e3 * moved.largest:.2f} mm within {DURATION:g} s; what "
                "the strip's circuit leaves of that is CPG-C",
            ),
        ),
        unknown=ASSUMED,
        figure=_figure_10(moved),
    )


def _figure_10(moved: Moved) -> Figure:
    figure, ((outputs, phase), (shape, force)) = figure_grid(2, 2)
    run, motion = moved.coupled.run, moved.motion
    for k in range(run.network.size):
        outputs.plot(run.time, run.outputs[:, k], color=COLOURS[k], linewidth=1.4, label=f"y$_{k + 1}$")
    outputs.set_ylabel("outputs of the neurons")
    outputs.set_xlabel("time [s]")
    draw_cycle(phase, run.rhythm, BLUE, "cycle", 5.0)
    times, positions = motion.snapshots(SNAPSHOT_TIMES)
    for k, (time, nodes) in enumerate(zip(times, positions, strict=True)):
        shape.plot(*(1e3 * nodes.mean(axis=1)).T, color=COLOURS[k], linewidth=1.6, label=f"{time:.1f} s")
    _axes_of_shape(shape)
    tension = 1e6 * motion.first_segment_force
    force.plot(motion.time, tension[:, 0], color=ORANGE, linewidth=1.4, label="face towards +normal")
    force.plot(motion.time, tension[:, 1], color=BLUE, linewidth=1.4, linestyle="--", label="other face")
    force.set_ylabel("tension in segment 1 [µN]")
    force.set_xlabel("time [s]")
    for letter, panel in zip("abcd", (outputs, phase, shape, force), strict=True):
        panel.set_title(f"({letter})", fontsize=10, loc="left")
    add_legends(outputs, phase, shape, force)
    return figure


def _axes_of_shape(panel: Axes) -> None:
    panel.set_xlabel("along the arm [mm]")
    panel.set_ylabel("across [mm] (another scale)")


def series(moves: list[Moved]) -> Figure:
    """Draw (a) outputs, (b) phase portraits, (c) the arm where its tip is farthest, with the tip's path."""
    figure, ((outputs, phase, shape),) = figure_grid(1, 3, width=11.0, height=3.9)
    for moved, colour in zip(moves, COLOURS, strict=False):
        run, motion = moved.coupled.run, moved.motion
        outputs.plot(run.time, run.unit_outputs[:, 0], color=colour, linewidth=1.3, label=moved.label)
        draw_cycle(phase, run.rhythm, colour, moved.label, 5.0)
        far = int(np.linalg.norm(moved.displacement, axis=1).argmax())
        label = f"{moved.label}: {1e3 * moved.largest:.2f} mm at {motion.time[far]:.2f} s"
        shape.plot(*(1e3 * motion.centreline[far]).T, color=colour, linewidth=1.6, label=label)
        shape.plot(*(1e3 * motion.tip).T, color=colour, linewidth=0.7, linestyle=":")
    outputs.set_ylabel("output y$_1$ − y$_2$")
    outputs.set_xlabel("time [s]")
    _axes_of_shape(shape)
    for letter, panel in zip("abc", (outputs, phase, shape), strict=True):
        panel.set_title(f"({letter})", fontsize=10, loc="left")
    add_legends(outputs, phase, shape)
    return figure


def figure_11(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(tonic=float(e)), f"e = {e}") for e in range(1, 5)]
    values = np.arange(1.0, 51.0)
    found = [rhythm(runs.network(tonic=float(e))) for e in values]
    amplitudes = np.array([f.amplitude for f in found])
    periods = np.array([f.period for f in found], dtype=float)
    proportional = amplitudes[0] * values
    strong = [move(runs, runs.network(tonic=e), f"e = {e:g}") for e in (10.0, 20.0, 50.0)]
    crossing = [m.label for m in strong if any(e.finding.code == "arm-crosses-itself" for e in m.motion.events)]
    crosses = f"the arm crosses itself at {', '.join(crossing)}" if crossing else "the arm does not cross itself"
    extents = ", ".join(f"{1e3 * m.largest:.1f} mm at {m.label}" for m in strong)
    return Reproduction(
        checks=(
            Check(
                "amplitude at e = 1 to 50",
                "that of e = 1, times e",
                largest_difference(amplitudes, proportional),
                _EXACT,
            ),
            Check("period at e = 1 to 50", "that of e = 1", largest_difference(periods, periods[:1]), _EXACT),
            *mechanics(*moves, *strong),
        ),
        claims=(
            PLACE,
            Claim(
                "a larger amplitude causes the soft actuator to become disordered",
                bool(crossing) or None,
                f"e scales the cycle and nothing else, while the start stays as it is. Within {DURATION:g} s the tip "
                f"moves by up to {extents}; {crosses}",
            ),
        ),
        unknown=("Which e the curves of the figure have: (0, 4) is printed, in steps of 1.", *ASSUMED),
        figure=series(moves),
    )


def figure_12(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(rise_time=t), f"T$_r$ = {t:g} s") for t in (0.1, 0.2, 0.3, 0.4, 0.5)]
    resting = [moved.label.replace("$", "") for moved in moves if not moved.coupled.run.rhythm.oscillates]
    return Reproduction(
        checks=mechanics(*moves),
        claims=(
            PLACE,
            Claim(
                "a smaller frequency destroys the limit cycle, causing failure of the maintenance of the movement",
                bool(resting),
                f"at {', '.join(resting)} the rhythm comes to rest, and with it the arm (CPG-R2 has the edge)",
            ),
        ),
        unknown=("Which T_r the curves of the figure have: 0 to 1 s in steps of 0.1 s were tried.", *ASSUMED),
        figure=series(moves),
    )


def figure_13(runs: PaperRuns) -> Reproduction:
    by_a = [move(runs, runs.network(inhibition=a, rise_time=0.1), f"a = {a:g}") for a in (2.0, 3.0, 4.0)]
    by_d = [move(runs, runs.network(adaptation=d, rise_time=0.1), f"d = {d:g}") for d in (2.0, 50.0)]
    whole = range(51)
    a_cycles = _cycling(runs, "inhibition", whole)
    d_cycles = _cycling(runs, "adaptation", whole)
    return Reproduction(
        checks=mechanics(*by_a, *by_d),
        claims=(
            PLACE,
            Claim(
                "the parameter's values from 0 to 50 leave a rhythm",
                None,
                f"were it a (d = 3), the whole numbers {_range_text(a_cycles)} cycle; were it d (a = 2.5), "
                f"{_range_text(d_cycles)}",
            ),
        ),
        unknown=(
            "Which parameter is varied: its symbol is lost. e = 1 and T_r = 0.1 s are printed, and steps of 1 from 0 "
            "to 50, so that it may be the mutual inhibition a or the adaptation d. Both are drawn.",
            *ASSUMED,
        ),
        figure=series([*by_a, *by_d]),
    )


def _cycling(runs: PaperRuns, name: str, values: range) -> list[int]:
    """Return those of ``values`` of a parameter for which the rhythm persists."""
    settings: list[dict[str, Any]] = [{name: float(v)} for v in values]
    found = [rhythm(runs.network(rise_time=0.1, **s)) for s in settings if s[name] > 0]
    return [int(s[name]) for s, f in zip([s for s in settings if s[name] > 0], found, strict=True) if f.oscillates]


def _range_text(values: list[int]) -> str:
    """Return whole numbers as text, a range where they are consecutive."""
    if not values:
        return "none"
    if values == list(range(values[0], values[-1] + 1)) and len(values) > 2:
        return f"{values[0]} to {values[-1]}"
    return ", ".join(map(str, values))


def segments(runs: PaperRuns) -> Reproduction:
    moves = [move(runs, runs.network(), f"{n} segments", segments=n) for n in (15, 30, 60)]
    coarse, fine, finest = (moved.displacement for moved in moves)
    largest = float(np.linalg.norm(finest, axis=1).max())
    apart = float(np.linalg.norm(coarse - fine, axis=1).max()) / largest
    next_apart = float(np.linalg.norm(fine - finest, axis=1).max()) / largest
    figure, ((way, difference),) = figure_grid(1, 2, height=3.6)
    for moved, colour in zip(moves, COLOURS, strict=False):
        way.plot(moved.motion.time, 1e3 * moved.displacement[:, 1], color=colour, linewidth=1.4, label=moved.label)
    time = moves[0].motion.time
    for moved, other, colour in ((moves[0], moves[1], BLUE), (moves[1], moves[2], ORANGE)):
        gap = np.linalg.norm(moved.displacement - other.displacement, axis=1)
        difference.plot(
            time, 100 * gap / largest, color=colour, label=f"{moved.label} against {other.label.split()[0]}"
        )
    way.set_ylabel("tip's displacement across [mm]")
    difference.set_ylabel("difference of the tips [% of the largest]")
    difference.axhline(0, color=GREY, linewidth=0.6)
    for panel in (way, difference):
        panel.set_xlabel("time [s]")
    add_legends(way, difference)
    return Reproduction(
        checks=(Check("tip with 30 segments", "60 segments", next_apart, 0.01), *mechanics(*moves)),
        claims=(
            Claim(
                "15 segments can provide the desired continuous structure",
                apart < 0.02,
                f"the tip with 15 segments is within {apart:.1%} of its largest displacement of that with 30, and that "
                f"within {next_apart:.2%} of that with 60",
            ),
        ),
        unknown=("What the paper compared, and to which accuracy: it only states the outcome.", *ASSUMED),
        figure=figure,
    )
