"""Measure the arm beside PyElastica's Cosserat rod in one run; prints a table and writes it to ARM.md.

Both simulate one and the same hanging arm: clamped base, gravity, muscle torques in a travelling wave. PyElastica's
time step is the largest of a ladder that is stable and keeps the tip within `ALLOWED` of the rod's own path at a fourth
of that step; the arm runs at a fixed tolerance, its error is against its own path at a thousandth of it.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from figure import Figure
from machine import conditions
from numpy.typing import NDArray

from ilg_circuit.arms import Activation, Arm, activation, simulate

Array = NDArray[np.float64]

RESULTS = Path(__file__).with_name("ARM.md")
PACKAGES = ("ilg-circuit", "pyelastica", "numba", "numpy")
ELEMENTS = (15, 30, 100)
ROUNDS = 5

LENGTH, RADIUS, DENSITY, MODULUS = 0.3, 0.01, 1000.0, 1e6
GRAVITY = 9.80665
DECAY = 1.0  # 1/s, of velocities: the rod's linear damper; the arm's first mode is damped alike
PERIOD, WAVES, RAMP, CURVATURE = 1.035463, 1.0, 0.5, 10.0  # muscle torque: s, waves over the length, s, 1/m at its peak
DURATION = 2.0
SAMPLES = np.linspace(0.0, DURATION, 51)
#: Largest error of the tip's path, relative to the length.
ALLOWED = 1e-3
#: Steps a second that are tried with the rod.
LADDER = tuple(25 * round(40 * 2 ** (k / 4)) for k in range(24))
TOLERANCE = 1e-3
#: A process that has nothing compiled, and one that finds it on disk.
FIRST_RUN = "import sys, time; sys.path.insert(0, sys.argv[1]); import arm; print(arm.run_arm(15, arm.TOLERANCE)[2])"


@dataclass(frozen=True)
class Row:
    """Figures for one number of elements: seconds of wall time a simulated second, and errors of the tip."""

    elements: int
    rod: float
    arm: float
    rod_error: float
    arm_error: float
    rod_steps: int
    arm_steps: int
    apart: float


def wave(time: Array, place: Array) -> Array:
    """Muscle curvature [1/m] at times (t, 1) and places (n,), both in SI."""
    ramp = np.minimum(1.0, time / RAMP)
    return CURVATURE * ramp * np.sin(2 * np.pi * (time / PERIOD + WAVES * place / LENGTH))


def the_arm(elements: int) -> tuple[Arm, Activation]:
    """Our arm: the rectangle of the round rod's area and second moment."""
    thickness = math.sqrt(3) * RADIUS
    arm = Arm(
        length=LENGTH,
        thickness=thickness,
        depth=math.pi * RADIUS / math.sqrt(3),
        density=DENSITY,
        youngs_modulus=MODULUS,
        segments=elements,
        gravity=(0.0, -GRAVITY),
        direction=-math.pi / 2,
    )
    arm = replace(arm, damping=DECAY / arm.first_frequency**2)
    times = np.linspace(0.0, DURATION, round(400 * DURATION / PERIOD) + 1)
    middles = (np.arange(elements) + 0.5) * LENGTH / elements
    return arm, activation(arm, times, 0.5 * thickness * wave(times[:, None], middles))


def run_arm(elements: int, tolerance: float) -> tuple[Array, int, float]:
    """The tip's path, the number of steps, and the time it took [s]."""
    arm, drive = the_arm(elements)
    start = perf_counter()
    motion = simulate(arm, drive, SAMPLES, tolerance=tolerance)
    seconds = perf_counter() - start
    steps = next(e.finding.values["steps"] for e in motion.events if e.finding.code == "arm-steps")
    return motion.tip, steps, seconds


def run_rod(elements: int, steps_a_second: int) -> tuple[Array, float]:
    """The tip's path, NaN where the rod is not stable, and the time it took [s], set-up not counted."""
    import elastica as ea  # untyped: to mypy its classes are Any, from which a strict class may not derive

    class Muscles(ea.MuscleTorques):  # type: ignore[misc]
        """The library's travelling wave with an amplitude."""

        def __init__(self, *, amplitude: float, **rest: object) -> None:
            super().__init__(**rest)
            self.my_spline *= amplitude

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
        """What a user of the library composes."""

    per_sample = max(1, round(steps_a_second * DURATION / (len(SAMPLES) - 1)))
    step = DURATION / (len(SAMPLES) - 1) / per_sample
    simulator = Simulator()
    down, out = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    rod = ea.CosseratRod.straight_rod(elements, np.zeros(3), down, out, LENGTH, RADIUS, DENSITY, youngs_modulus=MODULUS)
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=GRAVITY * down)
    number = 2 * np.pi * WAVES
    simulator.add_forcing_to(rod).using(
        Muscles,
        amplitude=MODULUS * np.pi / 4 * RADIUS**4 * CURVATURE,
        base_length=LENGTH,
        b_coeff=np.empty(0),
        period=PERIOD,
        wave_number=number,
        phase_shift=number,  # the library runs the wave from the tip: its place is 1 - x/L
        direction=out,
        rest_lengths=rod.rest_lengths,
        ramp_up_time=RAMP,
    )
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=DECAY, time_step=step)
    simulator.finalize()
    stepper = ea.PositionVerlet()
    time, tips = np.float64(0.0), [rod.position_collection[:2, -1].copy()]
    seconds = 0.0
    for _ in SAMPLES[1:]:
        start = perf_counter()
        for _ in range(per_sample):
            time = stepper.step(simulator, time, step)
        seconds += perf_counter() - start
        tips.append(rod.position_collection[:2, -1].copy())
        if not np.isfinite(tips[-1]).all() or np.abs(tips[-1]).max() > 2 * LENGTH:
            return np.full((len(SAMPLES), 2), np.nan), seconds
    return np.array(tips), seconds


