"""Estimates how the noise of a spectrum varies over its band, from the residuals of a fit.

The standard deviation of a point relative to the fit's weighting is taken as a power of the frequency, of abs(Z), or of
both, with the exponents of greatest restricted likelihood. Weights of even noise would take the noisiest points, often
the lowest frequencies, for as good as the others, and the intervals of what these determine would be too narrow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..fit.criteria import structured
from ..fit.result import FitResult

#: Fewest readings beyond the parameters that show a law, and least relative residuals that are noise.
_FEWEST, _LEAST = 12, 1e-7
#: Decrease of -2 log(restricted likelihood) for which an exponent is taken.
_GAIN = 4.0
#: Largest exponent, and the widths of the steps of the search.
_MOST, _WIDTHS = 1.5, (0.3, 0.1, 0.03, 0.01)
#: Step of an exponent for second differences of the likelihood.
_STEP = 0.03


@dataclass(frozen=True, eq=False)
class NoiseLaw:
    """How the noise of points varies: ``exponents`` (q,) of quantities whose centred logarithms are ``laws`` (q, f).

    ``covariance`` (q, q) is that of the exponents.
    """

    laws: Array
    exponents: Array
    covariance: Array

    @property
    def profile(self) -> Array:
        """Standard deviation of each point (f,) relative to their geometric mean."""
        return np.asarray(np.exp(self.exponents @ self.laws))

    def freedom(self, fit: FitResult) -> Array:
        """Return the degrees of freedom (n,) of the errors of a ``fit`` with these weights.

        The variance of a value is that of the residuals, times what the law has it differ where the value is
        determined; both are estimates.
        """
        laws = np.tile(self.laws, 2)
        shares = fit.projection**2
        there = shares / shares.sum(axis=1, keepdims=True) @ laws.T - laws @ fit.residuals**2 / fit.sum_of_squares
        doubt = 4 * np.einsum("nq,qk,nk->n", there, self.covariance, there)
        return np.asarray(2 / (2 / fit.freedom + doubt))


def noise_law(fit: FitResult, frequency: Array, modulus: Array) -> NoiseLaw | None:
    """Return how the noise of one spectrum varies with ``frequency`` (f,) [Hz] and ``modulus`` (f,) [ohm].

    None if it does not, if the points are too few to tell, or if the residuals have a structure, which is no noise.
    ``fit`` is that of the spectrum alone, with real parts before imaginary ones.
    """
    residuals = fit.residuals
    if len(residuals) - fit.count < _FEWEST or fit.rmse < _LEAST or any(map(structured, np.split(residuals, 2))):
        return None
    every = np.log(np.array([frequency, modulus]))
    every -= every.mean(axis=1, keepdims=True)
    columns = np.column_stack([fit.slopes / np.linalg.norm(fit.slopes, axis=0), residuals / np.linalg.norm(residuals)])
    best, least = None, _restricted(columns)
    for chosen in ([0], [1], [0, 1]):
        laws = every[chosen]

        def cost(exponents: Array, laws: Array = laws) -> float:
            return _restricted(columns * np.exp(-np.tile(exponents @ laws, 2))[:, None])

        exponents, found = _minimum(cost, np.zeros(len(chosen)))
        before = 0 if best is None else len(best.exponents)
        if found < least - _GAIN * (len(chosen) - before):
            curvature = _curvature(cost, exponents)
            if (np.linalg.eigvalsh(curvature) > 0).all():
                best, least = NoiseLaw(laws, exponents, np.asarray(2 * np.linalg.inv(curvature))), found
    return best


def _restricted(columns: Array) -> float:
    """Return -2 log(restricted likelihood), up to a constant, of weighted slopes and, last, residuals.

    The weights have the geometric mean 1.
    """
    diagonal = np.log(np.maximum(np.abs(np.diag(np.linalg.qr(columns, mode="r"))), np.finfo(float).tiny))
    return float(2 * diagonal[:-1].sum() + 2 * (len(columns) - len(diagonal) + 1) * diagonal[-1])


def _minimum(cost: Callable[[Array], float], start: Array) -> tuple[Array, float]:
    """Return the exponents of least cost, and the cost, by steps along each of them that become shorter."""
    at, least = start, cost(start)
    for width in _WIDTHS:
        moved = True
        while moved:
            moved = False
            for step in np.vstack([np.eye(len(at)), -np.eye(len(at))]) * width:
                trial = at + step
                if np.abs(trial).max() <= _MOST and (value := cost(trial)) < least:
                    at, least, moved = trial, value, True
    return at, least


def _curvature(cost: Callable[[Array], float], at: Array) -> Array:
    """Return the second derivatives (q, q) of a cost."""
    steps = _STEP * np.eye(len(at))
    rows = [[cost(at + a + b) - cost(at + a - b) - cost(at - a + b) + cost(at - a - b) for b in steps] for a in steps]
    return np.array(rows) / (4 * _STEP**2)
