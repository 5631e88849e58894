"""Computes a strip's energies: delivered by the source, dissipated and stored by each element, converted.

The electrical and the mechanical side balance separately:

    integral of u i    = stored on the ion capacitors + dissipated in Re, electron path, ion path + integral of u1 i1
    integral of F1 v1  = stored in beam, mass, springs + dissipated in dashpots

The two transformer terms are equal only if N is constant: with a complex N(s) the coupling is not a passive element, so
both are reported. The filters that realise d(s) are arithmetic and excluded from all sums.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, plain
from ..circuit.load import FORCE_SCALE, VELOCITY_SCALE
from ..circuit.netlist import GROUND, Element, Netlist, Output, Role
from ..result import Column, Result
from ..solve.transient import Waveforms
from ..solve.work import Named, Work

#: Joules per mechanical volt-ampere-second.
_MECHANICAL = FORCE_SCALE * VELOCITY_SCALE


@dataclass(frozen=True, repr=False, eq=False)
class EnergyAccount(Result):
    """Energies [J] since t = 0, each (n,) at ``time`` [s] (n,).

    ``source`` is delivered at the terminals; ``dissipated`` and ``stored`` are given by element (of a line: summed over
    its cells), with the side in ``roles``; ``converted`` = integral of u1 i1, taken from the electrical side;
    ``mechanical`` = integral of F1 v1, given to the beam.
    """

    presenter: ClassVar[str] = "energy"
    time: Array
    source: Array
    dissipated: dict[str, Array]
    stored: dict[str, Array]
    converted: Array
    mechanical: Array
    roles: dict[str, Role]

    def parts(self, kind: str, *, mechanical: bool) -> dict[str, Array]:
        """Return the energies of ``kind`` "dissipated" or "stored" by element of one side."""
        return {k: v for k, v in getattr(self, kind).items() if self.roles[k].mechanical == mechanical}

    def total(self, kind: str, *, mechanical: bool) -> Array:
        """Return the sum (n,) of ``kind`` "dissipated" or "stored" over the elements of one side."""
        return np.asarray(sum(self.parts(kind, mechanical=mechanical).values(), np.zeros_like(self.source)))

    @property
    def electrical_imbalance(self) -> float:
        """Largest error of the electrical balance, relative to the largest of its terms."""
        dissipated, stored = (self.total(kind, mechanical=False) for kind in ("dissipated", "stored"))
        return _imbalance(self.source, dissipated, stored, self.converted)

    @property
    def mechanical_imbalance(self) -> float:
        """Largest error of the mechanical balance, relative to the largest of its terms."""
        dissipated, stored = (self.total(kind, mechanical=True) for kind in ("dissipated", "stored"))
        return _imbalance(self.mechanical, dissipated, stored)

    @property
    def load(self) -> Array:
        """Energy [J] (n,) in a load's spring and dashpot (its mass moves with the strip's)."""
        parts = {**self.stored, **self.dissipated}
        taken = [energy for name, energy in parts.items() if self.roles[name] is Role.LOAD]
        return np.asarray(sum(taken, np.zeros_like(self.source)))

    @property
    def efficiency(self) -> float:
        """Largest mechanical energy given to the beam over the energy delivered until then; 0 where nothing moves."""
        moved = np.abs(self.mechanical)
        k = int(np.argmax(moved))
        return float(moved[k] / self.source[k]) if moved[k] and self.source[k] > 0 else 0.0

    def table(self) -> tuple[Column, ...]:
        """Return time and energies: delivered, of each element, given to the mechanical side and to the beam."""
        parts = [(f"{kind}_{k}", v) for kind in ("dissipated", "stored") for k, v in getattr(self, kind).items()]
        ends = [("converted", self.converted), ("mechanical", self.mechanical)]
        every = [("source", self.source), *parts, *ends]
        return (Column("time", self.time, "s", over=True), *(Column(name, values, "J") for name, values in every))

    def to_dict(self) -> dict[str, Any]:
        """Return the energies [J] over time as plain data, and the balances' errors."""
        return {
            "source": plain(self.source),
            "dissipated": {name: plain(values) for name, values in self.dissipated.items()},
            "stored": {name: plain(values) for name, values in self.stored.items()},
            "converted": plain(self.converted),
            "mechanical": plain(self.mechanical),
            "electrical_imbalance": self.electrical_imbalance,
            "mechanical_imbalance": self.mechanical_imbalance,
            "efficiency": self.efficiency,
        }


