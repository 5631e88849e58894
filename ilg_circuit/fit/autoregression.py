"""Computes the errors of a least-squares fit with autocorrelated residuals, by a first-order autoregression.

Every row of residuals (a spectrum has two, real and imaginary parts) is modelled as noise with the correlation
S = exp(-distance/length). The length maximises the restricted likelihood (REML, which uses the part of the residuals
that no parameter explains; the plain likelihood gives too short a length). The variance is the moment estimate. The
covariance of the estimate with slopes J is (J^T J)^-1 J^T (sum of v S) J (J^T J)^-1. S^-1 is tridiagonal, so that all
costs are proportional to the number of samples.

Distance is the difference of indices, as in an AR(1), or of the abscissae (time for a record: correlation decreases
over a gap), whichever has the greater likelihood. For evenly spaced samples these are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .observation import Observation
from .result import FitResult

#: Longest correlation length, as a fraction of the row, that a row can determine.
_LONGEST = 0.1
#: Distance of neighbours, in correlation lengths, above which they are independent: exp(-10).
_SHORTEST = 0.1
#: Relative variation of the distances below which samples count as evenly spaced.
_EVEN = 0.01
#: Singular value, relative to 1, below which a row does not determine a direction of the parameters.
_FELT = 1e-6
#: Least number of samples beyond the parameters from which a row's correlation is estimated.
_FEWEST = 8


@dataclass(frozen=True)
class Autoregression:
    """Covariance (n, n) of a fit's values, in their units, and degrees of freedom (n,) of the errors.

    ``correlations`` are correlations of neighbours at the median distance, one per row of residuals; ``samples`` are
    the effective numbers of independent samples of each row.
    """

    covariance: Array
    freedom: Array
    correlations: tuple[float, ...]
    samples: tuple[float, ...]

    @property
    def errors(self) -> Array:
        """Standard errors (n,)."""
        return np.sqrt(np.diag(self.covariance))


def autoregression(fit: FitResult) -> Autoregression:
    """Return the errors of ``fit`` by a first-order autoregression of each row of its residuals.

    Degrees of freedom are the independent samples minus the parameters that they determine, but at least half of the
    independent samples: the long-term variance, which determines the errors for slopes longer than the correlation, has
    that many from the information on the length alone. Several rows are combined by Satterthwaite's formula.
    """
    size = np.linalg.norm(fit.slopes, axis=0)
    tangent, upper = np.linalg.qr(fit.slopes / size)
    inverse = np.linalg.inv(upper) / size[:, None]
    rows = sequences(fit)
    noises = [_noise(fit.residuals[r.index], tangent[r.index], r.distances) for r in rows]
    tangents = [tangent[r.index] for r in rows]
    spread = [q.T @ noise.correlated(q) for q, noise in zip(tangents, noises, strict=True)]
    variances = _variances([fit.residuals[r.index] for r in rows], tangents, spread)
    parts = np.array([v * inverse @ s @ inverse.T for v, s in zip(variances, spread, strict=True)])
    n = len(fit.values)
    samples = np.array([noise.samples for noise in noises])
    spent = np.array([float((q**2).sum()) for q in tangents])
    spare = np.maximum(samples - spent, samples / 2)
    shares = np.diagonal(parts, axis1=1, axis2=2)[:, :n]
    freedom = shares.sum(axis=0) ** 2 / np.maximum((shares**2 / spare[:, None]).sum(axis=0), np.finfo(float).tiny)
    return Autoregression(
        covariance=parts.sum(axis=0)[:n, :n],
        freedom=freedom,
        correlations=tuple(float(np.exp(-1 / noise.length)) for noise in noises),
        samples=tuple(samples.tolist()),
    )


@dataclass(frozen=True)
class Sequence:
    """A row of consecutive samples: their ``index`` (m,) among all, and candidate ``distances`` (m - 1,).

    Distances are divided by their median.
    """

    index: NDArray[np.intp]
    distances: tuple[Array, ...]


def sequences(fit: FitResult) -> tuple[Sequence, ...]:
    """Return the rows of residuals of ``fit``, one per channel of each observation, in the order of the abscissae."""
    found = []
    for observation, part in zip(fit.problem.observations, fit.problem.slices, strict=True):
        for index in np.split(np.arange(part.start, part.stop), observation.channels):
            order, distances = _along(observation, len(index))
            found.append(Sequence(index[order], distances))
    return tuple(found)


def _along(observation: Observation, count: int) -> tuple[NDArray[np.intp], tuple[Array, ...]]:
    """Return the order of ``count`` samples along the abscissa, and their distances by index and by abscissa."""
    even = np.ones(count - 1)
    places = np.asarray(observation.x, dtype=float)
    if places.shape != (count,):
        return np.arange(count), (even,)
    order = np.argsort(places, kind="stable")
    gaps = np.diff(places[order])
    if count < 3 or not (gaps > 0).all():
        return order, (even,)
    gaps /= np.median(gaps)
    return order, (even,) if np.abs(gaps - 1).max() < _EVEN else (even, gaps)


@dataclass(frozen=True)
class _Noise:
    """Noise of one row: ``steps`` (m - 1,) are the correlations of neighbours, ``length`` in median distances."""

    length: float
    steps: Array

    def correlated(self, columns: Array) -> Array:
        """Return S times ``columns`` (m, k)."""
        from scipy.linalg import solveh_banded

        innovation = 1 - self.steps**2
        bands = np.zeros((2, len(columns)))
        bands[1] = 1.0
        bands[1, 1:] += self.steps**2 / innovation
        bands[1, :-1] += self.steps**2 / innovation
        bands[0, 1:] = -self.steps / innovation
        return np.asarray(solveh_banded(bands, columns))

    @property
    def samples(self) -> float:
        """Number of independent samples whose mean has the same variance."""
        ones = np.ones((len(self.steps) + 1, 1))
        return float(len(ones) ** 2 / self.correlated(ones).sum())


def _noise(residuals: Array, tangent: Array, candidates: tuple[Array, ...]) -> _Noise:
    """Return the noise of greatest restricted likelihood for a row of ``residuals`` (m,).

    ``tangent`` (m, p) are the slopes of the row with respect to the parameters.
    """
    from scipy.optimize import minimize_scalar

    u, sizes, _ = np.linalg.svd(tangent, full_matrices=False)
    u = u[:, sizes > _FELT]
    power = float(np.linalg.norm(residuals))
    if not power or len(residuals) - u.shape[1] < _FEWEST:
        return _Noise(_SHORTEST, np.exp(-candidates[0] / _SHORTEST))
    columns = np.column_stack([u, residuals / power])
    found = []
    for distances in candidates:

        def cost(logarithm: float, distances: Array = distances) -> float:
            return _restricted(columns, np.exp(-distances / np.exp(logarithm)))

        low, high = np.log(_SHORTEST * distances.min()), np.log(_LONGEST * (distances.sum() + 1))
        grid = np.linspace(low, high, max(int(np.ceil((high - low) / np.log(2))), 2) + 1)
        costs = [cost(x) for x in grid]
        k = int(np.argmin(costs))
        within = (grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)])
        best = minimize_scalar(cost, bounds=within, method="bounded", options={"xatol": 1e-6})
        x = float(best.x) if best.fun < costs[k] else float(grid[k])
        found.append((min(float(best.fun), costs[k]), _Noise(float(np.exp(x)), np.exp(-distances / np.exp(x)))))
    return min(found, key=lambda pair: pair[0])[1]


def _restricted(columns: Array, steps: Array) -> float:
    """Return minus the restricted log likelihood, up to a constant, with correlations ``steps`` (m - 1,) of neighbours.

    ``columns`` (m, p + 1) are the directions of the parameters and, last, the residuals.
    """
    innovation = 1 - steps**2
    white = columns.copy()
    white[1:] = (columns[1:] - steps[:, None] * columns[:-1]) / np.sqrt(innovation)[:, None]
    # the directions are orthonormal and whitened with a bounded correlation, so that their products are accurate
    try:
        diagonal = np.diag(np.linalg.cholesky(white.T @ white))
    except np.linalg.LinAlgError:  # an exact record: its residuals are rounding, and may lie in the other directions
        diagonal = np.abs(np.diag(np.linalg.qr(white, mode="r")))
    spare = len(columns) - len(diagonal) + 1
    least = np.finfo(float).tiny
    logarithms = np.log(np.maximum(diagonal, least))
    return float(0.5 * np.log(innovation).sum() + logarithms[:-1].sum() + spare * logarithms[-1])


def _variances(residuals: list[Array], tangents: list[Array], spread: list[Array]) -> Array:
    """Return the variances of the rows for which the expected sums of squares equal the residuals'.

    With residuals (1 - Q Q^T) e, the expectation in row s is v_s (m_s - 2 tr H_s) + sum of v_t tr(Q_s^T Q_s H_t) over
    all t, H = Q^T S Q; for a single row it is v (m - tr H).
    """
    grams = [q.T @ q for q in tangents]
    counts = np.array([len(r) for r in residuals], dtype=float)
    squares = np.array([float(r @ r) for r in residuals])
    expected = np.array([[float((g * h).sum()) for h in spread] for g in grams])
    expected += np.diag(counts - 2 * np.array([float(np.trace(h)) for h in spread]))
    # the estimate may be zero in a row that is dominated by another row's noise: its residuals are a lower limit
    return np.maximum(np.linalg.solve(expected, squares), squares / counts)
