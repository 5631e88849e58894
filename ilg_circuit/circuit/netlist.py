"""The element list that every engine reads, and its writing as a PySpice `Circuit`.

One source for all engines: ngspice gets the PySpice circuit, the exact solver stamps the same elements, so the two
cannot drift apart.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..strip.charge_laws import CHARGE_LAWS, ChargeLaw, require_rising
from ..strip.port import hyperbolic_cosine

if TYPE_CHECKING:
    from PySpice.Spice.Netlist import Circuit

    from ..drive import Drive

GROUND = "0"


class Role(Enum):
    """The role of a strip's element: its place in the account of energies, and at the pins of a library."""

    OTHER = "other"
    SOURCE = "source"
    LEAD = "lead"  # electrodes and inductance, in series with the port
    ELECTRON_PATH = "electron path"
    ION_PATH = "ion path"
    CHARGE_METER = "charge meter"  # what keeps count of the charge of a growing capacitance
    COUPLING_FILTER = "coupling filter"  # d(s), arithmetic
    FREE_VELOCITY = "free velocity"  # the transformer's side of the beam
    REFLECTED_VOLTAGE = "reflected voltage"  # the transformer's side of the port
    REFLECTION = "reflection"  # what computes the reflected voltage
    BEAM = "beam"  # the compliance
    TIP = "tip"
    LOAD = "load"

    @property
    def electrical(self) -> bool:
        """Return whether it dissipates or stores energy of the electrical side."""
        return self in (Role.LEAD, Role.ELECTRON_PATH, Role.ION_PATH)

    @property
    def mechanical(self) -> bool:
        """Return whether it dissipates or stores energy of the mechanical side."""
        return self in (Role.BEAM, Role.TIP, Role.LOAD)


#: kind -> (number of nodes, method of a PySpice circuit that adds one)
_KINDS = {
    "R": (2, "R"),
    "L": (2, "L"),
    "C": (2, "C"),
    "V": (2, "V"),
    "I": (2, "I"),
    "E": (4, "VCVS"),
    "G": (4, "VCCS"),
    "F": (2, "CCCS"),
    "H": (2, "CCVS"),
    "B": (None, "BehavioralSource"),
}
_WITH_STATE, _CONTROLLED, _POSITIVE = "LC", "FH", "RLCB"

#: Laws of behavioural sources: number of nodes, quantity set across or through the first two.
_OF_EITHER_SIGN = ("bent", "charge")
_LAWS = {"sinh": (2, "i"), "bent": (3, "v"), **dict.fromkeys(CHARGE_LAWS, (3, "v"))}


