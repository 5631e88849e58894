"""Measure the arm beside PyElastica's Cosserat rod in one run; prints a table and writes it to ARM.md.

Both simulate one and the same hanging arm: clamped base, gravity, muscle torques in a travelling wave. PyElastica's time
step is the largest of a ladder that is stable and keeps the tip within `ALLOWED` of the rod's own converged path; the
arm runs at a fixed tolerance that keeps its tip within the same error.
"""

from __future__ import annotations

import math
import os
import platform
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.arm import Activation, Arm, activation, simulate

Array = NDArray[np.float64]

RESULTS = Path(__file__).with_name("ARM.md")
PACKAGES = ("ilg-circuit", "pyelastica", "numba", "numpy")
ELEMENTS = (15, 30, 100)
ROUNDS = 5

LENGTH, RADIUS, DENSITY, MODULUS = 0.3, 0.01, 1000.0, 1e6
GRAVITY = 9.80665
DECAY = 0.5  # 1/s, of velocities: the rod's linear damper; the arm's first mode is damped alike
PERIOD, WAVES, RAMP, CURVATURE = 1.0, 1.0, 0.5, 10.0  # muscle torque: s, waves over the length, s, 1/m at its peak
DURATION = 2.0
SAMPLES = np.linspace(0.0, DURATION, 51)
#: Largest error of the tip's path, relative to the length.
ALLOWED = 1e-3
#: Steps a second that are tried with the rod: from the first on it is stable and accurate enough.
LADDER = tuple(round(250 * 2 ** (k / 4)) * 50 // 50 for k in range(40))
TOLERANCE = 1e-5


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
    times = np.linspace(0.0, DURATION, round(100 * DURATION / PERIOD) + 1)
    middles = (np.arange(elements) + 0.5) * LENGTH / elements
    return arm, activation(arm, times, 0.5 * thickness * wave(times[:, None], middles))


def run_arm(elements: int, tolerance: float) -> tuple[Array, int, float]:
    """The tip's path, the number of steps, and the time it took [s]."""
    arm, drive = the_arm(elements)
    start = perf_counter()
    motion = simulate(arm, drive, SAMPLES, tolerance=tolerance)
    seconds = perf_counter() - start
    steps = next(int(e.text.split()[0]) for e in motion.events if " steps of " in e.text)
    return motion.tip, steps, seconds


def run_rod(elements: int, steps_a_second: int) -> tuple[Array, float]:
    """The tip's path, NaN where the rod is not stable, and the time it took [s], set-up not counted."""
    import elastica as ea

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
