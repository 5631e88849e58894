"""Whether voltage or current was controlled is told from the readings, whatever the drive, its sampling, the noise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.measurements.forced import forces_current
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.response import Response

VOLTAGES = [
    *("step:2V", "square:2V,20s", "square:-2V..2V,10s", "square:-2V..2V,2.65s", "square:2V,2.1s", "triangle:2V,30s"),
    *("triangle:-2V..2V,8s", "sine:2V,0.05Hz", "sine:1V,0.3Hz", "cv:-1V..1V,50mV/s", "pulse:4V,1s,10s"),
    *("chirp:1V,0.01Hz..0.5Hz", "multisine:1V,0.01Hz..0.5Hz"),
]
#: Currents, and the largest noise of both readings, as a fraction of their spans, at which they are told.
CURRENTS = {
    "step:3mA": 1e-2,
    "square:5mA,20s": 1e-2,
    "square:-5mA..5mA,10s": 1e-2,
    "square:5mA,2.65s": 1e-3,
    "pulse:10mA,5s,20s": 1e-2,
    "pulse:10mA,1s,10s": 1e-3,
    "triangle:3mA,30s": 0.0,
    "cv:-5mA..5mA,0.2mA/s": 1e-3,
}


@cache
def answer(drive: str) -> Response:
    return ilg.simulate("paper", drive, "100 s", step="10 ms", engine="exact", beam="static")


def readings(drive: str, interval: float, noise: float, seed: int) -> Table:
    """Readings from 10 s before the drive on, by an instrument that does not step as it samples."""
    run, random = answer(drive), np.random.default_rng(seed)
    begin = random.uniform(0.0, interval)
    later = np.arange(begin, 99.0, interval)
    t = np.concatenate([np.arange(begin - 10.0, 0.0, interval), later])
    at = np.searchsorted(run.time, later)
    columns = {"time": t + 10.0}
    for name in ("voltage", "current"):
        values = np.append(np.zeros(len(t) - len(later)), getattr(run, name)[at])
        columns[name] = values + noise * np.ptp(values) * random.standard_normal(len(values))
    return Table(columns)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("interval", [0.1, 0.5, 2.0, 8.0])
@pytest.mark.parametrize("drive", VOLTAGES)
def test_a_controlled_voltage(drive: str, interval: float, noise: float) -> None:
    assert not any(forces_current(readings(drive, interval, noise, seed)) for seed in range(4))


@pytest.mark.parametrize("part", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("drive", CURRENTS)
def test_a_controlled_current(drive: str, part: float) -> None:
    assert all(forces_current(readings(drive, 0.5, part * CURRENTS[drive], seed)) for seed in range(4))


@pytest.mark.parametrize("drive", ["triangle:2V,30s", "sine:2V,0.05Hz", "square:2V,20s", "cv:-1V..1V,50mV/s"])
def test_an_open_circuit_s_offset_is_no_controlled_current(drive: str) -> None:
    read = readings(drive, 0.5, 1e-3, 0)
    offset = 5e-6 + 1e-7 * np.random.default_rng(1).standard_normal(len(read.time))
    assert not forces_current(Table({**read.columns, "current": offset}))


def test_one_level_of_current_from_the_first_reading_on_is_controlled() -> None:
    run = answer("step:3mA")
    random, columns = np.random.default_rng(2), {"time": run.time[::50]}
    for name, noise in (("voltage", 1e-3), ("current", 1e-6)):
        columns[name] = getattr(run, name)[::50] + noise * random.standard_normal(len(columns["time"]))
    assert forces_current(Table(columns))
