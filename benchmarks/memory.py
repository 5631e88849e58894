"""Resident memory of this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

WARM_UP = 200


def resident() -> float:
    """Resident set size [MB]; where there is no /proc its peak, which grows alike."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    import resource  # not on Windows

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def growth(run: Callable[[], object], runs: int) -> float:
    """Growth of the resident memory [MB] over ``runs`` runs, after the warm-up."""
    for _ in range(WARM_UP):
        run()
    before = resident()
    for _ in range(runs):
        run()
    return resident() - before
