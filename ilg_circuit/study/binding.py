"""What holds a design back: which requirements and ends of ranges it stands at, and what moving each would gain.

Each is moved by one percent and the problem solved again from where the design stands: that is a multiplier that is
right for a kink, too. Where no design meets everything, each requirement is left out in turn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..units import format_quantity
from .design import Design, Question
from .plan import Span
from .requirements import Requirement
from .search import Found, climb, scatter, search
from .space import Space

#: How far a limit is moved, as a part of it.
RELAXED = 0.01
#: A requirement or the end of a range is stood at within this; a gain below the other is none.
_AT = 2e-3
_NO_GAIN = 1e-5
#: Where a requirement is left out, a rough look is enough: scattered designs, and local searches.
_SCOUTS, _STARTS = {"exact": 256, "ngspice": 64}, 2


@dataclass(frozen=True)
class Limit:
    """A requirement, or an end of a range, that the design stands at, and the ``gain`` of relaxing it by 1 %.

    ``gain`` is a part of the objective, or an increase of the worst margin where that is what counts. ``parameter`` is
    None for a requirement; ``end`` is the end of that parameter's range [SI].
    """

    text: str
    gain: float
    parameter: str | None = None
    end: float | None = None

    @property
    def binds(self) -> bool:
        return self.gain > _NO_GAIN


@dataclass(frozen=True)
class Omission:
    """What comes of leaving one requirement out: the worst margin of the others, at least 0 where they can be met."""

    requirement: Requirement
    margin: float


def limits(design: Design) -> list[Limit]:
    """All that the design stands at, by gain."""
    question, place = design.question, design.found.place
    feasible = design.feasible
    found = []
    level = 0.0 if feasible and question.objective else design.worst_score
    for k, r in enumerate(question.requirements):
        room = design.score(r) - r.reserve
        if room > (level if r.stretched or not feasible else 0.0) + _AT:
            continue
        gain = _gain(design, _moved(question, k, r.relaxed(RELAXED)))
        if r.relation == "=":  # either way may be the better one
            gain = max(gain, _gain(design, _moved(question, k, r.relaxed(-RELAXED))))
        found.append(Limit(r.text, gain))
    for j, span in enumerate(question.space.spans):
        for at_high, share in ((False, place[j]), (True, 1 - place[j])):
            if share > _AT:
                continue
            end = span.high if at_high else span.low
            name = span.parameter.name
            gain = _gain(design, replace(question, space=_widened(question.space, j, at_high)))
            text = f"{name} {'<=' if at_high else '>='} {format_quantity(end, span.parameter.unit, 6)}"
            found.append(Limit(text, gain, name, end))
    return sorted(found, key=lambda limit: -limit.gain)


def omissions(design: Design) -> list[Omission]:
    """For a design that does not meet everything: what could be met without each requirement that it misses."""
    question = design.question
    results = []
    for k, r in enumerate(question.requirements):
        others = (*question.requirements[:k], *question.requirements[k + 1 :])
        if design.met(r) or not others:
            continue
        rest = replace(question, requirements=others, objective=None)
        places = scatter(len(question.space.spans), _SCOUTS[question.space.engine], question.seed)
        values = question.space.look(places, rest.quantities)
        nearest = search(
            rest.space, rest.elastic(), places, rest.elastic_terms(values), starts=_STARTS, seed=question.seed
        )
        results.append(Omission(r, float(np.expm1(-nearest.best.merit))))
    return results


def _moved(question: Question, k: int, requirement: Requirement) -> Question:
    requirements = list(question.requirements)
    requirements[k] = requirement
    return replace(question, requirements=tuple(requirements))


def _widened(space: Space, j: int, at_high: bool) -> Space:
    """The space with one end of one range moved outwards by one percent of its size."""
    span = space.spans[j]
    size = RELAXED * abs(span.high if at_high else span.low) or RELAXED * (span.high - span.low)
    low, high = (span.low, span.high + size) if at_high else (span.low - size, span.high)
    spans: list[Span] = list(space.spans)
    spans[j] = replace(span, low=low, high=high)
    return replace(space, spans=tuple(spans))


def _gain(design: Design, eased: Question) -> float:
    """How much better the best design of ``eased`` is, looked for from where ``design`` stands."""
    question = design.question
    columns = question.space.columns(design.found.place[None])
    start = eased.space.place({name: float(column[0]) for name, column in columns.items()})
    goal = eased.goal() if design.feasible else eased.elastic()
    end: Found = climb(eased.space, goal, start)
    before, after = design.found.merit, end.merit
    if not end.feasible:
        return 0.0
    objective = question.objective
    if not (design.feasible and objective):
        return max(float(np.exp(-after) - np.exp(-before)), 0.0)
    gain = 1 - np.exp(after - before) if objective.sense > 0 else np.exp(before - after) - 1
    return float(max(gain if objective.logarithmic else before - after, 0.0))
