"""Small-signal spectra of netlists about a bias: by ngspice's AC analysis, or from the state space."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray
from ..circuit.netlist import GROUND, Element, Netlist, copies, floating_nodes
from ..errors import InputError
from .state_space import StateSpace, refined_solve, state_space

#: Impedance, over that of a capacitor at the lowest frequency, of the element that gives a part without direct current
#: an operating point: an open circuit in the spectrum. A coil, because so large a resistor would be lost in
#: rounding; but a resistor for the charge of a growing capacitance, which is not zero at rest.
_OPEN = 1e13


@dataclass(frozen=True)
class Spectrum:
    """Small-signal outputs per volt of the drive: ``values`` (outputs, f) at ``frequency`` [Hz] (f,)."""

    frequency: Array
    values: ComplexArray
    names: tuple[str, ...]
    engine: str

    def output(self, name: str) -> ComplexArray:
        """Return one output (f,), in its unit per volt."""
        return np.asarray(self.values[self.names.index(name)])


def spectrum(
    netlist: Netlist, frequency: ArrayLike, *, bias: float = 0.0, inner_bias: float = 0.0, engine: str = "ngspice"
) -> Spectrum:
    """Return the outputs of ``netlist`` per volt of its drive at ``frequency`` [Hz] about ``bias`` [V] of the drive.

    The exact engine linearises nonlinear elements at ``inner_bias`` [V] across them; ngspice finds its own operating
    point. Raises InputError for frequencies that are not positive, SolveError when there is no operating point.
    """
    f = np.asarray(frequency, dtype=float)
    if f.ndim != 1 or not len(f) or not (np.isfinite(f).all() and (f > 0).all()):
        raise InputError("a spectrum needs at least one frequency, all positive and finite")
    names = tuple(o.name for o in netlist.outputs)
    if engine == "exact":
        (values,) = transfer(state_space([netlist.linearised(inner_bias)]), f)
        return Spectrum(f, values, names, engine)
    if engine != "ngspice":
        raise InputError(f"engine is '{engine}'; choose ngspice or exact")
    from .ngspice import session

    grounded = replace(netlist, elements=(*netlist.elements, *_ties(netlist, float(f.min()))))
    circuit, (vectors,) = copies([grounded])
    text = f"{circuit}\n{netlist.source.line(f'dc {float(bias)!r} ac 1.0')}"
    found = dict(zip(vectors, session().ac(text, f, list(vectors.values())), strict=True))
    nothing = np.zeros(len(f), dtype=np.complex128)
    values = np.array([sum((c * found[q] for q, c in output.terms), nothing) for output in netlist.outputs])
    return Spectrum(f, values, names, engine)


def _ties(netlist: Netlist, lowest: float) -> list[Element]:
    """Return resistors to ground from every part without direct current; open circuits from ``lowest`` [Hz] on."""
    omega = 2 * np.pi * lowest
    smallest = min((e.value for e in netlist.elements if e.kind == "C"), default=1.0)
    charges = {e.nodes[2] for e in netlist.elements if e.charge_law is not None}
    ties = []
    for k, node in enumerate(floating_nodes(netlist.elements)):
        if node in charges:
            ties.append(Element(f"Ropen{k}", (node, GROUND), _OPEN / omega))  # beside 1 F
        else:
            ties.append(Element(f"Lopen{k}", (node, GROUND), _OPEN / (omega**2 * smallest)))
    return ties


def transfer(system: StateSpace, frequency: Array) -> ComplexArray:
    """Return C (s - A)^-1 B + D from the drive to the outputs; shape (n, outputs, f)."""
    n, states, _ = system.a.shape
    result = np.empty((n, system.c.shape[1], len(frequency)), dtype=np.complex128)
    identity = np.eye(states)
    for k, s in enumerate(2j * np.pi * frequency):
        x = refined_solve(s * identity - system.a, system.b[:, :, :1]) if states else np.zeros((n, 0, 1))
        result[:, :, k] = (system.c @ x + system.d[:, :, :1])[..., 0]
    return result
