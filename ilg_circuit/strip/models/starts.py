"""What the starting values of several ion paths for a spectrum share.

Time constants are scattered over the band and beyond; what is linear once they are given is solved for by non-negative
least squares.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, ComplexArray

#: Sets of starting values for one spectrum.
SETS = 60
#: A term that non-negative least squares leaves out enters by this part of the data's size.
_LITTLE = 1e-3


def places(random: np.random.Generator) -> list[float]:
    """Return places in (0, 1), one in each of `SETS` equal parts, ascending, so that a search covers all of it."""
    spread: list[float] = ((np.arange(SETS) + random.uniform(0, 1, SETS)) / SETS).tolist()
    return spread


def electron_path(z: ComplexArray, random: np.random.Generator) -> tuple[float, ComplexArray]:
    """Return an Rdc [ohm] at random, often so large that it is hardly seen, and the impedance (f,) beside it."""
    dc = float(np.abs(z).max()) * 10 ** random.choice([random.uniform(0, 0.3), random.uniform(0, 3)])
    return dc, np.asarray(1 / (1 / z - 1 / dc))


def amounts(columns: ComplexArray, target: ComplexArray) -> Array:
    """Return positive amounts (k,) of ``columns`` (f, k) nearest to ``target`` (f,), in relative terms."""
    from scipy.optimize import nnls

    relative = columns / np.abs(target)[:, None]
    matrix = np.concatenate([relative.real, relative.imag])
    aim = np.concatenate([(target / np.abs(target)).real, (target / np.abs(target)).imag])
    size = np.linalg.norm(matrix, axis=0)
    size[size == 0] = 1.0
    found = nnls(matrix / size, aim)[0]
    return np.asarray(np.maximum(found, _LITTLE * float(np.linalg.norm(aim))) / size)
