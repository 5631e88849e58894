"""Closed orbits of a flow by Newton's method, with the exact derivative of the flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .flow import Flow

#: A motion that returns this close to itself, relative to its size, is near a cycle; the second is the distance to it.
NEAR = 0.02
CONVERGED = 1e-12


@dataclass(frozen=True)
class Orbit:
    """A motion that returns to ``state`` (m,) after ``period`` [s], and the derivative ``monodromy`` (m, m) of that."""

    state: Array
    period: float
    monodromy: Array


def propagated(flow: Flow, state: Array, duration: float) -> tuple[Array, Array, int]:
    """Return the derivative (m, m) of the state after ``duration`` [s] by ``state``, that state, the steps taken."""
    total = np.eye(len(state))
    last, steps = None, 0
    for stretch in flow.stretches(state, duration):
        total = stretch.propagator() @ total
        last, steps = stretch, steps + 1
    return total, state if last is None else last.states(last.length)[0], steps


def closed_orbit(
    flow: Flow, state: Array, period: float, size: float, reach: float, clocked: int = 0
) -> tuple[Orbit | None, int]:
    """Return the orbit, flow(z, T) = z, within ``reach`` times ``size`` of ``state`` (m,), and the steps it took.

    The last ``clocked`` states are a clock of just this ``period`` [s]: they and the period stay as they are. Without
    an orbit there the first is None.
    """
    z, duration = state.copy(), period
    m = len(z) - clocked
    free = 0 if clocked else 1  # the period, too, is to be found
    error, taken = np.inf, 0
    for _ in range(12):
        if not 0.8 * period < duration < 1.25 * period or np.abs(z - state).max() > reach * size:
            return None, taken
        monodromy, end, steps = propagated(flow, z, duration)
        taken += steps
        before, error = error, float(np.abs(end - z)[:m].max())
        if error <= CONVERGED * size and (clocked or error >= before / 2):
            break
        if error > 4 * before:
            return None, taken
        matrix = np.zeros((m + free, m + free))
        matrix[:m, :m] = monodromy[:m, :m] - np.eye(m)
        if free:
            matrix[:m, m] = flow.rate(end) * duration
            matrix[m, :m] = flow.rate(z) * duration  # the move is across the motion, not along it
        move = np.linalg.lstsq(matrix, np.append((z - end)[:m], np.zeros(free)), rcond=1e-11)[0]
        z[:m] = z[:m] + move[:m]
        duration = duration * (1 + move[m]) if free else duration
    if error > 100 * CONVERGED * size or np.abs(flow.rate(z)).max() * duration < 1e-9 * size:
        return None, taken
    return Orbit(z, duration, monodromy), taken
