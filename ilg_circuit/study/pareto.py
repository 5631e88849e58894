"""Pareto front of two or three quantities: designs that cannot be better in one without being worse in another.

Each point is the end of a constrained optimisation: from a reference point, all objectives are improved alike as far as
they go (Pascoletti and Serafini). References are scattered designs that no other dominates, then the middles of the
longest gaps between neighbours found so far, so that the points lie evenly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError, SolveError
from ..strip.validity import LARGEST_DEFLECTION
from .problem import DesignProblem, Objective
from .quantities import quantity
from .search import FEASIBLE, INITIAL_POINTS, Terms, apart, local_search, sobol_points
from .space import Space, measure

Progress = Callable[[int, int], None]

#: Points of a front of two, of three objectives where nobody says how many.
POINTS = {2: 25, 3: 60}
#: References taken from the scattered designs before gaps are filled.
_FIRST = {2: 2, 3: 12}
#: Weight of the sum of all objectives beside the improvement alike: without it an end may be weakly optimal only.
_SUM = 1e-3
#: In parts of the front's extent: what counts as dominated, and points so near that they are one.
_DOMINATED, _SAME = 1e-4, 2e-3
#: Gaps tried in vain before the front counts as complete, in parts of its points.
_PATIENCE = 0.5
#: Random designs around each point, within this part of the ranges, that must not improve on it.
_CHALLENGERS, _CHALLENGE = 16, 0.02


@dataclass(frozen=True, eq=False)
class Front:
    """Points in order of the first objective: designs, what they do by the search's engine and by ngspice.

    ``columns``: parameter -> (k,) [SI]; ``values`` and ``simulated``: quantity -> (k,) [SI]; ``units`` of all of them.
    ``improvable``: the most that a random design near a point betters it in all objectives at once, in parts of the
    front's extent. ``deflections`` (k,) are largest displacements over the load's distance, NaN without a coupling.
    """

    objectives: tuple[Objective, ...]
    columns: dict[str, Array]
    values: dict[str, Array]
    simulated: dict[str, Array]
    units: dict[str, str]
    improvable: float
    deflections: Array

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def bent(self) -> int:
        """Points beyond what the small-deflection beam is good for."""
        return int((self.deflections > LARGEST_DEFLECTION).sum())

    @property
    def difference(self) -> float:
        """Largest difference between the search's engine and ngspice, relative to each value."""
        return max(
            float(np.max(np.abs(self.simulated[n] / x - 1), initial=0.0, where=x != 0)) for n, x in self.values.items()
        )


def parse_objectives(text: str, varied: Sequence[str]) -> tuple[Objective, ...]:
    """Objectives from ``displacement_final,force_blocked,min:time_of_90``. Raises InputError.

    Without ``min:`` or ``max:`` displacement and force are maximised, all else is minimised.
    """
    found = []
    for word in (w.strip() for w in text.split(",")):
        sense, colon, name = word.rpartition(":")
        if colon and sense not in ("min", "max"):
            raise InputError(f"'{word[:60]}' is not understood; write min:{name} or max:{name}")
        wanted = quantity(name, varied)
        more = wanted.more_is_better if not colon else sense == "max"
        found.append(Objective(wanted, -1 if more else 1))
    if not 2 <= len(found) <= 3 or len({o.quantity.name for o in found}) < len(found):
        raise InputError(
            f"a front of '{text[:60]}': give two or three quantities, such as displacement_final,force_blocked"
        )
    return tuple(found)


def pareto_front(
    problem: DesignProblem,
    objectives: tuple[Objective, ...],
    *,
    points: int | None = None,
    progress: Progress | None = None,
) -> Front:
    """The front of the designs that meet the problem's requirements. Raises SolveError where there are none."""
    work = _Front(problem, objectives, points or POINTS[len(objectives)])
    work.begin()
    while work.fill():
        if progress:
            progress(min(len(work.points), work.wanted - 1), work.wanted)
    if progress:
        progress(work.wanted, work.wanted)
    return work.result()


