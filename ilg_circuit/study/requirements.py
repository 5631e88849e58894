"""Requirements on a design, such as ``displacement_final>=4mm``, and by how much a design meets them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..strip.actuator import Actuator
from ..units import format_quantity, parse
from .quantities import ASSUMPTIONS, Quantity, quantity

Array = NDArray[np.float64]

#: How near an ``=`` has to come, relative to its limit; and how far inside its limit a design is pulled, so that it
#: still meets it when ngspice simulates it again. What takes no simulation is not pulled.
EQUALITY_TOLERANCE = 1e-3
GUARD = 1e-4

#: Part of a limit below which a score is no logarithm but a line.
_STRAIGHT = 0.1

_FORM = re.compile(r"\s*([A-Za-z_]\w*)\s*(>=|<=|==|=)\s*(\S.*?)\s*")
REQUIREMENT_FORMS = "displacement_final>=4mm, settling_time<=60s or displacement_final=4mm"


@dataclass(frozen=True)
class Requirement:
    """``quantity`` related to ``limit`` [SI] by ``>=``, ``<=`` or ``=``.

    ``reserve``: score that a design must have to count as meeting it, for what is uncertain; ``guard``: how much more
    a search keeps.
    """

    quantity: Quantity
    relation: str
    limit: float
    guard: float = 0.0
    reserve: float = 0.0

    def __post_init__(self) -> None:
        if self.relation == "=" and self.limit == 0:
            raise InputError(f"{self.quantity.name}=0 has no scale to come near to; give >= and <= instead")

    @property
    def stretched(self) -> bool:
        """Whether more than enough of it is worth having: of what a run does, and not of where the model holds."""
        return self.relation != "=" and bool(self.quantity.outputs) and self.quantity.name not in ASSUMPTIONS

    @property
    def text(self) -> str:
        """Such as ``displacement_final >= 4 mm``."""
        return f"{self.quantity.name} {self.relation} {format_quantity(self.limit, self.quantity.unit, 6)}"

    def score(self, values: Array) -> Array:
        """Logarithm of the factor by which ``values`` (n,) meet it: log 1.1 for 4.4 mm of at least 4 mm.

        Where a value has the other sign or is near zero, a straight line goes on from the logarithm; a limit of zero is
        met by the value itself, in SI units. Of an ``=`` the score is at most that of its tolerance.
        """
        if self.relation == "=":
            low, high = (side.score(values) for side in self.sides())
            return np.minimum(low, high)
        sign = 1.0 if self.relation == ">=" else -1.0
        if self.limit == 0:
            return np.asarray(sign * values)
        ratio = values / self.limit
        logarithm = np.log(np.maximum(ratio, _STRAIGHT)) + np.minimum(ratio / _STRAIGHT - 1, 0.0)
        return np.asarray(sign * np.sign(self.limit) * logarithm)

    def room(self, values: Array) -> Array:
        """Scores of ``values`` (n,), less what a search keeps of them."""
        return self.score(values) - self.reserve - self.guard

    def sides(self) -> tuple[Requirement, ...]:
        """An ``=`` as the two requirements that it is; any other as itself."""
        if self.relation != "=":
            return (self,)
        low, high = sorted(self.limit * (1 + sign * EQUALITY_TOLERANCE) for sign in (-1, 1))
        return replace(self, relation=">=", limit=low), replace(self, relation="<=", limit=high)

    def relaxed(self, part: float) -> Requirement:
        """The same with its limit moved by ``part`` of it to where more is allowed; of an ``=``, to a larger size."""
        if self.relation == "=":
            return replace(self, limit=self.limit * (1 + part))
        outwards = -1.0 if self.relation == ">=" else 1.0
        return replace(self, limit=self.limit + outwards * part * abs(self.limit))


def parse_requirement(text: str, varied: Sequence[str]) -> Requirement:
    """A requirement from a text such as ``displacement_final>=4mm``; ``varied`` as in `quantity`. Raises InputError."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise InputError(f"requirement '{text[:60]}' is not understood; write it like {REQUIREMENT_FORMS}")
    name, relation, limit = match.groups()
    wanted = quantity(name, varied)
    value = parse(limit, wanted.unit, f"requirement '{text.strip()[:60]}'")
    return Requirement(wanted, relation.replace("==", "="), value, GUARD if wanted.outputs else 0.0)


def parse_requirements(texts: Iterable[str], varied: Sequence[str], actuator: Actuator) -> tuple[Requirement, ...]:
    """All of ``texts``; the word ``valid`` stands for every assumption of the model (gravity's not for a weightless
    strip, whose coupling has it in it). Raises InputError, also where two contradict one another."""
    found: list[Requirement] = []
    for text in texts:
        if text.strip() == "valid":
            found += [
                Requirement(q, "<=", limit, GUARD if q.outputs else 0.0)
                for name, (q, limit) in ASSUMPTIONS.items()
                if not (name == "gravity" and actuator.mounting.orientation == "weightless")
                and not (name == "relative_deflection" and actuator.coupling is None)
            ]
            continue
        found.append(parse_requirement(text, varied))
    for name in {r.quantity.name for r in found}:
        sides = [side for r in found if r.quantity.name == name for side in r.sides()]
        low = max((s.limit for s in sides if s.relation == ">="), default=-np.inf)
        high = min((s.limit for s in sides if s.relation == "<="), default=np.inf)
        if low > high:
            unit = sides[0].quantity.unit
            raise InputError(
                f"{name} is to be at least {format_quantity(low, unit, 6)} and at most "
                f"{format_quantity(high, unit, 6)}; no number is both"
            )
    return tuple(found)
