"""Decomposes linear systems into modes, and evaluates sums of modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .state_space import StateSpace

#: Number of intervals of a sum of modes that are added at once.
_CHUNK = 32
#: Largest factor by which modes may cancel; the same factor of accuracy is lost.
CANCELLING = 1e5
#: Ratio of poles above which a decomposition is sharpened, in how many corrections, the one after which the next would
#: be lost in rounding, and relative distance up to which poles count as nearly equal.
_STIFF, _CORRECTIONS, _LAST, _CLOSE = 1e4, 3, 1e-9, 1e-3
#: Largest error of left vectors as the inverse of right ones for which corrections have converged.
_INVERSE = 1e-6
#: Below this a Taylor series of five terms is exact to the last digits.
_SMALL = 1e-2
#: Most netlists that are solved as one circuit, and the largest ratio of their fastest modes: they share one grid.
_LARGEST_BATCH, _SPREAD = 100, 3.0

Numbers = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of ``n`` systems: ``poles`` [1/s] (n, s), their excitations and their outputs.

    ``excited`` (n, s, k + 1) are the coefficients of k drives and of the constant 1 in a mode's equation; ``shown``
    (n, outputs, s) are the coefficients of modes in the outputs.
    """

    poles: Numbers
    excited: Numbers
    shown: Numbers

    @property
    def shares(self) -> Array:
        """Steady contribution of each mode to an output (n, outputs, s), per unit of constant drives, all at once."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.abs(self.shown) * np.abs(self.excited[:, None, :, :-1] / self.poles[:, None, :, None]).sum(-1)
        return np.asarray(np.where(np.isfinite(found), found, 0.0))


def modes_of(system: StateSpace) -> Modes | None:
    """Return the modes of ``system``, or None if they cancel because close poles have nearly parallel eigenvectors.

    The measure is the sum of the terms of each mode's shape times its left one, which is 1 but for signs; it does not
    depend on the units of the states.
    """
    found = decomposed(system)
    if found is None:
        return None
    poles, left, shapes, order = found
    one = np.arange(len(order))[:, None]
    return Modes(poles, left @ system.b[one, order], system.c.swapaxes(1, 2)[one, order].swapaxes(1, 2) @ shapes)


def decomposed(system: StateSpace) -> tuple[Numbers, Numbers, Numbers, Numbers] | None:
    """Return poles (n, s), left and right eigenvectors (n, s, s), of the states in an order (n, s); None as `modes_of`.

    The first index of left eigenvectors, and the second of right ones, is that of the poles. Arrays may be read-only.
    """
    own = np.diagonal(system.a, axis1=1, axis2=2)
    alone = np.count_nonzero(system.a) == np.count_nonzero(own) and np.isfinite(own).all()
    if alone:  # every state is a mode: branches without a common resistor
        same = np.broadcast_to(np.eye(own.shape[1]), system.a.shape)
        return own.copy(), same, same, np.broadcast_to(np.arange(own.shape[1]), own.shape)
    # fast states first, so that slow poles keep their accuracy
    order = np.argsort(-np.abs(own), axis=1, kind="stable")
    one = np.arange(len(order))[:, None]
    a = system.a[one[..., None], order[:, :, None], order[:, None]]
    try:
        poles, shapes = np.linalg.eig(a)
        left = np.linalg.inv(shapes)
        for k in np.flatnonzero(_spread(poles) > _STIFF).tolist():
            poles[k], left[k], shapes[k] = _sharpened(a[k], poles[k], left[k], shapes[k])
    except np.linalg.LinAlgError:
        return None
    with np.errstate(all="ignore"):
        cancelling = np.einsum("nks,nsk->nk", np.abs(left), np.abs(shapes)).max(initial=1.0)
    return (poles, left, shapes, order) if cancelling < CANCELLING else None


def _spread(poles: Numbers) -> Array:
    """Return the ratio of the fastest pole of each system to its slowest that is not zero (n,)."""
    sizes = np.abs(poles)
    fastest = sizes.max(axis=1, initial=0.0)
    slowest = np.where(sizes > np.finfo(float).eps * fastest[:, None], sizes, np.inf).min(axis=1, initial=np.inf)
    return np.asarray(fastest / slowest)


def _clusters(close: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the number of the cluster of each pole (s,), of pairs (s, s) that are ``close``."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    return np.asarray(connected_components(csr_array(close), directed=False)[1], dtype=np.intp)


def _sharpened(a: Array, poles: Numbers, left: Numbers, shapes: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return poles (s,) and vectors (s, s) of one system whose slow modes are as accurate as its fast ones.

    An eigenvalue routine errs in proportion to the fastest pole. In the basis of its vectors the matrix is diagonal up
    to these errors: corrections of first order part poles that are distinct, as Newton's method does, and clusters of
    nearly equal ones are decomposed once more by themselves. Pairs stay conjugate. Poles that are zero up to rounding
    stay as they are.
    """
    sizes = np.abs(poles)
    moving = sizes > np.finfo(float).eps * sizes.max(initial=0.0)
    close = np.abs(poles[:, None] - poles) <= _CLOSE * np.maximum.outer(sizes, sizes)
    shared = np.count_nonzero(close, axis=1) > 1
    cluster = _clusters(close) if shared.any() else np.arange(len(poles))
    apart = cluster[:, None] != cluster
    begun = left, shapes
    for _ in range(_CORRECTIONS):
        left = 2 * left - (left @ shapes) @ left
        seen = left @ a @ shapes
        moved = np.divide(seen, np.diagonal(seen) - np.diagonal(seen)[:, None], out=np.zeros_like(seen), where=apart)
        shapes, left = shapes + shapes @ moved, left - moved @ left
        if np.abs(moved).max(initial=0.0) < _LAST:
            break
    if not np.abs(left @ shapes - np.eye(len(poles))).max() < _INVERSE:
        return poles, *begun
    found = poles.copy(), left.copy(), shapes.copy()
    _replace_single(found, a, np.flatnonzero(moving & ~shared))
    for k in np.unique(cluster[shared]).tolist():
        own = np.flatnonzero((cluster == k) & moving)
        above = own[poles[own].imag > 0]
        if len(above) == len(own) > 0:
            # the conjugate of each pole stands behind it
            new = _within(a, left[own], shapes[:, own])
            for at, part in ((own, new), (own + 1, tuple(np.conj(x) for x in new))):
                found[0][at], found[1][at], found[2][:, at] = part
        elif len(above) or (poles[own].imag == 0).any():
            real = own[poles[own].imag == 0]
            dual = np.concatenate([left[real].real, 2 * left[above].real, -2 * left[above].imag])
            basis = np.concatenate([shapes[:, real].real, shapes[:, above].real, shapes[:, above].imag], axis=1)
            new = _within(a, dual, basis)
            if np.iscomplexobj(new[0]) and not np.iscomplexobj(poles):
                raise np.linalg.LinAlgError("two real poles became a pair")
            at = np.concatenate([real, *([k, k + 1] for k in above)]).astype(int)
            found[0][at], found[1][at], found[2][:, at] = new
    return found


