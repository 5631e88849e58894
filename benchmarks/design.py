"""How long designs take from the command line, and how near a front comes to the closed form, beside NSGA-II.

Writes DESIGN.md beside this file; NSGA-II is pymoo's, and left out where that is not installed.
python benchmarks/design.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from figure import Figure
from machine import conditions
from numpy.typing import NDArray

from ilg_circuit.arrays import one_thread
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate
from ilg_circuit.study.pareto import pareto_front, parse_objectives
from ilg_circuit.study.problem import DesignProblem
from ilg_circuit.study.space import Space, parse_ranges

Array = NDArray[np.float64]

RANGES = ("thickness=0.2mm:1mm", "free_length=15mm:40mm", "voltage=1V:4V", "width=2mm:10mm")
GOALS = ("--require", "displacement_final>=4mm", "--require", "force_blocked>=0.1uN")
CALLS = {
    "best design, least energy": (*GOALS, "--minimise", "energy"),
    "best design, largest margin": GOALS,
    "wishes that cannot be met": (*GOALS, "--require", "settling_time<=60s"),
    "front of displacement and force, 25 points": ("--pareto", "displacement_final,force_blocked"),
    "front of displacement, force and energy, 60 points": ("--pareto", "displacement_final,force_blocked,energy"),
    "Sobol indices of 3 outputs, 6144 designs": (*GOALS, "--minimise", "energy", "--sobol"),
}


def seconds(arguments: tuple[str, ...]) -> float:
    """Wall time of one call in a process of its own, its start included."""
    varied = [word for text in RANGES for word in ("--vary", text)]
    command = [sys.executable, "-m", "ilg_circuit", "design", "paper", *arguments, *varied]
    with tempfile.TemporaryDirectory() as folder:
        begin = perf_counter()
        done = subprocess.run([*command, "--drive", "step:4V", "--duration", "300s"], cwd=folder, capture_output=True)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr.decode())
    return perf_counter() - begin


def shortfall(displacement: Array, force: Array) -> tuple[float, float]:
    """By how much y F^2 of a front misses (3 d0 U)^3 (E w/4)^2, at most and in the median."""
    d0 = PAPER.coupling.static if PAPER.coupling else np.nan
    most = (12 * d0) ** 3 * (PAPER.material.youngs_modulus * 10e-3 / 4) ** 2
    short = np.abs(1 - displacement * force**2 / most)
    return float(short.max()), float(np.median(short))


def fronts() -> list[tuple[str, float, float, float]]:
    """Method, processor seconds, largest and median shortfall, for a static strip."""
    ranges, fixed = parse_ranges(RANGES)
    space = Space(ScenarioTemplate(PAPER, "step:4V", 600.0, beam="static"), ranges, fixed, "exact")
    aims = parse_objectives("displacement_final,force_blocked", space.names)
    quantities = [aim.quantity for aim in aims]
    begin = process_time()
    front = pareto_front(DesignProblem(space, (), aims[0]), aims)
    rows = [("this, 25 points", process_time() - begin, *shortfall(*(front.values[q.name] for q in quantities)))]
    if find_spec("pymoo"):
        for generations in (20, 60, 150):
            begin = process_time()
            found = evolved(lambda x: -np.log(space.evaluate(x, quantities)), len(ranges), generations)
            spent = process_time() - begin
            rows.append((f"NSGA-II, 50 points, {generations} generations", spent, *shortfall(*np.exp(-found).T)))
    return rows


def evolved(function: Callable[[Array], Array], dimension: int, generations: int) -> Array:
    """Costs (k, m) of the front that NSGA-II finds."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Designs(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=dimension, n_obj=2, xl=0.0, xu=1.0)

        def _evaluate(self, x: Array, out: dict[str, Array], *args: object, **kwargs: object) -> None:
            out["F"] = function(x)

    return np.asarray(minimize(Designs(), NSGA2(pop_size=50), ("n_gen", generations), seed=1).F)


def main() -> list[Figure]:
    """Measure and write the page."""
    times = {name: seconds(arguments) for name, arguments in CALLS.items()}
    lines = [
        "# Designs",
        "",
        *conditions(("numpy", "scipy", "SALib"), *(["pymoo " + version("pymoo")] if find_spec("pymoo") else [])),
        "",
        "Times of the command are of a whole process, its start and the simulation by ngspice at the end included.",
        "",
        f"`ilg-circuit design paper` over {', '.join(RANGES)}; step of 4 V, 300 s, dynamic beam:",
        "",
        "| call | wall time |",
        "|---|---|",
        *(f"| {name} | {time:.1f} s |" for name, time in times.items()),
        "",
        "Front of displacement and force of a static strip, exact engine, against y F² = (3 d0 U)³ (E w/4)²:",
        "",
        "| method | processor time | largest shortfall | median |",
        "|---|---|---|---|",
    ]
    with one_thread():
        compared = list(fronts())
    lines += [f"| {name} | {time:.1f} s | {most:.1e} | {median:.1e} |" for name, time, most, median in compared]
    Path(__file__).with_name("DESIGN.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    own, *others = (f"{name}: {most:.1e} in {time:.1f} s" for name, time, most, _ in compared)
    return [
        *(Figure(f"`design`: {name}", f"{time:.1f} s") for name, time in times.items()),
        Figure("front of displacement and force, shortfall from the closed form", own, "; ".join(others)),
    ]


if __name__ == "__main__":
    main()
