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
from ..fit.observation import Predict, WithSlopes
from ..solve.exact import modal_jump_slopes, modal_output, modal_slopes
from ..solve.port_system import port_system
from ..solve.state_space import StateSpace, state_space
from ..strip.port import Port

#: Step of a parameter's logarithm by which matrices are compared for their derivatives.
STEP = 1e-5
#: values (m, parameters) -> ports with these values
Ports = Callable[[Array], list[Port]]
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
    moved = modal_output(_by_current(ports), "voltage", drive.from_rest(), t)
    return moved + np.array([drive.rest * port.steady_resistance for port in ports])[:, None]


def _by_current(ports: Sequence[Port]) -> StateSpace:
    """Return the state space of the voltages of ports under a current."""
    of_voltage = port_system(ports)
    b, c = of_voltage.b[:, :, :1], of_voltage.c[:, :1]
    direct = of_voltage.d[:, :1, :1]
    zero = np.zeros_like
    return StateSpace(
        of_voltage.a - b @ c / direct,
        np.concatenate([b / direct, zero(b)], axis=2),
        -c / direct,
        np.concatenate([1 / direct, zero(direct)], axis=2),
        ("voltage",),
    )


def modal_current_slopes(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> tuple[Array, Array] | None:
    """Return the current [A] (samples,) of a port and its derivatives (samples, p) by logarithms of its parameters.

    ``ports`` are those of `perturbed` values. None where modes cancel.
    """
    found = modal_slopes(port_system(ports), "current", drive.from_rest(), t, STEP)
    return _above(found, np.array([drive.rest / port.steady_resistance for port in ports]))


def modal_voltage_slopes(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> tuple[Array, Array] | None:
    """Return the same of a port's voltage [V] under a current."""
    found = modal_slopes(_by_current(ports), "voltage", drive.from_rest(), t, STEP)
    return _above(found, np.array([drive.rest * port.steady_resistance for port in ports]))


def modal_jump_currents(port: Port, drive: PiecewiseLinear, t: Array) -> Array | None:
    """Return derivatives [A/s] (samples, j) of a linear port's current, see `modal_jump_slopes`."""
    return modal_jump_slopes(port_system([port]), "current", drive, t)


def modal_jump_voltages(port: Port, drive: PiecewiseLinear, t: Array) -> Array | None:
    """Return the same [V/s] of a port's voltage under a current."""
    return modal_jump_slopes(_by_current([port]), "voltage", drive, t)


def _above(moved: tuple[Array, Array] | None, rest: Array) -> tuple[Array, Array] | None:
    """Return what ``moved`` from a state of ``rest`` (2 p + 1,), and its derivatives, with those of that state."""
    if moved is None:
        return None
    prediction, slopes = moved
    prediction += rest[0]
    slopes += differences(rest)
    return prediction, slopes


def modal_displacement_slopes(
    netlists: Sequence[Netlist], drive: PiecewiseLinear, t: Array
) -> tuple[Array, Array] | None:
    """Return the same of a strip's displacement [m], from rest; ``netlists`` are those of `perturbed` values."""
    return modal_slopes(state_space(netlists), "displacement", drive.from_rest(), t, STEP)


def perturbed(values: Array) -> Array:
    """Return one set (p,) of parameters, and all sets (2 p + 1, p) where one is greater or smaller by `STEP`."""
    steps = STEP * np.eye(len(values))
    return np.asarray(values * np.exp(np.concatenate([np.zeros((1, len(values))), steps, -steps])))


def differences(found: Array) -> Array:
    """Return derivatives (..., p) from numbers (2 p + 1, ...) of `perturbed` values."""
    count = len(found) // 2
    return np.asarray((found[1 : count + 1] - found[count + 1 :]).T / (2 * STEP))


def with_slopes(predict: Predict, slopes: Callable[[Array], tuple[Array, Array] | None]) -> WithSlopes:
    """Return a prediction with ``slopes`` by logarithms, which are central differences where that gives None."""

    def either(values: Array) -> tuple[Array, Array]:
        found = slopes(values)
        if found is None:
            sets = predict(perturbed(values))
            count = len(values)
            found = sets[0], (sets[1 : count + 1] - sets[count + 1 :]).T / (2 * STEP)
        return found

    return WithSlopes(predict, either)


def modal_displacements(netlists: Sequence[Netlist], drive: PiecewiseLinear, t: Array) -> Array:
    """Return the displacements [m] (strips, samples) of linear strips of one topology at ``t`` >= 0 [s], from rest."""
    return modal_output(state_space(netlists), "displacement", drive.from_rest(), t)


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