@dataclass(frozen=True, slots=True)
class Element:
    """One SPICE element. The first letter of ``name`` is its kind: R, L, C, V, I, E, F, G, H or B.

    ``nodes`` are plus and minus, for E and G followed by the controlling pair; ``control`` names the voltage source
    whose current controls F and H; ``value`` is in ohm, henry, farad, volt, ampere or the source's gain. Capacitors
    and inductors start from ``start`` [V, A]. ``role`` is its role in the strip; engines do not use it.

    A behavioural source B follows a ``law`` with a second constant ``scale`` (v is the voltage across it):

        sinh     i = value sinh(v/scale), a current through it
        charge, saturating, steric
                 v of a capacitance ``value`` that keeps a charge q, the third node's voltage, by a law of constant
                 ``scale``; see `ilg_circuit.strip.charge_laws`
        bent     v = x + value x abs(x) + scale x^2, where the third node's voltage is x; both of either sign
    """

    name: str
    nodes: tuple[str, ...]
    value: float
    control: str = ""
    law: str = ""
    scale: float = 0.0
    role: Role = Role.OTHER
    start: float = 0.0

    @property
    def kind(self) -> str:
        return self.name[0].upper()

    @property
    def part(self) -> str:
        """Its name without the cell or the segment of a line, which stands between underscores: Rd_7_1 is of Rd1."""
        return re.sub("_[^_]*_", "", self.name)

    @property
    def charge_law(self) -> ChargeLaw | None:
        """The law of the charge that it keeps; None for other elements."""
        return CHARGE_LAWS[self.law](self.scale) if self.law in CHARGE_LAWS else None

    @property
    def expression(self) -> str:
        """A behavioural source's law as SPICE writes it."""
        value, scale = float(self.value), float(self.scale)  # a numpy number would write its type, too
        if self.law == "sinh":
            return f"{value!r}*sinh(v({self.nodes[0]},{self.nodes[1]})/{scale!r})"
        q = f"v({self.nodes[2]})"
        if self.law == "bent":
            return f"{q}*(1+({value!r})*abs({q})+({scale!r})*{q})"
        if self.law == "charge" and scale > 0:
            return f"2*{q}/{value!r}/(1+sqrt(1+{2 * scale / value!r}*abs({q})))"
        assert self.charge_law is not None
        return self.charge_law.expression(q, repr(value), repr(scale))

    def charge(self, voltage: float) -> float:
        """Return the charge [C] of a capacitance with a law at ``voltage`` [V]."""
        law = self.charge_law
        return self.value * (voltage if law is None else float(law.charge(voltage)))

    def bent(self, x: float) -> float:
        """Return the voltage of a source of the law ``bent`` at ``x`` [V]."""
        return x + self.value * x * abs(x) + self.scale * x * x

    def line(self, value: str = "") -> str:
        """Return the element as a line of SPICE, with another text for its ``value`` or, of a law, its expression."""
        if self.law:
            plus, minus = self.nodes[:2]
            return f"{self.name} {plus} {minus} {_LAWS[self.law][1]}={value or self.expression}"
        words = [self.name, *self.nodes, self.control, value or repr(float(self.value))]
        if self.kind in _WITH_STATE:
            words.append(f"ic={float(self.start)!r}")
        return " ".join(filter(None, words))

    def linearised(self, voltage: float) -> Element:
        """Return the linear element that a small signal meets at ``voltage`` [V] across this one; itself if linear."""
        if self.law == "sinh":
            slope = self.value / self.scale * hyperbolic_cosine(voltage / self.scale)
            return replace(self, name=f"R{self.name}", value=1 / slope, law="")
        if self.charge_law is not None:
            require_rising(self.charge_law, voltage)
            gain = 1 / (self.value * float(self.charge_law.slope(voltage)))
            return replace(self, name=f"E{self.name}", nodes=(*self.nodes, GROUND), value=gain, law="")
        if self.law == "bent":
            gain = 1 + 2 * self.value * abs(voltage) + 2 * self.scale * voltage
            return replace(self, name=f"E{self.name}", nodes=(*self.nodes, GROUND), value=gain, law="")
        return self


@dataclass(frozen=True)
class Output:
    """A waveform of interest: a sum of quantities ``v(node)`` or ``i(source or inductor)`` with coefficients.

    The error of a ``probe`` is not judged by a solve, since it may be pure rounding.
    """

    name: str
    unit: str
    terms: tuple[tuple[str, float], ...]
    probe: bool = False


