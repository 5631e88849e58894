"""Constrained optimisation over a unit cube: Sobol points first, then sequential quadratic programming from the best.

A goal judges designs by `Terms`: an objective to minimise, terms whose minimum is maximised, and constraints. Gradients
are central differences, all solved in one batch with the value itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .requirements import Quantity
from .space import Space

#: Values (k,) of k designs by name of the quantity.
Values = Mapping[str, Array]

#: A constraint counts as met if it is missed by no more than this; far less than `GUARD`.
FEASIBLE = 1e-5
#: Starts agree if their results differ by no more than this, relative to the objective's or margin's size.
AGREEMENT = 1e-3
#: Value of a design that cannot be simulated.
_IMPOSSIBLE = 1e3
#: Steps of the central differences, as fractions of a range; larger for ngspice, whose error is 1e-6.
_STEPS = {"exact": 1e-4, "ngspice": 5e-3}
#: Local searches.
STARTS = {"exact": 8, "ngspice": 3}
_MOST_ITERATIONS = {"exact": 60, "ngspice": 25}
#: A search ends after this many points without an improvement by `_WORTH`: at kinks the method may never converge.
_PATIENCE, _WORTH = 25, 1e-6
#: Rounds of random points around a converged search, and points in each: kinks (a settling time's) may have stopped it.
POLISHING = {"exact": (6, 24), "ngspice": (3, 8)}


@dataclass(frozen=True, eq=False)
class Terms:
    """Terms of k designs.

    ``objective`` (k,) is minimised; ``maximin`` (k, a): the minimum over a is maximised; ``constraints`` (k, b) must
    be at least zero.
    """

    objective: Array
    maximin: Array
    constraints: Array

    def score(self) -> Array:
        """Return (k,) numbers to compare designs that meet all constraints by; lower is better."""
        lowest = self.maximin.min(axis=1) if self.maximin.shape[1] else 0.0
        return np.nan_to_num(self.objective - lowest, nan=_IMPOSSIBLE)

    def violation(self) -> Array:
        """Return (k,) the amount by which the worst constraint is missed, at least 0."""
        worst = self.constraints.min(axis=1, initial=np.inf)
        return np.maximum(-np.nan_to_num(worst, nan=-_IMPOSSIBLE), 0.0)

    def order(self) -> NDArray[np.intp]:
        """Return the designs' indices, best first: feasible ones by score, then the others by violation."""
        violation = self.violation()
        return np.lexsort((self.score(), np.where(violation <= FEASIBLE, 0.0, violation)))

    def optimum(self, points: Array, k: int = 0) -> LocalOptimum:
        """Return design k, which stands at ``points[k]``."""
        return LocalOptimum(points[k], float(self.score()[k]), float(self.violation()[k]))


@dataclass(frozen=True, eq=False)
class Goal:
    """The goal of a search in a ``space``: ``judge`` makes `Terms` from the values of the ``quantities``."""

    space: Space
    quantities: tuple[Quantity, ...]
    judge: Callable[[Values], Terms]

    def at(self, points: Array) -> Terms:
        """Return the terms of the designs at ``points`` (k, n)."""
        return self.judge(self.space.at(points, self.quantities))


@dataclass(frozen=True, eq=False)
class LocalOptimum:
    """End of a local search: ``point`` (n,), its score and violation as in `Terms`."""

    point: Array
    score: float
    violation: float

    @property
    def feasible(self) -> bool:
        return self.violation <= FEASIBLE

    @property
    def rank(self) -> tuple[float, float]:
        """Key to sort by, best first: feasible ones by score, then the others by violation."""
        return (0.0, self.score) if self.feasible else (self.violation, 0.0)


@dataclass(frozen=True, eq=False)
class Search:
    """Result of several starts: the ``best`` end, and all ``ends``."""

    best: LocalOptimum
    ends: tuple[LocalOptimum, ...]

    @property
    def _agreeing(self) -> list[LocalOptimum]:
        tolerance = AGREEMENT * max(1.0, abs(self.best.score))
        return [e for e in self.ends if e.feasible == self.best.feasible and e.score <= self.best.score + tolerance]

    @property
    def agreeing(self) -> int:
        """Number of starts that reached the best score."""
        return len(self._agreeing)

    @property
    def spread(self) -> Array:
        """Largest distance (n,) between the agreeing starts' designs, in fractions of the ranges; 0 if unique."""
        return np.ptp([self.best.point, *(e.point for e in self._agreeing)], axis=0)


def search(goal: Goal, points: Array, values: Values, *, starts: int | None = None, seed: int = 0) -> Search:
    """Return the best point for ``goal``, searched from the best of ``points`` (k, n), whose ``values`` are known."""
    chosen = distant(points, goal.judge(values).order(), starts or STARTS[goal.space.engine])
    ends = [local_search(goal, points[k]) for k in chosen]
    best = _best(ends)
    polished = _polished(goal, best, seed)
    if polished is not best:  # a kink had stopped the search: continue beyond it
        ends.append(local_search(goal, polished.point))
        best = _best([polished, ends[-1]])
    return Search(best, tuple(ends))


