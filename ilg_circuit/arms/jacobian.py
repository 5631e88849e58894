"""Derivatives of the arm's forces by position and velocity: exact, in 4 x 4 blocks; compiled kernels.

``S[j, d]`` is the derivative of rod j's forces by the positions of rod j + d - 2, d = 0 to 4, ``D`` the same by
velocities: (n + 1, 5, 4, 4). Columns and arrays otherwise as in `forces`.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .compiled import compiled
from .forces import depth_in_plane, drag_of_cell, shear_angle, shear_state, spring_state
from .lattice import Model

#: A matrix (2, 2), row by row.
Block = tuple[float, float, float, float]


@compiled
def _add(B: Array, j: int, x: int, i: int, y: int, scale: float, b: Block) -> None:
    """Add ``scale`` b: rod j, columns x, x + 1, by rod i, columns y, y + 1."""
    block = B[j, i - j + 2]
    block[x, y] += scale * b[0]
    block[x, y + 1] += scale * b[1]
    block[x + 1, y] += scale * b[2]
    block[x + 1, y + 1] += scale * b[3]


@compiled
def _add_between(B: Array, j: int, x: int, i: int, y: int, b: Block) -> None:
    """Add ``b`` of a force from rod j, column x, to rod i, column y, that their difference makes."""
    _add(B, j, x, i, y, 1.0, b)
    _add(B, j, x, j, x, -1.0, b)
    _add(B, i, y, i, y, -1.0, b)
    _add(B, i, y, j, x, 1.0, b)


@compiled
def derivatives(m: Model, q: Array, v: Array, a: Array, p: Array, S: Array, D: Array) -> None:
    """Return the derivatives of all forces, those of given pressures ``p`` included."""
    S[:] = 0.0
    D[:] = 0.0
    for k in range(m.spring.shape[0]):
        j, x, i, y = m.spring[k, 0], m.spring[k, 1], m.spring[k, 2], m.spring[k, 3]
        nx, ny, length, rate, stretch, stiffness = spring_state(m, q, v, a, k)
        damping = m.spring_damping[k]
        stress = (stiffness * stretch + damping * rate) / length
        gx = (stiffness - stress) * nx + damping * (v[i, y] - v[j, x] - rate * nx) / length
        gy = (stiffness - stress) * ny + damping * (v[i, y + 1] - v[j, x + 1] - rate * ny) / length
        _add_between(S, j, x, i, y, (nx * gx + stress, nx * gy, ny * gx, ny * gy + stress))
        if damping > 0:
            cross = damping * nx * ny
            _add_between(D, j, x, i, y, (damping * nx * nx, cross, cross, damping * ny * ny))
    # the area's gradient is linear: each node's force turns with the diagonal's other ends
    for i in range(a.shape[0]):
        turned = (0.0, 0.5 * p[i], -0.5 * p[i], 0.0)
        for j, x, one in ((i + 1, 0, 1.0), (i, 2, -1.0)):
            for k, y, two in ((i, 0, 1.0), (i + 1, 2, -1.0)):
                _add(S, j, x, k, y, one * two, turned)
                _add(S, k, y, j, x, -one * two, turned)
    _shear(m, q, v, S, D)
    for i in range(m.drag.shape[0]):
        tx, ty, length, along, across = drag_of_cell(q, v, i)
        nx, ny = -ty, tx
        push, lift = m.drag[i, 0], m.drag[i, 1]
        one, two = 2 * push * abs(along), 2 * lift * abs(across)
        cross = one * tx * ty + two * nx * ny
        by_velocity = (one * tx * tx + two * nx * nx, cross, cross, one * ty * ty + two * ny * ny)
        # by the angle of the axis; the angle by the difference of the rods' centres is n over its length
        to_t = -one * across + lift * abs(across) * across
        to_n = two * along - push * abs(along) * along
        fx, fy = (to_t * tx + to_n * nx) / length, (to_t * ty + to_n * ny) / length
        by_turn = (fx * nx, fx * ny, fy * nx, fy * ny)
        for j in (i, i + 1):
            for x in (0, 2):
                for k in (i, i + 1):
                    for y in (0, 2):
                        _add(D, j, x, k, y, -1 / 16, by_velocity)
                        _add(S, j, x, k, y, 0.125 if k > i else -0.125, by_turn)
    _, _, nx, ny, stiffness, damping = m.plane
    block = (nx * nx, nx * ny, nx * ny, ny * ny)
    for j in range(q.shape[0]):
        for x in (0, 2):
            depth, loss = depth_in_plane(m, q, v, j, x)
            if depth > 0 and loss > 0:
                _add(S, j, x, j, x, -stiffness * loss, block)
                _add(D, j, x, j, x, -stiffness * damping * depth, block)


@compiled
def _angle_hessian(x: float, y: float) -> tuple[float, float]:
    """Return the second derivatives of atan2(y, x): by xx (yy is its negative) and by xy."""
    square = (x * x + y * y) ** 2
    return 2 * x * y / square, (y * y - x * x) / square


@compiled
def _shear(m: Model, q: Array, v: Array, S: Array, D: Array) -> None:
    slope, second, turn, speed = np.empty(4), np.empty((4, 4)), np.empty(4), np.empty(4)
    by_u, by_w = np.empty((4, 4)), np.empty((4, 4))
    for e in range(m.shear_stiffness.shape[0]):
        cosine, sine, rx, ry, tx, ty, r2, t2 = shear_angle(m, q, e)
        speed[0], speed[1], speed[2], speed[3] = shear_state(m, v, e)
        turn[0], turn[1], turn[2], turn[3] = ry / r2, -rx / r2, -ty / t2, tx / t2  # gradient of the angle psi
        second[:] = 0.0
        for x, sign, (xx, xy) in ((0, -1.0, _angle_hessian(rx, ry)), (2, 1.0, _angle_hessian(tx, ty))):
            second[x, x], second[x + 1, x + 1] = sign * xx, -sign * xx
            second[x, x + 1] = second[x + 1, x] = sign * xy
        rate = 0.0
        for r in range(4):
            slope[r] = -sine * turn[r]
            rate += slope[r] * speed[r]
            for c in range(4):
                second[r, c] = -cosine * turn[r] * turn[c] - sine * second[r, c]
        k, damping = m.shear_stiffness[e], m.shear_damping[e]
        moment = k * (cosine - m.shear_cosine[e]) + damping * rate
        for c in range(4):
            bend = 0.0
            for r in range(4):
                bend += second[c, r] * speed[r]
            for r in range(4):
                by_u[r, c] = -(slope[r] * (k * slope[c] + damping * bend) + moment * second[r, c])
                by_w[r, c] = -damping * slope[r] * slope[c]
        _spread(m, e, by_u, S)
        if damping > 0:
            _spread(m, e, by_w, D)


@compiled
def _spread(m: Model, e: int, by_u: Array, B: Array) -> None:
    """Distribute derivatives by across direction and tangent of shear element e to the nodes that they are sums of."""
    for k in range(3):
        j, z, w = m.shear_index[e, k], m.shear_across[e, k], m.shear_along[e, k]
        for h in range(3):
            i, y, x = m.shear_index[e, h], m.shear_across[e, h], m.shear_along[e, h]
            if (z == 0 and w == 0) or (y == 0 and x == 0):
                continue
            d = i - j + 2
            for r in range(2):
                for c in range(2):
                    rr, rt = z * y * by_u[r, c], z * x * by_u[r, c + 2]
                    tr, tt = w * y * by_u[r + 2, c], w * x * by_u[r + 2, c + 2]
                    B[j, d, r, c] += rr + rt + tr + tt
                    B[j, d, r, c + 2] += -rr + rt - tr + tt
                    B[j, d, r + 2, c] += -rr - rt + tr + tt
                    B[j, d, r + 2, c + 2] += rr - rt - tr + tt


@compiled
def multiply(B: Array, x: Array, out: Array) -> None:
    """Compute ``out`` = B x for blocks B as `derivatives` makes them and node vectors x (n + 1, 4)."""
    count = x.shape[0]
    for j in range(count):
        for r in range(4):
            total = 0.0
            for d in range(max(0, 2 - j), min(5, count + 2 - j)):
                for c in range(4):
                    total += B[j, d, r, c] * x[j + d - 2, c]
            out[j, r] = total
