"""How long sweeps take: random designs of the full electromechanical circuit, by both engines, on one and two cores.

Writes SWEEP.md beside this file. python benchmarks/sweep.py [--designs 10000]
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from figure import Figure

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate
from ilg_circuit.study.dataset import read_sweep
from ilg_circuit.study.outputs import DEFAULT_OUTPUTS
from ilg_circuit.study.plan import random_plan
from ilg_circuit.study.spec import SweepSpec
from ilg_circuit.study.sweep import solve_sweep

RANGES = ("thickness=0.2mm:1mm", "free_length=15mm:40mm", "width=2mm:10mm", "youngs_modulus=5kPa:50kPa")
ACCURACY = 1e-5
TIMES = ("time_of_peak", "time_of_90", "settling_time", "overshoot")


@dataclass(frozen=True)
class Measured:
    engine: str
    jobs: int
    wall: float
    processor: float


def measure(engine: str, jobs: int, designs: int, path: Path) -> Measured:
    """Seconds of one sweep, from the start of its workers to its file."""
    spec = SweepSpec(
        ScenarioTemplate(PAPER, "step:4V", 300.0), random_plan(RANGES, designs), DEFAULT_OUTPUTS, engine, ACCURACY
    )
    used = processor_time()
    begin = perf_counter()
    done = solve_sweep(spec, path, jobs=jobs)
    wall = perf_counter() - begin
    if done.totals.failed:
        raise SystemExit(f"{done.totals.failed} designs failed")
    return Measured(engine, jobs, wall, processor_time() - used)


def processor_time() -> float:
    """Processor seconds of this process and of those that it has waited for."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in spent)


def largest_difference(first: Path, second: Path) -> tuple[float, str]:
    """Largest relative difference of the engines over all outputs but times, and that output's name."""
    with read_sweep(first) as a, read_sweep(second) as b:
        differences = {}
        for name in set(DEFAULT_OUTPUTS) - set(TIMES):
            scale = np.abs(a[name].values)
            known = scale > 0
            if known.any():
                differences[name] = float((np.abs(b[name].values - a[name].values)[known] / scale[known]).max())
    name = max(differences, key=lambda n: differences[n])
    return differences[name], name


def main() -> list[Figure]:
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=10_000)
    designs = parser.parse_args().designs
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        files = {engine: Path(folder) / f"{engine}.nc" for engine in ("exact", "ngspice")}
        rows = [measure(engine, jobs, designs, path) for engine, path in files.items() for jobs in (1, 2)]
        difference, name = largest_difference(*files.values())
    lines = [
        "# Sweeps",
        "",
        f"{designs} random designs of the `paper` strip's full electromechanical circuit (dynamic beam, free tip,",
        f"4 V for 300 s) over {', '.join(RANGES)};",
        f"{len(DEFAULT_OUTPUTS)} outputs each, ngspice at {ACCURACY:g} of each maximum.",
        "Start of the workers and writing of the file included. Remade by `python benchmarks/sweep.py`.",
        "",
        "| engine | processes | wall time | processor time | a design | efficiency, wall | efficiency, processor |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        one = next(r for r in rows if r.engine == row.engine and r.jobs == 1)
        lines.append(
            f"| {row.engine} | {row.jobs} | {row.wall:.1f} s | {row.processor:.1f} s | "
            f"{1e3 * row.processor / designs:.2f} ms | {one.wall / row.jobs / row.wall:.0%} | "
            f"{one.processor / row.processor:.0%} |"
        )
    lines += [
        "",
        f"The engines differ by at most {difference:.1e} ({name}), relative to each value, over all designs and all",
        "outputs but times and overshoot.",
        "Efficiency is the wall time of one process over that of n processes times n; in processor time, which other",
        "work on the machine does not lengthen, that of one process over that of n together.",
        f"When it began, {load:.1f} processes of other work ran on the machine's cores.",
        "",
        f"{platform.platform()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}",
    ]
    text = "\n".join(lines) + "\n"
    (Path(__file__).parent / "SWEEP.md").write_text(text, encoding="utf-8")
    print(text)
    return [
        Figure(
            f"{designs} designs of the full circuit by {row.engine}, processes: {row.jobs}",
            f"{row.wall:.1f} s, {1e3 * row.processor / designs:.2f} ms a design",
        )
        for row in rows
    ]


if __name__ == "__main__":
    main()
