"""Solve by ngspice and by the exact solver, and say how far apart they are.

Differences are relative to the largest value of a waveform, unless said otherwise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.circuit import Netlist
from ilg_circuit.drive import Drive
from ilg_circuit.solve import Waveforms, transient
from ilg_circuit.strip.actuator import PAPER, Actuator

Array = NDArray[np.float64]

AGREEMENT = 1e-7

DRIVES = {
    "step": "step:4V",
    "square": "square:4V,30s",
    "both signs": "square:-4V..4V,23s,0.3",
    "slow sine": "sine:2V,2mHz",
    "sine": "sine:2V,0.1Hz",
    "fast sine": "sine:1V,1.7Hz",
    "ramp": "ramp:20mV/s",
}


def largest_difference(found: Waveforms, expected: Waveforms) -> float:
    """Of all waveforms, each relative to its largest value; one that should be zero must be."""
    difference = np.abs(found.values - expected.values).max(axis=2)
    scale = np.abs(expected.values).max(axis=2)
    assert not difference[scale == 0].any()
    return float((difference[scale > 0] / scale[scale > 0]).max())


def assert_engines_agree(net: Netlist, drive: Drive, times: Array, tolerance: float = AGREEMENT) -> Waveforms:
    solved = transient(net, drive, times)
    assert solved.engine == "ngspice"
    assert solved.errors.max() <= 1e-7
    assert largest_difference(solved, transient(net, drive, times, engine="exact")) <= tolerance
    return solved


def material(**changes: float) -> Actuator:
    return replace(PAPER, material=replace(PAPER.material, **changes))


def geometry(**changes: float) -> Actuator:
    return replace(PAPER, geometry=replace(PAPER.geometry, **changes))
