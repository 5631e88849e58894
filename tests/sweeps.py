"""Small sweeps, and whether two files of them are equal."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate
from ilg_circuit.study.plan import random_plan
from ilg_circuit.study.spec import SweepSpec

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")
from ilg_circuit.study.dataset import read_sweep

STEP = ScenarioTemplate(PAPER, "step:4V", 300.0)
STATIC = replace(STEP, beam="static")


def spec_of(count: int = 22, engine: str = "exact", **more: Any) -> SweepSpec:
    """The question of ``count`` random designs of the strip under a step."""
    texts = ["thickness=0.3mm:1mm", "free_length=15mm:40mm"]
    return SweepSpec(STATIC, random_plan(texts, count), ("displacement_final", "settling_time"), engine, **more)


def equal(first: Path, second: Path) -> bool:
    """True if two files hold the same sweep."""
    with read_sweep(first) as a, read_sweep(second) as b:
        return bool(a.load().equals(b.load()))
