"""Wall time of the command line from nothing: interpreter, imports and work."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

REPEATS = 5


def time_help() -> float:
    """Seconds of ``ilg-circuit --help``."""
    return _median([command(), "--help"])


def time_simulate() -> float:
    """Seconds of a whole simulation of the paper's strip, its CSV file written."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "run.csv")
        return _median([command(), "simulate", "paper", "--drive", "step:4V", "--duration", "300s", "--out", out])


def command() -> str:
    """The program beside this Python."""
    beside = shutil.which("ilg-circuit", path=str(Path(sys.executable).parent))
    if not beside:
        raise SystemExit("ilg-circuit is not installed beside this Python; run `make setup` first")
    return beside


def _median(command: list[str]) -> float:
    seconds = []
    for _ in range(REPEATS):
        start = perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        seconds.append(perf_counter() - start)
    return median(seconds)
