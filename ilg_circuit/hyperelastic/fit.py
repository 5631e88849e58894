"""Fits one model to one or several load tests together by least squares, from many starts.

The parameters are the absolute value of each term's modulus g_i = mu_i alpha_i/2, and alpha_i. If the material is
constrained to be stable, all signs of g_i are positive, so that mu_i alpha_i > 0 holds by construction; otherwise the
signs of the start are kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..findings import Finding
from ..fit.fitting import finished, with_starts
from ..fit.misfit import Misfit
from ..fit.multistart import StartSummary
from ..fit.problem import Problem
from ..fit.reported import Reported, autocorrelated, with_autocorrelation
from ..fit.result import FitResult
from ..measurements.load_test import LoadTest
from .material import MODES, Ogden, stress_derivatives
from .misfit import stress_misfit
from .problem import MOST_READINGS, residual_units, stress_problem, thinned
from .search import RESOLUTION, descents, search

MOST_TERMS = 4

#: alphas that a model fixes; an Ogden material has none
FIXED: dict[str, tuple[float, ...]] = {"neo-hookean": (2.0,), "mooney-rivlin": (2.0, -2.0)}

#: Upper limit of |alpha_i| ln(l) over the data, far above any rubber's and without overflow.
_STEEPEST = 40.0
#: Relative difference of sums of squares below which two minima are the same.
_SAME = 1e-3
#: Residuals below this fraction of the largest stress are rounding.
ROUNDING = 1e-5
#: Condition of the slopes above which a combination of parameters is not determined.
_SINGULAR = 1e9


@dataclass(frozen=True, eq=False)
class HyperelasticFit:
    """A model fitted to load tests: a view of ``result``, whose values are abs(g_i) [Pa], then alpha_i.

    ``signs`` (n,) are the signs of the moduli. ``constrained`` is True if g_i > 0 was imposed, ``weighting`` is
    absolute or relative; see `fit_model`.
    """

    model: str
    tests: tuple[LoadTest, ...]
    result: FitResult
    signs: Array
    constrained: bool
    weighting: str

    @cached_property
    def material(self) -> Ogden:
        """The fitted material; an alpha of exactly 0, which has no mu, becomes the nearest number."""
        by_label = self.result.by_label()
        values = [by_label[p.name] for p in self.result.problem.parameters]
        alphas = [alpha or np.finfo(float).eps for alpha in values[self.terms :]]
        return Ogden.from_moduli(self.signs * values[: self.terms], alphas)

    @property
    def name(self) -> str:
        """The model's name for people."""
        return describe(self.model, self.terms)

    @property
    def terms(self) -> int:
        return len(self.signs)

    @property
    def samples(self) -> int:
        return len(self.result.residuals)

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Data - model [Pa] of each test."""
        return tuple(self.result.residuals_of(k) for k in range(len(self.tests)))

    @property
    def rmse(self) -> float:
        """Root mean square of the residuals of all tests [Pa]."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """The misfit of each test."""
        return tuple(stress_misfit(t, r) for t, r in zip(self.tests, self.residuals, strict=True))

    @property
    def modulus_known(self) -> bool:
        """True if E is positive and its standard error less than E; True if its error is not determined."""
        g = self.material.shear_modulus
        return g > 0 and not self.modulus_error >= g

    @property
    def success(self) -> bool:
        """True if the material describes every test, and E is determined."""
        return self.modulus_known and not any(m.fail for m in self.misfits)

    @property
    def aic(self) -> float:
        return self._likelihood + 2 * self.result.count

    @property
    def bic(self) -> float:
        return self._likelihood + math.log(self.samples) * self.result.count

    @property
    def _likelihood(self) -> float:
        return self.samples * math.log(max(self.result.rmse, RESOLUTION) ** 2)

    @property
    def stretch_range(self) -> tuple[float, float]:
        """Smallest and largest stretch of all tests, 1 included."""
        return min(t.range[0] for t in self.tests), max(t.range[1] for t in self.tests)

    @property
    def farthest(self) -> float:
        """The stretch farthest from 1, by logarithm, of all tests."""
        low, high = self.stretch_range
        return high if high * low >= 1 else low

    @cached_property
    def reported(self) -> Reported | None:
        """Errors that allow for autocorrelated residuals; None if residuals are noise, or errors not determined."""
        determined = np.isfinite(self.result.covariance).all()
        if not determined or self.result.rmse < ROUNDING or not autocorrelated(self.result):
            return None
        return with_autocorrelation(self.result)

    @cached_property
    def plain_covariance(self) -> Array:
        """Covariance (2 n, 2 n) of (g_1 .. g_n [Pa], alpha_1 .. alpha_n) for independent residuals.

        Rows of alphas that the model fixes are zero; all are NaN if the data do not determine a combination.
        """
        return self._completed(self.result.covariance)

    @cached_property
    def covariance(self) -> Array:
        """The same (2 n, 2 n), allowing for autocorrelated residuals."""
        return self.plain_covariance if self.reported is None else self._completed(self.reported.covariance)

    def _completed(self, moved: Array) -> Array:
        """Return the covariance of the fitted values, with zero rows for fixed ones, in the moduli's signs."""
        covariance = np.zeros((2 * self.terms, 2 * self.terms))
        covariance[: self.result.count, : self.result.count] = moved
        signs = np.concatenate([self.signs, np.ones(self.terms)])
        return covariance * np.outer(signs, signs)

    @property
    def modulus_error(self) -> float:
        """Standard error of G [Pa]; NaN where undetermined."""
        return float(np.sqrt(self.covariance[: self.terms, : self.terms].sum()))

    @property
    def plain_modulus_error(self) -> float:
        """Standard error of G [Pa] for independent residuals; NaN where undetermined."""
        return float(np.sqrt(self.plain_covariance[: self.terms, : self.terms].sum()))

    @property
    def to_parameters(self) -> Array:
        """Derivatives (2 n, 2 n) of (mu_1 .. mu_n [Pa], alpha_1 .. alpha_n) by (g_1 .. g_n [Pa], alpha_1 ..)."""
        n, mu, alpha = self.terms, np.array(self.material.mu), np.array(self.material.alpha)
        jacobian = np.eye(2 * n)
        jacobian[:n, :n] = np.diag(2 / alpha)
        jacobian[:n, n:] = np.diag(-mu / alpha)
        return jacobian

    def parameter_covariance(self) -> Array:
        """Return the covariance (2 n, 2 n) of (mu_1 .. mu_n [Pa], alpha_1 .. alpha_n), by the delta method."""
        return self.to_parameters @ self.covariance @ self.to_parameters.T

    def nominal_error(self, mode: str, stretch: float) -> float:
        """Return the standard error of the predicted nominal stress [Pa], by the delta method; NaN if undetermined."""
        gradient = stress_derivatives(mode, np.array([stretch]), self.material.moduli, self.material.alpha)
        return float(np.sqrt(max((gradient @ self.covariance @ gradient.T).item(), 0.0)))

    @cached_property
    def undetermined(self) -> tuple[Finding, ...]:
        """Findings on undetermined parameters: a modulus to a factor of ten, an alpha to its own size or its limits."""
        if np.isnan(self.covariance).any():
            return (Finding("terms-act-alike"),)
        n, errors = self.terms, np.sqrt(np.diag(self.covariance)).tolist()
        steepest = self.result.problem.parameters[n].upper
        found = []
        for i, (g, alpha) in enumerate(zip(self.material.moduli, self.material.alpha, strict=True)):
            values = {"term": i + 1, "alpha": alpha, "error": errors[n + i]}
            if errors[i] > math.log(10) * abs(g):
                found.append(Finding("modulus-not-determined", values={"term": i + 1}))
            if errors[n + i] > max(abs(alpha), 1.0):
                found.append(Finding("alpha-not-determined", values=values))
            if self.model == "ogden" and abs(alpha) > 0.99 * steepest:
                found.append(Finding("alpha-ran-away", values=values))
        return tuple(found)


