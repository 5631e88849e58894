"""Pareto front of two or three quantities: designs that cannot be improved in one without loss in another.

Each point is the end of a constrained optimisation: from a reference point, all objectives are improved equally
(Pascoletti and Serafini). References are nondominated initial points first, then the midpoints of the longest gaps
between neighbours, so that the points are evenly spaced.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError, SolveError
from ..findings import Finding, Warned
from ..result import Column, Result
from ..strip.validity import LARGEST_DEFLECTION, deflection_warnings
from .evaluate import Progress
from .plan import sobol_points
from .problem import DesignProblem, Objective, distinct, slacks
from .requirements import quantity
from .search import FEASIBLE, Goal, LocalOptimum, Terms, Values, distant, local_search

#: Number of objectives -> default number of points of the front.
POINTS = {2: 25, 3: 60}
#: References taken from the initial points before gaps are filled.
_FIRST = {2: 2, 3: 12}
#: Weight of the sum of all objectives beside their equal improvement; without it an end may be only weakly optimal.
_SUM = 1e-3
#: Relative to the front's extent: tolerance of dominance, and distance below which two points are one.
_DOMINATED, _SAME = 1e-4, 2e-3
#: Failed attempts to fill gaps after which the front counts as complete, relative to its number of points.
_PATIENCE = 0.5
#: Random designs around each point, within this fraction of the ranges, that must not dominate it.
_CHALLENGERS, _CHALLENGE = 16, 0.02


@dataclass(frozen=True, repr=False, eq=False)
class Front(Result, Warned):
    """A Pareto front: k designs in order of the first objective, ``report.front``.

    Attributes
    ----------
    parameters : dict of str to ndarray (k,)
        Values of the varied parameters [SI].
    simulated : dict of str to ndarray (k,)
        Objectives and other quantities, computed by ngspice [SI].
    values : dict of str to ndarray (k,)
        The same, computed by the engine of the search.
    units : dict of str to str
        SI units of all of them.
    objectives : tuple of Objective
        What was minimised or maximised.
    improvable : float
        Largest improvement in all objectives at once found by a random design near a point, relative to the extent of
        the front.
    deflections : ndarray (k,)
        Largest displacement over the distance of the load from the clamp; NaN without a coupling.
    referee : str
        What computed ``simulated``: ngspice, or the engine of the search where there is no ngspice.
    """

    presenter: ClassVar[str] = "front"

    objectives: tuple[Objective, ...]
    parameters: dict[str, Array]
    values: dict[str, Array]
    simulated: dict[str, Array]
    units: dict[str, str]
    improvable: float
    deflections: Array
    referee: str = "ngspice"

    def __len__(self) -> int:
        return len(next(iter(self.parameters.values())))

    @property
    def bent(self) -> int:
        """Number of points beyond the limit of the small-deflection beam."""
        return int((self.deflections > LARGEST_DEFLECTION).sum())

    @property
    def difference(self) -> float:
        """Largest difference between the search's engine and ngspice, relative to each value."""
        return max(
            float(np.max(np.abs(self.simulated[n] / x - 1), initial=0.0, where=x != 0)) for n, x in self.values.items()
        )

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The finding that designs exceed the small-deflection limit, if any do."""
        return tuple(Finding("assumption-fails", values={"text": text}) for text in deflection_warnings(self.bent))

    def table(self) -> tuple[Column, ...]:
        """Return parameters and quantities (by ngspice), one point a row."""
        found = {**self.parameters, **self.simulated}
        return tuple(Column(name, values, self.units[name]) for name, values in found.items())

    def to_dict(self) -> dict[str, Any]:
        """Return objectives, units and points as plain data."""
        return {
            "objectives": {o.quantity.name: "minimise" if o.sense > 0 else "maximise" for o in self.objectives},
            "units": self.units,
            "parameters": {name: column.tolist() for name, column in self.parameters.items()},
            "values": {name: column.tolist() for name, column in self.values.items()},
            "ngspice": {name: column.tolist() for name, column in self.simulated.items()},
            "improvable": self.improvable,
            "largest_difference": self.difference,
        }


def parse_objectives(text: str, varied: Sequence[str]) -> tuple[Objective, ...]:
    """Parse objectives such as ``displacement_final,force_blocked,min:time_of_90``. Raises InputError.

    Without ``min:`` or ``max:`` displacement and force are maximised, all others are minimised.
    """
    objectives = []
    for word in (w.strip() for w in text.split(",")):
        sense, colon, name = word.rpartition(":")
        if colon and sense not in ("min", "max"):
            raise InputError(f"'{word[:60]}' is not understood; write min:{name} or max:{name}")
        wanted = quantity(name, varied)
        more = wanted.more_is_better if not colon else sense == "max"
        objectives.append(Objective(wanted, -1 if more else 1))
    if not 2 <= len(objectives) <= 3 or len({o.quantity.name for o in objectives}) < len(objectives):
        raise InputError(
            f"a front of '{text[:60]}': give two or three quantities, such as displacement_final,force_blocked"
        )
    return tuple(objectives)


def pareto_front(
    problem: DesignProblem,
    objectives: tuple[Objective, ...],
    *,
    points: int | None = None,
    progress: Progress | None = None,
) -> Front:
    """Return the front of the designs that meet the problem's requirements.

    Raises InputError for an impossible number of points, SolveError where no design meets the requirements.
    """
    front = _FrontInProgress(problem, objectives, POINTS[len(objectives)] if points is None else points)
    while front.fill():
        if progress:
            progress(min(len(front.points), front.wanted - 1), front.wanted)
    if progress:
        progress(front.wanted, front.wanted)
    return front.result()


class _FrontInProgress:
    """A front while it is computed: ``points`` (k, n) in the unit cube and their ``costs`` (k, m)."""

    def __init__(self, problem: DesignProblem, objectives: tuple[Objective, ...], wanted: int) -> None:
        if not len(objectives) <= wanted <= 1000:
            raise InputError(f"a front of {wanted} points: give {len(objectives)} to 1000")
        self.wanted, self.objectives, self.problem = wanted, objectives, problem
        self.quantities = distinct([r.quantity for r in problem.requirements] + [o.quantity for o in objectives])
        self.space = problem.space
        self.tried: set[tuple[float, ...]] = set()
        self._begin()
        self.misses = 0

    def _begin(self) -> None:
        """Find the best design of each objective, and improve a few distant nondominated initial points."""
        sampled = sobol_points(len(self.space.ranges), 2 * self.space.scattered, self.problem.seed)
        values = self.space.at(sampled, self.quantities)
        self.objectives = tuple(o.scaled(values[o.quantity.name]) for o in self.objectives)
        costs, constraints = self._judge(values)
        feasible = (constraints >= -FEASIBLE).all(axis=1) & np.isfinite(costs).all(axis=1)
        m = len(self.objectives)
        ends = []
        for cost, weights in zip(costs.T, np.where(np.eye(m), 1.0, _SUM), strict=True):
            best = Terms(np.where(np.isfinite(cost), cost, np.inf), costs[:, :0], constraints).order()[0]
            ends.append(self._search(partial(_weighted, weights), sampled[int(best)]))
        extremes = np.array([end.point for end in ends if end.feasible])
        if not len(extremes):
            raise SolveError("no design within the ranges meets the requirements, so there is no front")
        points = np.concatenate([extremes, sampled[feasible]])
        costs = np.concatenate([self._evaluate(extremes)[0], costs[feasible]])
        first = nondominated(costs)
        self.low, self.extent = costs[first].min(axis=0), np.ptp(costs[first], axis=0)
        self.extent = np.where(self.extent > 1e-9, self.extent, 1.0)
        self.points, self.costs = extremes, costs[: len(extremes)]
        others = first[first >= len(extremes)]
        more = min(_FIRST[m], self.wanted - len(extremes))
        if len(others) and more > 0:
            shape = (costs[others] - self.low) / self.extent
            for k in distant(shape, np.arange(len(shape)), more):
                self._improve(points[others[k]], costs[others[k]])

    def fill(self) -> bool:
        """Fill the longest gap between neighbours; return False when the front is complete."""
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
        """Add the point reached from ``reference`` (m,); return False if the front has it, or a better one."""

        def improvements(costs: Array) -> tuple[Array, Array]:
            improvement = (reference - costs) / self.extent
            return -_SUM / len(self.objectives) * improvement.sum(axis=1), improvement

        end = self._search(improvements, start)
        if not end.feasible:
            return False
        cost = self._evaluate(end.point[None])[0]
        near = np.abs((self.costs - cost) / self.extent).max(axis=1).min() < _SAME
        costs = np.concatenate([self.costs, cost])
        kept = nondominated(costs / self.extent, _DOMINATED)
        new = bool((kept == len(self.costs)).any()) and not near
        if new:
            self.points, self.costs = np.concatenate([self.points, end.point[None]])[kept], costs[kept]
        return new

    def result(self) -> Front:
        kept = nondominated(np.round((self.costs - self.low) / self.extent, 6), _DOMINATED)  # two ends may coincide
        order = kept[np.argsort(self.costs[kept, 0])]
        points, costs = self.points[order], self.costs[order]
        columns = self.space.columns(points)
        deflection = quantity("relative_deflection", self.space.names)
        measured = self.space.measure(columns, (*self.quantities, deflection))[0]
        units = {r.parameter.name: r.parameter.unit for r in self.space.ranges}
        referee = self.space.referee()
        return Front(
            self.objectives,
            columns,
            values={q.name: measured[q.name] for q in self.quantities},
            simulated=self.space.measure(columns, self.quantities, referee)[0],
            units=units | {q.name: q.unit for q in self.quantities},
            improvable=self._improvable(points, costs),
            deflections=measured[deflection.name],
            referee=referee,
        )

    def _improvable(self, points: Array, costs: Array) -> float:
        random = np.random.default_rng(self.problem.seed)
        around = points[:, None] + _CHALLENGE * random.uniform(-1, 1, (len(points), _CHALLENGERS, points.shape[1]))
        challengers, constraints = self._evaluate(np.clip(around, 0, 1).reshape(-1, points.shape[1]))
        better = ((np.repeat(costs, _CHALLENGERS, axis=0) - challengers) / self.extent).min(axis=1)
        feasible = (constraints >= 0).all(axis=1) & np.isfinite(better)
        return float(max(better[feasible].max(initial=0.0), 0.0))

    def _evaluate(self, points: Array) -> tuple[Array, Array]:
        """Return costs (k, m) and slacks (k, b) at ``points`` (k, n)."""
        return self._judge(self.space.at(points, self.quantities))

    def _judge(self, values: Values) -> tuple[Array, Array]:
        """Return costs (k, m) and slacks (k, b) for the quantities' values."""
        costs = np.stack([o.cost(values[o.quantity.name]) for o in self.objectives], axis=1)
        return costs, slacks(self.problem.requirements, values)

    def _search(self, aims: Callable[[Array], tuple[Array, Array]], start: Array) -> LocalOptimum:
        """Return the local optimum of what ``aims`` makes of costs: an objective and terms of a maximin."""

        def judge(values: Values) -> Terms:
            costs, constraints = self._judge(values)
            return Terms(*aims(costs), constraints)

        return local_search(Goal(self.space, self.quantities, judge), start)


def _weighted(weights: Array, costs: Array) -> tuple[Array, Array]:
    """Return the weighted sum of costs (k, m) as an objective, and no terms of a maximin."""
    return costs @ weights, costs[:, :0]


def nondominated(costs: Array, tolerance: float = 0.0) -> NDArray[np.intp]:
    """Return the indices of nondominated ``costs`` (k, m); of equal ones the first.

    One is dominated if another is better in one cost by more than ``tolerance`` and worse in none.
    """
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
    """Return pairs of points (k, m) with no third point in the ball on their join, farthest first."""
    distance = ((shape[:, None] - shape[None]) ** 2).sum(axis=2)
    pairs = []
    for i in range(len(shape)):
        for j in range(i):
            between = distance[i] + distance[j] < distance[i, j] * (1 - 1e-9)
            if not between.any():
                pairs.append((float(distance[i, j]), j, i))
    return [(j, i) for _, j, i in sorted(pairs, reverse=True)]
