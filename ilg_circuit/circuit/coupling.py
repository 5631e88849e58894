"""The coupling d(s) of a strip as elements: a filter driven by the voltage across the ion path. EC (31).

`Transducer` is what a strip's netlist asks of its coupling, whatever the kind: `SecondOrder` is that of EC (31).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from ..strip.actuator import Coupling
from ..strip.elements import Elements
from ..strip.port import Port
from .load import FORCE_SCALE, VELOCITY_SCALE
from .netlist import GROUND, Element, Role
from .port import ion_path, port_node

#: The reflected voltage, in series with the ion path.
BACK = Element("Eback", ("back", GROUND, "copy", GROUND), 1.0, role=Role.REFLECTED_VOLTAGE)


class Transducer(ABC):
    """The coupling of a strip as elements. ``lumped`` are the strip's values, which have a coupling."""

    lumped: Elements

    @abstractmethod
    def filter(self, end: str, inner: float = 0.0) -> list[Element]:
        """Return the filter that is driven by the ion path between the port's node and ``end``.

        It starts at rest under ``inner`` [V] behind Re.
        """

    @abstractmethod
    def cell(self, port: Port, suffix: str, top: str, end: str) -> tuple[list[Element], dict[str, float]]:
        """Return the filter of one cell of a line, and D(s) x in it [m] as coefficients of node voltages.

        ``port`` is the cell's share, whose ion path lies between ``top`` and ``end``, and has the ``suffix``.
        """

    @abstractmethod
    def driven(self, name: str = "d") -> str:
        """Return the node of x, of odd and even parts where there are any, that drives the filter ``name``."""

    @abstractmethod
    def averaged(self) -> list[Element]:
        """Return the filter ``d`` of a line's dynamic beam, driven by the mean x of its cells at node ``mean``."""

    @abstractmethod
    def displacement(self) -> dict[str, float]:
        """Return the free displacement y1 [m] as coefficients of the filter's node voltages."""

    @abstractmethod
    def velocity(self) -> list[Element]:
        """Return the current sources into node ``beam`` whose sum is the free velocity.

        What follows without delay is `direct_velocity`. Raises InputError if there is no such sum.
        """

    def direct_velocity(self, port: Port, suffix: str, top: str, share: float = 1.0) -> list[Element]:
        """Return the current sources into node ``beam`` of what follows the currents of an ion path without delay.

        ``port`` is that of a cell, whose ``share`` of the displacement this is, and ``top`` its node.
        """
        return []

    @abstractmethod
    def voltage(self) -> list[Element]:
        """Return what computes the reflected voltage u1, of node ``copy``, from the force, of node ``beam``."""

    def reflection(self) -> list[Element]:
        """Return the reflection on the electrical side, in series with the ion path below node ``back``."""
        return [*self.voltage(), BACK]


@dataclass(frozen=True)
class SecondOrder(Transducer):
    """The transducer of EC (31)."""

    lumped: Elements
    coupling: Coupling

    def filter(self, end: str, inner: float = 0.0) -> list[Element]:
        return filter_elements(self.coupling, port_node(self.lumped.port), end, "d", inner)

    def cell(self, port: Port, suffix: str, top: str, end: str) -> tuple[list[Element], dict[str, float]]:
        name = f"d{suffix}"
        return filter_elements(self.coupling, top, end, name), moved(self.coupling, name)

    def driven(self, name: str = "d") -> str:
        return f"{name}1"

    def averaged(self) -> list[Element]:
        return filter_elements(self.coupling, "mean", GROUND, "d")

    def displacement(self) -> dict[str, float]:
        return {q: self.lumped.bending_ratio * c for q, c in moved(self.coupling, "d").items()}

    def velocity(self) -> list[Element]:
        gain = self.lumped.bending_ratio / VELOCITY_SCALE
        return filter_rate(self.coupling, "v1", "d", (GROUND, "beam"), gain, Role.FREE_VELOCITY)

    def voltage(self) -> list[Element]:
        """Return the current k s d(s) F1 through a copy of Zp, linearised near 0 V for a nonlinear ion path."""
        role, gain = Role.REFLECTION, self.lumped.bending_ratio * FORCE_SCALE
        return [
            *filter_elements(self.coupling, "beam", GROUND, "s"),
            *filter_rate(self.coupling, "u1", "s", (GROUND, "copy"), gain, role),
            *ion_path(self.lumped.port.linearised(), "copy", GROUND, "x", role)[0],
        ]


def filter_elements(coupling: Coupling, plus: str, minus: str, name: str, inner: float = 0.0) -> list[Element]:
    """Return the series R-L-C of d(s) behind a source that does not load (plus, minus); nodes name1, name2, name3."""
    wn = coupling.natural_frequency
    role = Role.COUPLING_FILTER
    return [
        Element(f"E{name}", (f"{name}1", GROUND, plus, minus), 1.0, role=role),
        Element(f"R{name}", (f"{name}1", f"{name}2"), 2 * coupling.damping_ratio / wn, role=role),
        Element(f"L{name}", (f"{name}2", f"{name}3"), 1 / wn**2, role=role),
        Element(f"C{name}", (f"{name}3", GROUND), 1.0, role=role, start=inner),
    ]


def filter_rate(
    coupling: Coupling, name: str, filter_name: str, out: tuple[str, str], gain: float, role: Role
) -> list[Element]:
    """Return the two current sources whose sum is gain s d(s) v, from the filter's inductor voltage and its current."""
    wn, d0 = coupling.natural_frequency, coupling.static
    resistor = 2 * coupling.damping_ratio / wn
    n1, n2, n3 = (f"{filter_name}{k}" for k in (1, 2, 3))
    return [
        Element(f"G{name}a", (*out, n2, n3), gain * d0 * wn**2 / coupling.zero, role=role),
        Element(f"G{name}b", (*out, n1, n2), gain * d0 / resistor, role=role),
    ]


def moved(coupling: Coupling, name: str) -> dict[str, float]:
    """Return d(s) v [m] as coefficients of the node voltages of a filter: d0 [v_C + (v1 - v2)/(R Zd C)]."""
    static = coupling.static
    through = static / (2 * coupling.damping_ratio / coupling.natural_frequency * coupling.zero)
    return {f"v({name}3)": static, f"v({name}1)": through, f"v({name}2)": -through}
