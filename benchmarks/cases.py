"""What is measured: two circuits under a 4 V step of 300 s, a hundred parameter sets of each, and a noisy record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.circuit import Netlist, electrical_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

#: Error allowed, relative to each output's largest value.
ACCURACY = 1e-6
DRIVE = PiecewiseLinear.step(4.0)
TIMES = np.linspace(0.0, 300.0, 601)
BATCH = 100
#: Every parameter of a batch lies within this part of its nominal value.
SPREAD = 0.2
#: Standard deviation of the record's noise, as a part of the peak current.
NOISE = 2e-3


@dataclass(frozen=True)
class Case:
    """A circuit by name, "rc" or "strip" (the dynamic beam), and the ``outputs`` that count."""

    name: str
    outputs: tuple[str, ...]

    def netlist(self, factors: Array) -> Netlist:
        """The paper's strip with Rdc, Rd and C (their material constants) multiplied by three ``factors``."""
        if self.name == "rc":
            dc, dynamic, capacitance = nominal_parameters() * factors
            return electrical_netlist(float(dc), ((float(dynamic), float(capacitance)),))
        m = PAPER.material
        material = replace(
            m,
            dc_resistivity=m.dc_resistivity * factors[0],
            dynamic_resistivity=m.dynamic_resistivity * factors[1],
            permittivity=m.permittivity * factors[2],
        )
        return strip_netlist(replace(PAPER, material=material))

    @cached_property
    def sets(self) -> Array:
        """Factors of the batch (100, 3); the first set is the nominal one."""
        factors = np.random.default_rng(1).uniform(1 - SPREAD, 1 + SPREAD, (BATCH, 3))
        factors[0] = 1.0
        return factors

    @cached_property
    def netlists(self) -> list[Netlist]:
        """The batch's netlists, the nominal one first."""
        return [self.netlist(factors) for factors in self.sets]

    @cached_property
    def reference(self) -> Array:
        """The exact engine's outputs (100, outputs, 601)."""
        waves = transient(self.netlists, DRIVE, TIMES, engine="exact")
        return waves.values[:, [waves.names.index(name) for name in self.outputs]]

    def error(self, values: Array, member: int = 0) -> float:
        """Largest error of ``values`` (outputs, 601), relative to each output's maximum, for one set of the batch."""
        exact = self.reference[member]
        return float((np.abs(values - exact).max(axis=1) / np.abs(exact).max(axis=1)).max())


@lru_cache
def case(name: str) -> Case:
    """The case of that name, made once a process."""
    return {"rc": Case("rc", ("current", "charge")), "strip": Case("strip", ("current", "displacement"))}[name]


def nominal_parameters() -> Array:
    """Rdc [ohm], Rd [ohm], C [F] of the paper's strip."""
    lumped = lumped_elements(PAPER)
    return np.array([lumped.port.dc_resistance, lumped.port.dynamic_resistance, lumped.port.capacitance])


@lru_cache
def record() -> tuple[Array, Array]:
    """Times [s] and noisy current [A], 600 samples of the step each, for the fit."""
    times = np.arange(600) * 0.5
    current = transient(case("rc").netlists[0], DRIVE, times, engine="exact").output("current")
    noise = np.random.default_rng(7).normal(0.0, NOISE * float(current.max()), len(times))
    return np.asarray(times, dtype=np.float64), current + noise
