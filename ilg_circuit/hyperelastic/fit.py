"""Least-squares fits of one model to one or several load tests: lmfit drives, from many starts.

The unknowns are each term's modulus g_i = mu_i alpha_i/2, by the logarithm of its size, and alpha_i. All signs are
positive where the material is to be stable, so that mu_i alpha_i > 0 holds by construction; otherwise they are those of
the start. At given alphas the stress is linear in g, so every random draw of alphas is completed by its best g
(non-negative least squares) before the best draws are polished.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..measurements.load_test import LoadTest
from .material import MODES, Ogden, stress_basis, stress_basis_slope

Array = NDArray[np.float64]

MOST_TERMS = 4

#: alphas that a model fixes; an Ogden material of n terms has none
FIXED: dict[str, tuple[float, ...]] = {"neo-hookean": (2.0,), "mooney-rivlin": (2.0, -2.0)}

#: |alpha_i| ln(l) stays below this over the data: far beyond any rubber, and far from overflow.
_STEEPEST = 40.0
_LOG_MODULUS = (-150.0, 50.0)  # of g_i over the largest stress
_DRAWS = 400
_POLISHED = 10
#: The search uses this many readings of all tests together, the last descent all of them.
_MOST_READINGS = 300
_MOST_EVALUATIONS = 200
#: Two ends of a fit are the same where their sums of squares differ by less than this part.
_SAME = 1e-3
#: No stress is read better than to this part of the largest: keeps statistics of exact data finite.
_RESOLUTION = 1e-7
_SINGULAR = 1e9


@dataclass(frozen=True)
class HyperelasticFit:
    """A model fitted to load tests.

    ``covariance`` (2 n, 2 n) is that of (g_1 .. g_n [Pa], alpha_1 .. alpha_n), g_i = mu_i alpha_i/2; rows of alphas
    that the model fixes are zero; NaN where the data leave a combination open. ``residuals`` = data - model [Pa] of
    each test. AIC and BIC count ``unknowns``. ``agreeing`` of ``starts`` polished starts ended here.
    ``undetermined`` says in words what the data leave open; empty if nothing.
    """

    model: str
    material: Ogden
    tests: tuple[LoadTest, ...]
    covariance: Array
    residuals: tuple[Array, ...]
    unknowns: int
    aic: float
    bic: float
    starts: int
    agreeing: int
    evaluations: int
    constrained: bool
    weighting: str
    undetermined: tuple[str, ...]

    @property
    def terms(self) -> int:
        return len(self.material.mu)

    @property
    def samples(self) -> int:
        return sum(len(r) for r in self.residuals)

    @property
    def rmse(self) -> float:
        """Over all readings of all tests [Pa]."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    @property
    def modulus_error(self) -> float:
        """Standard error of G [Pa]; NaN where undetermined."""
        n = self.terms
        return float(np.sqrt(self.covariance[:n, :n].sum()))

    def parameter_covariance(self) -> Array:
        """Covariance (2 n, 2 n) of (mu_1 .. mu_n [Pa], alpha_1 .. alpha_n), paper's convention, by the delta method."""
        n, mu, alpha = self.terms, np.array(self.material.mu), np.array(self.material.alpha)
        jacobian = np.eye(2 * n)
        jacobian[:n, :n] = np.diag(2 / alpha)
        jacobian[:n, n:] = np.diag(-mu / alpha)
        return np.asarray(jacobian @ self.covariance @ jacobian.T)

    def nominal_error(self, mode: str, stretch: float) -> float:
        """Standard error of the predicted nominal stress [Pa], by the delta method; NaN where undetermined."""
        gradient = _jacobian(mode, np.array([stretch]), np.array(self.material.moduli), np.array(self.material.alpha))
        return float(np.sqrt(max((gradient @ self.covariance @ gradient.T).item(), 0.0)))


