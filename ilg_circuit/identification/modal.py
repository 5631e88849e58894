"""Computes current and displacement of a linear strip as sums of modes, in closed form for a measured drive.

Many parameter sets are computed at once, at much lower cost than by an engine, for the thousands of predictions of a
multi-start search, a profile likelihood or a Markov chain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..drive import PiecewiseLinear
from ..solve.exact import drive_lines, interval_grid, modal_output
from ..solve.modes import phi, recursion
from ..solve.port_system import port_system
from ..solve.state_space import StateSpace, state_space
from ..strip.port import Port

#: values (m, parameters) -> ports with these values
Ports = Callable[[Array], list[Port]]
#: Intervals of a drive whose responses are computed at once.
_BLOCK = 4000
#: Least distance of the poles of second order, over twice their frequency.
_APART = 1e-3


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


def driven_modes(poles: NDArray[Any], drive: PiecewiseLinear, t: Array) -> NDArray[Any]:
    """Return what 1/(s - pole) makes of a ``drive`` from rest (poles, samples) at ``t`` >= 0 [s]; poles [1/s] (n,)."""
    grid = interval_grid(drive, t)
    widths = np.diff(grid)
    start, slopes = drive_lines(drive, grid[:-1], widths)
    found = np.zeros((len(grid), len(poles)), dtype=poles.dtype)
    for first in range(0, len(widths), _BLOCK):
        part = slice(first, first + _BLOCK)
        width = widths[part, None]
        z = poles * width
        gained = width * (start[part, None] * phi(z, 1) + slopes[part, None] * width * phi(z, 2))
        states = recursion(np.exp(z), gained, found[first])
        found[first + 1 : first + 1 + len(states)] = states
    return found[np.searchsorted(grid, t)].T


def second_order_waves(damping: Array, frequency: Array, through: Callable[[NDArray[Any]], NDArray[Any]]) -> Array:
    """Return what wn^2/(s^2 + 2 zeta wn s + wn^2), and s wn over the same, make of a signal (n, 2, samples).

    ``through`` says what 1/(s - pole) makes of it. Near critical damping the two poles are held apart by a thousandth,
    which changes an answer by a millionth.
    """
    root = np.sqrt(np.asarray(damping**2 - 1, dtype=complex))
    root = np.where(np.abs(root) < _APART, _APART, root)
    pair = frequency * np.array([root - damping, -root - damping])
    fast, slow = through(pair.ravel()).reshape(2, len(frequency), -1)
    apart = (pair[0] - pair[1])[:, None]
    first = frequency[:, None] ** 2 * (fast - slow) / apart
    second = frequency[:, None] * (pair[0][:, None] * fast - pair[1][:, None] * slow) / apart
    return np.real(np.stack([first, second], axis=1))
