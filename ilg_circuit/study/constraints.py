"""Active constraints of a design, the gain of relaxing each, and the effect of omitting single requirements.

Each limit is relaxed by 1 % and the problem re-solved: a finite-difference Lagrange multiplier, valid also at kinks.
Where no design meets every requirement, each is omitted in turn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..units import format_quantity
from .plan import sobol_points
from .problem import Design, DesignProblem
from .requirements import Requirement
from .search import local_search, search

#: Fraction by which a limit is relaxed.
RELAXED = 0.01
#: Largest distance from a limit at which it counts as active; largest gain that counts as none.
_AT = 2e-3
_NO_GAIN = 1e-5
#: Sobol points and local searches where a requirement is omitted: a rough search suffices.
_INITIAL_POINTS, _STARTS = {"exact": 256, "ngspice": 64}, 2


@dataclass(frozen=True)
class ActiveConstraint:
    """An active requirement or end of a range, and the ``gain`` of relaxing it by 1 %.

    ``gain`` is relative to the objective, or an increase of the worst margin where there is no objective.
    ``parameter`` is None for a requirement; ``end`` is the end of that parameter's range [SI].
    """

    text: str
    gain: float
    parameter: str | None = None
    end: float | None = None

    @property
    def binds(self) -> bool:
        return self.gain > _NO_GAIN


@dataclass(frozen=True)
class WithoutRequirement:
    """Result of omitting one requirement: the worst ``margin`` of the others, at least 0 where they can be met."""

    requirement: Requirement
    margin: float


def active_constraints(design: Design) -> list[ActiveConstraint]:
    """Return the active requirements and ends of ranges of ``design``, largest gain first."""
    problem, point = design.problem, design.search.best.point
    feasible = design.feasible
    active = []
    level = 0.0 if feasible and problem.objective else design.worst_score
    for r in problem.requirements:
        slack = design.score(r) - r.reserve
        if slack > (level if r.maximised or not feasible else 0.0) + _AT:
            continue
        # of an equality either direction may be the better one
        parts = (RELAXED, -RELAXED) if r.relation == "=" else (RELAXED,)
        active.append(ActiveConstraint(r.text, max(_gain(design, _relaxed(problem, r, part)) for part in parts)))
    for interval, share in zip(problem.space.ranges, point, strict=True):
        name, unit = interval.parameter.name, interval.parameter.unit
        for side, relation, outwards, distance in (("low", ">=", -1, share), ("high", "<=", 1, 1 - share)):
            if distance > _AT:
                continue
            end = getattr(interval, side)
            step = RELAXED * (abs(end) or interval.high - interval.low)
            widened = replace(interval, **{side: end + outwards * step})
            ranges = tuple(widened if r is interval else r for r in problem.space.ranges)
            gain = _gain(design, replace(problem, space=replace(problem.space, ranges=ranges)))
            active.append(ActiveConstraint(f"{name} {relation} {format_quantity(end, unit, 6)}", gain, name, end))
    return sorted(active, key=lambda constraint: -constraint.gain)


def without_each_requirement(design: Design) -> list[WithoutRequirement]:
    """Return, for each requirement that ``design`` misses, the worst margin reached when it alone is omitted."""
    problem = design.problem
    space, seed = problem.space, problem.seed
    results = []
    for r in problem.requirements:
        others = tuple(other for other in problem.requirements if other is not r)
        if design.met(r) or not others:
            continue
        rest = replace(problem, requirements=others, objective=None)
        points = sobol_points(len(space.ranges), _INITIAL_POINTS[space.engine], seed)
        values = space.at(points, rest.quantities)
        nearest = search(rest.goal(elastic=True), points, values, starts=_STARTS, seed=seed)
        results.append(WithoutRequirement(r, float(np.expm1(-nearest.best.score))))
    return results


def _relaxed(problem: DesignProblem, eased: Requirement, part: float) -> DesignProblem:
    """Return the problem with one requirement eased by the fraction ``part``."""
    requirements = (r.relaxed(part) if r is eased else r for r in problem.requirements)
    return replace(problem, requirements=tuple(requirements))


def _gain(design: Design, relaxed: DesignProblem) -> float:
    """Return the gain of the local optimum of ``relaxed``, searched from ``design``."""
    problem = design.problem
    start = relaxed.space.point(problem.space.values(design.search.best.point))
    end = local_search(relaxed.goal(elastic=not design.feasible), start)
    if not end.feasible:
        return 0.0
    before, after, objective = design.search.best.score, end.score, problem.objective
    if not (design.feasible and objective):
        return max(float(np.exp(-after) - np.exp(-before)), 0.0)
    gain = 1 - np.exp(after - before) if objective.sense > 0 else np.exp(before - after) - 1
    return float(max(gain if objective.logarithmic else before - after, 0.0))
