"""What every page of results begins with: date, machine, how busy it is, versions."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version


def conditions(packages: Sequence[str], *further: str) -> list[str]:
    """Two lines: when and where, and versions of Python, ``packages`` and what is ``further`` told."""
    versions = ", ".join([*(f"{name} {version(name)}" for name in packages), *further])
    return [
        f"{datetime.now(UTC):%Y-%m-%d}; {platform.system()} {platform.machine()}, {os.cpu_count()} cores{load()}.",
        f"Python {platform.python_version()}, {versions}.",
    ]


def load(when: str = "now") -> str:
    """How busy the machine is, where it can tell: times of a busy one are no good."""
    return f", load average {os.getloadavg()[0]:.1f} {when}" if hasattr(os, "getloadavg") else ""
