"""Couplings that relax, as elements: R-C filters of the ions' charge or of the voltage across their path.

x     a sum of sources: the voltage across the ion path, or its charge over C_ref
w     x, or a behavioural source of it: x + odd x abs(x) + even x^2
z_j   the voltage of 1 F behind tau_j ohm from w, so that z_j' is the resistor's current and nothing is derived

free velocity      v1 = k [sum of g_j (w - z_j)/tau_j + g_0 x'],  x' = i/C_ref of the current i into the ion path
reflected voltage  u1 = N F1: the same filter driven by the force; for a law of voltage a current k s D(s) F1
                   through a copy of the ion path
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError, argument
from ..strip.actuator import Coupling
from ..strip.couplings import RelaxingCoupling
from ..strip.elements import Elements
from ..strip.port import Port
from .coupling import SecondOrder, Transducer
from .load import FORCE_SCALE, VELOCITY_SCALE
from .netlist import GROUND, Element, Role, series_sum
from .port import ion_path, port_node, stores

_ROLE = Role.COUPLING_FILTER


@dataclass(frozen=True)
class Relaxing(Transducer):
    """The transducer of a coupling that relaxes."""

    lumped: Elements
    coupling: RelaxingCoupling

    def filter(self, end: str, inner: float = 0.0) -> list[Element]:
        port = self.lumped.port
        return self._filter("d", port, "", port_node(port), end, self.lumped.bent(inner))

    def _filter(self, name: str, port: Port, suffix: str, top: str, end: str, start: float = 0.0) -> list[Element]:
        """Return the filter ``name`` of an ion path with a ``suffix`` between ``top`` and ``end``."""
        law = self.coupling
        kept = [(node, end, c / port.capacitance) for node, c in stores(port, suffix)]
        # a charge meter's node is a charge to ground
        kept = [(node, GROUND if node.startswith("q") else low, gain) for node, low, gain in kept]
        drives = kept if law.follows_charge else [(top, end, 1.0)]
        ends = [f"x{name}", *(f"x{name}_{k}" for k in range(1, len(drives))), GROUND]
        elements = [
            Element(f"Ex{name}{k}", (ends[k], ends[k + 1], plus, minus), gain, role=_ROLE)
            for k, (plus, minus, gain) in enumerate(drives)
        ]
        if not law.linear:
            odd, even, x = law.odd or 0.0, law.even or 0.0, f"x{name}"
            elements.append(Element(f"Bw{name}", (f"w{name}", GROUND, x), odd, law="bent", scale=even, role=_ROLE))
        return elements + self._sections(name, self.driven(name), start)

    def driven(self, name: str = "d") -> str:
        return f"x{name}" if self.coupling.linear else f"w{name}"

    def cell(self, port: Port, suffix: str, top: str, end: str) -> tuple[list[Element], dict[str, float]]:
        name = f"d{suffix}"
        return self._filter(name, port, suffix, top, end), self._terms(name, self.driven(name))

    def averaged(self) -> list[Element]:
        mean = Element("Exd", (self.driven(), GROUND, "mean", GROUND), 1.0, role=_ROLE)
        return [mean, *self._sections("d", self.driven())]

    def _sections(self, name: str, node: str, start: float = 0.0) -> list[Element]:
        elements = []
        for k, mode in enumerate(self.lumped.relaxations, 1):
            elements.append(Element(f"Rz{name}{k}", (node, f"z{name}{k}"), mode.time, role=_ROLE))
            elements.append(Element(f"Cz{name}{k}", (f"z{name}{k}", GROUND), 1.0, role=_ROLE, start=start))
        return elements

    def _terms(self, name: str, node: str) -> dict[str, float]:
        """Return D(s) of what drives the filter ``name`` as coefficients [m/V] of its nodes."""
        terms = {f"v(z{name}{k})": mode.gain for k, mode in enumerate(self.lumped.relaxations, 1)}
        return terms | ({f"v({node})": self.coupling.instantaneous} if self.coupling.instantaneous else {})

    def displacement(self) -> dict[str, float]:
        return {q: self.lumped.bending_ratio * gain for q, gain in self._terms("d", self.driven()).items()}

    def gains(self) -> list[str]:
        """Return the gains of `displacement`, in its order, as expressions of a library."""
        modes = [mode.gain_text for mode in self.lumped.relaxations]
        return [*modes, *(["coupling_instantaneous"] if self.coupling.instantaneous else [])]

    def velocity(self) -> list[Element]:
        gain = self.lumped.bending_ratio / VELOCITY_SCALE
        return self._rates("v1", "d", self.driven(), (GROUND, "beam"), gain, Role.FREE_VELOCITY)

    def direct_velocity(self, port: Port, suffix: str, top: str, share: float = 1.0) -> list[Element]:
        law, role = self.coupling, Role.FREE_VELOCITY
        if not law.instantaneous:
            return []
        self._require_rate()
        if not law.linear:
            raise InputError(
                "coupling.instantaneous with an odd or even part needs the rate of a product on a dynamic beam; take "
                f"{argument('beam', 'static')}, or a gain_1 with a short time_1"
            )
        gain = share * self.lumped.bending_ratio / VELOCITY_SCALE * law.instantaneous / port.capacitance
        first = port.series_resistance + port.ladder.resistance if port.ladder is not None else 0.0
        resistances = [first] if port.ladder is not None else [r for r, _ in port.branches]
        return [
            Element(f"Gv1i{suffix}{k}", (GROUND, "beam", top, f"ion{suffix}{k}"), gain / r, role=role)
            for k, r in enumerate(resistances, 1)
        ]

    def _rates(self, rate: str, name: str, node: str, out: tuple[str, str], gain: float, role: Role) -> list[Element]:
        """Return the current sources whose sum is gain s D(s) of what drives the filter ``name``."""
        return [
            Element(f"G{rate}{k}", (*out, node, f"z{name}{k}"), gain * mode.gain / mode.time, role=role)
            for k, mode in enumerate(self.lumped.relaxations, 1)
        ]

    def _require_rate(self) -> None:
        """Raise InputError for an instantaneous part of the voltage, whose rate no current of the strip tells."""
        if not self.coupling.follows_charge:
            raise InputError(
                "coupling.instantaneous of kind 'voltage-relaxations' needs the rate of the voltage on a dynamic beam, "
                f"which no current tells; take {argument('beam', 'static')}, or a gain_1 with a short time_1"
            )

    def voltage(self) -> list[Element]:
        port, role = self.lumped.port, Role.REFLECTION
        if self.coupling.instantaneous:
            self._require_rate()
        gain = self.lumped.bending_ratio * FORCE_SCALE
        elements = [Element("Exs", ("xs", GROUND, "beam", GROUND), 1.0, role=_ROLE), *self._sections("s", "xs")]
        if not self.coupling.follows_charge:
            elements += self._rates("u1", "s", "xs", (GROUND, "copy"), gain, role)
            return elements + ion_path(port.linearised(), "copy", GROUND, "x", role)[0]
        terms = [(q, gain * c / port.capacitance) for q, c in self._terms("s", "xs").items()]
        return [*elements, *(self._of_reflection(e) for e in series_sum("copy", terms))]

    @staticmethod
    def _of_reflection(element: Element) -> Element:
        return Element(element.name, element.nodes, element.value, role=Role.REFLECTION)


def transducer(lumped: Elements) -> Transducer:
    """Return the transducer of a strip's coupling, which it has."""
    if isinstance(lumped.coupling, RelaxingCoupling):
        return Relaxing(lumped, lumped.coupling)
    assert isinstance(lumped.coupling, Coupling)
    return SecondOrder(lumped, lumped.coupling)
