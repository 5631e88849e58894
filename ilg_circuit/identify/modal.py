"""Current and displacement of a linear strip as sums of modes, whose answer to a measured drive is a closed form.

Many parameter sets at once, and far cheaper than an engine: for the thousands of predictions that a search of many
starts, a profile likelihood or a Markov chain needs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..circuit.strip import port_netlist
from ..drive import PiecewiseLinear
from ..solve.exact import modal_output
from ..solve.state_space import StateSpace, state_space
from ..strip.port import Port

#: values (m, parameters) -> the ports that they make
Ports = Callable[[Array], list[Port]]


def modal_currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the currents [A] (ports, samples) into linear ``ports`` of one model at ``t`` >= 0 [s]."""
    return _from_rest(state_space([port_netlist(port) for port in ports]), "current", drive, t)


def modal_displacements(netlists: Sequence[Netlist], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the displacements [m] (strips, samples) of linear strips of one topology at ``t`` >= 0 [s]."""
    return _from_rest(state_space(netlists), "displacement", drive, t)


def _from_rest(system: StateSpace, output: str, drive: PiecewiseLinear, t: Array) -> Array:
    moved = modal_output(system, output, drive.from_rest(), t)
    if not drive.rest:
        return moved
    return moved + drive.rest * system.steady()[:, [system.output_names.index(output)]]
