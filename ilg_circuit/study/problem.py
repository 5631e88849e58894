"""The inverse problem: the best design, within ranges, that meets requirements.

Without an objective the best design maximises the worst margin: the factor by which every requirement could be
tighter. If no design meets every requirement, the one whose worst margin is least negative is returned.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError
from .parameters import Scenario
from .plan import sobol_points
from .requirements import Quantity, Requirement, nothing_asked
from .search import FEASIBLE, Goal, Search, Terms, Values, local_search, search
from .space import Space

#: Lowest and highest value.
Reach = tuple[float, float]


@dataclass(frozen=True)
class Objective:
    """A quantity to minimise (``sense`` 1) or maximise (-1); its logarithm where all values are positive."""

    quantity: Quantity
    sense: int
    logarithmic: bool = False
    scale: float = 1.0

    @property
    def text(self) -> str:
        return f"{'minimise' if self.sense > 0 else 'maximise'} {self.quantity.name}"

    def scaled(self, values: Array) -> Objective:
        """Return it with the scale that suits ``values`` (k,). Raises SolveError where none of them is finite."""
        finite = values[np.isfinite(values)]
        if not len(finite):
            raise SolveError(f"{self.quantity.name} could not be had of any design within the ranges")
        if (finite > 0).all():
            return replace(self, logarithmic=True)
        return replace(self, scale=float(np.abs(finite).max()) or 1.0)

    def cost(self, values: Array) -> Array:
        """Return ``values`` (k,) as a cost to minimise."""
        if self.logarithmic:
            return self.sense * np.log(np.where(values > 0, values, np.nan))
        return self.sense * values / self.scale


def distinct(quantities: Iterable[Quantity]) -> tuple[Quantity, ...]:
    """Return ``quantities``, each name once."""
    return tuple({q.name: q for q in quantities}.values())


def slacks(requirements: Iterable[Requirement], values: Values) -> Array:
    """Return the slacks (k, b) of the requirements' sides."""
    columns = [side.slack(values[r.quantity.name]) for r in requirements for side in r.sides()]
    return np.stack(columns, axis=1) if columns else np.zeros((len(next(iter(values.values()))), 0))


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """Requirements and an objective within a search space. Raises InputError where both are missing."""

    space: Space
    requirements: tuple[Requirement, ...]
    objective: Objective | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.requirements and self.objective is None:
            raise InputError(nothing_asked())

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the requirements and of the objective, each once."""
        wanted = [r.quantity for r in self.requirements] + ([self.objective.quantity] if self.objective else [])
        return distinct(wanted)

    def goal(self, *, elastic: bool = False) -> Goal:
        """Return the goal of the best feasible design; ``elastic``: of the one nearest to meeting every requirement."""
        objective = None if elastic else self.objective
        improved = [r for r in self.requirements if elastic or r.maximised] or self.requirements
        maximin = () if objective else improved
        others = [r for r in self.requirements if r not in maximin]

        def judge(values: Values) -> Terms:
            margins, constraints = slacks(maximin, values), slacks(others, values)
            cost = objective.cost(values[objective.quantity.name]) if objective else np.zeros(len(margins))
            return Terms(cost, margins, constraints)

        return Goal(self.space, self.quantities, judge)


@dataclass(frozen=True, eq=False)
class Design:
    """The solution of a design problem, ``report.design``.

    Attributes
    ----------
    values : dict of str to float
        Values of the varied parameters [SI].
    simulated : dict of str to float
        Quantities by name, computed by ngspice [SI].
    exact : dict of str to float
        The same, computed by the engine of the search.
    scenario : Scenario
        The strip, ``scenario.actuator``, and its run.
    error : float
        Error of ``simulated`` estimated by ngspice, relative.
    reach : dict of str to Reach
        Lowest and highest value of each quantity among the initial points.
    failures : int
        Number of initial points that could not be evaluated.
    referee : str
        What computed ``simulated``: ngspice, or the engine of the search where there is no ngspice.
    problem : DesignProblem
        Ranges, requirements and objective.
    search : Search
        The starts of the search and where they ended.
    """

    problem: DesignProblem
    search: Search
    values: dict[str, float]
    scenario: Scenario
    exact: dict[str, float]
    simulated: dict[str, float]
    error: float
    reach: dict[str, Reach]
    failures: int
    referee: str = "ngspice"

    def score(self, requirement: Requirement) -> float:
        """Return a requirement's score by ngspice, as in `Requirement.score`."""
        return float(requirement.score(np.array([self.simulated[requirement.quantity.name]]))[0])

    def margin(self, requirement: Requirement) -> float:
        """Return a requirement's margin by ngspice: 0.1 if at least 4 mm is met as 4.4 mm."""
        return float(np.expm1(self.score(requirement)))

    def met(self, requirement: Requirement) -> bool:
        """Return True if it is met by ngspice; a size chosen equal to its limit may differ by a double's rounding."""
        rounding = 0.0 if requirement.quantity.outputs else 1e-12
        return self.score(requirement) >= requirement.reserve - rounding

    @property
    def feasible(self) -> bool:
        """True if all requirements are met."""
        return all(self.met(r) for r in self.problem.requirements)

    @property
    def worst_score(self) -> float:
        """Worst score of the maximised requirements; of all requirements where not all are met."""
        wanted = [r for r in self.problem.requirements if r.maximised] if self.feasible else []
        return min((self.score(r) for r in wanted or self.problem.requirements), default=np.inf)

    @property
    def worst_margin(self) -> float:
        """Margin of the worst score."""
        return float(np.expm1(self.worst_score))

    @property
    def difference(self) -> float:
        """Largest difference between the search's engine and ngspice, relative to each quantity."""
        return max(
            (abs(self.simulated[n] - x) / abs(x) for n, x in self.exact.items() if x and np.isfinite(x)), default=0.0
        )


