"""Quantities that a design can be required to have: outputs of its run, varied parameters, validity numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..strip.elements import lumped_elements
from ..strip.validity import ELECTROCHEMICAL_WINDOW, LARGEST_DEFLECTION, LARGEST_SLENDERNESS, gravity
from .evaluate import Evaluation
from .outputs import OUTPUTS, Output
from .parameters import PARAMETERS, Scenario, unknown_name

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
        """Direction of an objective for which none is given."""
        return bool(self.outputs) and self.unit in _WANTED_MORE


def _of_scenario(compute: Callable[[Scenario], float]) -> Callable[[Designs], Array]:
    return lambda designs: np.array([np.nan if isinstance(c, str) else compute(c) for c in designs.scenarios])


def _of_output(output: Output) -> Quantity:
    name = output.name
    return Quantity(name, output.unit, output.meaning, lambda designs: designs.evaluation.output(name), (name,))


def _gravity(scenario: Scenario) -> float:
    return gravity(scenario.actuator, lumped_elements(scenario.actuator).stiffness).number


_ASSUMED: tuple[tuple[str, str, Callable[[Scenario], float], float], ...] = (
    (
        "slenderness",
        "thickness over free length",
        lambda c: c.actuator.geometry.thickness / c.actuator.geometry.free_length,
        LARGEST_SLENDERNESS,
    ),
    (
        "window",
        f"largest voltage over the electrochemical window of {ELECTROCHEMICAL_WINDOW:g} V",
        lambda c: c.drive.largest() / ELECTROCHEMICAL_WINDOW,
        1.0,
    ),
    ("gravity", "sag over L0 if horizontal, else gravity's stiffness over K", _gravity, 1.0),
)
#: Assumptions of the model as in `ilg_circuit.strip.validity`: name -> quantity and its limit.
ASSUMPTIONS = {"relative_deflection": (_of_output(OUTPUTS["relative_deflection"]), LARGEST_DEFLECTION)} | {
    name: (Quantity(name, "", meaning, _of_scenario(compute)), limit) for name, meaning, compute, limit in _ASSUMED
}


def quantity(name: str, varied: Sequence[str]) -> Quantity:
    """Return the quantity of that name; ``varied`` names the parameters of the search. Raises InputError."""
    if name in OUTPUTS:
        return _of_output(OUTPUTS[name])
    if name in ASSUMPTIONS:
        return ASSUMPTIONS[name][0]
    if name in varied:
        item = PARAMETERS[name]
        return Quantity(name, item.unit, item.meaning, lambda d: d.columns[name])
    if name in PARAMETERS:
        raise InputError(f"{name} is not varied, so it stays what it is; add --vary {name}=from:to, or ask another")
    raise unknown_name("quantity", name, (*OUTPUTS, *ASSUMPTIONS, *varied))
