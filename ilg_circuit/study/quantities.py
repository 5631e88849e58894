"""What a design can be asked for: outputs of its run, the parameters that are varied, and where the model holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..strip.elements import lumped_elements
from ..strip.validity import ELECTROCHEMICAL_WINDOW, LARGEST_DEFLECTION, LARGEST_SLENDERNESS, gravity
from .evaluate import Evaluation
from .outputs import OUTPUTS, Output
from .parameters import PARAMETERS, Case

Array = NDArray[np.float64]

#: Units of what one wants much of; of times, currents, energies, charges, voltages and sizes one wants little.
_WANTED_MORE = ("m", "N")


@dataclass(frozen=True, eq=False)
class Designs:
    """n designs: their ``cases``, or why one cannot be; values (n,) of what is varied; outputs of their runs."""

    cases: Sequence[Case | str]
    columns: dict[str, Array]
    evaluation: Evaluation


@dataclass(frozen=True)
class Quantity:
    """A number that a design has. ``outputs`` are those of its run that it takes; none: it is exact as it stands."""

    name: str
    unit: str
    meaning: str
    compute: Callable[[Designs], Array]
    outputs: tuple[str, ...] = ()

    @property
    def more_is_better(self) -> bool:
        """What people want of it, where they do not say."""
        return bool(self.outputs) and self.unit in _WANTED_MORE


def _of_case(compute: Callable[[Case], float]) -> Callable[[Designs], Array]:
    return lambda designs: np.array([np.nan if isinstance(c, str) else compute(c) for c in designs.cases])


def _of_output(output: Output) -> Quantity:
    name = output.name
    return Quantity(name, output.unit, output.meaning, lambda designs: designs.evaluation.output(name), (name,))


def _gravity(case: Case) -> float:
    return gravity(case.actuator, lumped_elements(case.actuator).stiffness).number


#: Where the model holds, as `ilg_circuit.strip.validity` judges it: quantity and the limit of each assumption.
ASSUMPTIONS = {
    "relative_deflection": (_of_output(OUTPUTS["relative_deflection"]), LARGEST_DEFLECTION),
    "slenderness": (
        Quantity(
            "slenderness",
            "",
            "thickness over free length",
            _of_case(lambda c: c.actuator.geometry.thickness / c.actuator.geometry.free_length),
        ),
        LARGEST_SLENDERNESS,
    ),
    "window": (
        Quantity(
            "window",
            "",
            f"largest voltage over the electrochemical window of {ELECTROCHEMICAL_WINDOW:g} V",
            _of_case(lambda c: c.drive.largest() / ELECTROCHEMICAL_WINDOW),
        ),
        1.0,
    ),
    "gravity": (
        Quantity("gravity", "", "sag over L0 if horizontal, else gravity's stiffness over K", _of_case(_gravity)),
        1.0,
    ),
}


def quantity(name: str, varied: Sequence[str]) -> Quantity:
    """The quantity of that name, ``varied`` being the parameters that a design may choose. Raises InputError."""
    if name in OUTPUTS:
        return _of_output(OUTPUTS[name])
    if name in ASSUMPTIONS:
        return ASSUMPTIONS[name][0]
    if name in varied:
        item = PARAMETERS[name]
        return Quantity(name, item.unit, item.meaning, lambda d: d.columns[name])
    if name in PARAMETERS:
        raise InputError(f"{name} is not varied, so it stays what it is; add --vary {name}=from:to, or ask another")
    from difflib import get_close_matches

    choices = (*OUTPUTS, *ASSUMPTIONS, *varied)
    near = get_close_matches(name, choices, n=4)
    raise InputError(
        f"unknown quantity '{name[:40]}'; {'perhaps ' + ', '.join(near) if near else 'known are ' + ', '.join(choices)}"
    )