def tip_error(path: Array, reference: Array) -> float:
    """Largest distance of two tip paths, relative to the length."""
    return float(np.linalg.norm(path - reference, axis=1).max()) / LENGTH


def tune_rod(elements: int) -> tuple[int, Array, float]:
    """Fewest steps a second of the ladder that reach `ALLOWED`, the path and its error."""
    for steps in LADDER:
        path, _ = run_rod(elements, steps)
        if np.isfinite(path).all():
            error = tip_error(path, run_rod(elements, 4 * steps)[0])
            if error <= ALLOWED:
                return steps, path, error
    raise SystemExit(f"the rod with {elements} elements reaches {ALLOWED:g} with none of {LADDER} steps a second")


def measure(elements: int) -> Row:
    """Both ways, taking turns."""
    steps, path, rod_error = tune_rod(elements)
    ours, arm_steps, _ = run_arm(elements, TOLERANCE)
    arm_error = tip_error(ours, run_arm(elements, TOLERANCE / 1000)[0])
    rod_times, arm_times = [], []
    for _ in range(ROUNDS):
        rod_times.append(run_rod(elements, steps)[1])
        arm_times.append(run_arm(elements, TOLERANCE)[2])
    return Row(
        elements=elements,
        rod=median(rod_times) / DURATION,
        arm=median(arm_times) / DURATION,
        rod_error=rod_error,
        arm_error=arm_error,
        rod_steps=steps,
        arm_steps=round(arm_steps / DURATION),
        apart=tip_error(path, ours),
    )


def compile_times() -> tuple[float, float]:
    """Wall seconds of the first run of 15 segments in a process with an empty cache, and in the next process."""
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            done = subprocess.run(
                [sys.executable, "-c", FIRST_RUN, str(Path(__file__).parent)],
                env=os.environ | {"NUMBA_CACHE_DIR": folder},
                check=True,
                capture_output=True,
                text=True,
            )
            seconds.append(float(done.stdout.split()[-1]))
    return seconds[0], seconds[1]


def markdown(rows: list[Row], compiled: tuple[float, float], took: float) -> str:
    """The page: conditions, table, notes."""
    lines = [
        "# The arm beside PyElastica",
        "",
        "Written by `python benchmarks/arm.py` (`pip install '.[bench]'`).",
        "",
        *conditions(PACKAGES),
        "",
        "| elements | PyElastica, s/s | steps/s | error | ilg_circuit, s/s | steps/s | error | ratio | tips apart |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        cells = (
            str(r.elements),
            f"{r.rod:.4f}",
            str(r.rod_steps),
            f"{r.rod_error:.1e}",
            f"{r.arm:.4f}",
            str(r.arm_steps),
            f"{r.arm_error:.1e}",
            f"{r.rod / r.arm:.1f}",
            f"{r.apart:.1%}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    notes = [
        "s/s: seconds of wall time for a simulated second, the median of "
        f"{ROUNDS} runs of {DURATION:g} s that take turns; set-up of the rod, start of the arm's run included.",
        f"A hanging arm, {LENGTH:g} m long, {2e3 * RADIUS:g} mm across, {MODULUS:.0e} Pa; a muscle torque of the "
        f"curvature {CURVATURE:g}/m in a wave of {PERIOD:g} s. The rod's section is round, the arm's a rectangle of "
        "the same area and second moment. The first mode is damped alike, higher ones by each model's law: the rod's "
        "damper slows every velocity, the arm's material loss (Kelvin-Voigt) takes more from fast modes.",
        "Errors: of the tip's path, relative to the length, from each way's own refined solution of as many elements.",
        f"PyElastica's step is the largest of a ladder (factor 1.19) that is stable and errs by {ALLOWED:g} at most; "
        "the search is not counted. It is a three-dimensional rod with shear, stretch and twist; the arm is plane, "
        "its cells keep their area. The first element of the rod is clamped as a whole, so that its free length is "
        "shorter by an element: part of the distance between the tips.",
        f"The arm ran at the tolerance {TOLERANCE:g}; the implicit method was chosen by itself.",
        f"numba: the first run of 15 segments takes {compiled[0]:.1f} s in a process that has to compile, "
        f"{compiled[1]:.2f} s in the next one, which loads the result from disk. None of it is in the table.",
        f"Whole run: {took:.0f} s.",
    ]
    return "\n".join([*lines, "", *(f"- {note}" for note in notes), ""])


def main() -> list[Figure]:
    """Measure, print and write the table."""
    start = perf_counter()
    run_arm(15, TOLERANCE), run_rod(15, 8000)  # everything compiled and loaded
    rows = [measure(elements) for elements in ELEMENTS]
    page = markdown(rows, compile_times(), perf_counter() - start)
    RESULTS.write_text(page, encoding="utf-8")
    print(page)
    return [
        Figure(
            f"an arm of {r.elements} segments, wall time a simulated second",
            f"{1e3 * r.arm:.1f} ms",
            f"PyElastica: {1e3 * r.rod:.1f} ms, {r.rod / r.arm:.1f} times",
        )
        for r in rows
    ]


if __name__ == "__main__":
    main()
