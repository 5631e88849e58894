"""Linear algebra of tall matrices (samples, unknowns) by blocks of rows: a long record needs no copies of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Array

#: Number of rows of a block.
_ROWS = 32768


def blocks(count: int) -> Iterator[slice]:
    """Yield slices of successive rows out of ``count``."""
    for start in range(0, count, _ROWS):
        yield slice(start, min(start + _ROWS, count))


def lengths(matrix: Array) -> Array:
    """Return the lengths (n,) of the columns of ``matrix`` (m, n)."""
    return np.sqrt(np.einsum("ij,ij->j", matrix, matrix))


def triangle(matrix: Array, size: Array) -> Array:
    """Return the factor R (n, n) of ``matrix`` (m, n), its columns divided by ``size`` (n,), with R^T R = J^T J.

    For fewer rows than columns it is (m, n).
    """
    parts = [np.linalg.qr(matrix[rows] / size, mode="r") for rows in blocks(len(matrix))]
    return np.asarray(parts[0] if len(parts) == 1 else np.linalg.qr(np.concatenate(parts), mode="r"))


def products(matrix: Array, basis: Array) -> Array:
    """Return J^T J (n, n) of ``matrix`` (m, n) without its part along the orthonormal columns of ``basis`` (m, q)."""
    along = basis.T @ matrix
    found = np.zeros((matrix.shape[1],) * 2)
    for rows in blocks(len(matrix)):
        across = matrix[rows] - basis[rows] @ along
        found += across.T @ across
    return found
