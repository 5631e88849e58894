"""The inverse problem: which design, within ranges, meets requirements, and best.

Without an objective the best design is the one whose worst margin is largest: the factor by which every requirement
could be tighter. Where no design meets everything, the nearest one is that whose worst margin is least negative.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError
from .parameters import Case
from .quantities import Quantity
from .requirements import Requirement
from .search import FEASIBLE, SCOUTS, Found, Goal, Search, Terms, climb, scatter, search
from .space import Space, measure

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Objective:
    """What is to be small (``sense`` 1) or large (-1), by its logarithm where it is positive throughout."""

    quantity: Quantity
    sense: int
    logarithmic: bool = False
    scale: float = 1.0

    @property
    def text(self) -> str:
        return f"{'minimise' if self.sense > 0 else 'maximise'} {self.quantity.name}"

    def scaled(self, values: Array) -> Objective:
        """The same in the measure that suits ``values`` (k,) of it, seen over the ranges."""
        seen = values[np.isfinite(values)]
        if not len(seen):
            raise SolveError(f"{self.quantity.name} could not be had of any design within the ranges")
        if (seen > 0).all():
            return replace(self, logarithmic=True)
        return replace(self, scale=float(np.abs(seen).max()) or 1.0)

    def cost(self, values: Array) -> Array:
        """Values (k,) as a cost."""
        if self.logarithmic:
            return np.asarray(self.sense * np.log(np.where(values > 0, values, np.nan)))
        return np.asarray(self.sense * values / self.scale)

    def gain(self, old: float, new: float) -> float:
        """How much better ``new`` is, as a part of ``old``."""
        return -self.sense * (new - old) / (abs(old) or 1.0)


@dataclass(frozen=True, eq=False)
class Question:
    """What a design is asked for within a space."""

    space: Space
    requirements: tuple[Requirement, ...]
    objective: Objective | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.requirements and self.objective is None:
            raise InputError(
                "nothing is asked of the design; give --require displacement_final>=4mm, --minimise or --maximise"
            )

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """All that has to be known of a design, each once."""
        wanted = [r.quantity for r in self.requirements] + ([self.objective.quantity] if self.objective else [])
        return tuple({q.name: q for q in wanted}.values())

    def column(self, quantity: Quantity) -> int:
        return [q.name for q in self.quantities].index(quantity.name)

    def goal(self) -> Goal:
        """Best among the designs that meet everything."""
        return lambda places: self.terms(self.space.look(places, self.quantities))

    def elastic(self) -> Goal:
        """Nearest to meeting everything."""
        return lambda places: self.elastic_terms(self.space.look(places, self.quantities))

    def terms(self, values: Array) -> Terms:
        """Terms of `goal` for ``values`` (k, q) of the quantities."""
        if self.objective:
            return Terms(
                self.objective.cost(values[:, self.column(self.objective.quantity)]),
                np.zeros((len(values), 0)),
                self._margins(values, lambda r: True),
            )
        if not any(r.stretched for r in self.requirements):
            return self.elastic_terms(values)
        return Terms(
            np.zeros(len(values)),
            self._margins(values, lambda r: r.stretched),
            self._margins(values, lambda r: not r.stretched),
        )

    def elastic_terms(self, values: Array) -> Terms:
        """Terms of `elastic` for ``values`` (k, q) of the quantities."""
        return Terms(np.zeros(len(values)), self._margins(values, lambda r: True), np.zeros((len(values), 0)))

    def _margins(self, values: Array, which: Callable[[Requirement], bool]) -> Array:
        columns = [
            side.room(values[:, self.column(r.quantity)]) for r in self.requirements if which(r) for side in r.sides()
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((len(values), 0))


@dataclass(frozen=True, eq=False)
class Design:
    """The answer: ``values`` [SI] of what was varied, the ``case`` that they make, and how it was found.

    ``exact`` and ``simulated``: quantities by name, from the search's engine and from ngspice; ``error``: ngspice's
    own estimate. ``reach``: lowest and highest of each quantity among the designs scattered over the ranges.
    """

    question: Question
    found: Found
    values: dict[str, float]
    case: Case
    search: Search
    exact: dict[str, float]
    simulated: dict[str, float]
    error: float
    reach: dict[str, tuple[float, float]]
    failures: int

    def score(self, requirement: Requirement) -> float:
        """A requirement's score by ngspice, as in `Requirement.score`."""
        return float(requirement.score(np.array([self.simulated[requirement.quantity.name]]))[0])

    def margin(self, requirement: Requirement) -> float:
        """How much tighter a requirement could be, by ngspice: 0.1, and at least 4 mm is met as 4.4 mm."""
        return float(np.expm1(self.score(requirement)))

    def met(self, requirement: Requirement) -> bool:
        """Whether ngspice finds it met; a size chosen equal to its limit may differ by the rounding of a double."""
        rounding = 0.0 if requirement.quantity.outputs else 1e-12
        return self.score(requirement) >= requirement.reserve - rounding

    @property
    def feasible(self) -> bool:
        return all(self.met(r) for r in self.question.requirements)

    @property
    def worst_score(self) -> float:
        """Among the requirements whose margins were to be large; among all where not all are met."""
        wanted = [r for r in self.question.requirements if r.stretched] if self.feasible else []
        return min((self.score(r) for r in wanted or self.question.requirements), default=np.inf)

    @property
    def worst_margin(self) -> float:
        """The margin of that score."""
        return float(np.expm1(self.worst_score))

    @property
    def difference(self) -> float:
        """Largest difference between the search's engine and ngspice, relative to each quantity."""
        return max(
            (abs(self.simulated[n] - x) / abs(x) for n, x in self.exact.items() if x and np.isfinite(x)), default=0.0
        )


