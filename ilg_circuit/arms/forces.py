"""Forces on the arm's nodes, the pressures that hold each cell's area, energies and powers: compiled kernels.

Arrays that all kernels share, n cells, n + 1 rods: ``q``, ``v``, forces and accelerations (n + 1, 4) with the columns
x, y of side 0, x, y of side 1; ``a`` activations (n, 3) of edge 0, edge 1 and the rods; ``p`` pressures (n,) [N/m].
Everything is SI. Results are written into arrays that the caller owns.
"""

from __future__ import annotations

import math

from ..arrays import Array
from .compiled import compiled
from .lattice import Model

#: Columns of energies: kinetic, elastic (springs and plane), shear, gravity [J]; of powers: the actuators', and the
#: losses in damping, drag and impact [W].
ENERGIES = ("kinetic", "elastic", "shear", "gravity")
POWERS = ("actuator", "damping", "drag", "impact")


@compiled
def spring_activation(m: Model, a: Array, k: int) -> float:
    """Return the activation of spring k: the mean of its cells'."""
    channel = m.spring[k, 6]
    return float(0.5 * (a[m.spring[k, 4], channel] + a[m.spring[k, 5], channel]))


@compiled
def spring_state(m: Model, q: Array, v: Array, a: Array, k: int) -> tuple[float, float, float, float, float, float]:
    """Return direction of spring k from its first node to its second (2), length, its rate, stretch, and stiffness."""
    j, x, i, y = m.spring[k, 0], m.spring[k, 1], m.spring[k, 2], m.spring[k, 3]
    dx, dy = q[i, y] - q[j, x], q[i, y + 1] - q[j, x + 1]
    length = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / length, dy / length
    rate = nx * (v[i, y] - v[j, x]) + ny * (v[i, y + 1] - v[j, x + 1])
    active = spring_activation(m, a, k)
    stretch = length - m.spring_length[k] * (1 + m.strain * active)
    return nx, ny, length, rate, stretch, m.spring_stiffness[k] + m.spring_active[k] * active


@compiled
def shear_state(m: Model, q: Array, e: int) -> tuple[float, float, float, float]:
    """Return the across direction r and tangent t of shear element e; their rates where ``q`` holds velocities."""
    rx = ry = tx = ty = 0.0
    for k in range(3):
        i, z, w = m.shear_index[e, k], m.shear_across[e, k], m.shear_along[e, k]
        rx += z * (q[i, 0] - q[i, 2])
        ry += z * (q[i, 1] - q[i, 3])
        tx += w * (q[i, 0] + q[i, 2])
        ty += w * (q[i, 1] + q[i, 3])
    return rx, ry, tx, ty


@compiled
def shear_angle(m: Model, q: Array, e: int) -> tuple[float, float, float, float, float, float, float, float]:
    """Return cosine, sine of the angle of shear element e, its across direction and tangent (4), their squares."""
    rx, ry, tx, ty = shear_state(m, q, e)
    r2, t2 = rx * rx + ry * ry, tx * tx + ty * ty
    scale = 1 / math.sqrt(r2 * t2)
    return (rx * tx + ry * ty) * scale, (rx * ty - ry * tx) * scale, rx, ry, tx, ty, r2, t2


@compiled
def drag_of_cell(q: Array, v: Array, i: int) -> tuple[float, float, float, float, float]:
    """Return axis t of cell i (2), its length, and the velocity of the cell along and across it."""
    dx = 0.5 * (q[i + 1, 0] + q[i + 1, 2] - q[i, 0] - q[i, 2])
    dy = 0.5 * (q[i + 1, 1] + q[i + 1, 3] - q[i, 1] - q[i, 3])
    length = math.sqrt(dx * dx + dy * dy)
    tx, ty = dx / length, dy / length
    wx = 0.25 * (v[i, 0] + v[i, 2] + v[i + 1, 0] + v[i + 1, 2])
    wy = 0.25 * (v[i, 1] + v[i, 3] + v[i + 1, 1] + v[i + 1, 3])
    return tx, ty, length, wx * tx + wy * ty, wy * tx - wx * ty


