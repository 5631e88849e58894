"""A source of current that does not step as the voltage is read: its jumps lie anywhere between two readings."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import ilg_circuit as ilg
from ilg_circuit.identification import Identification
from ilg_circuit.simulation.response import Response
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

PORT = lumped_elements(PAPER).port
TRUTH = {
    "dc_resistance": PORT.dc_resistance,
    "dynamic_resistance": PORT.branches[0][0],
    "capacitance": PORT.branches[0][1],
}
MOVED = {
    f"coupling_{name}": getattr(PAPER.coupling, name) for name in ("gain", "zero", "damping_ratio", "natural_frequency")
}


def solved(drive: str) -> Response:
    return ilg.simulate("paper", drive, "100 s", step="10 ms", engine="exact", beam="static")


def readings(run: Response, later: float, seed: int, *, moves: bool) -> dict[str, NDArray[np.float64]]:
    """Every 0.5 s, ``later`` [s] than the source's steps: voltage with 0.1 %, displacement with 0.5 % of noise."""
    random = np.random.default_rng(seed)
    since = np.arange(0.0, 99.0, 0.5)
    at = np.searchsorted(run.time, since + later - 1e-9)
    rest = np.arange(-10.0, 0.0, 0.5)
    columns = {"time_s": np.append(rest, since) + 10.0}
    for header, values, noise in (
        ("voltage_V", run.voltage, 1e-3),
        ("current_A", run.current, 0.0),
        ("displacement_m", run.displacement, 5e-3),
    ):
        read = np.append(np.zeros(len(rest)), values[at])
        columns[header] = read + noise * np.ptp(read) * random.standard_normal(len(read))
    return columns if moves else {name: values for name, values in columns.items() if name != "displacement_m"}


def away(fit: Identification, truths: dict[str, float]) -> dict[str, float]:
    """Return the distances of estimates from the truth, in standard errors."""
    return {name: (fit[name].value - truth) / (fit[name].stderr or np.nan) for name, truth in truths.items()}


@pytest.mark.parametrize("drive", ["square:5mA,20s", "square:5mA,2.65s", "pulse:10mA,5s,20s"])
def test_the_circuit(drive: str) -> None:
    run = solved(drive)
    for seed in range(4):
        later = float(np.random.default_rng(seed + 50).uniform(0.0, 0.5))
        fit = ilg.identify(readings(run, later, seed, moves=False), PAPER, model="rc", engine="exact")
        assert fit.success
        assert "current-controlled" in {finding.code for finding in fit.findings}
        assert max(np.abs(list(away(fit, TRUTH).values()))) < 3


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_what_a_displacement_decides_it_decides_where_the_current_jumps(seed: int) -> None:
    """In the middle of the intervals the motion seems to drift, more than its rest allows."""
    run = solved("square:-5mA..5mA,10s")
    data = readings(run, 0.043, seed, moves=True)
    fit = ilg.identify(data, PAPER, model="rc", engine="exact", coupling="ec31")
    assert max(np.abs(list(away(fit, TRUTH | MOVED).values()))) < 3
    assert not fit["displacement_drift"].fixed_because
