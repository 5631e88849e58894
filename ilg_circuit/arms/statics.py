"""The arm at rest: equilibrium under a constant activation, and small oscillations about it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError
from .activation import Activation
from .banded import PER_ROD, WIDTH, assemble, factorise, matrix, solve, vector
from .chain_motion import at_rest, chain_frequencies
from .dynamics import velocity_rate
from .forces import acceleration, add_pressures, area_gradient, forces
from .jacobian import derivatives
from .lattice import Arm, Model, cell_areas, model

_STEPS = 500
#: A step that changes the lattice by this little, and by a tenth of the one before, is the last.
_SMALL = 1e-8
#: A step turns or stretches no part of the lattice by more than this.
_TURN = 0.3


def equilibrium(arm: Arm, drive: Activation, *, at: float = 0.0, start: Array | None = None) -> tuple[Array, Array]:
    """Return positions [m] (n + 1, 2, 2) and pressures [Pa] (n,) at rest under the activation at the time ``at`` [s].

    Newton's method on forces and areas, steadied by an inertia that falls while steps are small (pseudo-transient
    continuation, after Kelley and Keyes, SIAM J. Numer. Anal. 35, 1998). ``start``: where to begin, if not at the rest
    shape. Of several equilibria the one reached from there is found. Raises InputError for a start of the
    wrong shape, SolveError where there is no equilibrium.
    """
    if arm.formulation == "chain":
        return at_rest(arm, drive, at, start)
    m, n = model(arm), arm.segments
    q = arm.rest_positions() if start is None else np.array(start, dtype=np.float64)
    if q.shape != (n + 1, 2, 2) or not np.isfinite(q).all():
        raise InputError(f"start: give finite positions of the shape {(n + 1, 2, 2)}")
    q = np.ascontiguousarray(q.reshape(-1, 4))
    a = drive.at([at])[0]
    p = np.zeros(n)
    acceleration(m, q, np.zeros_like(q), a, p, np.zeros_like(q), np.zeros((n, 6)))
    inertia, before = 100 * velocity_rate(arm) ** 2, math.inf
    for _ in range(_STEPS):
        move, push = _newton(m, q, a, p, inertia)
        turn = _turn(arm, move)
        if turn <= _TURN:
            q, p = q + move, p + push
            if turn <= _SMALL and turn <= 0.1 * before:
                return q.reshape(n + 1, 2, 2), p / arm.tapered(at_cells=True)[1]
            before = turn
            inertia *= 0.1 if turn <= 0.5 * _TURN else 1.0
        else:
            inertia *= 4.0
    raise SolveError(f"no equilibrium of the arm was found in {_STEPS} steps; is the activation or a load too strong?")


def natural_frequencies(arm: Arm, count: int = 1, drive: Activation | None = None) -> Array:
    """Return the lowest ``count`` undamped angular frequencies [rad/s] about the equilibrium under ``drive`` at 0.

    Without ``drive``: about the rest shape, gravity left out. Dense, so for some hundred segments at most.
    """
    from scipy.linalg import eigh, qr

    if arm.formulation == "chain":
        return chain_frequencies(arm, count, drive)
    m, n = model(arm), arm.segments
    if not 1 <= count <= 3 * n:
        raise InputError(f"{count} frequencies: an arm of {n} segments has 1 to {3 * n}")
    q, p = arm.rest_positions().reshape(-1, 4), np.zeros(n)
    a = np.zeros((n, 3))
    if drive is not None:
        positions, pressures = equilibrium(arm, drive)
        q, p, a = positions.reshape(-1, 4).copy(), pressures * arm.tapered(at_cells=True)[1], drive.at([0.0])[0]
    elif arm.formulation == "yekutieli":  # pressures balance the pre-tension
        still = np.zeros_like(q)
        acceleration(m._replace(weight=(0.0, 0.0)), q, still, a, p, np.zeros_like(q), np.zeros((n, 6)))
    S, D = np.zeros((n + 1, 5, 4, 4)), np.zeros((n + 1, 5, 4, 4))
    derivatives(m, q, np.zeros_like(q), a, p, S, D)
    stiffness, gradient = np.zeros((4 * n, 4 * n)), np.zeros((n, n + 1, 4))
    for j in range(1, n + 1):
        for i in range(max(1, j - 2), min(n, j + 2) + 1):
            stiffness[4 * (j - 1) : 4 * j, 4 * (i - 1) : 4 * i] = -S[j, i - j + 2]
    for i in range(n):
        gx, gy, hx, hy = area_gradient(q, i)
        gradient[i, i + 1], gradient[i, i] = [gx, gy, -hx, -hy], [hx, hy, -gx, -gy]
    free = qr(gradient[:, 1:].reshape(n, 4 * n).T)[0][:, n:]  # motions that keep every area
    mass = np.repeat(m.mass[1:], 4)
    stiffness = 0.5 * (stiffness + stiffness.T)
    squares = eigh(free.T @ stiffness @ free, free.T @ (mass[:, None] * free), eigvals_only=True)
    return np.asarray(np.sqrt(np.maximum(squares[:count], 0.0)))


def lattice_error(arm: Arm, drive: Activation) -> float:
    """Return the error of the tip of an arm at rest, by its lattice of n segments against that of 2 n.

    For the profile of ``drive`` along the arm, at the time at which it is largest and at that at which it varies most
    along the arm, without gravity; relative to the tip's distance from the rest shape, at least to a thousandth of
    that which the strain could move it. A chain has none.
    """
    if arm.formulation == "chain":
        return 0.0
    still = replace(arm, gravity=(0.0, 0.0))
    fine, finer = doubled(still, drive)
    sizes = np.abs(drive.values).max(axis=(1, 2)), np.abs(np.diff(drive.values, axis=1)).sum(axis=(1, 2))
    worst, least = 0.0, 1e-3 * float(sizes[0].max()) * arm.length**2 / arm.thickness
    for at in {float(drive.time[int(size.argmax())]) for size in sizes}:
        tips = [equilibrium(*each, at=at)[0][-1].mean(axis=0) for each in ((still, drive), (fine, finer))]
        moved = float(np.linalg.norm(tips[1] - arm.rest_positions()[-1].mean(axis=0)))
        worst = max(worst, float(np.linalg.norm(tips[1] - tips[0])) / max(moved, least, 1e-6 * arm.length))
    return worst


def doubled(arm: Arm, drive: Activation) -> tuple[Arm, Activation]:
    """Return an ``arm`` with twice as many segments, and its ``drive``: each two have the values of one."""
    bends = arm.curvature if isinstance(arm.curvature, float | int) else tuple(np.repeat(arm.curvature, 2).tolist())
    finer = replace(arm, segments=2 * arm.segments, curvature=bends)
    return finer, replace(drive, values=np.ascontiguousarray(np.repeat(drive.values, 2, axis=1)))


def _turn(arm: Arm, change: Array) -> float:
    """Return the largest change of an edge or a rod relative to its length."""
    nodes = change.reshape(-1, 2, 2)
    along = np.abs(np.diff(nodes, axis=0)).max() / arm.segment_length
    across = (np.abs(nodes[:, 0] - nodes[:, 1]).max(axis=1) / arm.tapered(at_cells=False)[0]).max()
    return float(max(along, across))


def _newton(m: Model, q: Array, a: Array, p: Array, inertia: float) -> tuple[Array, Array]:
    """Return the changes of positions and pressures, not finite where the equations are singular."""
    n = len(p)
    S, D, A = np.zeros((n + 1, 5, 4, 4)), np.zeros((n + 1, 5, 4, 4)), matrix(n)
    derivatives(m, q, np.zeros_like(q), a, p, S, D)
    gradient = np.array([area_gradient(q, i) for i in range(n)])
    scale = assemble(m, q, gradient, S, D, inertia, 0.0, 1.0, A)
    f = np.zeros_like(q)
    forces(m, q, np.zeros_like(q), a, f)
    add_pressures(q, p, f)
    padded = vector(n)
    rows = padded[WIDTH : WIDTH + PER_ROD * n].reshape(n, PER_ROD)
    rows[:, :4] = f[1:]
    rows[:, 4] = scale * (m.area - cell_areas(q.reshape(-1, 2, 2)))
    sound = factorise(A)
    solve(A, padded)
    if not (sound and np.isfinite(rows).all()):
        rows[:] = np.nan
    return np.pad(rows[:, :4], ((1, 0), (0, 0))), rows[:, 4].copy()
