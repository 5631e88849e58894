"""A state space in its balanced states, and only as many of them as count."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from ..arrays import Array

#: Hankel singular values below this part of the largest are left out: the motion's reflection, the electrical port.
_NEGLIGIBLE = 1e-7
#: Shift of all poles, in parts of the slowest but integrators, so that Gramians exist: they only choose the states.
_SHIFT = 1e-2


def balanced(a: Array, b: Array, c: Array, order: int = 0) -> tuple[Array, Array, Array]:
    """Return A, b, c of the balanced system without the states that neither the input reaches nor the output shows.

    b is (s,) of one input or (s, inputs), c is (s,) or (outputs, s); several are to be of one size. ``order`` states
    are kept; 0 keeps those whose Hankel singular values count.
    """
    inputs, outputs = b.shape[1:], c.shape[:-1]
    b, c = b.reshape(len(a), -1), c.reshape(-1, len(a))
    speeds = np.abs(np.linalg.eigvals(a))
    slowest = float(speeds[speeds > 1e-12 * speeds.max()].min())
    shifted = a - _SHIFT * slowest * np.eye(len(a))
    # states of one size first: each by the size it has under a step
    reached = solve_continuous_lyapunov(shifted, -b @ b.T)
    size = np.sqrt(np.maximum(np.diag(reached), 1e-300))
    size[size < 1e-12 * size.max()] = 1.0
    a, shifted, b, c = a * size / size[:, None], shifted * size / size[:, None], b / size[:, None], c * size
    reached = solve_continuous_lyapunov(shifted, -b @ b.T)
    shown = solve_continuous_lyapunov(shifted.T, -c.T @ c)
    left, right = _root(reached), _root(shown)
    u, values, v = np.linalg.svd(right.T @ left)
    kept = order or int((values > _NEGLIGIBLE * values[0]).sum())
    root = np.sqrt(values[:kept])
    into, out = (left @ v[:kept].T) / root, (right @ u[:, :kept]) / root
    return out.T @ a @ into, (out.T @ b).reshape(kept, *inputs), (c @ into).reshape(*outputs, kept)


def _root(gramian: Array) -> Array:
    values, vectors = np.linalg.eigh((gramian + gramian.T) / 2)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
