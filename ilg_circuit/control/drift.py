"""A strip that changes while it runs, as a drying one: its capacitance, resistances and gain at every call.

The values move linearly from those at the start to the end of the run, in steps between calls of the controller.
Across a step charges stay: the voltage of a capacitor that shrinks rises. A coupling that follows the charge keeps its
reference, so that its bending follows the charge as before, which less capacitance makes smaller.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.netlist import Netlist, Role
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument, unknown_name
from ..solve.state_space import StateSpace, state_space
from ..strip.actuator import Actuator
from ..strip.couplings import Coupling, RelaxingCoupling
from ..strip.couplings.law import CouplingLaw
from ..strip.elements import lumped_port

#: What may drift: name -> key of the material.
KEYS = {"capacitance": "permittivity", "dynamic_resistance": "dynamic_resistivity", "dc_resistance": "dc_resistivity"}
GAIN = "gain"
#: Steps of a drift over a run, at most, and factors that are allowed.
_STEPS, _LEAST, _MOST = 500, 0.01, 100.0


def changed(actuator: Actuator, factors: Mapping[str, float]) -> Actuator:
    """Return a strip with ``factors`` on its capacitance, resistances and gain, by the names of `KEYS` or "gain".

    Raises InputError for other names, a factor out of range, or a strip whose circuit has more than one branch.
    """
    for name, factor in factors.items():
        if name not in (*KEYS, GAIN):
            raise unknown_name("drift", name, (*KEYS, GAIN))
        if not _LEAST <= factor <= _MOST:
            raise InputError(f"{argument('drift')}: {name} becomes {factor:g} of itself; give {_LEAST} to {_MOST:g}")
    material, model = actuator.material, actuator.material.model.name
    if model != "rc":
        raise InputError(f"{argument('drift')} is of strips of model rc; '{actuator.name}' is of {model}")
    values = {key: getattr(material, key) * factors.get(name, 1.0) for name, key in KEYS.items()}
    material = replace(material, **values)
    return replace(actuator, material=material, coupling=_gained(actuator, factors), uncertainty=None)


def _gained(actuator: Actuator, factors: Mapping[str, float]) -> CouplingLaw | None:
    """Return the coupling with its gains changed."""
    coupling, gain = actuator.coupling, factors.get(GAIN, 1.0)
    if isinstance(coupling, Coupling):
        return replace(coupling, gain=coupling.gain * gain)
    if not isinstance(coupling, RelaxingCoupling):
        return coupling
    if coupling.follows_charge:  # its gains are of the charge over today's capacitance
        gain *= factors.get("capacitance", 1.0)
    names = [name for name in vars(coupling) if name == "instantaneous" or "gain" in name]
    values = {name: getattr(coupling, name) for name in names}
    return replace(coupling, **{name: value * gain for name, value in values.items() if value is not None})


@dataclass(frozen=True, eq=False)
class Drifting:
    """A drifting strip as systems that hold from ``starts`` [s] (k,) on; states are multiplied by ``jumps`` (k, s)."""

    starts: Array
    system: StateSpace
    jumps: Array


def drifting(actuator: Actuator, ends: Mapping[str, float], duration: float, period: float, **how: Any) -> Drifting:
    """Return a linear strip whose values drift to ``ends`` times what they were; ``how`` is for its netlists."""
    calls = int(np.floor(duration / period * (1 + 1e-12))) + 1
    every = -(-calls // _STEPS)
    starts: Array = np.asarray(np.arange(0, calls, every) * period, dtype=np.float64)
    middles = np.minimum((starts + every * period / 2) / duration, 1.0)
    nets = [strip_netlist(changed(actuator, drifted(ends, part)), **how) for part in middles.tolist()]
    jumps = [np.ones(len(_charges(nets[0], actuator)))]
    for before, after in pairwise(nets):
        jumps.append(_charges(before, actuator) / _charges(after, actuator))
    return Drifting(starts, state_space(nets), np.array(jumps))


def unseen(actuator: Actuator, names: Iterable[str]) -> bool:
    """Return whether no displacement shows a drift: a coupling follows the voltage, which nothing comes before."""
    coupling, port = actuator.coupling, lumped_port(actuator)
    follows = coupling is not None and coupling.follows_charge
    return not follows and not port.electrode_resistance and GAIN not in names


def drifted(ends: Mapping[str, float], part: Any) -> dict[str, Any]:
    """Return the factors at a ``part`` of the run."""
    return {name: 1 + (end - 1) * part for name, end in ends.items()}


def _charges(net: Netlist, actuator: Actuator) -> Array:
    """Return for each state what it is inversely proportional to at a given charge: a capacitance, or 1."""
    coupling = actuator.coupling
    stored = next(e.value for e in net.elements if e.kind == "C" and e.role is Role.ION_PATH)
    follows = coupling is not None and coupling.follows_charge
    return np.array(
        [
            stored if e.role is Role.ION_PATH or (follows and e.name.startswith("Czd")) else 1.0
            for e in net.elements
            if e.kind in "CL"
        ]
    )