def fit_model(
    tests: Sequence[LoadTest],
    model: str = "ogden",
    terms: int | None = None,
    *,
    constrained: bool = True,
    weighting: str = "absolute",
    seed: int = 0,
) -> HyperelasticFit:
    """Return the fit of one model to one or several tests together.

    Parameters
    ----------
    tests
        Load tests, all readings of which are fitted. Each test's residuals have a separate variance.
    model, terms
        ogden with ``terms`` 1 to 4, neo-hookean, or mooney-rivlin.
    constrained
        Keeps mu_i alpha_i > 0, which suffices for stability.
    weighting
        absolute: every reading to the same stress; relative: to its own size, down to a hundredth of the largest.
    seed
        The same seed gives the same starts.

    Raises
    ------
    InputError
        There are too few readings, or the model does not exist.
    """
    given = tuple(tests)
    fixed = _require_model(given, model, terms, weighting)
    count = len(fixed) if fixed else terms or 1
    unknowns = count if fixed else 2 * count
    readings = sum(len(t.stress) for t in given)
    if readings <= unknowns:
        raise InputError(
            f"{readings} readings are too few for {describe(model, count)}, which has {unknowns} constants: give at "
            f"least {unknowns + 1}, or ask for fewer terms"
        )
    steepest = _STEEPEST / max(float(np.abs(np.log(t.stretch)).max()) for t in given)
    units = residual_units(given, weighting)
    whole = partial(stress_problem, given, units, fixed, steepest)
    coarse = partial(stress_problem, *thinned(given, units), fixed, steepest)
    found, evaluations = search(coarse, count, constrained, seed)
    agreeing, best = max(found.agreeing, found.near(_SAME)), found.best
    if readings > MOST_READINGS:
        # the best minimum of the thinned readings may be the second best of all readings
        ends = [run.parameters for run in (best, *found.runs[agreeing : agreeing + 2])]
        refined, more = descents(whole, count, ends)
        best, evaluations = refined.best, evaluations + more
    moduli, alphas = best.parameters[:count], best.parameters[count:]
    if not fixed:  # the order of terms is arbitrary: by their part of G, the largest first
        order = np.argsort(-np.abs(moduli), kind="stable")
        moduli, alphas = moduli[order], alphas[order]
        if all(t.mode == "planar" for t in given):  # planar stress is even in alpha: choose one of the equal fits
            alphas = np.abs(alphas)
    signs = np.sign(moduli)
    result = _finished(whole(signs), np.concatenate([np.abs(moduli), alphas]), best.offset, evaluations)
    result = with_starts(result, StartSummary(len(found.runs), agreeing))
    return HyperelasticFit(model, given, result, signs, constrained, weighting)