def best_design(problem: DesignProblem, extra: Sequence[Quantity] = ()) -> Design:
    """Return the best design, or the nearest one; ``extra`` quantities are evaluated for it, too.

    Raises SolveError where no design within the ranges can be simulated.
    """
    space = problem.space
    points = sobol_points(len(space.ranges), space.scattered, problem.seed)
    values = space.at(points, problem.quantities)
    known = np.isfinite(list(values.values())).all(axis=0)
    if not known.any():
        raise SolveError(_why_none(space, problem, points))
    if problem.objective:
        problem = replace(problem, objective=problem.objective.scaled(values[problem.objective.quantity.name]))
    result = _search(problem, points, values)
    reach = {name: (float(np.nanmin(column)), float(np.nanmax(column))) for name, column in values.items()}
    return _verified(problem, result, reach, int((~known).sum()), extra)


def _why_none(space: Space, problem: DesignProblem, points: Array) -> str:
    failures = space.measure(space.columns(points[:8]), problem.quantities)[1].failures
    reason = next(iter(failures.values()), None)
    if reason is None:
        names = ", ".join(q.name for q in problem.quantities)
        reason = f"one of {names} is not known of this strip under this drive (no coupling, or a motion that ends at 0)"
    return f"not one design within the ranges can be judged: {reason}"


def _search(problem: DesignProblem, points: Array, values: Values) -> Search:
    """Search for the goal; if that ends infeasible, again from the point nearest to meeting all requirements."""
    result = search(problem.goal(), points, values, seed=problem.seed)
    if result.best.feasible:
        return result
    nearest = search(problem.goal(elastic=True), points, values, seed=problem.seed)
    if nearest.best.score > FEASIBLE:
        return nearest
    end = local_search(problem.goal(), nearest.best.point)
    return Search(end, (end,)) if end.feasible else nearest


def _verified(
    problem: DesignProblem, result: Search, reach: dict[str, Reach], failures: int, extra: Sequence[Quantity]
) -> Design:
    """Return the design at the search's end, rounded where that violates no requirement, simulated by ngspice."""
    space, referee = problem.space, problem.space.referee()
    quantities = distinct((*problem.quantities, *extra))
    designs = []
    for values in (space.rounded(result.best.point), space.values(result.best.point)):
        scenario = space.scenario(values)
        if isinstance(scenario, str):
            continue
        columns = {name: np.array([x]) for name, x in values.items()}
        exact, _ = space.measure(columns, quantities)
        simulated, evaluation = space.measure(columns, quantities, referee)
        if evaluation.failures:
            raise SolveError(f"{referee} could not simulate the design that was found: {evaluation.failures[0]}")
        first, again = ({name: float(x[0]) for name, x in found.items()} for found in (exact, simulated))
        error = float(evaluation.errors[0])
        designs.append(Design(problem, result, values, scenario, first, again, error, reach, failures, referee))
        if designs[-1].feasible:
            return designs[-1]
    if not designs:
        raise SolveError("the design that was found cannot be simulated")
    return designs[0]
