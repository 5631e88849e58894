"""Energies, powers, spring forces and self-contact of an arm: compiled kernels, arrays as in `forces`."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .compiled import compiled
from .forces import depth_in_plane, drag_of_cell, shear_angle, shear_state, spring_activation, spring_state
from .lattice import Model


@compiled
def energies(m: Model, q: Array, v: Array, a: Array, out: Array) -> None:
    """Compute the kinetic, elastic (springs and plane), shear and gravitational energy [J] into ``out`` (4,)."""
    out[:] = 0.0
    for j in range(q.shape[0]):
        for x in range(4):
            out[0] += 0.5 * m.mass[j] * v[j, x] * v[j, x]
        out[3] -= m.mass[j] * (m.weight[0] * (q[j, 0] + q[j, 2]) + m.weight[1] * (q[j, 1] + q[j, 3]))
        for x in (0, 2):
            depth, _ = depth_in_plane(m, q, v, j, x)
            out[1] += 0.5 * m.plane[4] * max(depth, 0.0) ** 2
    for k in range(m.spring.shape[0]):
        _, _, _, _, stretch, stiffness = spring_state(m, q, v, a, k)
        out[1] += 0.5 * stiffness * stretch * stretch
    for e in range(m.shear_stiffness.shape[0]):
        cosine = shear_angle(m, q, e)[0]
        out[2] += 0.5 * m.shear_stiffness[e] * (cosine - m.shear_cosine[e]) ** 2


@compiled
def powers(m: Model, q: Array, v: Array, a: Array, rate: Array, out: Array) -> None:
    """Compute the power of the actuators, and losses in damping, drag and impact [W], into ``out`` (4,).

    ``rate`` (n, 3) is the activations' time derivative. The actuators' power is the elastic energy's partial
    derivative with respect to time: -k (l - l_rest) l_rest' for an eigenstrain, 1/2 k' (l - l_rest)^2 for a muscle.
    """
    out[:] = 0.0
    for k in range(m.spring.shape[0]):
        _, _, _, speed, stretch, stiffness = spring_state(m, q, v, a, k)
        by_activation = 0.5 * m.spring_active[k] * stretch - stiffness * m.strain * m.spring_length[k]
        out[0] += spring_activation(m, rate, k) * stretch * by_activation
        out[1] += m.spring_damping[k] * speed * speed
    _, _, nx, ny, stiffness, _ = m.plane
    for j in range(q.shape[0]):
        for x in (0, 2):
            depth, loss = depth_in_plane(m, q, v, j, x)
            if depth > 0:
                out[3] -= stiffness * depth * (loss - 1) * (v[j, x] * nx + v[j, x + 1] * ny)
    for e in range(m.shear_stiffness.shape[0]):
        _, sine, rx, ry, tx, ty, r2, t2 = shear_angle(m, q, e)
        sx, sy, ux, uy = shear_state(m, v, e)
        turn = sine * ((rx * sy - ry * sx) / r2 - (tx * uy - ty * ux) / t2)
        out[1] += m.shear_damping[e] * turn * turn
    for i in range(m.drag.shape[0]):
        _, _, _, along, across = drag_of_cell(q, v, i)
        out[2] += m.drag[i, 0] * abs(along) ** 3 + m.drag[i, 1] * abs(across) ** 3


@compiled
def evaluate(m: Model, states: Array, a: Array, energy: Array, tension: Array) -> None:
    """Return `energies` and the springs' tensions [N], damping included, (t, 3 n + 1) of every sample.

    ``states`` (t, 2, n + 1, 4) are positions and velocities; the other arrays have time as the first axis, too.
    """
    for t in range(a.shape[0]):
        q, v = states[t, 0], states[t, 1]
        energies(m, q, v, a[t], energy[t])
        for k in range(m.spring.shape[0]):
            _, _, _, speed, stretch, stiffness = spring_state(m, q, v, a[t], k)
            tension[t, k] = stiffness * stretch + m.spring_damping[k] * speed


@compiled
def _side(a: Array, b: Array, c: Array) -> float:
    """Return a positive number if ``c`` lies left of the line from ``a`` to ``b``."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


@compiled
def crosses_itself(q: Array) -> int:
    """Return the number of the first segment whose outline another part of the outline crosses, 0 if there is none."""
    n = q.shape[0] - 1
    nodes = np.concatenate((q[:, :2], q[::-1, 2:]))  # face 0 from base to tip, face 1 from tip to base
    for i in range(2 * n + 1):
        a, b = nodes[i], nodes[i + 1]
        for k in range(i + 2, 2 * n + 1):
            c, d = nodes[k], nodes[k + 1]
            if _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0:
                return int(min(i, n - 1) + 1)
    return 0
