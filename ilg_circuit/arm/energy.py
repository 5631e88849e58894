"""Energies, powers, spring forces and self-contact of an arm: compiled kernels, arrays as in `forces`."""

from __future__ import annotations

import math

from ..arrays import Array
from .compiled import compiled
from .forces import depth_in_plane, drag_of_cell, rod_activation, shear_state
from .lattice import Model


@compiled
def energies(m: Model, q: Array, v: Array, a: Array, out: Array) -> None:
    """Kinetic, elastic (springs and plane), shear and gravitational energy [J] into ``out`` (4,)."""
    n = a.shape[0]
    out[:] = 0.0
    for j in range(n + 1):
        for x in range(4):
            out[0] += 0.5 * m.mass[j] * v[j, x] * v[j, x]
        out[3] -= m.mass[j] * (m.weight_x * (q[j, 0] + q[j, 2]) + m.weight_y * (q[j, 1] + q[j, 3]))
    for i in range(n):
        for s in range(2):
            length = math.hypot(q[i + 1, 2 * s] - q[i, 2 * s], q[i + 1, 2 * s + 1] - q[i, 2 * s + 1])
            stretch = length - m.edge_length[i, s] * (1 + m.strain * a[i, s])
            out[1] += 0.5 * (m.edge_stiffness[i, s] + m.edge_active[i, s] * a[i, s]) * stretch * stretch
    for j in range(n + 1):
        active = rod_activation(a, j)
        stretch = math.hypot(q[j, 0] - q[j, 2], q[j, 1] - q[j, 3]) - m.rod_length[j] * (1 + m.strain * active)
        out[1] += 0.5 * (m.rod_stiffness[j] + m.rod_active[j] * active) * stretch * stretch
        if m.plane_stiffness > 0:
            for x in (0, 2):
                depth, _ = depth_in_plane(m, q, v, j, x)
                out[1] += 0.5 * m.plane_stiffness * max(depth, 0.0) ** 2
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
    n = a.shape[0]
    out[:] = 0.0
    for i in range(n):
        for s in range(2):
            x, y = 2 * s, 2 * s + 1
            dx, dy = q[i + 1, x] - q[i, x], q[i + 1, y] - q[i, y]
            length = math.hypot(dx, dy)
            speed = (dx * (v[i + 1, x] - v[i, x]) + dy * (v[i + 1, y] - v[i, y])) / length
            stretch = length - m.edge_length[i, s] * (1 + m.strain * a[i, s])
            stiffness = m.edge_stiffness[i, s] + m.edge_active[i, s] * a[i, s]
            out[0] += (
                rate[i, s]
                * stretch
                * (0.5 * m.edge_active[i, s] * stretch - stiffness * m.strain * m.edge_length[i, s])
            )
            out[1] += m.edge_damping[i, s] * speed * speed
    for j in range(n + 1):
        dx, dy = q[j, 0] - q[j, 2], q[j, 1] - q[j, 3]
        length = math.hypot(dx, dy)
        speed = (dx * (v[j, 0] - v[j, 2]) + dy * (v[j, 1] - v[j, 3])) / length
        active, change = rod_activation(a, j), rod_activation(rate, j)
        stretch = length - m.rod_length[j] * (1 + m.strain * active)
        stiffness = m.rod_stiffness[j] + m.rod_active[j] * active
        out[0] += change * stretch * (0.5 * m.rod_active[j] * stretch - stiffness * m.strain * m.rod_length[j])
        out[1] += m.rod_damping[j] * speed * speed
        if m.plane_stiffness > 0:
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
        for i in range(n):
            _, _, _, along, across = drag_of_cell(m, q, v, i)
            out[2] += m.drag_along[i] * abs(along) ** 3 + m.drag_across[i] * abs(across) ** 3


@compiled
def spring_forces(m: Model, q: Array, v: Array, a: Array, edges: Array, rods: Array) -> None:
    """Tensions [N] of the edges into ``edges`` (n, 2), of the rods into ``rods`` (n + 1,), damping included."""
    n = a.shape[0]
    for i in range(n):
        for s in range(2):
            x, y = 2 * s, 2 * s + 1
            dx, dy = q[i + 1, x] - q[i, x], q[i + 1, y] - q[i, y]
            length = math.hypot(dx, dy)
            speed = (dx * (v[i + 1, x] - v[i, x]) + dy * (v[i + 1, y] - v[i, y])) / length
            stretch = length - m.edge_length[i, s] * (1 + m.strain * a[i, s])
            stiffness = m.edge_stiffness[i, s] + m.edge_active[i, s] * a[i, s]
            edges[i, s] = stiffness * stretch + m.edge_damping[i, s] * speed
    for j in range(n + 1):
        dx, dy = q[j, 0] - q[j, 2], q[j, 1] - q[j, 3]
        length = math.hypot(dx, dy)
        speed = (dx * (v[j, 0] - v[j, 2]) + dy * (v[j, 1] - v[j, 3])) / length
        active = rod_activation(a, j)
        stretch = length - m.rod_length[j] * (1 + m.strain * active)
        rods[j] = (m.rod_stiffness[j] + m.rod_active[j] * active) * stretch + m.rod_damping[j] * speed


@compiled
def evaluate(m: Model, q: Array, v: Array, a: Array, energy: Array, edges: Array, rods: Array) -> None:
    """`energies` and `spring_forces` of every sample: the arrays of `forces` with time as the first axis."""
    for k in range(q.shape[0]):
        energies(m, q[k], v[k], a[k], energy[k])
        spring_forces(m, q[k], v[k], a[k], edges[k], rods[k])


@compiled
def crosses_itself(q: Array) -> int:
    """Number of the first segment whose outline another part of the outline crosses, 0 if there is none."""
    n = q.shape[0] - 1
    count = 2 * n + 1  # face 0 from base to tip, the tip's rod, face 1 from tip to base
    for i in range(count):
        ax, ay, bx, by = _outline(q, n, i)
        for k in range(i + 2, count):
            cx, cy, dx, dy = _outline(q, n, k)
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


@compiled
def _outline(q: Array, n: int, i: int) -> tuple[float, float, float, float]:
    """Ends of piece i of the outline."""
    if i < n:
        return q[i, 0], q[i, 1], q[i + 1, 0], q[i + 1, 1]
    if i == n:
        return q[n, 0], q[n, 1], q[n, 2], q[n, 3]
    j = 2 * n + 1 - i
    return q[j, 2], q[j, 3], q[j - 1, 2], q[j - 1, 3]
