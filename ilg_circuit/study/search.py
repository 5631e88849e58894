"""Constrained optimisation over a unit cube: scattered starts, then sequential quadratic programming from each.

A goal turns what designs do into `Terms`: a cost to make small, terms to lift as high as their lowest can come, others
to keep above zero. Gradients are central differences, all solved together with the value itself.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .space import Space

Array = NDArray[np.float64]

#: A constraint counts as kept if it is missed by no more than this; far less than `GUARD`.
FEASIBLE = 1e-5
#: Starts whose results differ by no more than this, in parts of the cost's or margin's size, agree.
AGREEMENT = 1e-3
#: What stands in for a design that cannot be.
_IMPOSSIBLE = 1e3
#: Steps of the central differences, in parts of a range: by the exact engine, and by ngspice, whose error is 1e-6.
_STEPS = {"exact": 1e-4, "ngspice": 5e-3}
#: Scattered designs looked at first, by the exact engine and by ngspice.
SCOUTS = {"exact": 1024, "ngspice": 64}
#: Local searches.
STARTS = {"exact": 8, "ngspice": 3}
_MOST_ITERATIONS = {"exact": 60, "ngspice": 25}
#: A search ends when so many places in a row brought no gain worth mentioning: kinks can keep one busy for ever.
_PATIENCE, _WORTH = 25, 1e-6
#: A search that has converged is tried again around its end, where kinks (a settling time's) may have stopped it.
POLISHING = {"exact": (6, 24), "ngspice": (3, 8)}


@dataclass(frozen=True, eq=False)
class Terms:
    """What k designs come to: ``cost`` (k,); ``lifted`` (k, a), whose lowest is to be as high as can be; ``kept``
    (k, b), at least zero."""

    cost: Array
    lifted: Array
    kept: Array

    def merit(self) -> Array:
        """(k,), the less the better among designs that keep what is to be kept."""
        lowest = self.lifted.min(axis=1) if self.lifted.shape[1] else 0.0
        return np.asarray(np.nan_to_num(self.cost - lowest, nan=_IMPOSSIBLE))

    def violation(self) -> Array:
        """(k,), how far the worst of what is to be kept is missed, at least 0."""
        worst = self.kept.min(axis=1) if self.kept.shape[1] else np.zeros(len(self.cost))
        return np.asarray(np.maximum(-np.nan_to_num(worst, nan=-_IMPOSSIBLE), 0.0))

    def order(self) -> NDArray[np.intp]:
        """The designs, best first: those that keep all by merit, then the others by violation."""
        missed = self.violation()
        missed = np.where(missed <= FEASIBLE, 0.0, missed)
        return np.lexsort((self.merit(), missed))


#: From places (k, n) to terms.
Goal = Callable[[Array], Terms]


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended: ``place`` (n,), its merit and violation."""

    place: Array
    merit: float
    violation: float

    @property
    def feasible(self) -> bool:
        return self.violation <= FEASIBLE

    def better_than(self, other: Found) -> bool:
        if self.feasible and other.feasible:
            return self.merit < other.merit
        return self.violation < other.violation


@dataclass(frozen=True, eq=False)
class Search:
    """The best of several starts; ``ends`` of all of them, ``agreeing`` how many came to the same merit."""

    best: Found
    ends: tuple[Found, ...]

    @property
    def _alike(self) -> list[Found]:
        tolerance = AGREEMENT * max(1.0, abs(self.best.merit))
        return [e for e in self.ends if e.feasible == self.best.feasible and e.merit <= self.best.merit + tolerance]

    @property
    def agreeing(self) -> int:
        return len(self._alike)

    @property
    def spread(self) -> Array:
        """(n,), how far the agreeing starts' designs lie apart, in parts of each range (large: not unique)."""
        return np.asarray(np.ptp([self.best.place, *(e.place for e in self._alike)], axis=0))


