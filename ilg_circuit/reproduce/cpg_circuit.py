"""Computes the transfer of the rhythm by the strip's circuit, and the reachable positions; needs the arm's kernels."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np

from ..arms import strip_arm
from ..arms.coupling import Coupled, couple
from ..arms.reach import reach_target
from ..report.arm import reach_figure
from ..report.axes import COLOURS, GREY, grid
from .cpg_motion import move
from .cpg_rhythm import add_legends
from .items import Check, Reproduction, rows
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
    kept: dict[str, float] = {}
    off, curves = 0.0, []
    for mode, (slower, periods) in itertools.product(("circuit", "charge"), _SLOWER.items()):
        period = runs.two_period * slower
        coupled = couple(runs.network(2), 1, periods * period, mode=mode, slower=slower)
        ratio = fundamental(coupled, period)
        kept[f"{mode}_kept_{slower}"] = 100 * abs(ratio)
        kept[f"{mode}_phase_{slower}"] = math.degrees(cmath.phase(ratio))
        scale = coupled.scales[0]
        off = max(off, abs(ratio / cmath.rect(scale.kept, math.radians(scale.phase)) - 1))
        if mode == "circuit":
            curves.append((period, coupled))
    ideal, real = (move(runs, runs.network(), mode=mode) for mode in ("ideal", "circuit"))
    figure, ((strains, tips),) = grid(1, 2, (11.0, 3.8))
    for number, ((period, coupled), colour) in enumerate(zip(curves, COLOURS, strict=False)):
        last = coupled.time >= coupled.time[-1] - 2 * period
        phase = (coupled.time[last] - coupled.time[last][0]) / period
        if number == 0:
            wanted = 100 * coupled.outputs[last, 0] / coupled.run.amplitude
            strains.plot(phase, wanted, color=GREY, linestyle="--", linewidth=1.2, label="ideal")
        share = 100 * coupled.strains[last, 0] / coupled.largest_strain
        strains.plot(phase, share, color=colour, linewidth=1.5, label=f"period {period:.4g} s")
    strains.set(xlabel="time over the period", ylabel="free strain [% of that at rest under 4 V]", ylim=(-115, 150))
    for moved, name, colour in ((ideal, "ideal", GREY), (real, "through the circuit", COLOURS[0])):
        size = 1e3 * np.linalg.norm(moved.displacement, axis=1)
        tips.semilogy(moved.motion.time[1:], size[1:], color=colour, linewidth=1.5, label=name)
    tips.set(xlabel="time [s]", ylabel="tip's displacement [mm]", ylim=(1e-5, 2.0))
    add_legends(figure)
    return Reproduction(
        rows=rows("cpg_circuit", kept),
        checks=(Check("strain by ngspice, over time", "transfer function", off, 1e-3),),
        holds=(False,),
        numbers=kept | {"ideal": 1e3 * ideal.largest, "real": 1e3 * real.largest},
        figure=figure,
    )


def reach(runs: PaperRuns) -> Reproduction:
    arm = strip_arm()
    x, y = (share * arm.length for share in _TARGET)
    found = reach_target(arm, (x, y), _REACH)
    return Reproduction(
        holds=(found.everywhere,),
        numbers={
            "distance": 1e3 * found.distance,
            "x": 1e3 * x,
            "y": 1e3 * y,
            "share": found.share,
            "tolerance": 1e3 * found.tolerance,
            "motions": len(found.sample),
            "reasons": "; ".join(found.reasons),
        },
        figure=reach_figure(found),
    )
