"""A linearly implicit method of order 4(3) for the arm, L-stable: a compiled kernel with step control.

Rosenbrock method RODAS: Hairer, Wanner, *Solving Ordinary Differential Equations II*, section IV.7. A step needs one
exact Jacobian, one banded factorisation and six solutions, all O(n). The pressures are eliminated exactly in each
stage's right-hand side and kept as unknowns in the equations, which so stay banded:

    [M - H D - H^2 S] k_v - H G^T k_p = H M r_v + H^2 S r_q,      k_q = H (k_v + r_q),      H = gamma h
    [G + 2 H G(v) + 2 beta H G + H^2 E] k_v = H G r_v - H^2 E r_q,    E = G(acc) + 2 beta G(v) + beta^2 G
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from .banded import PER_ROD, WIDTH, assemble, factorise, matrix, solve, vector
from .compiled import compiled
from .explicit import (
    RUNNING,
    STEPS_A_CALL,
    Integration,
    accept,
    begin,
    change_step,
    interpolate,
    largest_error,
    next_step,
    weighted_sum,
)
from .forces import acceleration, add_pressures, along_gradient, area_gradient, eliminate, substitute
from .jacobian import derivatives, multiply
from .lattice import Model

_GAMMA = 0.25
_A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1.544000000000000, 0.0, 0.0, 0.0, 0.0],
        [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
        [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0.0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0],
    ]
)
_C = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [-5.668800000000000, 0.0, 0.0, 0.0, 0.0],
        [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
        [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
        [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0],
        [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
    ]
)
_TIMES = np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0])
_SLOPES = np.array([0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0])
#: Weights of the stages in the interpolant's middle, beside the mean of both ends: those of its terms in theta
#: (1 - theta) and theta (1 - theta)^2, with theta = 1/2.
_INSIDE = 0.25 * (
    np.array([10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662])
    + 0.5 * np.array([-0.6762803392806898, 6.087714651680606, 16.43084320892478, 24.76722511418386, -6.594389125716872])
)


@compiled
def constraint_rows(m: Model, q: Array, v: Array, acc: Array, H: float, C: Array, E: Array) -> None:
    """Compute the two gradients of the module's last equation, as `area_gradient`, into ``C``, ``E`` (n, 4)."""
    for i in range(C.shape[0]):
        g, gv, ga = area_gradient(q, i), area_gradient(v, i), area_gradient(acc, i)
        for c in range(4):
            E[i, c] = ga[c] + 2 * m.beta * gv[c] + m.beta**2 * g[c]
            C[i, c] = g[c] + 2 * H * (gv[c] + m.beta * g[c]) + H * H * E[i, c]


@compiled
def project(m: Model, q: Array, v: Array, p: Array, work: Array, push: Array) -> None:
    """Move ``q`` and ``v`` the least, weighted by mass, so that areas and their rates are right to second order.

    Steps may be long beside 1/beta, with which the stabilisation alone would bring the areas back: what is left of an
    error there costs later steps far more than this. ``p`` (n,), ``work`` (n, 6) and ``push`` (n + 1, 4) are scratch.
    """
    for part in range(2):
        target = q if part == 0 else v
        for i in range(p.shape[0]):
            g = area_gradient(q, i)
            load = along_gradient(g, v, i) if part == 1 else 0.5 * along_gradient(g, q, i) - m.area[i]
            eliminate(m, q, i, load, p, work)
        substitute(p, work)
        push[:] = 0.0
        add_pressures(q, p, push)
        for j in range(q.shape[0]):
            for x in range(4):
                target[j, x] -= m.mobility[j] * push[j, x]


@compiled
def implicit(m: Model, run: Integration) -> None:
    """Integrate on towards the last stop, by `STEPS_A_CALL` at most."""
    n = m.area.shape[0]
    K, L = np.zeros((6, n + 1, 4)), np.zeros((6, n + 1, 4))
    states, activations = run.states, np.zeros((3, n, 3))
    q, v, x, w = states[0, 0], states[0, 1], states[2, 0], states[2, 1]
    acc, first, rq, rv = np.zeros((n + 1, 4)), np.zeros((n + 1, 4)), np.zeros((n + 1, 4)), np.zeros((n + 1, 4))
    turned, drift = np.zeros((n + 1, 4)), np.zeros((1, n + 1, 4))
    a, rate, p, work = activations[2], np.zeros((n, 3)), np.zeros(n), np.zeros((n, 6))
    S, D = np.zeros((n + 1, 5, 4, 4)), np.zeros((n + 1, 5, 4, 4))
    C, E, A, padded = np.zeros((n, 4)), np.zeros((n, 4)), matrix(n), vector(n)
    rows, mass = padded[WIDTH : WIDTH + PER_ROD * n].reshape(n, PER_ROD), m.mass[1:].reshape(n, 1)
    begin(m, run, activations, p, first, work)
    derivatives(m, q, v, activations[0], p, S, D)
    for _ in range(STEPS_A_CALL):
        if run.counts[4] != RUNNING:
            break
        h, last = next_step(run)
        H = _GAMMA * h
        constraint_rows(m, q, v, first, H, C, E)
        scale = assemble(m, q, C, S, D, 1.0, H, H * H, A)
        sound = factorise(A)
        # forces are linear in the activation: h times their slope is the change by h times its slope, which is that of
        # the parabola through the step's ends and middle
        interpolate(run, run.clock[0] + 0.5 * h, activations[1])
        interpolate(run, run.clock[0] + h, a)
        rate[:] = 4 * activations[1] - 2 * activations[0] - a
        acceleration(m, q, v, rate, p, drift[0], work)
        drift[0] -= first
        for s in range(6):
            weighted_sum(_A[s], K, s, 1.0, q, x)
            weighted_sum(_A[s], L, s, 1.0, v, w)
            weighted_sum(_C[s], K, s, 1 / h, w, rq)
            if s == 0:
                weighted_sum(_SLOPES[s : s + 1], drift, 1, 1.0, first, rv)
            else:
                interpolate(run, run.clock[0] + _TIMES[s] * h, a)
                acceleration(m, x, w, a, p, acc, work)
                weighted_sum(_C[s], L, s, 1 / h, acc, rv)
                weighted_sum(_SLOPES[s : s + 1], drift, 1, 1.0, rv, rv)
            multiply(S, rq, turned)
            rows[:, :4] = H * mass * rv[1:] + H * H * turned[1:]
            for i in range(n):
                g = area_gradient(q, i)
                rows[i, 4] = scale * (H * along_gradient(g, rv, i) - H * H * along_gradient(E[i], rq, i))
            solve(A, padded)
            L[s, 1:] = rows[:, :4]
            K[s, 1:] = H * (L[s, 1:] + rq[1:])
        error = largest_error(run, K[5], L[5]) if sound else math.inf
        if not change_step(run, h, error, 4.0):
            continue
        x += K[5]
        w += L[5]
        project(m, x, w, p, work, turned)
        weighted_sum(_INSIDE, K, 5, 1.0, 0.5 * (q + x), states[1, 0])
        weighted_sum(_INSIDE, L, 5, 1.0, 0.5 * (v + w), states[1, 1])
        acceleration(m, x, w, a, p, first, work)
        derivatives(m, x, w, a, p, S, D)
        accept(m, run, h, last, activations, p)