@compiled
def depth_in_plane(m: Model, q: Array, v: Array, j: int, x: int) -> tuple[float, float]:
    """Return how deep the node of rod j with x in column ``x`` lies in the plane [m], and 1 + chi d' or zero."""
    px, py, nx, ny, _, damping = m.plane
    depth = (px - q[j, x]) * nx + (py - q[j, x + 1]) * ny
    return depth, max(1 - damping * (v[j, x] * nx + v[j, x + 1] * ny), 0.0)


@compiled
def forces(m: Model, q: Array, v: Array, a: Array, f: Array) -> None:
    """Compute all forces but those of the pressures [N], into ``f``."""
    for j in range(q.shape[0]):
        f[j, 0] = f[j, 2] = m.mass[j] * m.weight[0]
        f[j, 1] = f[j, 3] = m.mass[j] * m.weight[1]
    for k in range(m.spring.shape[0]):
        nx, ny, _, rate, stretch, stiffness = spring_state(m, q, v, a, k)
        tension = stiffness * stretch + m.spring_damping[k] * rate
        j, x, i, y = m.spring[k, 0], m.spring[k, 1], m.spring[k, 2], m.spring[k, 3]
        f[j, x] += tension * nx
        f[j, x + 1] += tension * ny
        f[i, y] -= tension * nx
        f[i, y + 1] -= tension * ny
    for e in range(m.shear_stiffness.shape[0]):
        cosine, sine, rx, ry, tx, ty, r2, t2 = shear_angle(m, q, e)
        sx, sy, ux, uy = shear_state(m, v, e)
        # cos(angle of t - angle of r): its gradient is sine times that of the angle of r, less that of t
        gx, gy = -sine * ry / r2, sine * rx / r2
        hx, hy = sine * ty / t2, -sine * tx / t2
        rate = gx * sx + gy * sy + hx * ux + hy * uy
        moment = m.shear_stiffness[e] * (cosine - m.shear_cosine[e]) + m.shear_damping[e] * rate
        for k in range(3):
            i, z, w = m.shear_index[e, k], moment * m.shear_across[e, k], moment * m.shear_along[e, k]
            f[i, 0] -= z * gx + w * hx
            f[i, 1] -= z * gy + w * hy
            f[i, 2] += z * gx - w * hx
            f[i, 3] += z * gy - w * hy
    for i in range(m.drag.shape[0]):
        tx, ty, _, along, across = drag_of_cell(q, v, i)
        push, lift = m.drag[i, 0] * abs(along) * along, m.drag[i, 1] * abs(across) * across
        gx, gy = 0.25 * (push * tx - lift * ty), 0.25 * (push * ty + lift * tx)
        for j in (i, i + 1):
            for x in (0, 2):
                f[j, x] -= gx
                f[j, x + 1] -= gy
    _, _, nx, ny, stiffness, _ = m.plane
    for j in range(q.shape[0]):
        for x in (0, 2):
            depth, loss = depth_in_plane(m, q, v, j, x)
            if depth > 0:
                push = stiffness * depth * loss
                f[j, x] += push * nx
                f[j, x + 1] += push * ny


@compiled
def area_gradient(x: Array, i: int) -> tuple[float, float, float, float]:
    """Return the gradient of cell i's area, which is linear in positions ``x``.

    With g, h the result: g at side 0 of rod i + 1, -g at side 1 of rod i, h at side 0 of rod i, -h at side 1 of
    rod i + 1. Area = 1/2 (d1 x d2) of the diagonals d1 = x(i+1, 0) - x(i, 1), d2 = x(i, 0) - x(i+1, 1).
    """
    ax, ay = x[i + 1, 0] - x[i, 2], x[i + 1, 1] - x[i, 3]
    bx, by = x[i, 0] - x[i + 1, 2], x[i, 1] - x[i + 1, 3]
    return 0.5 * by, -0.5 * bx, -0.5 * ay, 0.5 * ax


