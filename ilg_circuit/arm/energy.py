"""Energies, powers, spring forces and self-contact of an arm: compiled kernels, arrays as in `forces`."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from .compiled import compiled
from .forces import depth_in_plane, drag_of_cell, shear_state, spring_activation, spring_state
from .lattice import Model


@compiled
def energies(m: Model, q: Array, v: Array, a: Array, out: Array) -> None:
    """Kinetic, elastic (springs and plane), shear and gravitational energy [J] into ``out`` (4,)."""
    out[:] = 0.0
    for j in range(q.shape[0]):
        for x in range(4):
            out[0] += 0.5 * m.mass[j] * v[j, x] * v[j, x]
        out[3] -= m.mass[j] * (m.weight_x * (q[j, 0] + q[j, 2]) + m.weight_y * (q[j, 1] + q[j, 3]))
        if m.plane_stiffness > 0:
            for x in (0, 2):
                depth, _ = depth_in_plane(m, q, v, j, x)
                out[1] += 0.5 * m.plane_stiffness * max(depth, 0.0) ** 2
    for k in range(m.spring.shape[0]):
        _, _, _, _, stretch, stiffness = spring_state(m, q, v, a, k)
        out[1] += 0.5 * stiffness * stretch * stretch
    for e in range(m.shear_stiffness.shape[0]):
        rx, ry, tx, ty = shear_state(m, q, e)
        cosine = (rx * tx + ry * ty) / math.sqrt((rx * rx + ry * ry) * (tx * tx + ty * ty))
        out[2] += 0.5 * m.shear_stiffness[e] * (cosine - m.shear_cosine[e]) ** 2


@compiled
def powers(m: Model, q: Array, v: Array, a: Array, rate: Array, out: Array) -> None:
    """Power of the actuators, and losses in damping, drag and impact [W], into ``out`` (4,).

    ``rate`` (n, 3) is the activations' time derivative. The actuators' power is the elastic energy's partial
    derivative with respect to time: -k (l - l_rest) l_rest' for an eigenstrain, 1/2 k' (l - l_rest)^2 for a muscle.
    """
    out[:] = 0.0
    for k in range(m.spring.shape[0]):
        _, _, _, speed, stretch, stiffness = spring_state(m, q, v, a, k)
        by_activation = 0.5 * m.spring_active[k] * stretch - stiffness * m.strain * m.spring_length[k]
        out[0] += spring_activation(m, rate, k) * stretch * by_activation
        out[1] += m.spring_damping[k] * speed * speed
    if m.plane_stiffness > 0:
        for j in range(q.shape[0]):
            for x in (0, 2):
                depth, loss = depth_in_plane(m, q, v, j, x)
                if depth > 0:
                    approach = -(v[j, x] * m.plane[2] + v[j, x + 1] * m.plane[3])
                    out[3] += m.plane_stiffness * depth * (loss - 1) * approach
    if m.sheared:
        for e in range(m.shear_stiffness.shape[0]):
            rx, ry, tx, ty = shear_state(m, q, e)
            sx, sy, ux, uy = shear_state(m, v, e)
            r2, t2 = rx * rx + ry * ry, tx * tx + ty * ty
            sine = (rx * ty - ry * tx) / math.sqrt(r2 * t2)
            turn = sine * ((rx * sy - ry * sx) / r2 - (tx * uy - ty * ux) / t2)
            out[1] += m.shear_damping[e] * turn * turn
    if m.dragged:
        for i in range(a.shape[0]):
            _, _, _, along, across = drag_of_cell(m, q, v, i)
            out[2] += m.drag_along[i] * abs(along) ** 3 + m.drag_across[i] * abs(across) ** 3


@compiled
def evaluate(m: Model, q: Array, v: Array, a: Array, energy: Array, tension: Array) -> None:
    """`energies` and the springs' tensions [N], damping included, (t, 3 n + 1) of every sample.

    The arrays are those of `forces` with time as the first axis.
    """
    for t in range(q.shape[0]):
        energies(m, q[t], v[t], a[t], energy[t])
        for k in range(m.spring.shape[0]):
            _, _, _, speed, stretch, stiffness = spring_state(m, q[t], v[t], a[t], k)
            tension[t, k] = stiffness * stretch + m.spring_damping[k] * speed


@compiled
def crosses_itself(q: Array) -> int:
    """Number of the first segment whose outline another part of the outline crosses, 0 if there is none."""
    n = q.shape[0] - 1
    nodes = np.concatenate((q[:, :2], q[::-1, 2:]))  # face 0 from base to tip, face 1 from tip to base
    for i in range(2 * n + 1):
        ax, ay, bx, by = nodes[i, 0], nodes[i, 1], nodes[i + 1, 0], nodes[i + 1, 1]
        for k in range(i + 2, 2 * n + 1):
            cx, cy, dx, dy = nodes[k, 0], nodes[k, 1], nodes[k + 1, 0], nodes[k + 1, 1]
            if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
                continue
            if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
                continue
            one = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            two = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
            three = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
            four = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
            if one * two < 0 and three * four < 0:
                return int(min(i, n - 1) + 1)
    return 0