class _Front:
    """A front while it is made: ``points`` (k, n) of its points and their ``costs`` (k, m)."""

    def __init__(self, problem: DesignProblem, objectives: tuple[Objective, ...], wanted: int) -> None:
        if not len(objectives) <= wanted <= 1000:
            raise InputError(f"a front of {wanted} points: give {len(objectives)} to 1000")
        self.wanted, self.objectives = wanted, objectives
        self.problem = replace(problem, objective=objectives[0])
        needed = [r.quantity for r in problem.requirements] + [o.quantity for o in objectives]
        self.quantities = tuple({q.name: q for q in needed}.values())
        self.space: Space = problem.space
        self.tried: set[tuple[float, ...]] = set()

    def begin(self) -> None:
        """Scattered designs, the best of each objective, and a few improved from well apart."""
        sampled_points = sobol_points(len(self.space.ranges), 2 * INITIAL_POINTS[self.space.engine], self.problem.seed)
        values = self._evaluate(sampled_points)
        self.objectives = tuple(o.scaled(values[:, self._column(o)]) for o in self.objectives)
        costs, constraints = self._judge(values)
        fine = (constraints >= -FEASIBLE).all(axis=1) & np.isfinite(costs).all(axis=1)
        m = len(self.objectives)
        ends = []
        for j in range(m):
            weights = np.full(m, _SUM)
            weights[j] = 1.0
            order = Terms(
                np.where(np.isfinite(costs[:, j]), costs[:, j], np.inf), np.zeros((len(costs), 0)), constraints
            )
            start = sampled_points[int(order.order()[0])]
            ends.append(local_search(self.space, self._weighted(weights), start))
        feasible = [end.point for end in ends if end.feasible]
        if not feasible:
            raise SolveError("no design within the ranges meets the requirements, so there is no front")
        points = np.concatenate([np.array(feasible), sampled_points[fine]])
        costs = np.concatenate([self._judge(self._evaluate(np.array(feasible)))[0], costs[fine]])
        first = nondominated(costs)
        self.low, self.extent = costs[first].min(axis=0), np.ptp(costs[first], axis=0)
        self.extent = np.where(self.extent > 1e-9, self.extent, 1.0)
        self.points, self.costs = np.array(feasible), costs[: len(feasible)]
        scattered = first[first >= len(feasible)]
        more = min(_FIRST[m], self.wanted - len(feasible))
        if len(scattered) and more > 0:
            shape = (costs[scattered] - self.low) / self.extent
            for k in apart(shape, np.arange(len(shape)), more):
                self._improve(points[scattered[k]], costs[scattered[k]])
        self.misses = 0

    def fill(self) -> bool:
        """Fill the longest gap between neighbours; False when the front is complete."""
        if len(self.points) >= self.wanted or self.misses > _PATIENCE * self.wanted:
            return False
        shape = (self.costs - self.low) / self.extent
        for i, j in neighbours(shape):
            middle = (self.costs[i] + self.costs[j]) / 2
            mark = tuple(middle.round(9))
            if mark in self.tried:
                continue
            self.tried.add(mark)
            self.misses += not self._improve((self.points[i] + self.points[j]) / 2, middle)
            return True
        return False

    def _improve(self, start: Array, reference: Array) -> bool:
        """Add the point to which ``reference`` (m,) improves; False where the front has it, or better, already."""
        m = len(self.objectives)

        def goal(points: Array) -> Terms:
            costs, constraints = self._judge(self._evaluate(points))
            maximin = (reference - costs) / self.extent
            return Terms(-_SUM / m * maximin.sum(axis=1), maximin, constraints)

        end = local_search(self.space, goal, start)
        if not end.feasible:
            return False
        cost = self._judge(self._evaluate(end.point[None]))[0]
        near = np.abs((self.costs - cost) / self.extent).max(axis=1).min() < _SAME
        costs = np.concatenate([self.costs, cost])
        constraints = nondominated(costs / self.extent, _DOMINATED)
        new = bool((constraints == len(self.costs)).any()) and not near
        if new:
            self.points, self.costs = np.concatenate([self.points, end.point[None]])[constraints], costs[constraints]
        return new

    def result(self) -> Front:
        apart = nondominated(np.round((self.costs - self.low) / self.extent, 6), _DOMINATED)  # ends may be one point
        order = apart[np.argsort(self.costs[apart, 0])]
        points, costs = self.points[order], self.costs[order]
        columns = self.space.columns(points)
        scenarios = self.space.scenarios(columns)
        deflection = quantity("relative_deflection", self.space.names)
        *ours, deflections = measure(scenarios, columns, (*self.quantities, deflection), self.space.engine)[0].T
        theirs = measure(scenarios, columns, self.quantities, "ngspice")[0]
        names = [q.name for q in self.quantities]
        return Front(
            self.objectives,
            columns,
            dict(zip(names, ours, strict=True)),
            dict(zip(names, theirs.T, strict=True)),
            {
                **{s.parameter.name: s.parameter.unit for s in self.space.ranges},
                **{q.name: q.unit for q in self.quantities},
            },
            self._improvable(points, costs),
            deflections,
        )

    def _improvable(self, points: Array, costs: Array) -> float:
        random = np.random.default_rng(self.problem.seed)
        around = points[:, None] + _CHALLENGE * random.uniform(-1, 1, (len(points), _CHALLENGERS, points.shape[1]))
        found, constraints = self._judge(self._evaluate(np.clip(around, 0, 1).reshape(-1, points.shape[1])))
        better = ((np.repeat(costs, _CHALLENGERS, axis=0) - found) / self.extent).min(axis=1)
        fine = (constraints >= 0).all(axis=1) & np.isfinite(better)
        return float(max(better[fine].max(initial=0.0), 0.0))

    def _evaluate(self, points: Array) -> Array:
        return self.space.evaluate(points, self.quantities)

    def _column(self, objective: Objective) -> int:
        return [q.name for q in self.quantities].index(objective.quantity.name)

    def _judge(self, values: Array) -> tuple[Array, Array]:
        """Costs (k, m) and scores (k, b) of the requirements, for values (k, q) of the quantities."""
        costs = np.stack([o.cost(values[:, self._column(o)]) for o in self.objectives], axis=1)
        names = [q.name for q in self.quantities]
        scores = [
            side.slack(values[:, names.index(r.quantity.name)]) for r in self.problem.requirements for side in r.sides()
        ]
        return costs, np.stack(scores, axis=1) if scores else np.zeros((len(values), 0))

    def _weighted(self, weights: Array) -> Callable[[Array], Terms]:
        def goal(points: Array) -> Terms:
            costs, constraints = self._judge(self._evaluate(points))
            return Terms(costs @ weights, np.zeros((len(costs), 0)), constraints)

        return goal


def nondominated(costs: Array, tolerance: float = 0.0) -> NDArray[np.intp]:
    """Indices of ``costs`` (k, m) that no other betters in one by more than ``tolerance`` while it is no worse in any;
    of equal ones the first."""
    keep = np.ones(len(costs), dtype=bool)
    for k, cost in enumerate(costs):
        if not keep[k]:
            continue
        others = costs[keep]
        no_worse = (others <= cost + tolerance / 10).all(axis=1)
        keep[k] = not (no_worse & (others < cost - tolerance).any(axis=1)).any()
        if keep[k]:
            equal = (costs == cost).all(axis=1)
            equal[: k + 1] = False
            keep &= ~equal
    return np.flatnonzero(keep)


def neighbours(shape: Array) -> list[tuple[int, int]]:
    """Pairs of points (k, m) between which there is no third (none within the ball on their join), farthest first."""
    distance = ((shape[:, None] - shape[None]) ** 2).sum(axis=2)
    pairs = []
    for i in range(len(shape)):
        for j in range(i):
            between = distance[i] + distance[j] < distance[i, j] * (1 - 1e-9)
            if not between.any():
                pairs.append((float(distance[i, j]), j, i))
    return [(j, i) for _, j, i in sorted(pairs, reverse=True)]
