"""Starting values for a spectrum, for several ion paths.

Time constants are scattered over the band and beyond; what is linear once they are given is solved for by non-negative
least squares.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array, ComplexArray

#: Sets of starting values for one spectrum.
SETS = 60
#: Size, relative to the data's, of a term whose coefficient by non-negative least squares is zero.
_LITTLE = 1e-3


def scattered(
    z: ComplexArray, random: np.random.Generator, start: Callable[[ComplexArray, float], list[float]]
) -> Array:
    """Return starting values (m, n + 1), Rdc first, for a spectrum ``z`` (f,) [ohm].

    ``start`` makes those of the ion path from its impedance (f,) and a place in (0, 1). There is one place in each of
    `SETS` equal parts, ascending, so that a search covers all of it.
    """
    found = []
    for place in ((np.arange(SETS) + random.uniform(0, 1, SETS)) / SETS).tolist():
        # at random, often so large that it has hardly any effect
        dc = float(np.abs(z).max()) * 10 ** random.choice([random.uniform(0, 0.3), random.uniform(0, 3)])
        found.append([dc, *start(np.asarray(1 / (1 / z - 1 / dc)), place)])
    return np.array(found)


def amounts(columns: ComplexArray, target: ComplexArray) -> Array:
    """Return positive coefficients (k,) of ``columns`` (f, k) for the least relative residuals of ``target`` (f,)."""
    from scipy.optimize import nnls

    relative = columns / np.abs(target)[:, None]
    matrix = np.concatenate([relative.real, relative.imag])
    aim = np.concatenate([(target / np.abs(target)).real, (target / np.abs(target)).imag])
    size = np.linalg.norm(matrix, axis=0)
    size[size == 0] = 1.0
    found = nnls(matrix / size, aim)[0]
    return np.asarray(np.maximum(found, _LITTLE * float(np.linalg.norm(aim))) / size)