@compiled
def along_gradient(g: tuple[float, float, float, float] | Array, x: Array, i: int) -> float:
    """Return the scalar product of cell i's area gradient ``g`` with node vectors ``x``."""
    ax, ay = x[i + 1, 0] - x[i, 2], x[i + 1, 1] - x[i, 3]
    bx, by = x[i, 0] - x[i + 1, 2], x[i, 1] - x[i + 1, 3]
    return float(g[0] * ax + g[1] * ay + g[2] * bx + g[3] * by)


@compiled
def add_pressures(q: Array, p: Array, f: Array) -> None:
    """Add the forces of pressures ``p`` to ``f``: G^T p."""
    for i in range(p.shape[0]):
        g = area_gradient(q, i)
        for x in range(2):
            f[i + 1, x] += p[i] * g[x]
            f[i, 2 + x] -= p[i] * g[x]
            f[i, x] += p[i] * g[2 + x]
            f[i + 1, 2 + x] -= p[i] * g[2 + x]


@compiled
def eliminate(m: Model, q: Array, i: int, load: float, p: Array, work: Array) -> None:
    """Eliminate row i - 1 from row i of the tridiagonal equations (G M^-1 G^T) p = load; ``work`` (n, 6) is scratch."""
    g = area_gradient(q, i)
    near, far = m.mobility[i], m.mobility[i + 1]
    diagonal = (g[0] ** 2 + g[1] ** 2 + g[2] ** 2 + g[3] ** 2) * (near + far)
    if i > 0:
        coupling = near * (
            work[i - 1, 0] * g[2] + work[i - 1, 1] * g[3] + work[i - 1, 2] * g[0] + work[i - 1, 3] * g[1]
        )
        ratio = coupling / work[i - 1, 4]
        diagonal -= ratio * coupling
        load -= ratio * p[i - 1]
        work[i, 5] = coupling
    work[i, 0], work[i, 1], work[i, 2], work[i, 3] = g
    work[i, 4] = diagonal
    p[i] = load


@compiled
def substitute(p: Array, work: Array) -> None:
    """Solve the equations of `eliminate` backwards, ``p`` in place."""
    n = p.shape[0]
    p[n - 1] /= work[n - 1, 4]
    for i in range(n - 2, -1, -1):
        p[i] = (p[i] - work[i + 1, 5] * p[i + 1]) / work[i, 4]


@compiled
def acceleration(m: Model, q: Array, v: Array, a: Array, p: Array, acc: Array, work: Array) -> None:
    """Compute the pressures into ``p``, accelerations [m/s^2] into ``acc``; ``work`` (n, 6) is scratch.

    (G M^-1 G^T) p = -(G M^-1 f + G' v) - 2 beta G v - beta^2 (A - A0),  M q'' = f + G^T p: tridiagonal, O(n).
    """
    n = a.shape[0]
    forces(m, q, v, a, acc)
    for i in range(n):
        g = area_gradient(q, i)
        near, far = m.mobility[i], m.mobility[i + 1]
        push = far * (
            g[0] * acc[i + 1, 0] + g[1] * acc[i + 1, 1] - g[2] * acc[i + 1, 2] - g[3] * acc[i + 1, 3]
        ) + near * (g[2] * acc[i, 0] + g[3] * acc[i, 1] - g[0] * acc[i, 2] - g[1] * acc[i, 3])
        rate = area_gradient(v, i)
        error = 0.5 * along_gradient(g, q, i) - m.area[i]
        load = -push - along_gradient(rate, v, i) - 2 * m.beta * along_gradient(g, v, i) - m.beta**2 * error
        eliminate(m, q, i, load, p, work)
    substitute(p, work)
    add_pressures(q, p, acc)
    for j in range(n + 1):
        for x in range(4):
            acc[j, x] *= m.mobility[j]
