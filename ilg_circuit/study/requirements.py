"""Requirements on a design, such as ``displacement_final>=4mm``, and their margins.

A requirement limits a quantity: an output of the design's run, a varied parameter or a validity number.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument, unknown_name
from ..strip.actuator import Actuator
from ..strip.elements import gravity_ratio
from ..strip.validity import ELECTROCHEMICAL_WINDOW, LARGEST_DEFLECTION, LARGEST_SLENDERNESS, largest_voltage
from ..units import format_quantity, parse
from .evaluate import Evaluation
from .outputs import OUTPUTS, Output
from .parameters import PARAMETERS, Scenario, varied_parameter

#: Units of outputs that are maximised by default (displacement, force); all others are minimised.
_WANTED_MORE = ("m", "N")


@dataclass(frozen=True, eq=False)
class Designs:
    """n designs: ``scenarios`` (a text says why one is impossible), varied values (n,), outputs of their runs."""

    scenarios: Sequence[Scenario | str]
    columns: dict[str, Array]
    evaluation: Evaluation


@dataclass(frozen=True)
class Quantity:
    """A number that a design has; ``outputs`` of its run that it needs, none where it takes no simulation."""

    name: str
    unit: str
    meaning: str
    compute: Callable[[Designs], Array]
    outputs: tuple[str, ...] = ()

    @property
    def more_is_better(self) -> bool:
        """True if an objective without a direction maximises it."""
        return bool(self.outputs) and self.unit in _WANTED_MORE


def _of_scenario(name: str, meaning: str, compute: Callable[[Scenario], float]) -> Quantity:
    return Quantity(name, "", meaning, partial(_each, compute))


def _of_output(output: Output) -> Quantity:
    return Quantity(output.name, output.unit, output.meaning, partial(_output, output.name), (output.name,))


def _each(compute: Callable[[Scenario], float], designs: Designs) -> Array:
    return np.array([np.nan if isinstance(c, str) else compute(c) for c in designs.scenarios])


def _output(name: str, designs: Designs) -> Array:
    return designs.evaluation.output(name)


def _column(name: str, designs: Designs) -> Array:
    return designs.columns[name]


def _window(scenario: Scenario) -> float:
    return largest_voltage(scenario.actuator, scenario.drive) / ELECTROCHEMICAL_WINDOW


def _slenderness(scenario: Scenario) -> float:
    return scenario.actuator.geometry.thickness / scenario.actuator.geometry.free_length


_ASSUMED = (
    (_of_output(OUTPUTS["relative_deflection"]), LARGEST_DEFLECTION),
    (_of_scenario("slenderness", "thickness over free length", _slenderness), LARGEST_SLENDERNESS),
    (
        _of_scenario(
            "window",
            f"largest voltage over the electrochemical window of {ELECTROCHEMICAL_WINDOW:g} V",
            _window,
        ),
        1.0,
    ),
    (
        _of_scenario("gravity", "rho_m w b g L0^3/(8 EI), sag over L0 if lying", lambda c: gravity_ratio(c.actuator)),
        1.0,
    ),
)
#: Assumptions of the model as in `ilg_circuit.strip.validity`: name -> quantity and its limit.
ASSUMPTIONS = {quantity.name: (quantity, limit) for quantity, limit in _ASSUMED}


def quantity(name: str, varied: Sequence[str]) -> Quantity:
    """Return the quantity of that name; ``varied`` names the parameters of the search. Raises InputError."""
    if name in OUTPUTS:
        return _of_output(OUTPUTS[name])
    if name in ASSUMPTIONS:
        return ASSUMPTIONS[name][0]
    if name in varied:
        item = varied_parameter(name)
        return Quantity(name, item.unit, item.meaning, partial(_column, name))
    if name in PARAMETERS:
        raise InputError(
            f"{name} is not varied, so it keeps its value; add {argument('vary', f'{name}=from:to')}, or name another"
        )
    raise unknown_name("quantity", name, (*OUTPUTS, *ASSUMPTIONS, *varied))


def nothing_asked() -> str:
    """Return the message for a design without requirement and objective."""
    example = argument("require", "displacement_final>=4mm")
    return f"nothing is asked of the design; give {example}, {argument('minimise')} or {argument('maximise')}"


#: Relative tolerance of an ``=``.
EQUALITY_TOLERANCE = 1e-3
#: Margin kept by the search, so that the design still meets its requirements when ngspice simulates it again.
#: Quantities that take no simulation need none.
GUARD = 1e-4

#: Fraction of a limit below which the score continues as a straight line instead of a logarithm.
_STRAIGHT = 0.1

_FORM = re.compile(r"\s*([A-Za-z_]\w*)\s*(>=|<=|==|=)\s*(\S.*?)\s*")
REQUIREMENT_FORMS = "displacement_final>=4mm, settling_time<=60s or displacement_final=4mm"


@dataclass(frozen=True)
class Requirement:
    """``quantity`` related to ``limit`` [SI] by ``>=``, ``<=`` or ``=``.

    ``reserve`` is a score, see `score`: the safety margin for parameter uncertainty.
    """

    quantity: Quantity
    relation: str
    limit: float
    reserve: float = 0.0

    def __post_init__(self) -> None:
        if self.relation == "=" and self.limit == 0:
            raise InputError(f"{self.quantity.name}=0 has no scale to come near to; give >= and <= instead")

    @property
    def maximised(self) -> bool:
        """True if a larger margin is better (outputs of a run); False for equality and for validity limits."""
        return self.relation != "=" and bool(self.quantity.outputs) and self.quantity.name not in ASSUMPTIONS

    @property
    def text(self) -> str:
        """The requirement as text, such as ``displacement_final >= 4 mm``."""
        return f"{self.quantity.name} {self.relation} {format_quantity(self.limit, self.quantity.unit, 6)}"

    def score(self, values: Array) -> Array:
        """Return the logarithm of the factor by which ``values`` (n,) meet it: log 1.1 for 4.4 mm of at least 4 mm.

        For values near zero or of the other sign the logarithm is continued by a straight line. For a limit of zero
        the score is the value itself [SI]. For an ``=`` it is at most the score of its tolerance.
        """
        if self.relation == "=":
            low, high = (side.score(values) for side in self.sides())
            return np.minimum(low, high)
        sign = 1.0 if self.relation == ">=" else -1.0
        if self.limit == 0:
            return sign * values
        ratio = values / self.limit
        logarithm = np.log(np.maximum(ratio, _STRAIGHT)) + np.minimum(ratio / _STRAIGHT - 1, 0.0)
        return np.asarray(sign * np.sign(self.limit) * logarithm)

    def slack(self, values: Array) -> Array:
        """Return the scores of ``values`` (n,) less reserve and guard: at least zero where the search accepts them."""
        return self.score(values) - self.reserve - (GUARD if self.quantity.outputs else 0.0)

    def sides(self) -> tuple[Requirement, ...]:
        """Return an ``=`` as two inequalities, any other requirement as itself."""
        if self.relation != "=":
            return (self,)
        low, high = sorted(self.limit * (1 + sign * EQUALITY_TOLERANCE) for sign in (-1, 1))
        return replace(self, relation=">=", limit=low), replace(self, relation="<=", limit=high)

    def relaxed(self, part: float) -> Requirement:
        """Return it with its limit eased by the fraction ``part``; the limit of an ``=`` is increased in size."""
        if self.relation == "=":
            return replace(self, limit=self.limit * (1 + part))
        outwards = -1.0 if self.relation == ">=" else 1.0
        return replace(self, limit=self.limit + outwards * part * abs(self.limit))


def parse_requirement(text: str, varied: Sequence[str]) -> Requirement:
    """Parse a text such as ``displacement_final>=4mm``; ``varied`` as in `quantity`. Raises InputError."""
    match = _FORM.fullmatch(text) if len(text) <= 200 else None
    if match is None:
        raise InputError(f"requirement '{text[:60]}' is not understood; write it like {REQUIREMENT_FORMS}")
    name, relation, limit = match.groups()
    wanted = quantity(name, varied)
    value = parse(limit, wanted.unit, f"requirement '{text.strip()[:60]}'")
    return Requirement(wanted, relation.replace("==", "="), value)


def parse_requirements(texts: Iterable[str], varied: Sequence[str], actuator: Actuator) -> tuple[Requirement, ...]:
    """Parse all ``texts``; the word ``valid`` stands for every assumption of the model.

    Gravity is not among these for a weightless strip, whose coupling includes it. Raises InputError for a text that is
    not understood, and for requirements that contradict one another.
    """
    requirements: list[Requirement] = []
    for text in texts:
        if text.strip() == "valid":
            requirements += [
                Requirement(q, "<=", limit)
                for name, (q, limit) in ASSUMPTIONS.items()
                if not (name == "gravity" and actuator.mounting.orientation == "weightless")
                and not (name == "relative_deflection" and actuator.coupling is None)
            ]
        else:
            requirements.append(parse_requirement(text, varied))
    for name in {r.quantity.name for r in requirements}:
        sides = [side for r in requirements if r.quantity.name == name for side in r.sides()]
        low = max((s.limit for s in sides if s.relation == ">="), default=-np.inf)
        high = min((s.limit for s in sides if s.relation == "<="), default=np.inf)
        if low > high:
            least, most = (format_quantity(x, sides[0].quantity.unit, 6) for x in (low, high))
            raise InputError(f"{name} is to be at least {least} and at most {most}; no number is both")
    return tuple(requirements)