def _replace_single(found: tuple[Numbers, Numbers, Numbers], a: Array, single: NDArray[np.intp]) -> None:
    """Replace poles (s,) and vectors (s, s) at the places ``single`` by real ones, or by pairs that are conjugate."""
    poles, left, shapes = found
    real, above = single[poles[single].imag == 0], single[poles[single].imag > 0]
    left[real], shapes[:, real] = left[real].real, shapes[:, real].real
    poles[real] = np.einsum("ks,sk->k", left[real].real @ a, shapes[:, real].real)
    poles[above] = np.einsum("ks,sk->k", left[above] @ a, shapes[:, above])
    poles[above + 1], left[above + 1] = np.conj(poles[above]), np.conj(left[above])
    shapes[:, above + 1] = np.conj(shapes[:, above])


def _within(a: Array, left: Numbers, shapes: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return the modes of a matrix within a subspace, by its left (m, s) and right (s, m) vectors."""
    poles, turned = np.linalg.eig(left @ a @ shapes)
    return poles, np.linalg.inv(turned) @ left, shapes @ turned


def grown(z: Numbers) -> Numbers:
    """Return e^z - 1; of complex numbers by real functions, which cost a third of numpy's complex one."""
    if not np.iscomplexobj(z):
        return np.asarray(np.expm1(z))
    real, half = np.expm1(z.real), z.imag / 2
    sine = np.sin(half)
    found = np.empty_like(z)
    found.real = real - 2 * (1 + real) * sine**2
    found.imag = 2 * (1 + real) * sine * np.cos(half)
    return found


def phi_pair(z: Numbers) -> tuple[Numbers, Numbers]:
    """Return (e^z - 1)/z and (e^z - 1 - z)/z^2, by their series where z is small."""
    small = np.abs(z) < _SMALL
    few = bool(small.any())
    far = np.where(small, 1.0, z) if few else z
    first = grown(far) / far
    second = (first - 1) / far
    if few:
        near = z[small]
        first[small] = 1 + near / 2 * (1 + near / 3 * (1 + near / 4 * (1 + near / 5)))
        second[small] = (1 + near / 3 * (1 + near / 4 * (1 + near / 5 * (1 + near / 6)))) / 2
    return first, second


def phi_slopes(z: Numbers, first: Numbers, second: Numbers) -> tuple[Numbers, Numbers]:
    """Return the derivatives by z of ``first`` and ``second`` of `phi_pair`, to eleven digits."""
    small = np.abs(z) < _SMALL
    few = bool(small.any())
    far = np.where(small, 1.0, z) if few else z
    of_first = (1 + z * first - first) / far
    of_second = (of_first - second) / far
    if few:
        near = z[small]
        of_first[small] = 1 / 2 + near * (1 / 3 + near * (1 / 8 + near * (1 / 30 + near * (1 / 144 + near / 840))))
        of_second[small] = 1 / 6 + near * (1 / 12 + near * (1 / 40 + near * (1 / 180 + near / 1008)))
    return of_first, of_second


def fallen(poles: Numbers, times: Array) -> Numbers:
    """Return e^z - 1, z = ``poles`` (n, s) [1/s] times ``times`` (m,) [s], (m, n, s).

    It is computed for one pole of each pair of conjugates only.
    """
    z = poles * times[:, None, None]
    if not np.iscomplexobj(z):
        return np.asarray(np.expm1(z))
    found = np.empty_like(z)
    still = ~poles.imag.any(axis=0)
    found[..., still] = np.expm1(z.real[..., still])
    pairs: dict[bytes, int] = {}
    ringing = np.flatnonzero(~still).tolist()
    kept = [pairs.setdefault(min(poles[:, k].tobytes(), poles[:, k].conj().tobytes()), k) for k in ringing]
    own = list(pairs.values())
    found[..., own] = grown(z[..., own])
    for k, other in zip(ringing, kept, strict=True):
        if k != other:
            same = np.array_equal(poles[:, k], poles[:, other])
            found[..., k] = found[..., other] if same else found[..., other].conj()
    return found


def recursion(kept: Numbers, gained: Numbers, before: Numbers) -> Numbers:
    """Return x_k = kept_k x_(k-1) + gained_k (k, ...), x_(-1) = ``before``: inside chunks all at once, then along them.

    ``kept`` broadcasts to ``gained``. Within a chunk, sums of 2, 4, 8, ... terms are computed from sums of half the
    length.
    """
    length = len(gained)
    chunks = -(-length // _CHUNK)

    def chunked(values: Numbers) -> Numbers:
        padded = np.zeros((chunks * _CHUNK, *values.shape[1:]), dtype=np.result_type(kept, gained))
        padded[:length] = values
        return padded.reshape(chunks, _CHUNK, *values.shape[1:])

    factor, x = chunked(kept), chunked(gained)
    step = 1
    while step < _CHUNK:
        x[:, step:] += factor[:, step:] * x[:, :-step]
        factor[:, step:] *= factor[:, :-step].copy()
        step *= 2
    state = before
    for k in range(chunks):
        x[k] += factor[k] * state
        state = x[k, -1]
    return np.asarray(x.reshape(chunks * _CHUNK, *gained.shape[1:])[:length])


def fastest_modes(system: StateSpace) -> Array:
    """Return the magnitude [1/s] of the fastest pole of each netlist (n,); next to nothing where there is none."""
    return np.asarray(np.abs(system.poles()).max(axis=1, initial=1e-300))


def similar(fastest: Array) -> list[NDArray[np.intp]]:
    """Group netlists of similar time constants: one fast member would slow all others."""
    order = np.argsort(fastest, kind="stable")
    batches, start = [], 0
    for k in range(1, len(order) + 1):
        full = k - start == _LARGEST_BATCH
        if k == len(order) or full or fastest[order[k]] > _SPREAD * fastest[order[start]]:
            batches.append(order[start:k])
            start = k
    return batches
