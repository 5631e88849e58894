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
from ..solve.port_system import port_system
from ..solve.state_space import StateSpace, state_space
from ..strip.port import Port

#: values (m, parameters) -> ports with these values
Ports = Callable[[Array], list[Port]]


def modal_currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the currents [A] (ports, samples) into linear ``ports`` of one model at ``t`` >= 0 [s]."""
    moved = modal_output(port_system(ports), "current", drive.from_rest(), t)
    return moved + np.array([drive.rest / port.steady_resistance for port in ports])[:, None]


def modal_voltages(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the voltages [V] (ports, samples) of linear ``ports`` of one model under a current, at ``t`` >= 0 [s].

    The state space of their currents, i = C x + D u, solved for u.
    """
    of_voltage = port_system(ports)
    b, c = of_voltage.b[:, :, :1], of_voltage.c[:, :1]
    direct = of_voltage.d[:, :1, :1]
    zero = np.zeros_like
    system = StateSpace(
        of_voltage.a - b @ c / direct,
        np.concatenate([b / direct, zero(b)], axis=2),
        -c / direct,
        np.concatenate([1 / direct, zero(direct)], axis=2),
        ("voltage",),
    )
    moved = modal_output(system, "voltage", drive.from_rest(), t)
    return moved + np.array([drive.rest * port.steady_resistance for port in ports])[:, None]


def modal_displacements(netlists: Sequence[Netlist], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the displacements [m] (strips, samples) of linear strips of one topology at ``t`` >= 0 [s], from rest."""
    return modal_output(state_space(netlists), "displacement", drive.from_rest(), t)
