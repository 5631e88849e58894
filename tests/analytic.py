"""Responses to any drive by superposition of the papers' closed forms, written apart from the package's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]


def steps_and_bends(drive: PiecewiseLinear) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """(time, height) of every jump and (time, change of slope) of every bend of a drive that is 0 before t = 0."""
    times, values = drive.times, drive.values
    assert times[0] >= 0
    jumps = [(0.0, values[0])]
    bends = []
    slope = 0.0
    for k in range(len(times) - 1):
        gap, rise = times[k + 1] - times[k], values[k + 1] - values[k]
        if gap == 0:
            jumps.append((times[k], rise))
            continue
        bends.append((times[k], rise / gap - slope))
        slope = rise / gap
    bends.append((times[-1], -slope))
    return jumps, bends


def superposed(drive: Drive, t: Array, kind: str, *constants: float) -> Array:
    """Response of ``formulas.<kind>_step`` and its kin to the drive, at ``t`` [s]."""
    if isinstance(drive, Sine):
        return np.asarray(drive.amplitude * getattr(formulas, f"{kind}_sine")(t, *constants, drive.frequency))
    assert isinstance(drive, PiecewiseLinear)
    jumps, bends = steps_and_bends(drive)
    result = np.zeros(len(t))
    for shape, parts in (("step", jumps), ("ramp", bends)):
        for start, size in parts:
            if size:
                on = t >= start
                result[on] += size * getattr(formulas, f"{kind}_{shape}")(t[on] - start, *constants)
    return result


def current(strip: Actuator, drive: Drive, t: Array) -> Array:
    """Current of a strip that reflects nothing, one branch or Re = 0."""
    lumped = lumped_elements(strip)
    total = np.zeros(len(t))
    for k, (r, c) in enumerate(lumped.port.branches):
        a0, a1, rate = formulas.current_constants(lumped.port.dc_resistance, r, c, lumped.port.electrode_resistance)
        total += superposed(drive, t, "current", 0.0 if k else a0, a1, rate)
    return total


def displacement(strip: Actuator, drive: Drive, t: Array) -> Array:
    """Free displacement of the massless strip, Re = 0."""
    lumped, k = lumped_elements(strip), strip.coupling
    assert k is not None
    return superposed(
        drive, t, "displacement", k.gain, k.zero, k.damping_ratio, k.natural_frequency, lumped.bending_ratio
    )


def charge(strip: Actuator, drive: Drive, t: Array) -> Array:
    """Charge on the capacitors, Re = 0: each branch's share of the current, less what it was, over its pole."""
    lumped = lumped_elements(strip)
    u = drive.value(t)
    total = np.zeros(len(t))
    for r, c in lumped.port.branches:
        branch_current = superposed(drive, t, "current", 0.0, 1 / r, 1 / (r * c))
        total += c * (u - r * branch_current)
    return total
