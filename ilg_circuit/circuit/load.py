"""What hangs on a strip's tip, and the mesh of the tip that carries it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import InputError
from ..strip.elements import Elements
from .netlist import GROUND, Element, Role

#: Newtons per mechanical volt and metres per second per mechanical ampere.
FORCE_SCALE = 1e-6
VELOCITY_SCALE = 1e-3
IMPEDANCE_SCALE = VELOCITY_SCALE / FORCE_SCALE

SCALE_NOTE = "mechanical side: 1 V = 1 uN, 1 A = 1 mm/s, 1 C = 1 mm; positive towards the anode"


@dataclass(frozen=True)
class Load:
    """What hangs on the strip at L_F: mass [kg], spring [N/m] and dashpot [N s/m] to ground, each zero or more.

    On a hanging strip the mass has weight, which pulls at the free end.
    """

    mass: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("mass", "kg"), ("stiffness", "N/m"), ("damping", "N s/m")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"load {name} is {value:g} {unit}; it must be zero or more")

    def __bool__(self) -> bool:
        return bool(self.mass or self.stiffness or self.damping)


#: A load: an object, a text such as "mass=1g", or its parts by name, numbers in SI units or texts.
Hung: TypeAlias = "Load | str | Mapping[str, float | str] | None"


def load_of(given: Hung) -> Load | None:
    """Return the load that an object, its parts or a text such as ``mass=1g,stiffness=1mN/m,damping=1uN*s/m`` name.

    Raises InputError for others.
    """
    from ..units import si

    if isinstance(given, Load) or not given:
        return given if isinstance(given, Load) else None
    wrong = InputError(f"load '{str(given)[:60]}' is not understood; write mass=1g,stiffness=1mN/m,damping=1uN*s/m")
    if isinstance(given, str):
        parts: list[Any] = [part.partition("=")[::2] for part in given.split(",")]
    elif isinstance(given, Mapping):
        parts = list(given.items())
    else:
        raise wrong
    units = {"mass": "kg", "stiffness": "N/m", "damping": "N*s/m"}
    values: dict[str, float] = {}
    for name, value in parts:
        if not isinstance(name, str) or not isinstance(value, str | float | int):
            raise wrong
        key = name.strip()
        if key not in units or value == "" or key in values:
            raise wrong
        values[key] = si(value, units[key], f"load {key}")
    return Load(**values)


def tip_elements(lumped: Elements, load: Load) -> tuple[list[Element], dict[str, float]]:
    """Return the tip's mesh from node ``beam`` to ground: mass, damping, gravity, load; and the force on the load."""
    mass = lumped.mass + load.mass
    chain = [("Ltip", mass * IMPEDANCE_SCALE, Role.TIP)]
    if lumped.damping:
        chain.append(("Rtip", lumped.damping * IMPEDANCE_SCALE, Role.TIP))
    if lumped.gravity:
        chain.append(("Cgravity", 1 / (lumped.gravity * IMPEDANCE_SCALE), Role.TIP))
    # horizontal: the weight is a constant force; displacement counts from the sagged rest, so it drops out
    start_of_load = len(chain)
    if load.damping:
        chain.append(("Rload", load.damping * IMPEDANCE_SCALE, Role.LOAD))
    if load.stiffness:
        chain.append(("Cload", 1 / (load.stiffness * IMPEDANCE_SCALE), Role.LOAD))
    nodes = ["beam", *(f"tip{k}" for k in range(1, len(chain))), GROUND]
    elements = [Element(name, (nodes[k], nodes[k + 1]), x, role=role) for k, (name, x, role) in enumerate(chain)]
    force: dict[str, float] = {"v(beam)": 0.0}
    if nodes[start_of_load] != GROUND:
        force[f"v({nodes[start_of_load]})"] = FORCE_SCALE
    if load.mass:  # the load's share of the voltage across the joint inductor
        share = FORCE_SCALE * load.mass / mass
        force["v(beam)"] += share
        if nodes[1] != GROUND:
            force[f"v({nodes[1]})"] = force.get(f"v({nodes[1]})", 0.0) - share
    return elements, force
