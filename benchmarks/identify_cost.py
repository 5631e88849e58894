"""What does the command `identify` cost? Processor time and peak memory, its start and its whole folder included.

python benchmarks/identify_cost.py
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from cold_start import command
from figure import Figure

from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, IonBranch
from ilg_circuit.strip.elements import lumped_port

#: A second, slower branch: 24 s.
TWO_BRANCHES = replace(PAPER, material=replace(PAPER.material, further_branches=(IonBranch(60.0, 0.4),)))
#: Charges that grow with the voltage, and that saturate as those of ions with a size do.
GROWING, STERIC = PAPER.with_(capacitance_slope=0.3), PAPER.with_(packing_fraction=0.05)
CASES: dict[str, tuple[Actuator, Drive]] = {
    "step": (TWO_BRANCHES, PiecewiseLinear.step(4.0)),
    "square": (TWO_BRANCHES, PiecewiseLinear.square(0.0, 4.0, 40.0, 300.0)),
    "sine": (TWO_BRANCHES, Sine(4.0, 0.02)),
    "square, growing charge": (GROWING, PiecewiseLinear.square(0.0, 3.0, 40.0, 300.0)),
    "sine, steric charge": (STERIC, Sine(3.0, 0.02)),
}
#: Rows of the step's records.
ROWS = (1_600, 100_000, 1_000_000)
#: Rows before the onset, as a part of the record, and noise relative to the largest value.
REST, NOISE = 0.02, 0.01


def write_record(path: Path, strip: Actuator, drive: Drive, rows: int) -> Path:
    """Write a record of voltage, current and displacement under a drive, with rest and noise."""
    random = np.random.default_rng(3)
    before = int(REST * rows)
    after = np.linspace(0.0, 300.0, rows - before)
    engine = "exact" if lumped_port(strip).linear else "ngspice"
    made = simulate(strip, drive, after, beam="static", engine=engine)

    def noisy(values: np.ndarray, size: float) -> np.ndarray:
        return np.concatenate([np.zeros(before), values]) + size * random.standard_normal(rows)

    time = after[1] * np.arange(rows)
    current = noisy(made.current, NOISE * float(np.abs(made.current).max()))
    moved = noisy(made.displacement, NOISE * float(np.abs(made.displacement).max()))
    table = np.column_stack([time, noisy(made.voltage, 1e-3), 1e3 * current, 1e3 * moved])
    np.savetxt(path, table, "%.9g", ",", header="time_s,voltage_V,current_mA,displacement_mm", comments="")
    return path


def cost(path: Path) -> tuple[float, float]:
    """Return processor time [s] and peak memory [MB] of `identify` of a file."""
    ran = subprocess.Popen(
        [command(), "identify", path.name, "--force"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=path.parent,
    )  # fmt: skip
    _, status, used = os.wait4(ran.pid, 0)
    if status:
        raise SystemExit(f"identify of {path.name} failed")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def main() -> list[Figure]:
    """Measure and print."""
    figures = []
    cases = [(name, ROWS[0]) for name in CASES] + [("step", rows) for rows in ROWS[1:]]
    with tempfile.TemporaryDirectory() as folder:
        for name, rows in cases:
            # in a process of its own: a child's peak memory is at least that of the process that starts it
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
                file = Path(folder) / f"{name.replace(', ', '_').replace(' ', '_')}_{rows}.csv"
                path = fresh.submit(write_record, file, *CASES[name], rows).result()
            seconds, memory = cost(path)
            what = f"`identify` of {rows:,} rows with displacement, {name}, model auto"
            told = f"{seconds:.1f} s of processor time, {memory:.0f} MB"
            print(f"{what}: {told}", flush=True)
            figures.append(Figure(what, told))
    return figures


if __name__ == "__main__":
    main()