def describe(model: str, terms: int) -> str:
    """Return a model's name for people."""
    names = {"neo-hookean": "neo-Hookean", "mooney-rivlin": "Mooney-Rivlin"}
    return names.get(model) or f"Ogden with {terms} term{'s' if terms > 1 else ''}"


def _require_model(
    tests: tuple[LoadTest, ...], model: str, terms: int | None, weighting: str
) -> tuple[float, ...] | None:
    """Return the alphas that a model fixes. Raises InputError for an invalid model."""
    if not tests:
        raise InputError(f"no test was given; give at least one of {', '.join(MODES)}")
    if model != "ogden" and model not in FIXED:
        raise InputError(f"model is '{model}'; choose ogden, {' or '.join(FIXED)}")
    if model == "ogden" and (terms is None or not 1 <= terms <= MOST_TERMS):
        raise InputError(f"terms is {terms}; an Ogden fit has 1 to {MOST_TERMS}")
    fixed = FIXED.get(model)
    if fixed and terms not in (None, len(fixed)):
        raise InputError(f"terms is {terms}, but {describe(model, 1)} has {len(fixed)}; leave it out")
    if weighting not in ("absolute", "relative"):
        raise InputError(f"weighting is '{weighting}'; choose absolute or relative")
    return fixed


def _finished(problem: Problem, values: Array, offset: float, evaluations: int) -> FitResult:
    """Return the result at ``values``; the variance is at least that due to rounding."""
    x = problem.scales.coordinates(values)
    prediction, slopes = problem.derivatives(x)
    residuals = problem.data - prediction
    samples, unknowns = slopes.shape
    exact = float(residuals @ residuals) <= samples * RESOLUTION**2
    return finished(
        problem,
        x,
        np.empty(0),
        residuals,
        slopes,
        offset=offset,
        evaluations=evaluations,
        variance=samples * RESOLUTION**2 / (samples - unknowns) if exact else None,
        singular=_SINGULAR,
    )
