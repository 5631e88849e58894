"""Transfer of the paper's rhythm by the strip's circuit, and the reachable positions. Imports the arm's kernels."""

from __future__ import annotations

import cmath
import math

import numpy as np

from ..arm import strip_arm
from ..arm.coupling import Coupled, couple
from ..arm.reach import reach_target
from ..report.arm import reach_figure
from ..report.axes import GREY
from ..report.panels import COLOURS
from .cpg_motion import ASSUMED, DURATION, move
from .cpg_rhythm import add_legends, figure_grid
from .items import Check, Claim, Reproduction, rows
from .paper_runs import PaperRuns

#: Factor by which the rhythm is slowed -> periods until the initial transient has decayed.
_SLOWER = {1: 150, 10: 25, 100: 6}
#: A target within the disc of the arm's length, as fractions of it.
_TARGET = (2 / 3, 1 / 2)
#: Duration [s] of a motion to it: at least four periods of the rhythm.
_REACH = 6.0


def fundamental(coupled: Coupled, period: float) -> complex:
    """Return the first harmonic of the strain over the last ``period`` [s], relative to the ideal strain's."""
    last = coupled.time >= coupled.time[-1] - period * (1 + 1e-9)
    turning = np.exp(-2j * np.pi * coupled.time[last] / period)
    ideal = coupled.outputs[last, 0] / coupled.run.amplitude * coupled.largest_strain
    made, wanted = (np.trapezoid(w * turning, coupled.time[last]) for w in (coupled.strains[last, 0], ideal))
    return complex(made / wanted)


def circuit(runs: PaperRuns) -> Reproduction:
    two = runs.network(2)
    kept: dict[str, float] = {}
    off, curves = 0.0, []
    for mode in ("circuit", "charge"):
        for slower, periods in _SLOWER.items():
            period = runs.two_period * slower
            coupled = couple(two, 1, periods * period, mode=mode, slower=slower)
            ratio = fundamental(coupled, period)
            kept[f"{mode}_kept_{slower}"] = 100 * abs(ratio)
            kept[f"{mode}_phase_{slower}"] = math.degrees(cmath.phase(ratio))
            scale = coupled.scales[0]
            transfer = cmath.rect(scale.kept, math.radians(scale.phase))
            off = max(off, abs(ratio / transfer - 1))
            if mode == "circuit":
                curves.append((slower, period, coupled))
    ideal, real = (move(runs, runs.network(), mode=mode) for mode in ("ideal", "circuit"))
    figure, ((strains, tips),) = figure_grid(1, 2, height=3.8)
    for (slower, period, coupled), colour in zip(curves, COLOURS, strict=False):
        last = coupled.time >= coupled.time[-1] - 2 * period
        phase = (coupled.time[last] - coupled.time[last][0]) / period
        share = 100 * coupled.strains[last, 0] / coupled.largest_strain
        if slower == 1:
            wanted = 100 * coupled.outputs[last, 0] / coupled.run.amplitude
            strains.plot(phase, wanted, color=GREY, linestyle="--", linewidth=1.2, label="ideal")
        strains.plot(phase, share, color=colour, linewidth=1.5, label=f"period {period:.4g} s")
    strains.set_xlabel("time over the period")
    strains.set_ylabel("free strain [% of that at rest under 4 V]")
    strains.set_ylim(-115, 150)
    for moved, name, colour in ((ideal, "ideal", GREY), (real, "through the circuit", COLOURS[0])):
        size = 1e3 * np.linalg.norm(moved.displacement, axis=1)
        tips.semilogy(moved.motion.time[1:], size[1:], color=colour, linewidth=1.5, label=name)
    tips.set_ylim(1e-5, 2.0)
    tips.set_xlabel("time [s]")
    tips.set_ylabel("tip's displacement [mm]")
    add_legends(strains, tips)
    return Reproduction(
        rows=rows("cpg_circuit", kept),
        checks=(Check("strain by ngspice, over time", "transfer function", off, 1e-3),),
        claims=(
            Claim(
                f"the motion shown for the first {DURATION:g} s",
                False,
                f"cannot have passed through this circuit: it keeps {kept['circuit_kept_1']:.2g} % of the strain, and "
                f"the tip moves by {1e3 * real.largest:.2g} mm in place of {1e3 * ideal.largest:.2g} mm",
            ),
        ),
        unknown=ASSUMED[2:],
        figure=figure,
    )


def reach(runs: PaperRuns) -> Reproduction:
    arm = strip_arm()
    target = (_TARGET[0] * arm.length, _TARGET[1] * arm.length)
    found = reach_target(arm, target, _REACH)
    return Reproduction(
        claims=(
            Claim(
                "the actuator can reach any specified position",
                found.share > 0.99,
                f"the tip passes {1e3 * found.distance:.1f} mm from ({1e3 * target[0]:g}, {1e3 * target[1]:g}) mm, and "
                f"{found.share:.2%} of the disc of the arm's length lies within {1e3 * found.tolerance:g} mm of a "
                f"place that one of {len(found.sample)} motions visits: " + "; ".join(found.reasons),
            ),
        ),
        unknown=("Which positions were tried.", *ASSUMED[2:]),
        figure=reach_figure(found),
    )
