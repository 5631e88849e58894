"""Dormand and Prince's Runge-Kutta method of order 5(4) for the arm: a compiled kernel with step control.

Coefficients: Dormand, Prince, J. Comput. Appl. Math. 6 (1980) 19; Hairer, Norsett, Wanner, *Solving Ordinary
Differential Equations I*, table II.5.2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .compiled import Indices, compiled
from .energy import powers
from .forces import acceleration
from .lattice import Model

#: How a run stands: not at its end yet, all stops reached, no step small enough, a value that is not finite.
RUNNING, DONE, TOO_SMALL, NOT_FINITE = 0, 1, 2, 3

#: Steps after which a kernel returns to its caller, who then can show progress or be interrupted.
STEPS_A_CALL = 2000

#: Factors by which a step may shrink or grow.
_SHRINK, _GROW, _SAFETY = 0.2, 3.0, 0.9

_A = np.array(
    [
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_C = np.array([1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


class Integration(NamedTuple):
    """Inputs and outputs of a kernel; K stops, T samples.

    A step ends at each of ``stops`` [s] (K,); ``sample`` (K,) is the sample's number there or -1. The activation is
    linear between ``times`` [s] (J,), ``values`` (J, n, 3). ``states``: positions and velocities at a step's start,
    middle and end; those of the start stand between calls. ``clock``: time, step, the four integrals of `powers`,
    smallest and largest step. ``counts``: stops passed, steps taken, steps refused, rod of the largest error, and how
    the run stands.
    """

    stops: Array
    sample: Indices
    times: Array
    values: Array
    states: Array  # (3, 2, n + 1, 4)
    clock: Array
    counts: Indices
    samples: Array  # (T, 2, n + 1, 4) positions, velocities
    pressures: Array  # (T, n)
    works: Array  # (T, 4)
    tolerance: tuple[float, float]  # of positions [m], of velocities [m/s]


@compiled
def interpolate(run: Integration, t: float, a: Array) -> None:
    """Compute the activation at ``t`` into ``a`` (n, 3)."""
    last = run.times.shape[0] - 1
    if t <= run.times[0] or last == 0:
        a[:] = run.values[0]
    elif t >= run.times[last]:
        a[:] = run.values[last]
    else:
        k = np.searchsorted(run.times, t) - 1
        part = (t - run.times[k]) / (run.times[k + 1] - run.times[k])
        for i in range(a.shape[0]):
            for c in range(3):
                a[i, c] = run.values[k, i, c] + part * (run.values[k + 1, i, c] - run.values[k, i, c])


@compiled
def record(run: Integration, p: Array) -> None:
    """Write the state at the present stop, if it is a sample."""
    s = run.sample[run.counts[0]]
    if s >= 0:
        run.samples[s] = run.states[0]
        run.pressures[s] = p
        run.works[s] = run.clock[2:6]


@compiled
def begin(m: Model, run: Integration, activations: Array, p: Array, acc: Array, work: Array) -> None:
    """Return the first of ``activations`` (3, n, 3), pressures and accelerations at the begin of a call."""
    interpolate(run, run.clock[0], activations[0])
    acceleration(m, run.states[0, 0], run.states[0, 1], activations[0], p, acc, work)
    if run.counts[1] == 0:
        record(run, p)


@compiled
def next_step(run: Integration) -> tuple[float, bool]:
    """Return the step [s] that fits to the next stop, and whether it ends there; for a run that goes on.

    No generator makes them: numba does not find one that it has kept from an earlier process for another kernel.
    """
    left = run.stops[run.counts[0] + 1] - run.clock[0]
    if run.clock[1] >= left * (1 - 1e-9):
        return left, True
    return min(run.clock[1], 0.5 * left), False


@compiled
def accept(m: Model, run: Integration, h: float, last: bool, activations: Array, p: Array) -> None:
    """Move on by ``h`` to the step's end, with pressures ``p``.

    The integrals of `powers` grow by Simpson's rule. ``activations`` (3, n, 3) are those at the step's start, middle
    and end; their slopes are those of the parabola through the three.
    """
    a, b, c = activations[0], activations[1], activations[2]
    power = np.zeros(4)
    for k in range(3):
        rate = (c - a + (a - 2 * b + c) * (2 * k - 2)) / h
        powers(m, run.states[k, 0], run.states[k, 1], activations[k], rate, power)
        run.clock[2:6] += h * (4.0 if k == 1 else 1.0) / 6 * power
    run.states[0] = run.states[2]
    activations[0] = activations[2]
    run.clock[0] += h
    run.counts[1] += 1
    run.clock[6] = min(run.clock[6], h)
    run.clock[7] = max(run.clock[7], h)
    if last:
        run.counts[0] += 1
        run.clock[0] = run.stops[run.counts[0]]
        record(run, p)
    if run.counts[0] == run.stops.shape[0] - 1:
        run.counts[4] = DONE


@compiled
def largest_error(run: Integration, error_q: Array, error_v: Array) -> float:
    """Compute largest error over its tolerance, infinite where one is not finite; its rod into ``run.counts[3]``."""
    worst = 0.0
    for j in range(1, error_q.shape[0]):
        for x in range(4):
            e = max(abs(error_q[j, x]) / run.tolerance[0], abs(error_v[j, x]) / run.tolerance[1])
            if not math.isfinite(error_q[j, x] + error_v[j, x]):
                run.counts[3] = j
                return math.inf
            if e > worst:
                worst = e
                run.counts[3] = j
    return worst


@compiled
def change_step(run: Integration, h: float, error: float, order: float) -> bool:
    """Set the next step after one of ``h`` with ``error``; whether ``h`` is accepted."""
    factor = min(max(_SAFETY * error ** (-1 / order), _SHRINK), _GROW)  # also of an error of zero, or infinite
    if error <= 1:  # a step cut short by a stop does not shorten the next one
        run.clock[1] = max(run.clock[1], h * factor) if h < 0.99 * run.clock[1] and factor >= 1 else h * factor
        return True
    run.clock[1] = h * min(factor, 1.0)
    run.counts[2] += 1
    if run.clock[1] < 1e-14 * run.stops[-1]:
        run.counts[4] = TOO_SMALL if math.isfinite(error) else NOT_FINITE
    return False


@compiled
def weighted_sum(weights: Array, stages: Array, count: int, h: float, base: Array, out: Array) -> None:
    """Compute ``out`` = base + h times the weighted sum of the first ``count`` stages, all (n + 1, 4)."""
    total, start = out.reshape(-1), base.reshape(-1)
    total[:] = start
    for s in range(count):
        factor = h * weights[s]
        if factor != 0.0:
            stage = stages[s].reshape(-1)
            for c in range(total.shape[0]):
                total[c] += factor * stage[c]


@compiled
def explicit(m: Model, run: Integration) -> None:
    """Integrate on towards the last stop, by `STEPS_A_CALL` at most."""
    n = m.area.shape[0]
    K, L = np.zeros((7, n + 1, 4)), np.zeros((7, n + 1, 4))  # stages' velocities and accelerations
    states, activations = run.states, np.zeros((3, n, 3))
    q, v, x, w = states[0, 0], states[0, 1], states[2, 0], states[2, 1]
    a, zero = activations[2], np.zeros((n + 1, 4))
    p, work, error_q, error_v = np.zeros(n), np.zeros((n, 6)), np.zeros((n + 1, 4)), np.zeros((n + 1, 4))
    begin(m, run, activations, p, L[0], work)
    for _ in range(STEPS_A_CALL):
        if run.counts[4] != RUNNING:
            break
        h, last = next_step(run)
        K[0] = v
        for s in range(6):
            weighted_sum(_A[s], K, s + 1, h, q, x)
            weighted_sum(_A[s], L, s + 1, h, v, w)
            interpolate(run, run.clock[0] + _C[s] * h, a)
            K[s + 1] = w
            acceleration(m, x, w, a, p, L[s + 1], work)
        weighted_sum(_ERROR, K, 7, h, zero, error_q)
        weighted_sum(_ERROR, L, 7, h, zero, error_v)
        error = largest_error(run, error_q, error_v)
        if not change_step(run, h, error, 5.0):
            continue
        # the quintic through both ends in the step's middle
        states[1, 0] = (q + x) / 2 + 5 * h / 32 * (v - w) + h * h / 64 * (L[0] + L[6])
        states[1, 1] = 15 / 8 * (x - q) / h - 7 / 16 * (v + w) + h / 32 * (L[6] - L[0])
        interpolate(run, run.clock[0] + 0.5 * h, activations[1])
        L[0] = L[6]
        accept(m, run, h, last, activations, p)