def _best(ends: Iterable[LocalOptimum]) -> LocalOptimum:
    return min(ends, key=lambda end: end.rank)


def distant(points: Array, order: NDArray[np.intp], count: int) -> list[int]:
    """Return indices of ``count`` of the best quarter of ``points``, best first, far from one another."""
    best = order[: max(len(order) // 4, count)]
    chosen = [int(best[0])]
    distance = np.abs(points[best] - points[chosen[0]]).max(axis=1)
    while len(chosen) < min(count, len(best)):
        # the best among the points at least half as far as the farthest
        k = int(np.argmax(distance >= 0.5 * distance.max()))
        chosen.append(int(best[k]))
        distance = np.minimum(distance, np.abs(points[best] - points[best[k]]).max(axis=1))
    return chosen


def local_search(goal: Goal, start: Array) -> LocalOptimum:
    """Return the local optimum reached from ``start`` (n,), or the best point evaluated if SLSQP does not converge.

    With maximin terms the variables are (point, t): t is maximised under maximin - t >= 0.
    """
    from scipy.optimize import Bounds, minimize

    n = len(start)
    local = _Evaluator(goal)
    first, _ = local.at(start)
    kept, bounded = first.constraints.shape[1], first.maximin.shape[1]
    extra = int(bounded > 0)  # the variable t is added
    of_t = np.zeros((kept + bounded, extra))
    of_t[kept:] = -1.0

    def objective(z: Array) -> tuple[float, Array]:
        terms, slopes = local.at(z[:n])
        return float(terms.objective[0] - z[n:].sum()), np.append(slopes[0], [-1.0] * extra)

    def constraints(z: Array) -> Array:
        terms, _ = local.at(z[:n])
        return np.concatenate([terms.constraints[0], terms.maximin[0] - z[n:].sum()])

    def jacobian(z: Array) -> Array:
        return np.hstack([local.at(z[:n])[1][1:], of_t])

    with suppress(_StalledError):
        minimize(
            objective,
            np.append(start, first.maximin[0].min()) if extra else start,
            jac=True,
            bounds=Bounds([0.0] * n + [-np.inf] * extra, [1.0] * n + [np.inf] * extra),
            constraints=[{"type": "ineq", "fun": constraints, "jac": jacobian}] if len(of_t) else [],
            method="SLSQP",
            options={"maxiter": _MOST_ITERATIONS[goal.space.engine], "ftol": 1e-9},
        )
    assert local.best is not None
    return local.best


class _StalledError(Exception):
    """Ends a local search that no longer improves."""


class _Evaluator:
    """Terms and slopes of a goal: evaluated together, kept while the point stays the same; ``best`` point so far."""

    def __init__(self, goal: Goal) -> None:
        self._goal, self._step = goal, _STEPS[goal.space.engine]
        self._point: Array | None = None
        self._idle = 0
        self.best: LocalOptimum | None = None

    def at(self, point: Array) -> tuple[Terms, Array]:
        """Return the terms at ``point`` (n,), and the slopes (1 + b + a, n) of objective, constraints, maximin."""
        point = np.clip(point, 0.0, 1.0)
        if self._point is None or (point != self._point).any():
            n = len(point)
            up = np.minimum(point + self._step * np.eye(n), 1.0)
            down = np.maximum(point - self._step * np.eye(n), 0.0)
            around = self._goal.at(np.concatenate([point[None], up, down]))
            columns = [around.objective, around.constraints, around.maximin]
            table = np.nan_to_num(np.column_stack(columns), nan=-_IMPOSSIBLE, neginf=-_IMPOSSIBLE)
            table[np.isnan(around.objective), 0] = _IMPOSSIBLE
            widths = np.diagonal(up - down)[:, None]
            slopes = ((table[1 : n + 1] - table[n + 1 :]) / widths).T
            a = around.constraints.shape[1]
            self._found = Terms(table[:1, 0], table[:1, 1 + a :], table[:1, 1 : 1 + a]), slopes
            self._point = point
            self._remember(self._found[0].optimum(point[None]))
        return self._found

    def _remember(self, here: LocalOptimum) -> None:
        best = self.best
        self._idle += 1
        if best is None or here.rank < best.rank:
            self.best = here
            if best is None or here.score < best.score - _WORTH or here.violation < best.violation - _WORTH:
                self._idle = 0
        if self._idle >= _PATIENCE:
            raise _StalledError


def _polished(goal: Goal, best: LocalOptimum, seed: int) -> LocalOptimum:
    """Return the best of ``best`` and of random points around it, nearer in each round."""
    random = np.random.default_rng(seed)
    rounds, count = POLISHING[goal.space.engine]
    for k in range(rounds):
        width = 0.1 * 0.3**k
        points = np.clip(best.point + width * random.uniform(-1, 1, (count, len(best.point))), 0, 1)
        terms = goal.at(points)
        best = _best([best, terms.optimum(points, int(terms.order()[0]))])
    return best