def probes(netlist: Netlist) -> tuple[Output, ...]:
    """Return the outputs that an account needs beyond a netlist's own; their errors are not checked."""
    found = [_across(e) for e in netlist.elements if _counts(e)]
    for element in _of(netlist, Role.REFLECTED_VOLTAGE):
        found += [
            replace(_across(element), name=f"u1 of {element.name}"),
            Output(f"i1 of {element.name}", "A", ((f"i({element.name})", 1.0),), probe=True),
        ]
    terms: dict[str, float] = {}
    for element in _of(netlist, Role.FREE_VELOCITY):
        _, _, plus, minus = element.nodes
        terms[f"v({plus})"] = terms.get(f"v({plus})", 0.0) + element.value
        terms[f"v({minus})"] = terms.get(f"v({minus})", 0.0) - element.value
    return (*found, Output("v1", "m/s", tuple(terms.items()), probe=True)) if terms else tuple(found)


def works(netlist: Netlist) -> tuple[Work, ...]:
    """Return the energies that an account needs, of a netlist with `probes`: source, stores and losses.

    The losses of a line's cells are those of its parts.
    """
    found = [Work("energy", _delivered(netlist), probe=False)]
    losing: dict[str, list[Element]] = {}
    for element in netlist.elements:
        if _counts(element) and _dissipates(element):
            losing.setdefault(element.part, []).append(element)
    found += [Work(f"energy of {part}", _dissipation(elements)) for part, elements in losing.items()]
    if reflected := _of(netlist, Role.REFLECTED_VOLTAGE):
        names = [e.name for e in reflected]
        found.append(
            Work("converted", lambda _, of: np.asarray(sum(of(f"u1 of {n}") * of(f"i1 of {n}") for n in names)))
        )
    if beams := _of(netlist, Role.BEAM):
        force = f"across {beams[0].name}"
        found.append(Work("mechanical", lambda _, of: _MECHANICAL * of(force) * of("v1")))
    return tuple(found)


def _delivered(netlist: Netlist) -> Callable[[Array, Named], Array]:
    """Return the power of all sources, as a function of the drives' voltages and the outputs."""
    names = [o.name for o in netlist.outputs if o.name.startswith("delivered_")]
    if not names:
        answer = "voltage" if netlist.by_current else "current"
        return lambda drive, of: np.asarray((drive[0] if drive.ndim > 1 else drive) * of(answer))

    def power(voltage: Array, of: Named) -> Array:
        return np.asarray(sum(u * of(name) for u, name in zip(np.atleast_2d(voltage), names, strict=True)))

    return power


def _dissipates(element: Element) -> bool:
    return element.kind == "R" or element.law == "sinh"


def _dissipation(elements: list[Element]) -> Callable[[Array, Named], Array]:
    """Return the power dissipated in resistors or sinh electron paths, as a function of the outputs."""

    def of_one(element: Element, wave: Array) -> Array:
        if element.law:
            return np.asarray(wave * element.value * np.sinh(wave / element.scale))
        return (_MECHANICAL if element.role.mechanical else 1.0) * wave**2 / element.value

    return lambda _, of: np.asarray(sum(of_one(e, of(f"across {e.name}")) for e in elements))


def account(netlist: Netlist, waves: Waveforms) -> EnergyAccount:
    """Return the account of a run, from its `probes` and `works`."""
    dissipated: dict[str, Array] = {}
    stored: dict[str, Array] = {}
    for element in filter(_counts, netlist.elements):
        part = element.part
        if _dissipates(element):
            dissipated[part] = waves.output(f"energy of {part}")
            continue
        v = waves.output(f"across {element.name}")
        if element.charge_law is not None:
            energy = element.value * element.charge_law.energy(v)
        else:  # C: its voltage, L: its current
            energy = (_MECHANICAL if element.role.mechanical else 1.0) * element.value * v**2 / 2
        stored[part] = stored[part] + energy if part in stored else energy
    nothing = np.zeros(len(waves.times))
    converted, mechanical = (waves.output(n) if n in waves.names else nothing for n in ("converted", "mechanical"))
    roles = {e.part: e.role for e in netlist.elements if _counts(e)}
    return EnergyAccount(waves.times, waves.output("energy"), dissipated, stored, converted, mechanical, roles)


def _counts(element: Element) -> bool:
    """Return True if an element is part of the strip, and not arithmetic or the copy for the reflected voltage."""
    return element.role.electrical or element.role.mechanical


def _of(netlist: Netlist, role: Role) -> list[Element]:
    return [e for e in netlist.elements if e.role is role]


def _across(element: Element) -> Output:
    if element.kind == "L":
        return Output(f"across {element.name}", "A", ((f"i({element.name})", 1.0),), probe=True)
    plus, minus = element.nodes[:2]
    terms = tuple((f"v({n})", sign) for n, sign in ((plus, 1.0), (minus, -1.0)) if n != GROUND)
    return Output(f"across {element.name}", "V", terms, probe=True)


def _imbalance(given: Array, *taken: Array) -> float:
    largest = max(float(np.abs(term).max()) for term in (given, *taken))
    return float(np.abs(given - sum(taken)).max() / largest) if largest else 0.0