def best_design(question: Question, extra: Sequence[Quantity] = ()) -> Design:
    """The best design, or the nearest to one; ``extra`` are quantities to know of it besides.

    Raises SolveError where not one design within the ranges can be simulated.
    """
    space = question.space
    scouted = scatter(len(space.spans), SCOUTS[space.engine], question.seed)
    values = space.look(scouted, question.quantities)
    known = np.isfinite(values).all(axis=1)
    if not known.any():
        raise SolveError(_why_none(space, question, scouted))
    if question.objective:
        column = values[:, question.column(question.objective.quantity)]
        question = replace(question, objective=question.objective.scaled(column))
    result = _search(question, scouted, values)
    reach = {
        q.name: (float(np.nanmin(values[:, k])), float(np.nanmax(values[:, k])))
        for k, q in enumerate(question.quantities)
    }
    return _answer(question, result, reach, int((~known).sum()), extra)


def _why_none(space: Space, question: Question, places: Array) -> str:
    columns = space.columns(places[:8])
    evaluation = measure(space.cases(columns), columns, question.quantities, space.engine)[1]
    reason = next(iter(evaluation.failures.values()), None)
    if reason is None:
        names = ", ".join(q.name for q in question.quantities)
        reason = f"one of {names} is not known of this strip under this drive (no coupling, or a motion that ends at 0)"
    return f"not one design within the ranges can be judged: {reason}"


def _search(question: Question, scouted: Array, values: Array) -> Search:
    """By the goal itself; where that ends outside, from the place that comes nearest to meeting everything."""
    space, seed = question.space, question.seed
    found = search(space, question.goal(), scouted, question.terms(values), seed=seed)
    if found.best.feasible:
        return found
    nearest = search(space, question.elastic(), scouted, question.elastic_terms(values), seed=seed)
    if nearest.best.merit > FEASIBLE:
        return nearest
    end = climb(space, question.goal(), nearest.best.place)
    return Search(end, (end,)) if end.feasible else nearest


def _answer(
    question: Question, result: Search, reach: dict[str, tuple[float, float]], failures: int, extra: Sequence[Quantity]
) -> Design:
    """The design at the search's end, its sizes rounded where that harms no requirement, simulated again by ngspice."""
    space = question.space
    exactly = {name: float(column[0]) for name, column in space.columns(result.best.place[None]).items()}
    quantities = tuple({q.name: q for q in (*question.quantities, *extra)}.values())
    answers = []
    for values in (space.rounded(result.best.place), exactly):
        case = space.case(values)
        if isinstance(case, str):
            continue
        columns = {name: np.array([x]) for name, x in values.items()}
        ours = measure([case], columns, quantities, space.engine)[0][0]
        simulated, evaluation = measure([case], columns, quantities, "ngspice")
        if evaluation.failures:
            raise SolveError(f"ngspice could not simulate the design that was found: {evaluation.failures[0]}")
        names = [q.name for q in quantities]
        answers.append(
            Design(
                question,
                result.best,
                values,
                case,
                result,
                dict(zip(names, map(float, ours), strict=True)),
                dict(zip(names, map(float, simulated[0]), strict=True)),
                float(evaluation.errors[0]),
                reach,
                failures,
            )
        )
        if answers[-1].feasible:
            break
    if not answers:
        raise SolveError("the design that was found cannot be simulated")
    return answers[0] if answers[0].feasible or not answers[-1].feasible else answers[-1]
