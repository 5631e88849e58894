"""Multi-start search of a hyperelastic fit: random alphas with their best moduli, and descents from them.

For given alphas the stress is linear in the moduli. Every random draw of alphas therefore gets the moduli of (non-
negative) least squares, and descents start from the best draws.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..fit.minimise import Run
from ..fit.multistart import Search, gather
from ..fit.multistart import search as multistart
from ..fit.problem import Problem

#: Least relative error of a stress, which keeps statistics of exact data finite.
RESOLUTION = 1e-7

#: Modulus, relative to the largest stress, below which it is zero.
_LEAST_MODULUS = math.exp(-150.0)
_DRAWS = 400
_DESCENTS = 10
#: Ends of a descent: relative change of the sum of squares, evaluations, Gauss-Newton steps.
_TOLERANCE, _MOST_EVALUATIONS, _POLISHES = 1e-12, 200, 10


#: Signs of the moduli (terms,) -> the problem of fitting their sizes and the alphas.
Build = Callable[[Array], Problem]


def search(build: Build, terms: int, constrained: bool, seed: int) -> tuple[Search, int]:
    """Return the ends of the search, moduli [Pa] with their signs, then alphas, and the number of evaluations."""
    problem = build(np.ones(terms))
    found, evaluations = descents(build, terms, _starts(problem, constrained, seed))
    if found.best.degenerate and not problem.fixed and terms > 1:
        # a term without effect at this alpha may have one at another
        starts = _starts(problem, constrained, seed, found.best.parameters)
        found, more = descents(build, terms, starts, found.runs)
        evaluations += more
    return found, evaluations


def descents(build: Build, terms: int, starts: Sequence[Array], earlier: Sequence[Run] = ()) -> tuple[Search, int]:
    """Return the minima of descents from ``starts``, in the same form, and the number of evaluations.

    ``build`` returns the problem for given signs, which no descent changes; ``earlier`` descents are included.
    """
    by_signs: dict[tuple[float, ...], list[Array]] = {}
    for start in starts:
        by_signs.setdefault(tuple(np.sign(start[:terms]).tolist()), []).append(start)
    runs = list(earlier)
    evaluations, rounding = 0, 0.0
    for signs, members in by_signs.items():
        problem = build(np.array(signs))
        rounding = len(problem.data) * RESOLUTION**2
        turned = np.ones(len(problem.labels))
        turned[:terms] = signs
        inside = (1 - 1e-12) * problem.scales.upper
        least = np.where(np.isinf(inside), _LEAST_MODULUS * max(o.size for o in problem.observations), -inside)

        def residuals(x: Array, problem: Problem = problem) -> Array:
            nonlocal evaluations
            evaluations += 1
            return problem.predictions(x[None])[0] - problem.data

        def jacobian(x: Array, problem: Problem = problem) -> Array:
            return problem.derivatives(x)[1]

        origins = [problem.scales.coordinates(turned * start) for start in members]
        found = multistart(
            residuals, jacobian, origins,
            rounding=rounding, tolerance=_TOLERANCE, most=_MOST_EVALUATIONS, polishes=_POLISHES,
        )  # fmt: skip
        for run in found.runs:
            values = np.clip(problem.scales.values(run.parameters), least, inside)
            runs.append(replace(run, parameters=turned * values))
    return gather(runs, rounding), evaluations


def _starts(problem: Problem, constrained: bool, seed: int, best: Array | None = None) -> list[Array]:
    """Return starts (unknowns,), moduli with their signs, then alphas, best first: random alphas, their best moduli.

    With ``best``, a minimum of the search, only the alpha of its smallest term is drawn.
    """
    terms = len(problem.parameters) // 2
    free = not problem.fixed
    alphas = np.empty((1, 0))  # for a model that fixes them
    if free:
        steep = 0.45 * problem.parameters[-1].upper
        random = np.random.default_rng(seed)
        shape = (_DRAWS, terms)
        # half of the draws near known rubbers, half over all that this range of stretches can distinguish
        ordinary = random.random(shape) < 0.5
        alphas = np.where(ordinary, random.uniform(-6, 10, shape), random.uniform(-steep, steep, shape))
        alphas = np.clip(alphas, -steep, steep)
        if best is not None:
            others = np.arange(terms) != np.argmin(np.abs(best[:terms]))
            alphas[:, others] = best[terms:][others]
    # the stress is linear in the moduli: columns of all draws' single terms at once
    units = np.hstack([np.tile(np.eye(terms), (len(alphas), 1)), np.repeat(alphas, terms, axis=0)])
    bases = problem.predicted(units).reshape(len(alphas), terms, -1).swapaxes(1, 2)
    chosen = []
    # at fixed alphas the best moduli are one solution, signs included
    for positive in (True,) if constrained else (True, False) if free else (False,):
        moduli = [_best_moduli(basis, problem.data, positive) for basis in bases]
        ranked = np.argsort([cost for _, cost in moduli], kind="stable")[:_DESCENTS]
        chosen += [np.concatenate([moduli[k][0], alphas[k]]) for k in ranked]
    return chosen


def _best_moduli(basis: Array, data: Array, positive: bool) -> tuple[Array, float]:
    """Return the best moduli (terms,), or the best positive ones, and their sum of squares."""
    from scipy.optimize import nnls

    size = np.linalg.norm(basis, axis=0)
    if positive:
        try:
            g = nnls(basis / size, data)[0]
        except RuntimeError:  # it cycles where two columns are the same
            g = np.zeros(len(size))
    else:
        g = np.linalg.lstsq(basis / size, data, rcond=1e-10)[0]
    # a term with zero modulus in a draw starts small, so that its logarithm is finite
    least = 1e-3 * max(float(np.abs(g).max()), float(np.linalg.norm(data)))
    g = np.where(g < 0, -1.0, 1.0) * np.maximum(np.abs(g), least) / size
    return g, float(((basis @ g - data) ** 2).sum())
