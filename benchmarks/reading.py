"""How long does reading a table take beside numpy's own reader? Processor time of 200,000 rows, the least of three.

python benchmarks/reading.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from figure import Figure

from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read_columns

ROWS = 200_000


def seconds(run: Callable[[], object]) -> float:
    """Return the processor time [s] of a call, the least of three."""

    def once() -> float:
        begin = time.process_time()
        run()
        return time.process_time() - begin

    return min(once() for _ in range(3))


def main() -> list[Figure]:
    """Measure and print."""
    t, y = 0.01 * np.arange(ROWS), np.random.default_rng(3).normal(0, 1, ROWS)
    rows = (f"{a:.2f},{4 * (a > 10)},{6 + b:.6g},{b:.5g}" for a, b in zip(t.tolist(), y.tolist(), strict=True))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "large.csv"
        path.write_text("\n".join(["time_s,voltage_V,current_mA,displacement_mm", *rows]), encoding="utf-8")
        read_columns(path, RECORD)  # the units are looked up once
        ours = seconds(lambda: read_columns(path, RECORD))
        numpys = seconds(lambda: np.loadtxt(path, delimiter=",", skiprows=1))
    told = f"{ours / numpys:.1f} times ({ours:.2f} s and {numpys:.2f} s)"
    print(f"{ROWS} rows of CSV: {told} of numpy.loadtxt")
    return [Figure(f"reading {ROWS} rows of CSV beside numpy.loadtxt", told)]


if __name__ == "__main__":
    main()
