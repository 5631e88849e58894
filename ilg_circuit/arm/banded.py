"""Banded linear equations of the arm: LU with row exchanges, compiled; O(n) for n segments.

Row i of an (N, 3 WIDTH + 1) array holds the columns i - WIDTH to i + 2 WIDTH of the matrix; the last third is room for
what row exchanges fill in.
"""

from __future__ import annotations

from .compiled import Array, Indices, compiled
from .forces import area_gradient
from .lattice import Model

#: Unknowns of rod j >= 1: its four columns, then the pressure of the cell before it: 5 (j - 1) to 5 (j - 1) + 4.
PER_ROD = 5
#: Columns to either side of the diagonal: the shear energy couples rods two apart.
WIDTH = 13


@compiled
def factorise(A: Array, pivots: Indices) -> bool:
    """LU of ``A`` in place; False where it is singular or not finite."""
    size = A.shape[0]
    for i in range(size):
        best, at = abs(A[i, WIDTH]), i
        for r in range(i + 1, min(i + WIDTH + 1, size)):
            candidate = abs(A[r, i - r + WIDTH])
            if candidate > best:
                best, at = candidate, r
        if not 0 < best < 1e300:
            return False
        pivots[i] = at
        width = min(2 * WIDTH, size - 1 - i) + 1
        if at != i:
            shift = WIDTH - (at - i)
            for c in range(width):
                A[i, WIDTH + c], A[at, shift + c] = A[at, shift + c], A[i, WIDTH + c]
        inverse = 1 / A[i, WIDTH]
        for r in range(i + 1, min(i + WIDTH + 1, size)):
            start = i - r + WIDTH
            factor = A[r, start] * inverse
            A[r, start] = factor
            if factor != 0.0:
                for c in range(1, width):
                    A[r, start + c] -= factor * A[i, WIDTH + c]
    return True


@compiled
def solve(A: Array, pivots: Indices, b: Array) -> None:
    """Solve with `factorise`'s result, ``b`` (N,) in place."""
    size = A.shape[0]
    for i in range(size):
        at = pivots[i]
        if at != i:
            b[i], b[at] = b[at], b[i]
        for r in range(i + 1, min(i + WIDTH + 1, size)):
            b[r] -= A[r, i - r + WIDTH] * b[i]
    for i in range(size - 1, -1, -1):
        total = b[i]
        for c in range(1, min(2 * WIDTH, size - 1 - i) + 1):
            total -= A[i, WIDTH + c] * b[i + c]
        b[i] = total / A[i, WIDTH]


@compiled
def assemble(
    m: Model, q: Array, C: Array, S: Array, D: Array, inertia: float, by_v: float, by_q: float, A: Array
) -> float:
    """The saddle-point matrix [inertia M - by_v D - by_q S, -G^T; s C, 0] into ``A``; returns the scale s.

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
            if plus_rod > 0:
                at = PER_ROD * (plus_rod - 1) + k % 2
                A[at, column - at + WIDTH] = -g[k]
                A[column, at - column + WIDTH] = scale * C[i, k]
            if minus_rod > 0:
                at = PER_ROD * (minus_rod - 1) + 2 + k % 2
                A[at, column - at + WIDTH] = g[k]
                A[column, at - column + WIDTH] = -scale * C[i, k]
    return scale