def scatter(dimension: int, count: int, seed: int) -> Array:
    """``count`` places (count, n), a scrambled Sobol sequence's; count is rounded up to a power of two."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimension, rng=np.random.default_rng(seed)).random_base2(int(np.ceil(np.log2(count)))))


def search(
    space: Space, goal: Goal, scouted: Array, terms: Terms, *, starts: int | None = None, seed: int = 0
) -> Search:
    """The best place for ``goal``: from the best of the ``scouted`` places (k, n), whose ``terms`` are known."""
    chosen = apart(scouted, terms.order(), starts or STARTS[space.engine])
    ends = [climb(space, goal, scouted[k]) for k in chosen]
    best = _best(ends)
    polished = _polished(space, goal, best, seed)
    if polished is not best:  # a kink had stopped it: on from beyond that
        ends.append(climb(space, goal, polished.place))
        best = _best([polished, ends[-1]])
    return Search(best, tuple(ends))


def _best(ends: list[Found]) -> Found:
    best = ends[0]
    for end in ends[1:]:
        best = end if end.better_than(best) else best
    return best


def apart(places: Array, order: NDArray[np.intp], count: int) -> list[int]:
    """``count`` of the best quarter of ``places``, best first, none near another while there are others."""
    best = order[: max(len(order) // 4, count)]
    chosen = [int(best[0])]
    distance = np.abs(places[best] - places[chosen[0]]).max(axis=1)
    while len(chosen) < min(count, len(best)):
        # among places at least half as far as the farthest, the best one
        k = int(np.argmax(distance >= 0.5 * distance.max()))
        chosen.append(int(best[k]))
        distance = np.minimum(distance, np.abs(places[best] - places[best[k]]).max(axis=1))
    return chosen


def climb(space: Space, goal: Goal, start: Array) -> Found:
    """The local optimum from ``start`` (n,) on; the best place that was passed if the method does not converge."""
    from scipy.optimize import Bounds, minimize

    n = len(start)
    local = _Local(goal, _STEPS[space.engine])
    first = local.at(start)
    lifts = first.lifted.shape[1] > 0
    kept = first.kept.shape[1] + first.lifted.shape[1]

    def cost(z: Array) -> float:
        return float(local.at(z[:n]).cost[0] - (z[n] if lifts else 0.0))

    def cost_slope(z: Array) -> Array:
        slope = local.slopes(z[:n])[0]
        return np.append(slope, -1.0) if lifts else slope

    def constraints(z: Array) -> Array:
        terms = local.at(z[:n])
        return np.concatenate([terms.kept[0], terms.lifted[0] - (z[n] if lifts else 0.0)])

    def constraint_slopes(z: Array) -> Array:
        slopes = local.slopes(z[:n])[1:]
        if not lifts:
            return slopes
        lift = np.zeros((kept, 1))
        lift[first.kept.shape[1] :] = -1.0
        return np.hstack([slopes, lift])

    z = np.append(start, first.lifted[0].min()) if lifts else start
    bounds = Bounds([0.0] * n + [-np.inf] * lifts, [1.0] * n + [np.inf] * lifts)
    conditions = [{"type": "ineq", "fun": constraints, "jac": constraint_slopes}] if kept else []
    with suppress(_StalledError):
        minimize(
            cost,
            z,
            jac=cost_slope,
            bounds=bounds,
            constraints=conditions,
            method="SLSQP",
            options={"maxiter": _MOST_ITERATIONS[space.engine], "ftol": 1e-9},
        )
    return local.best()


class _StalledError(Exception):
    """Ends a local search that gains nothing any more."""


class _Local:
    """Terms and slopes of a goal at one place after another: solved together, remembered while the place stays."""

    def __init__(self, goal: Goal, step: float) -> None:
        self._goal, self._step = goal, step
        self._place: Array | None = None
        self._slopes: Array = np.zeros((0, 0))
        self._best: Found | None = None
        self._idle = 0

    def at(self, place: Array) -> Terms:
        place = np.clip(place, 0.0, 1.0)
        if self._place is None or (place != self._place).any():
            n = len(place)
            up = np.minimum(place + self._step * np.eye(n), 1.0)
            down = np.maximum(place - self._step * np.eye(n), 0.0)
            around = self._goal(np.concatenate([place[None], up, down]))
            table = np.nan_to_num(
                np.column_stack([around.cost, around.kept, around.lifted]), nan=-_IMPOSSIBLE, neginf=-_IMPOSSIBLE
            )
            table[np.isnan(around.cost), 0] = _IMPOSSIBLE
            widths = np.diagonal(up - down)[:, None]
            self._slopes = ((table[1 : n + 1] - table[n + 1 :]) / widths).T
            a = around.kept.shape[1]
            self._terms = Terms(table[:1, 0], table[:1, 1 + a :], table[:1, 1 : 1 + a])
            self._place = place
            self._remember(place)
        return self._terms

    def slopes(self, place: Array) -> Array:
        """(1 + b + a, n): of the cost, of what is kept, of what is lifted; a copy, which the caller may spoil."""
        self.at(place)
        return self._slopes.copy()

    def _remember(self, place: Array) -> None:
        here, best = found(place, self._terms), self._best
        worth = best is None or here.merit < best.merit - _WORTH or here.violation < best.violation - _WORTH
        if best is None or here.better_than(best):
            self._best, self._idle = here, 0 if worth else self._idle + 1
        else:
            self._idle += 1
        if self._idle >= _PATIENCE:
            raise _StalledError

    def best(self) -> Found:
        """The best place so far."""
        assert self._best is not None
        return self._best


def found(place: Array, terms: Terms, k: int = 0) -> Found:
    """Design k of ``terms``, which stands at ``place`` (n,)."""
    return Found(place, float(terms.merit()[k]), float(terms.violation()[k]))


def _polished(space: Space, goal: Goal, best: Found, seed: int) -> Found:
    """The best of ``best`` and of random places around it, nearer each time."""
    random = np.random.default_rng(seed)
    rounds, designs = POLISHING[space.engine]
    for k in range(rounds):
        width = 0.1 * 0.3**k
        places = np.clip(best.place + width * random.uniform(-1, 1, (designs, len(best.place))), 0, 1)
        terms = goal(places)
        first = int(terms.order()[0])
        there = found(places[first], terms, first)
        if there.better_than(best):
            best = there
    return best
