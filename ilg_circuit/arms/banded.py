"""Banded linear equations of the arm: LU without row exchanges, compiled; O(n) for n segments.

Row i of an (N + WIDTH, 2 WIDTH + 1) array holds the columns i - WIDTH to i + WIDTH of the matrix, a right-hand side has
WIDTH zeros before and after its N values: so all inner loops have one length, which the compiler unrolls.

The order of unknowns, each pressure after the rods that it pushes, makes row exchanges unnecessary while inertia
prevails; where they would be needed `factorise` says so, and the caller takes a shorter step.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .compiled import compiled, compiled_loosely
from .forces import area_gradient
from .lattice import Model

#: Unknowns of rod j >= 1: its four columns, then the pressure of the cell before it: 5 (j - 1) to 5 (j - 1) + 4.
PER_ROD = 5
#: Columns to either side of the diagonal: the shear energy couples rods two apart.
WIDTH = 13


#: Smallest pivot relative to its row that is taken as sound.
_SOUND = 1e-9


@compiled
def matrix(n: int) -> Array:
    """Return an empty matrix for the equations of n segments."""
    return np.zeros((PER_ROD * n + WIDTH, 2 * WIDTH + 1))


@compiled
def vector(n: int) -> Array:
    """Return an empty right-hand side; its values begin at `WIDTH`."""
    return np.zeros(PER_ROD * n + 2 * WIDTH)


@compiled
def factorise(A: Array) -> bool:
    """Factorise ``A`` in place into LU, pivots inverted; return False if one is too small or not finite."""
    for i in range(A.shape[0] - WIDTH):
        largest = 0.0
        for c in range(2 * WIDTH + 1):
            largest = max(largest, abs(A[i, c]))
        pivot = A[i, WIDTH]
        if not _SOUND * largest < abs(pivot) < 1e300:
            return False
        inverse = 1 / pivot
        A[i, WIDTH] = inverse
        for r in range(1, WIDTH + 1):
            factor = A[i + r, WIDTH - r] * inverse
            if factor != 0.0:
                A[i + r, WIDTH - r] = factor
                for c in range(WIDTH):
                    A[i + r, WIDTH - r + 1 + c] -= factor * A[i, WIDTH + 1 + c]
    return True


@compiled_loosely
def solve(A: Array, b: Array) -> None:
    """Solve with `factorise`'s result, ``b`` in place."""
    size = A.shape[0] - WIDTH
    for i in range(size):
        total = 0.0
        for c in range(WIDTH):
            total += A[i, c] * b[i + c]
        b[i + WIDTH] -= total
    for i in range(size - 1, -1, -1):
        total = 0.0
        for c in range(WIDTH):
            total += A[i, WIDTH + 1 + c] * b[i + WIDTH + 1 + c]
        b[i + WIDTH] = (b[i + WIDTH] - total) * A[i, WIDTH]


@compiled
def assemble(
    m: Model, q: Array, C: Array, S: Array, D: Array, inertia: float, by_v: float, by_q: float, A: Array
) -> float:
    """Compute the saddle-point matrix [inertia M - by_v D - by_q S, -G^T; s C, 0] into ``A``; returns the scale s.

    ``C`` (n, 4) holds the constraints' gradients as `area_gradient` gives them. s brings both kinds of row to one size.
    """
    n = C.shape[0]
    A[:] = 0.0
    diagonal = 0.0
    size = 0.0
    for j in range(1, n + 1):
        for d in range(max(0, 3 - j), min(5, n + 3 - j)):
            i = j + d - 2
            for r in range(4):
                row = PER_ROD * (j - 1) + r
                shift = PER_ROD * (i - 1) - row + WIDTH
                for c in range(4):
                    A[row, shift + c] = -by_v * D[j, d, r, c] - by_q * S[j, d, r, c]
        for r in range(4):
            A[PER_ROD * (j - 1) + r, WIDTH] += inertia * m.mass[j]
            diagonal += abs(A[PER_ROD * (j - 1) + r, WIDTH])
            size += abs(C[j - 1, r])
    scale = diagonal / size
    for i in range(n):
        g = area_gradient(q, i)
        column = PER_ROD * i + 4
        for k in range(4):
            # g, h at sides 0 of rods i + 1, i; -g, -h at sides 1 of rods i, i + 1
            plus_rod, minus_rod = (i + 1, i) if k < 2 else (i, i + 1)
            for rod, x, sign in ((plus_rod, 0, 1.0), (minus_rod, 2, -1.0)):
                if rod > 0:
                    at = PER_ROD * (rod - 1) + x + k % 2
                    A[at, column - at + WIDTH] = -sign * g[k]
                    A[column, at - column + WIDTH] = sign * scale * C[i, k]
    return scale
