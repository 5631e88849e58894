"""Estimates Young's modulus from the readings at small strains alone: the tangent at stretch 1, not a secant.

The ratio of the stress to a neo-Hookean material's stress with G = 1 equals G at stretch 1, for every load. It is
fitted by a polynomial in the logarithm of the stretch for each load, all with the same value at 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..fit.criteria import autocorrelation
from ..measurements.load_test import LoadTest
from .material import Ogden

#: Largest small strain, up to which the stress is determined mainly by E.
SMALL = 0.2
#: Largest order of the polynomial, and largest number of unknowns relative to the readings.
_MOST, _UNKNOWN = 4, 0.6
#: Least number of readings for a tangent: for a line and for its residuals.
_FEWEST = 4


def tangent_modulus(tests: Sequence[LoadTest]) -> tuple[float, float] | None:
    """Return E and its standard error [Pa] from the readings of ``tests`` at small strains alone.

    The order of the polynomial has the lowest BIC or, for few readings, the lowest corrected AIC. The error allows for
    autocorrelation, and includes the change by one more order. None if there are too few readings, or E does not exceed
    its error.
    """
    small = [(t.mode, t.stretch[near], t.stress[near]) for t in tests for near in [np.abs(t.stretch - 1) <= SMALL]]
    small = [part for part in small if len(part[1])]
    stress = np.concatenate([p for *_, p in small]) if small else np.empty(0)
    if len(stress) < _FEWEST:
        return None
    fits = [_fitted(small, stress, order) for order in range(_MOST + 1) if _fits(small, order)]
    best = int(np.argmin([criterion for *_, criterion in fits]))
    g, error, _ = fits[best]
    other = fits[best + 1] if best + 1 < len(fits) else fits[best - 1]
    error = float(np.hypot(error, other[0] - g)) if len(fits) > 1 else np.inf
    return (3 * g, 3 * error) if g > error else None


def _fits(small: Sequence[tuple[str, Array, Array]], order: int) -> bool:
    """Return True if there are enough readings of each load for polynomials of an ``order``."""
    count = sum(len(stress) for *_, stress in small)
    enough = all(len(stress) > order for *_, stress in small) or not order
    return enough and 1 + order * len(small) <= _UNKNOWN * count


def _fitted(small: Sequence[tuple[str, Array, Array]], stress: Array, order: int) -> tuple[float, float, float]:
    """Return G, its standard error [Pa] and the criterion of polynomials of an ``order``."""
    columns = np.zeros((len(stress), 1 + order * len(small)))
    start = 0
    for k, (mode, stretch, _) in enumerate(small):
        rows = slice(start, start + len(stretch))
        unit, x = Ogden.neo_hookean(1.0).nominal(mode, stretch), np.log(stretch) / SMALL
        columns[rows, 0] = unit
        for power in range(1, order + 1):
            columns[rows, k * order + power] = unit * x**power
        start = rows.stop
    size = np.linalg.norm(columns, axis=0)
    q, upper = np.linalg.qr(columns / size)
    if not np.linalg.cond(upper) < 1e10:
        return np.nan, np.inf, np.inf
    inverse = np.linalg.inv(upper) / size[:, None]
    coefficients = inverse @ (q.T @ stress)
    residuals = stress - columns @ coefficients
    n, unknowns = columns.shape
    squares = max(float(residuals @ residuals), n * (1e-9 * float(np.abs(stress).max())) ** 2)
    correlation = min(max(autocorrelation(residuals), 0.0), 0.9)
    variance = squares / (n - unknowns) * (1 + correlation) / (1 - correlation)
    error = float(np.sqrt(variance) * np.linalg.norm(inverse[0]))
    penalty = unknowns * max(float(np.log(n)), 2 * n / (n - unknowns - 1))
    return float(coefficients[0]), error, n * float(np.log(squares / n)) + penalty
