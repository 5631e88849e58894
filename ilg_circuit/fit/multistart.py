"""Multi-start: descents from many starts, so that the result does not depend on a single one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .minimise import Jacobian, Residuals, Run, blur, descend

#: Relative difference of sums of squares up to which minima are the same.
SAME = 1e-7
#: Evaluations of a rough descent, and ratio to the least sum of squares up to which it is continued to its minimum.
_ROUGH_EVALUATIONS, _HOPEFUL = 60, 10.0


@dataclass(frozen=True)
class StartSummary:
    """The number of ``starts``, and the number ``agreeing`` on the best minimum."""

    starts: int = 1
    agreeing: int = 1

    @property
    def confirmed(self) -> bool:
        """True if the best minimum was reached twice, or there was one start only."""
        return self.agreeing > 1 or self.starts == 1


#: A fit whose minimum was not confirmed by other starts.
ONE_START = StartSummary()


@dataclass(frozen=True)
class Search:
    """All runs, best first, of which the first ``agreeing`` reached the best minimum.

    ``rounding`` is the sum of squares due to rounding alone.
    """

    runs: tuple[Run, ...]
    agreeing: int
    rounding: float = 0.0

    @property
    def best(self) -> Run:
        return self.runs[0]

    def near(self, share: float) -> int:
        """Return the number of runs within a ``share`` of the least sum of squares, converged or not."""
        best = self.best.sum_of_squares
        limit = best * (1 + share) + blur(best, self.rounding)
        return sum(run.sum_of_squares <= limit for run in self.runs)


def search(
    residuals: Residuals,
    jacobian: Jacobian,
    starts: Iterable[Array],
    *,
    rounding: float = 0.0,
    tolerance: float = 1e-15,
    most: int = 2000,
    polishes: int = 60,
    enough: int = 0,
    alike: float = SAME,
    rough: float = 0.0,
) -> Search:
    """Return the descents from all ``starts``, or until ``enough`` of them reach the same least sum of squares.

    That is the same if it differs by a share of ``alike``. With a tolerance ``rough`` all starts descend to that first,
    and only from there to ``tolerance``, if they are among the best. For the other arguments see `minimise.descend`.
    """
    runs: list[Run] = []
    if rough:
        runs = [
            descend(residuals, jacobian, start, tolerance=rough, most=_ROUGH_EVALUATIONS, polishes=0)
            for start in starts
        ]
        limit = _HOPEFUL * min((run.sum_of_squares for run in runs), default=0.0)
        starts = [run.parameters for run in runs if run.sum_of_squares <= limit]
        runs = [run for run in runs if run.sum_of_squares > limit]
    for start in starts:
        how = {"rounding": rounding, "tolerance": tolerance}
        runs.append(descend(residuals, jacobian, start, most=most, polishes=polishes, **how))
        sound = [run for run in runs if np.isfinite(run.sum_of_squares) and not run.degenerate]
        if enough and len(sound) >= enough and gather(sound, rounding).near(alike) >= enough:
            break
    return gather(runs, rounding)


def gather(runs: Sequence[Run], rounding: float = 0.0) -> Search:
    """Return ``runs`` sorted, converged ones first among those of the same sum of squares, and counted."""
    lowest = min(run.sum_of_squares for run in runs)

    def same(squares: float, other: float) -> bool:
        return abs(squares - other) <= SAME * max(squares, other) + blur(squares, rounding)

    ordered = sorted(runs, key=lambda r: (not same(r.sum_of_squares, lowest), not r.converged, r.sum_of_squares))
    best = ordered[0]
    agreeing = sum(same(run.sum_of_squares, best.sum_of_squares) and run.converged for run in ordered)
    return Search(tuple(ordered), agreeing, rounding)