@dataclass(frozen=True)
class Netlist:
    """Elements, the voltage source that the drive sets, and the outputs to report.

    ``further`` are the sources that further drives set, if there are several, in their order.

    A nonlinear circuit starts at rest under ``rest`` [V], by its elements' ``start``; of a linear one a solver adds the
    steady state itself. ``free`` is the free displacement of a strip on a dynamic beam [mm], as terms of an output.
    Raises InputError for duplicate names (SPICE is case-blind), wrong node counts, and values that
    ngspice would take without a word: NaN, negative or zero R, L, C.
    """

    title: str
    elements: tuple[Element, ...]
    outputs: tuple[Output, ...]
    drive: str = "Vdrive"
    comments: tuple[str, ...] = ()
    rest: float = 0.0
    further: tuple[str, ...] = ()
    free: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        seen: set[str] = set()
        sources = {e.name.lower() for e in self.elements if e.kind == "V"}
        for element in self.elements:
            _check_element(element, sources)
            if element.name.lower() in seen:
                raise InputError(f"element {element.name} appears twice (SPICE ignores upper and lower case)")
            seen.add(element.name.lower())
        nodes = {node for element in self.elements for node in element.nodes}
        if len({node.lower() for node in nodes}) < len(nodes):
            raise InputError("two nodes differ only in upper and lower case, which SPICE takes for one")
        for drive in (self.drive, *self.further):
            if drive.lower() not in sources:
                raise InputError(f"the netlist has no voltage source {drive} for the drive")

    @property
    def source(self) -> Element:
        """The voltage source that the drive sets, the first one of several."""
        return self.sources[0]

    @cached_property
    def sources(self) -> tuple[Element, ...]:
        """The voltage sources that drives set, in the order of the drives."""
        named = {e.name: e for e in self.elements}
        return tuple(named[name] for name in (self.drive, *self.further))

    @cached_property
    def topology(self) -> tuple[Any, ...]:
        """What two netlists must share to be solved as copies of one another: everything but the values."""
        return (
            tuple((e.name, e.nodes, e.control, e.law) for e in self.elements),
            tuple((o.name, tuple(q for q, _ in o.terms)) for o in self.outputs),
            self.drive,
            self.further,
        )

    @property
    def linear(self) -> bool:
        return not any(e.law for e in self.elements)

    @property
    def by_current(self) -> bool:
        """True if the drive is a current: its source sets one of current."""
        return any(e.role is Role.SOURCE and e.kind == "G" for e in self.elements)

    def voltage_at(self, drive: float) -> float:
        """Return the largest voltage [V] across a behavioural source at rest under a ``drive``: the drive itself.

        A current [A] makes it across the electron path alone.
        """
        if not self.by_current:
            return drive
        electrons = next(e for e in self.elements if e.role is Role.ELECTRON_PATH)
        if electrons.law:
            return electrons.scale * math.asinh(drive / electrons.value)
        return drive * electrons.value

    def require_rising(self, voltage: float) -> None:
        """Raise InputError where a charge does not rise with the voltage up to ``voltage`` [V] of either sign."""
        for law in {e.charge_law for e in self.elements} - {None}:
            if law is not None:
                require_rising(law, voltage)

    def linearised(self, voltage: float = 0.0) -> Netlist:
        """Return the circuit of a small signal with ``voltage`` [V] across electron path and ion path."""
        if self.linear:
            return self
        x = 0.0
        laws = {e.nodes[2]: e for e in self.elements if e.charge_law is not None}
        for e in self.elements:
            if e.name.startswith("Exd"):  # what the coupling follows: a charge meter, or a voltage of the ion path
                x += e.value * (laws[e.nodes[2]].charge(voltage) if e.nodes[2] in laws else voltage)
        return replace(self, elements=tuple(e.linearised(x if e.law == "bent" else voltage) for e in self.elements))

    @property
    def values(self) -> tuple[float, ...]:
        return tuple(e.value for e in self.elements)

    @property
    def driven(self) -> tuple[Element, ...]:
        """All elements but the sources that drives set."""
        return tuple(e for e in self.elements if e.name not in (self.drive, *self.further))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Circuit quantities that the outputs need, each once."""
        return tuple(dict.fromkeys(q for output in self.outputs for q, _ in output.terms))

    def to_pyspice(self, drive: Drive | None = None, duration: float = 1.0) -> Circuit:
        """Return the PySpice `Circuit`; with a ``drive`` its sources have PWL or SIN waveforms over ``duration`` [s].

        Values go in as ``repr`` text: PySpice would write 1 F, which is femto.
        """
        from PySpice.Spice.Netlist import Circuit

        circuit = Circuit(plain(self.title))
        add_elements(circuit, self.driven)
        from ..drive import each

        waveforms = ["0.0"] * len(self.sources) if drive is None else [part.spice(duration) for part in each(drive)]
        for source, waveform in zip(self.sources, waveforms, strict=True):
            circuit.V(source.name[1:], *source.nodes, waveform)
        return circuit


def add_elements(circuit: Any, elements: Iterable[Element]) -> None:
    """Add ``elements`` to a PySpice circuit or subcircuit."""
    for element in elements:
        add = getattr(circuit, _KINDS[element.kind][1])
        name, nodes = element.name[1:], element.nodes
        if element.law:
            add(name, *nodes[:2], **{_LAWS[element.law][1]: element.expression})
            continue
        values = [element.control] if element.control else []
        start = {"initial_condition": float(element.start)} if element.kind in _WITH_STATE else {}
        add(name, *nodes, *values, repr(float(element.value)), **start)


def copies(netlists: Sequence[Netlist]) -> tuple[str, list[dict[str, str]]]:
    """Return a netlist's text with independent copies of netlists of one topology, all but their drive sources.

    Every copy hangs on the drive nodes of the first; names and inner nodes get the suffix ``_k``. Also returns, per
    copy, the ngspice vector of every quantity that its outputs need. Plain text, because PySpice takes longer to make
    a hundred copies than ngspice to solve them.
    """
    lines = [f".title {plain(netlists[0].title)}"]
    vectors = []
    for k, netlist in enumerate(netlists):
        suffix = f"_{k}"
        shared = {GROUND, *(source.nodes[1] for source in netlist.sources)}
        rename = {n: n if n in shared else n + suffix for e in netlist.elements for n in e.nodes}
        # a source of 0 V between the copy and the common drive has the copy's current, with the sign of its own drive
        for source in netlist.sources:
            plus = source.nodes[0]
            lines.append(Element(source.name + suffix, (rename[plus], plus), 0.0).line())
        for e in netlist.driven:
            nodes, control = tuple(rename[n] for n in e.nodes), e.control and e.control + suffix
            lines.append(replace(e, name=e.name + suffix, nodes=nodes, control=control).line())
        vectors.append({q: _vector(q, rename, suffix) for q in netlist.quantities})
    return "\n".join(lines), vectors


def series_sum(node: str, terms: Sequence[tuple[str, float]]) -> list[Element]:
    """Return controlled sources in series from ``node`` to ground whose sum is the sum of ``terms``, see `Output`."""
    ends = [node, *(f"{node}_{k}" for k in range(1, len(terms))), GROUND]
    elements = []
    for k, (quantity, gain) in enumerate(terms):
        between, inner = (ends[k], ends[k + 1]), quantity[2:-1]
        if quantity[0] == "v":
            elements.append(Element(f"E{node}{k}", (*between, inner, GROUND), gain))
        else:
            elements.append(Element(f"H{node}{k}", between, gain, inner))
    return elements


def floating_nodes(elements: Sequence[Element]) -> list[str]:
    """Return one node of every part of a circuit that no direct current can reach from ground."""
    # node -> the node that its part is named after
    part = {GROUND: GROUND} | {node: node for element in elements for node in element.nodes}
    for element in elements:
        if element.kind in "RLVEH" or element.law:
            joined, into = (part[node] for node in element.nodes[:2])
            part = {node: into if of == joined else of for node, of in part.items()}
    return [node for node, of in part.items() if of == node and node != part[GROUND]]


def plain(text: str) -> str:
    """Return text that is safe in a netlist: a name from a file must not become a line, which ngspice would execute."""
    return re.sub(r"[^A-Za-z0-9 _.,:;()+*/=\[\]-]", "_", text)


def _vector(quantity: str, rename: dict[str, str], suffix: str) -> str:
    """Return ngspice's name of a quantity in a copy: ``v(node)`` -> ``node``, ``i(source)`` -> ``source#branch``."""
    kind, inner = quantity[0], quantity[2:-1]
    if kind == "v":
        return rename[inner].lower()
    return f"{inner}{suffix}#branch".lower()


