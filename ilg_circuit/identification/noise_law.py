"""Estimates how the noise of a spectrum varies over its band, from the residuals of a fit.

The standard deviation of a point relative to the fit's weighting is taken as a power of the frequency, of abs(Z), or of
both, or as even noise with a floor, of the voltage's readings (it is felt where abs(Z) is small) or of the current's
(where it is large). The constants are those of greatest restricted likelihood. Weights of even noise would take the
noisiest points, often the lowest frequencies, for as good as the others, and the intervals of what these determine
would be too narrow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..fit.criteria import structured
from ..fit.result import FitResult

#: Fewest readings beyond the parameters that show a law, and least relative residuals that are noise.
_FEWEST, _LEAST = 12, 1e-7
#: Decrease of -2 log(restricted likelihood) for which a constant is taken.
_GAIN = 4.0
#: Largest exponent, and the widths of the steps of the search.
_MOST, _WIDTHS = 1.5, (0.3, 0.1, 0.03, 0.01)
#: Step of a constant for differences.
_STEP = 0.03
#: Where a search for a floor begins, as parts of the points by their abs(Z).
_PLACES = (0.2, 0.5, 0.8)


@dataclass(frozen=True, eq=False)
class NoiseLaw:
    """How the noise of points varies: the ``logarithm`` (f,) of their standard deviations, about its mean.

    ``laws`` (q, f) are its derivatives by q constants, whose ``covariance`` is (q, q).
    """

    logarithm: Array
    laws: Array
    covariance: Array

    @property
    def profile(self) -> Array:
        """Standard deviation of each point (f,) relative to their geometric mean."""
        return np.asarray(np.exp(self.logarithm))

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
    columns = np.column_stack([fit.slopes / np.linalg.norm(fit.slopes, axis=0), residuals / np.linalg.norm(residuals)])
    best, least, before = None, _restricted(columns), 0
    for family in _families(np.log(frequency), np.log(modulus)):

        def cost(constants: Array, family: _Family = family) -> float:
            return _restricted(columns * np.exp(-np.tile(family.logarithm(constants), 2))[:, None])

        found = [_minimum(cost, start, family.most) for start in family.starts]
        constants, value = min(found, key=lambda each: each[1])
        count = len(constants)
        if value < least - _GAIN * (count - before):
            curvature = _curvature(cost, constants)
            if (np.linalg.eigvalsh(curvature) > 0).all():
                covariance = np.asarray(2 * np.linalg.inv(curvature))
                best = NoiseLaw(family.logarithm(constants), family.slopes(constants), covariance)
                least, before = value, count
    return best


@dataclass(frozen=True, eq=False)
class _Family:
    """A law of noise: its ``shape`` gives logarithms (f,) for constants (q,), which begin at any of ``starts``.

    No constant is larger than ``most``.
    """

    shape: Callable[[Array], Array]
    starts: Sequence[Array]
    most: float

    def logarithm(self, constants: Array) -> Array:
        """Return the logarithms (f,) of the standard deviations about their mean."""
        found = self.shape(constants)
        return np.asarray(found - found.mean())

    def slopes(self, constants: Array) -> Array:
        """Return the derivatives (q, f) of the logarithms by the constants."""
        steps = 0.5 * _STEP * np.eye(len(constants))
        return np.array([(self.logarithm(constants + d) - self.logarithm(constants - d)) / _STEP for d in steps])


def _families(frequency: Array, modulus: Array) -> list[_Family]:
    """Return the laws that are tried, of the logarithms of frequencies and moduli (f,)."""
    every = np.array([frequency - frequency.mean(), modulus - modulus.mean()])

    def powers(chosen: list[int]) -> _Family:
        return _Family(lambda exponents: exponents @ every[chosen], [np.zeros(len(chosen))], _MOST)

    def floor(side: float) -> _Family:
        starts = [np.array([place]) for place in np.quantile(every[1], _PLACES).tolist()]
        most = float(np.abs(every[1]).max())
        return _Family(lambda at: 0.5 * np.logaddexp(0.0, 2 * side * (every[1] - at[0])), starts, most)

    return [powers([0]), powers([1]), floor(-1.0), floor(1.0), powers([0, 1])]


def _restricted(columns: Array) -> float:
    """Return -2 log(restricted likelihood), up to a constant, of weighted slopes and, last, residuals.

    The weights have the geometric mean 1.
    """
    diagonal = np.log(np.maximum(np.abs(np.diag(np.linalg.qr(columns, mode="r"))), np.finfo(float).tiny))
    return float(2 * diagonal[:-1].sum() + 2 * (len(columns) - len(diagonal) + 1) * diagonal[-1])


def _minimum(cost: Callable[[Array], float], start: Array, most: float) -> tuple[Array, float]:
    """Return the constants of least cost, and the cost, by steps along each of them that become shorter."""
    at, least = start, cost(start)
    for width in _WIDTHS:
        moved = True
        while moved:
            moved = False
            for step in np.vstack([np.eye(len(at)), -np.eye(len(at))]) * width:
                trial = at + step
                if np.abs(trial).max() <= most and (value := cost(trial)) < least:
                    at, least, moved = trial, value, True
    return at, least


def _curvature(cost: Callable[[Array], float], at: Array) -> Array:
    """Return the second derivatives (q, q) of a cost."""
    steps = _STEP * np.eye(len(at))
    rows = [[cost(at + a + b) - cost(at + a - b) - cost(at - a + b) + cost(at - a - b) for b in steps] for a in steps]
    return np.array(rows) / (4 * _STEP**2)