@dataclass(frozen=True)
class _Problem:
    """Stacked data in units of ``scale`` [Pa], and their weights; the unknowns x are ln |g|, then the free alphas."""

    tests: tuple[LoadTest, ...]
    scale: float
    weights: Array
    data: Array
    terms: int
    fixed: tuple[float, ...] | None
    constrained: bool

    @property
    def steepest(self) -> float:
        """The largest |alpha| allowed."""
        return _STEEPEST / max(float(np.abs(np.log(t.stretch)).max()) for t in self.tests)

    def thinned(self) -> _Problem:
        """The same with a few hundred readings, for the search from many starts; itself if it has no more."""
        step = -(-len(self.data) // _MOST_READINGS)
        if step == 1:
            return self
        kept, tests, first = [], [], 0
        for t in self.tests:
            n = len(t.stretch)
            every = step if n > 10 * step else 1  # a test of few readings keeps them all
            part = slice((n - 1) % every, n, every)  # the last one, where the material is stiffest, stays
            kept.append(np.arange(first, first + n)[part])
            tests.append(replace(t, stretch=t.stretch[part], stress=t.stress[part]))
            first += n
        rows = np.concatenate(kept)
        return replace(self, tests=tuple(tests), weights=self.weights[rows], data=self.data[rows])

    def unpack(self, x: Array, signs: Array) -> tuple[Array, Array]:
        return signs * np.exp(x[: self.terms]), np.array(self.fixed) if self.fixed else x[self.terms :]

    def basis(self, alpha: Array) -> Array:
        parts = np.concatenate([stress_basis(t.mode, t.stretch, alpha) for t in self.tests])
        return np.asarray(self.weights[:, None] * parts)

    def residual(self, x: Array, signs: Array) -> Array:
        g, alpha = self.unpack(x, signs)
        return np.asarray(self.basis(alpha) @ g - self.weights * self.data)

    def jacobian(self, x: Array, signs: Array) -> Array:
        g, alpha = self.unpack(x, signs)
        full = np.concatenate([_jacobian(t.mode, t.stretch, g, alpha) for t in self.tests]) * self.weights[:, None]
        full[:, : self.terms] *= g
        return full[:, : self.terms] if self.fixed else full

    def starts(self, seed: int) -> list[tuple[Array, Array]]:
        """Starting points (x, signs), best first: random alphas with their best moduli."""
        steep = self.steepest * 0.45
        if self.fixed:
            alphas = np.array([self.fixed])
        else:
            random = np.random.default_rng(seed)
            shape = (_DRAWS, self.terms)
            # half the draws where rubbers are, half over whatever this range of stretches could tell apart
            ordinary = random.random(shape) < 0.5
            alphas = np.where(ordinary, random.uniform(-6, 10, shape), random.uniform(-steep, steep, shape))
            alphas = np.clip(alphas, -steep, steep)
        chosen = []
        # at fixed alphas the best g is one solution, signs included
        for positive in (True,) if self.constrained else (False,) if self.fixed else (True, False):
            ranked = sorted((self._start(a, positive) for a in alphas), key=lambda start: start[0])
            chosen += [(x, signs) for _, x, signs in ranked[:_POLISHED]]
        return chosen

    def _start(self, alpha: Array, positive: bool) -> tuple[float, Array, Array]:
        """Sum of squares, x and signs for these alphas, with the best g, or the best positive one."""
        from scipy.optimize import nnls

        basis, target = self.basis(alpha), self.weights * self.data
        size = np.linalg.norm(basis, axis=0)
        if positive:
            try:
                g = nnls(basis / size, target)[0]
            except RuntimeError:  # it cycles where two columns are the same
                g = np.zeros(self.terms)
        else:
            g = np.linalg.lstsq(basis / size, target, rcond=1e-10)[0]
        # a term that the draw does not want starts small, not at the end of a logarithm
        least = 1e-3 * max(float(np.abs(g).max()), float(np.linalg.norm(target)))
        signs = np.where(g < 0, -1.0, 1.0)
        g = np.maximum(np.abs(g), least) / size
        cost = float(((basis @ (signs * g) - target) ** 2).sum())
        return cost, np.concatenate([np.log(g), () if self.fixed else alpha]), signs


def fit_model(
    tests: Sequence[LoadTest],
    model: str = "ogden",
    terms: int | None = None,
    *,
    constrained: bool = True,
    weighting: str = "absolute",
    seed: int = 0,
) -> HyperelasticFit:
    """Fit ``model`` (ogden with ``terms`` 1 to 4, neo-hookean, mooney-rivlin) to one or several tests together.

    ``constrained`` keeps mu_i alpha_i > 0. ``weighting``: absolute (every reading to the same stress) or relative (to
    its own size, down to a hundredth of the largest). The same ``seed`` gives the same starts. Raises InputError for
    too few readings or a model that does not exist.
    """
    problem = _problem(tests, model, terms, constrained, weighting)
    unknowns = problem.terms * (1 if problem.fixed else 2)
    if len(problem.data) <= unknowns:
        raise InputError(
            f"{len(problem.data)} readings are too few for {describe(model, problem.terms)}, which has {unknowns} "
            f"constants: give at least {unknowns + 1}, or ask for fewer terms"
        )
    coarse = problem.thinned()
    ends = sorted((_polish(coarse, *start) for start in coarse.starts(seed)), key=lambda end: end.cost)
    floor = len(coarse.data) * _RESOLUTION**2
    agreeing = sum(end.cost <= ends[0].cost * (1 + _SAME) + floor for end in ends)
    evaluations = sum(end.evaluations for end in ends)
    best = ends[0]
    if coarse is not problem:
        # the best minimum of some readings may be the second of all
        finals = [_polish(problem, end.x, end.signs) for end in ends[:1] + ends[agreeing : agreeing + 2]]
        best = min(finals, key=lambda end: end.cost)
        evaluations += sum(end.evaluations for end in finals)
    return _finish(problem, model, best, weighting, len(ends), agreeing, evaluations)


def describe(model: str, terms: int) -> str:
    """A model's name for people."""
    names = {"neo-hookean": "neo-Hookean", "mooney-rivlin": "Mooney-Rivlin"}
    return names.get(model) or f"Ogden with {terms} term{'s' if terms > 1 else ''}"


def _problem(tests: Sequence[LoadTest], model: str, terms: int | None, constrained: bool, weighting: str) -> _Problem:
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
    stress = np.concatenate([t.stress for t in tests])
    scale = float(np.abs(stress).max())
    data = stress / scale
    weights = np.ones_like(data)
    if weighting == "relative":
        weights = 1 / np.maximum(np.abs(data), 0.01)
        weights /= np.sqrt(np.mean(weights**2))
    return _Problem(tuple(tests), scale, weights, data, len(fixed) if fixed else terms or 1, fixed, constrained)


@dataclass(frozen=True)
class _End:
    """Where a descent ended: sum of squares, unknowns, signs, and what it took."""

    cost: float
    x: Array
    signs: Array
    evaluations: int


def _polish(problem: _Problem, start: Array, signs: Array) -> _End:
    """lmfit's trust-region descent from ``start``."""
    import lmfit

    n, steepest = problem.terms, problem.steepest
    parameters = lmfit.Parameters()
    for j, value in enumerate(start):
        low, high = _LOG_MODULUS if j < n else (-steepest, steepest)
        parameters.add(f"p{j}", value=float(value), min=low, max=high)

    def unpack(current: lmfit.Parameters) -> Array:
        return np.array([p.value for p in current.values()])

    minimizer = lmfit.Minimizer(lambda p: problem.residual(unpack(p), signs), parameters, nan_policy="raise")
    with np.errstate(all="ignore"):  # lmfit's own covariance, of no use here, may be singular on the way
        result = minimizer.least_squares(
            jac=lambda p: problem.jacobian(unpack(p), signs),
            x_scale="jac",
            max_nfev=_MOST_EVALUATIONS,
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-14,
        )
    x = unpack(result.params)
    return _End(float((problem.residual(x, signs) ** 2).sum()), x, signs, int(result.nfev))


def _finish(
    problem: _Problem, model: str, end: _End, weighting: str, starts: int, agreeing: int, evaluations: int
) -> HyperelasticFit:
    x, signs = end.x, end.signs
    n, samples = problem.terms, len(problem.data)
    g, alpha = problem.unpack(x, signs)
    if not problem.fixed:  # the order of terms is free: by their part of G, the largest first
        order = np.argsort(-np.abs(g), kind="stable")
        g, alpha, signs = g[order], alpha[order], signs[order]
        x = np.concatenate([x[:n][order], alpha])
    if not problem.fixed and all(t.mode == "planar" for t in problem.tests):
        alpha = np.abs(alpha)  # planar stress is even in alpha: of all these equal fits, the one that others print
        x = np.concatenate([x[:n], alpha])
    # alpha = 0 exactly has no mu; the nearest number has, and the same stress
    alpha = np.where(alpha == 0, np.finfo(float).eps, alpha)
    material = Ogden.from_moduli(g * problem.scale, alpha)
    unknowns = len(x)
    cost = max(float((problem.residual(x, signs) ** 2).sum()), samples * _RESOLUTION**2)
    fitted = _covariance(problem.jacobian(x, signs)) * cost / (samples - unknowns)
    covariance = np.zeros((2 * n, 2 * n))
    units = np.concatenate([g * problem.scale, np.ones(unknowns - n)])
    covariance[:unknowns, :unknowns] = fitted * np.outer(units, units)
    likelihood = samples * math.log(cost / samples)
    return HyperelasticFit(
        model=model,
        material=material,
        tests=problem.tests,
        covariance=covariance,
        residuals=tuple(t.stress - material.nominal(t.mode, t.stretch) for t in problem.tests),
        unknowns=unknowns,
        aic=float(likelihood + 2 * unknowns),
        bic=float(likelihood + math.log(samples) * unknowns),
        starts=starts,
        agreeing=agreeing,
        evaluations=evaluations,
        constrained=problem.constrained,
        weighting=weighting,
        undetermined=_undetermined(material, covariance, problem),
    )


def _covariance(slope: Array) -> Array:
    """(J^T J)^-1 by QR; NaN where the columns are not independent."""
    size = np.sqrt((slope**2).sum(axis=0))
    unknown = np.full((slope.shape[1],) * 2, np.nan)
    if not (size > 0).all():
        return unknown
    r = np.linalg.qr(slope / size, mode="r")
    if np.linalg.cond(r) > _SINGULAR:
        return unknown
    inverse = np.linalg.inv(r) / size[:, None]
    return np.asarray(inverse @ inverse.T)


def _undetermined(material: Ogden, covariance: Array, problem: _Problem) -> tuple[str, ...]:
    """What the data leave open: a modulus not known to a factor of ten, an alpha not known to its own size, a bound."""
    if np.isnan(covariance).any():
        return ("two of its terms act alike, or one does not act at all",)
    n, errors = problem.terms, np.sqrt(np.diag(covariance))
    found = []
    for i, (g, alpha) in enumerate(zip(material.moduli, material.alpha, strict=True)):
        if errors[i] > math.log(10) * abs(g):
            found.append(f"mu_{i + 1} is not even known to a factor of ten")
        if errors[n + i] > max(abs(alpha), 1.0):
            found.append(f"alpha_{i + 1} is {alpha:.3g} with a standard error of {errors[n + i]:.2g}")
        if not problem.fixed and abs(alpha) > 0.99 * problem.steepest:
            found.append(f"alpha_{i + 1} ran away to {alpha:.3g}")
    return tuple(found)


def _jacobian(mode: str, stretch: Array, g: Array, alpha: Array) -> Array:
    """Derivatives of the nominal stress by (g_1 .. g_n, alpha_1 .. alpha_n), (samples, 2 n)."""
    return np.concatenate([stress_basis(mode, stretch, alpha), stress_basis_slope(mode, stretch, alpha) * g], axis=1)
