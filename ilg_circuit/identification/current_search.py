"""Multi-start search for a fit of the current: descents from many starts on a thinned record, without an engine.

Starts scattered over decades descend by the closed form of a linear port (see `modal`); the engine of record then fits
from the best minimum; the number of descents that reached it is a measure of confidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError, SolveError
from ..fit.fitting import fit, require_near, with_starts
from ..fit.multistart import Search, StartSummary, gather, search
from ..fit.observation import Predict
from ..fit.problem import Evaluation, Problem, Progress
from ..fit.result import FitResult
from .start import thinned

_SETS = 64
#: Decades about the suggested start within which scattered starts lie, in each round.
_DECADES = (0.3, 1.0, 2.0)
_FITS, _MORE_FITS = 5, 8
_EVALUATIONS = 60
#: Number of descents to the same least sum of squares, converged or not, at which the search stops; relative difference
#: up to which it is the same: in a flat valley each descent ends elsewhere.
_AGREEING, _ALIKE = 3, 1e-4
#: Relative offset of a descent that has not settled, and distance of a logarithm from its start where it runs away.
_UNSETTLED, _AWAY = 0.1, 6.0
_SAMPLES = 300
#: Relative residuals below this value are rounding errors of the closed form.
_ROUNDING = 1e-11
#: Factor by which the final residuals may exceed those of the start, which uses other samples.
_COME_BACK = 1.5
#: If every fit needs ngspice: number of additional starts, their scatter, relative tolerance for the same minimum.
_FEW, _NEAR, _SAME_MISFIT = 2, 0.5, 1e-3
#: Tolerance of these fits; relative residuals below which minima are the same, being the solver's error.
_TRIAL, _NOTHING = 1e-4, 1e-3


def search_starts(
    problem: Problem, at_times: Callable[[Array], Predict], t: Array, start: Array, seed: int = 0
) -> tuple[Array, StartSummary, Callable[[Array], None]]:
    """Return the best start (n,) of ``problem``, one observation of a current, from ``start`` (n,) and around it.

    ``at_times`` makes the prediction at other times [s] than ``t`` (samples,), those of the data. The third answer is
    a check of the final fit's values: it raises SolveError if they are not at the best minimum found.
    """
    cheap = _thinned_problem(problem, at_times, t)
    size = float(np.abs(cheap.data).max()) or 1.0
    rounding = len(cheap.data) * (_ROUNDING * size) ** 2
    random = np.random.default_rng(seed)
    origin = cheap.scales.coordinates(start)
    found = _descents(cheap, chain([origin], _scattered(cheap, origin, random, _FITS)), rounding)
    if found.near(_ALIKE) < 2:
        if found.best.offset > _UNSETTLED:  # starts around it would run away as well
            require_near(cheap, found.best.parameters, origin, _AWAY)
        around = chain([origin], _scattered(cheap, found.best.parameters, random, _MORE_FITS))
        found = gather([*found.runs, *_descents(cheap, around, rounding).runs], rounding)
    best = found.best.sum_of_squares
    require_near(cheap, found.best.parameters, origin)

    def check(values: Array) -> None:
        squares = float(cheap.sum_of_squares(cheap.scales.coordinates(values)[None])[0])
        # allowance for the difference between the engine of record and the closed form
        blur = len(cheap.data) * (1e-5 * size) ** 2
        if squares > _COME_BACK * best + blur:
            raise SolveError(
                f"the fit did not return to the best of its {len(found.runs)} starts: the data do not determine "
                "this model"
            )

    summary = StartSummary(len(found.runs), found.near(_ALIKE))
    return cheap.scales.values(found.best.parameters), summary, check


def fit_from_several(problem: Problem, rough: Problem, start: Array, progress: Progress, seed: int = 0) -> FitResult:
    """Return the best fit from ``start`` and a few starts around it, for models without a closed form.

    The ``rough`` problem is the same with cheaper predictions; its best fit is the start of the final one. Raises
    SolveError if none of them converges.
    """
    random = np.random.default_rng(seed)
    origin = problem.scales.coordinates(start)
    starts = [origin, *(origin + random.uniform(-_NEAR, _NEAR, (_FEW, len(origin))))]
    fits: list[FitResult] = []
    failures: list[IlgError] = []
    for x in starts:
        try:
            fits.append(fit(rough, rough.scales.values(x), progress, _TRIAL))
        except (InputError, SolveError) as error:
            failures.append(error)
    fits.sort(key=lambda found: found.rmse)
    for found in fits:
        try:
            best = fit(problem, found.values, progress)
        except (InputError, SolveError) as error:
            failures.append(error)
            continue
        same = max(found.rmse * (1 + _SAME_MISFIT), _NOTHING * rough.observations[0].size)
        return with_starts(best, StartSummary(len(starts), sum(other.rmse <= same for other in fits)))
    raise failures[-1 if fits else 0]


def _thinned_problem(problem: Problem, at_times: Callable[[Array], Predict], t: Array) -> Problem:
    """Return the problem with few samples, weighted by the number each represents, so that the minimum is similar."""
    (o,) = problem.observations
    keep = thinned(t, _SAMPLES)
    edges = np.concatenate([[0.0], (keep[1:] + keep[:-1] + 1) / 2, [float(len(o.x))]])
    x, data, nuisance = o.x[keep], o.data[keep], o.nuisance[keep]
    sigma = o.sigma / np.sqrt(np.diff(edges))
    few = replace(o, x=x, data=data, nuisance=nuisance, predict=at_times(t[keep]), sigma=sigma)
    return replace(problem, observations=(few,))


def _descents(problem: Problem, starts: Iterable[Array], rounding: float) -> Search:
    evaluate = Evaluation(problem)

    def residuals(x: Array) -> Array:
        try:
            return problem.projected(evaluate(x)[0] - problem.data)
        except SolveError:  # no valid circuit, or no finite value
            return np.full(len(problem.data), np.nan)

    def jacobian(x: Array) -> Array:
        try:
            return problem.projected(evaluate(x)[1].T).T
        except SolveError:
            return np.zeros((len(problem.data), len(x)))

    return search(
        residuals, jacobian, starts,
        tolerance=1e-9, rounding=rounding, most=_EVALUATIONS, polishes=1, enough=_AGREEING, alike=_ALIKE,
    )  # fmt: skip


def _scattered(problem: Problem, centre: Array, random: np.random.Generator, count: int) -> Iterator[Array]:
    """Yield the best of each of ``count`` groups of starts around ``centre``, each predicted when it is asked for."""
    decades = np.resize(_DECADES, _SETS)[:, None] * np.log(10)
    sets = centre + decades * random.uniform(-1, 1, (_SETS, len(centre)))
    for group in np.array_split(sets, count):
        try:
            squares = problem.sum_of_squares(group)
        except (InputError, SolveError):
            continue
        if np.isfinite(squares).any():
            yield group[int(np.nanargmin(squares))]
