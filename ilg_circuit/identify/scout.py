"""Where a fit of the current starts: fits from many starts on a thinned record, cheap because they need no engine.

Starts scattered over decades are run to their minima by the closed form of a linear port (see `modal`); the engine of
record then fits from the best of these, and how many of them ended there says how far it can be trusted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..drive import PiecewiseLinear
from ..errors import IlgError, InputError, SolveError
from ..fit.least_squares import Fit, fit_problem, require_near
from ..fit.multistart import SAME, Search, gather, search
from ..fit.problem import Evaluation, Problem
from .modal import Ports, modal_model
from .start import thinned

Array = NDArray[np.float64]

_SETS = 64
#: Scattered starts lie within so many decades of the suggested one, in turn.
_DECADES = (0.3, 1.0, 2.0)
_FITS, _MORE_FITS = 5, 8
_EVALUATIONS = 100
_SAMPLES = 300
#: Residuals below this part of the data are the closed form's rounding.
_ROUNDING = 1e-11
#: The final fit may leave so much more than its scout: they do not see the same samples.
_COME_BACK = 1.5
#: Where every fit needs ngspice: starts besides the suggested one, how far scattered, and which ends are one.
_FEW, _NEAR, _SAME_MISFIT = 2, 0.5, 1e-5


@dataclass(frozen=True)
class Scouting:
    """``values`` (n,) of the best start; ``starts`` tried, ``agreeing`` of them ended at the best minimum."""

    values: Array
    starts: int
    agreeing: int

    @property
    def doubt(self) -> str:
        """Why the best may not be the least; empty where it was reached twice."""
        return "" if self.agreeing > 1 else f"the best of {self.starts} fits was not reached a second time"


def scout(
    problem: Problem, ports: Ports, drive: PiecewiseLinear, t: Array, start: Array, seed: int = 0
) -> tuple[Scouting, Callable[[Array], None]]:
    """Fits from ``start`` (n,) and from around it, for ``problem`` whose data are at ``t`` [s].

    ``ports`` makes the ports of values (m, n). The second answer is a check that the final fit's values must pass: it
    raises SolveError where they are not at the best minimum that was found.
    """
    cheap = _thinned_problem(problem, ports, drive, t)
    size = float(np.abs(cheap.data).max()) or 1.0
    rounding = len(cheap.data) * (_ROUNDING * size) ** 2
    random = np.random.default_rng(seed)
    origin = cheap.scales.coordinates(start)
    found = _fits(cheap, [origin, *_scattered(cheap, origin, random, _FITS)], rounding)
    if _together(found) < 2:
        around = [origin, *_scattered(cheap, found.best.parameters, random, _MORE_FITS)]
        found = gather([*found.runs, *_fits(cheap, around, rounding).runs], rounding)
    best = found.best.squares
    require_near(cheap, found.best.parameters, origin)

    def check(values: Array) -> None:
        left = float(cheap.squares(cheap.scales.coordinates(values)[None])[0])
        # what the engine of record may be away from the closed form
        blur = len(cheap.data) * (1e-5 * size) ** 2
        if left > _COME_BACK * best + blur:
            raise SolveError(
                f"the fit did not come back to the best of its {len(found.runs)} starts: the data do not determine "
                "this model"
            )

    return Scouting(cheap.scales.values(found.best.parameters), len(found.runs), _together(found)), check


def fit_from_several(
    problem: Problem, start: Array, progress: Callable[[], None] | None, seed: int = 0
) -> tuple[Scouting, Fit]:
    """The best fit from ``start`` and a few starts around it, where there is no closed form to scout with.

    Raises SolveError where none of them converges.
    """
    random = np.random.default_rng(seed)
    origin = problem.scales.coordinates(start)
    starts = [origin, *(origin + random.uniform(-_NEAR, _NEAR, (_FEW, len(origin))))]
    fits: list[Fit] = []
    failures: list[IlgError] = []
    for x in starts:
        try:
            fits.append(fit_problem(problem, problem.scales.values(x), progress))
        except (InputError, SolveError) as error:
            failures.append(error)
    if not fits:
        raise failures[0]
    best = min(fits, key=lambda fit: fit.rmse)
    agreeing = sum(fit.rmse <= best.rmse * (1 + _SAME_MISFIT) for fit in fits)
    return Scouting(best.values, len(starts), agreeing), best


def _thinned_problem(problem: Problem, ports: Ports, drive: PiecewiseLinear, t: Array) -> Problem:
    """Few samples, each weighted by how many it stands for, so that their minimum is near that of all."""
    keep = thinned(t, _SAMPLES)
    model = modal_model(ports, drive, t[keep])
    edges = np.concatenate([[0.0], (keep[1:] + keep[:-1] + 1) / 2, [float(len(t))]])
    weights = np.sqrt(np.diff(edges))
    nuisance = problem.nuisance[keep] * weights[:, None]
    data = problem.data[keep] * weights
    return replace(problem, model=lambda values: model(values) * weights, data=data, nuisance=nuisance)


def _fits(problem: Problem, starts: Sequence[Array], rounding: float) -> Search:
    """Fits from ``starts``, the first of which is what the data suggest."""
    evaluate = Evaluation(problem)
    basis = np.linalg.qr(problem.nuisance)[0]
    nothing = np.full(len(problem.data), np.nan)

    def solved(x: Array) -> tuple[Array, Array]:
        try:
            wave, slopes = evaluate(x)
        except SolveError:  # no circuit, or no value at all
            return nothing, np.zeros((len(nothing), len(x)))
        return problem.projected(wave - problem.data), slopes - basis @ (basis.T @ slopes)

    return search(
        lambda x: solved(x)[0],
        lambda x: solved(x)[1],
        starts,
        tolerance=1e-9,
        most=_EVALUATIONS,
        rounding=rounding,
        polishes=4,
    )


def _together(found: Search) -> int:
    """Runs that ended at the best sum of squares, converged to the last digit or not."""
    best = found.best.squares
    return sum(run.squares <= best * (1 + 1e2 * SAME) + 1e-300 for run in found.runs)


def _scattered(problem: Problem, centre: Array, random: np.random.Generator, count: int) -> list[Array]:
    """The best of each of ``count`` groups of sets around ``centre``."""
    decades = np.resize(_DECADES, _SETS)[:, None] * np.log(10)
    sets = centre + decades * random.uniform(-1, 1, (_SETS, len(centre)))
    groups = []
    for group in np.array_split(sets, count):
        try:
            squares = problem.squares(group)
        except (InputError, SolveError):
            continue
        if np.isfinite(squares).any():
            groups.append(group[int(np.nanargmin(squares))])
    return groups
