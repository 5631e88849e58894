"""Computes current and displacement of a linear strip as sums of modes, in closed form for a measured drive.

Many parameter sets are computed at once, at much lower cost than by an engine, for the thousands of predictions of a
multi-start search, a profile likelihood or a Markov chain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..drive import PiecewiseLinear
from ..solve.exact import modal_output
from ..solve.port_system import coupling_system, port_system
from ..solve.state_space import state_space
from ..strip.coupling import Coupling
from ..strip.port import Port

#: values (m, parameters) -> ports with these values
Ports = Callable[[Array], list[Port]]


def modal_currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the currents [A] (ports, samples) into linear ``ports`` of one model at ``t`` >= 0 [s]."""
    moved = modal_output(port_system(ports), "current", drive.from_rest(), t)
    return moved + np.array([drive.rest / port.steady_resistance for port in ports])[:, None]


def modal_displacements(netlists: Sequence[Netlist], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the displacements [m] (strips, samples) of linear strips of one topology at ``t`` >= 0 [s], from rest."""
    return modal_output(state_space(netlists), "displacement", drive.from_rest(), t)


def modal_couplings(couplings: Sequence[Coupling], ratio: float, drive: PiecewiseLinear, t: Array) -> Array:
    """Return the displacements [m] (couplings, samples) ``ratio`` d(s) of a drive at ``t`` >= 0 [s], from rest."""
    return modal_output(coupling_system(couplings, ratio), "displacement", drive.from_rest(), t)