def _check_element(element: Element, sources: set[str]) -> None:
    kind = element.kind
    if kind not in _KINDS:
        raise InputError(f"element {element.name}: kind {kind} is not one of {', '.join(_KINDS)}")
    count, _ = _KINDS[kind]
    controlled, positive = kind in _CONTROLLED, kind in _POSITIVE
    if (kind == "B") != bool(element.law) or (element.law and element.law not in _LAWS):
        raise InputError(f"element {element.name}: law '{element.law}' is not one of {', '.join(_LAWS)}, of a source B")
    if element.law:
        count = _LAWS[element.law][0]
        positive = element.law not in _OF_EITHER_SIGN
        if not (math.isfinite(element.scale) and (element.scale > 0 or not positive)):
            raise InputError(f"element {element.name} has scale {element.scale!r}; it must be positive and finite")
    if len(element.nodes) != count:
        raise InputError(f"element {element.name} has {len(element.nodes)} nodes; kind {kind} takes {count}")
    if controlled != bool(element.control) or (controlled and element.control.lower() not in sources):
        raise InputError(f"element {element.name}: its controlling source '{element.control}' is not in the netlist")
    if not math.isfinite(element.value) or (positive and element.value <= 0):
        allowed = "positive and finite" if positive else "finite"
        raise InputError(f"element {element.name} has value {element.value!r}; it must be {allowed}")
