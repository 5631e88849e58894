"""A strip of every electrical model, and its port equations EC (17) solved by hand at every frequency."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.circuit import Load
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.models import Ladders, electrical_model, model_names
from ilg_circuit.strip.port import Port

Complex = NDArray[np.complex128]

#: Every model of the registry, and one with several additions; of two laws of charge one branch stands for all.
MODELS = (*(m for m in model_names() if not re.fullmatch("rc[23].(saturating|steric)", m)), "rc2+growing+sinh")

VALUES = {
    "dc_resistance": 600.0,
    "dynamic_resistance": 20.0,
    "capacitance": 0.35,
    "resistance_1": 30.0,
    "capacitance_1": 0.1,
    "resistance_2": 50.0,
    "capacitance_2": 0.3,
    "resistance_3": 120.0,
    "capacitance_3": 0.6,
    "series_resistance": 15.0,
    "warburg_resistance": 60.0,
    "diffusion_time": 20.0,
    "cpe_coefficient": 0.2,
    "cpe_exponent": 0.75,
    "interface_resistance": 12.0,
    "interface_time": 0.3,
    "interface_exponent": 0.8,
    "diffusion_exponent": 0.46,
    "emission_voltage": 0.8,
    "inductance": 0.02,
    "capacitance_slope": 0.3,
    "saturation_voltage": 3.0,
    "packing_fraction": 0.05,
}


def values_of(model: str) -> list[float]:
    return [VALUES[name] for name in electrical_model(model).names]


def port_of(model: str, electrode_resistance: float = 0.0, **ladders: Any) -> Port:
    return electrical_model(model).port(values_of(model), electrode_resistance, Ladders(**ladders))


def strip_of(model: str, electrode_resistance: float = 0.0, base: Actuator = PAPER, **ladders: Any) -> Actuator:
    """The paper's strip with another electrical side."""
    port = port_of(model, electrode_resistance, **ladders)
    made = Actuator.from_port(base.geometry, port, base=base.material, coupling=base.coupling)
    return replace(made, name=model, mounting=base.mounting)


def strongly_coupled(strip: Actuator) -> Actuator:
    """A strip whose motion acts back on its current, unlike the paper's (there by 1e-10)."""
    k = strip.coupling
    assert k is not None
    return replace(
        strip,
        material=replace(strip.material, youngs_modulus=1e9),
        coupling=replace(k, gain=100 * k.gain),
    )


def ion_impedance(port: Port, s: Complex) -> Complex:
    """Zp near 0 V from the elements, a ladder's as they stand in it."""
    if port.ladder is None:
        return np.asarray(1 / sum(1 / (r + 1 / (c * s)) for r, c in port.branches))
    ladder = port.ladder
    relaxing = sum(1 / (1 / r + c * s) for r, c in ladder.sections)
    return np.asarray(port.series_resistance + ladder.resistance + relaxing + 1 / (ladder.capacitance * s))


class PortEquations:
    """What EC (17) says of a strip with the given port at ``s``; positive towards the anode, hence N for EC's -N."""

    def __init__(self, strip: Actuator, port: Port, s: Complex) -> None:
        g, m, k = strip.geometry, strip.material, strip.coupling
        assert k is not None
        self.s, self.rdc = s, port.dc_resistance
        self.re = port.electrode_resistance + port.inductance * s  # all that is in series with the port
        lf = g.load_distance
        bending = m.youngs_modulus * g.width * g.thickness**3 / 12
        stiffness = 3 * (bending if m.bending_stiffness is None else m.bending_stiffness) / lf**3
        mass = 3 * g.free_length**4 * m.density * g.width * g.thickness / (lf**3 * 1.875104068711961**4)
        self.zp = ion_impedance(port, s)
        d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
        self.ratio = 3 * lf**2 / g.thickness**2
        self.static = k.gain * k.zero / k.natural_frequency**2
        # the filter's node voltages against its output
        self.filter = 1 + k.natural_frequency / (2 * k.damping_ratio * k.zero)
        self.n = self.ratio * d * s * self.zp
        self.z1 = stiffness / s
        self.z2 = mass * s + 2 * m.beam_damping_ratio * np.sqrt(stiffness * mass)

    def driven(self, tip: str, beam: str, load: Load) -> dict[str, Complex]:
        """Outputs per volt of the source, and the rounding of those that are small differences."""
        zl = load.mass * self.s + load.damping + load.stiffness / self.s
        z_tip = np.full_like(self.s, np.inf) if tip == "clamped" else self.z2 + zl
        moves = 0.0 if tip == "clamped" else 1.0
        share = 1.0 if tip == "clamped" else z_tip / (self.z1 + z_tip)
        if beam == "static":
            share = np.ones_like(self.s) * (1 - moves)
        reflected = 0.0 if beam == "static" else self.n**2 * self.z1 * share
        admittance = 1 / self.rdc + 1 / (self.zp + reflected)
        u = 1 / (1 + self.re * admittance)
        i1 = u / (self.zp + reflected)
        v = moves * self.n * i1 * (1 - share)
        free = np.abs(self.n * i1 / self.s)
        return {
            "current": admittance * u,
            "charge": i1 / self.s,
            "displacement": v / self.s,
            "force": zl * v if moves else self.n * i1 * self.z1,
            "rounding": 1e-11 * free + 1e-14 * self.ratio * self.static * self.filter,
            # a load's share of a clamped tip's force
            "rounding of force": 1e-12 * np.abs(self.n * i1 * self.z1),
        }

    def moved(self, terminals: str) -> dict[str, Complex]:
        """Outputs per metre of imposed motion."""
        outer = self.rdc * self.re / (self.rdc + self.re) if terminals == "short" else self.rdc
        i1 = self.n * self.z1 * self.s / (outer + self.zp + self.n**2 * self.z1)
        answer = (
            {"voltage": -self.rdc * i1} if terminals == "open" else {"current": i1 * self.rdc / (self.rdc + self.re)}
        )
        return answer | {"charge": i1 / self.s, "force": self.z1 * (self.n * i1 - self.s)}
