"""A constant phase element behind a series resistance.

Zp = Rs + 1/(Q s^a)
1/(Q s^a) = sin(pi a)/(pi Q) integral of lambda^-a/(s + lambda) dlambda,   0 < a < 1
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, ComplexArray
from ...errors import InputError
from ...fit.parameter import Parameter
from ..ladder import LADDER_ERROR, Ladder, Ladders, enough, require_ladders
from ..port import Port
from .ladder_path import SCALED, LadderPath
from .model import LibraryText, Pair, Shown
from .starts import amounts, scattered

#: Bounds of an exponent: diffusion's 1/2 and a capacitor's 1.
_EXPONENT = 0.8


@dataclass(frozen=True)
class ConstantPhase(LadderPath):
    """A series resistance and a constant phase element; its permittivity in a file gives Q, at 1 rad/s."""

    name = "cpe"
    title = "constant phase element"
    name_in_tables = "CPE"
    equation = "Z = Re + Rdc || (Rs + 1/(Q s^a))"
    constants = (
        Parameter("cpe_coefficient", "Q", "F s^(a-1)", "constant phase element"),
        Parameter("cpe_exponent", "a", "", "constant phase element: 1 a capacitor, 1/2 diffusion", upper=1.0),
    )
    material = constants[1:]
    auto = ("spectrum",)
    library_parameters = ("dynamic_resistivity", "permittivity")
    library_note = "its exponent is fixed"

    def element(self, values: Array, s: ComplexArray) -> ComplexArray:
        return cpe_impedance(s, values[:, :1], values[:, 1:])

    def ladder(self, constants: Sequence[float], ladders: Ladders) -> Ladder:
        """Return the ladder. Raises InputError for an exponent outside (0, 1) too."""
        coefficient, exponent = constants
        require_ladders(ladders)
        if not 0 < exponent < 1:
            raise InputError(f"CPE exponent {exponent:g} must lie between 0 and 1")
        return enough(lambda n: _ladder(coefficient, exponent, ladders.band, n), ladders.sections, 4)

    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        return dict(zip(("dynamic_resistivity", "permittivity", "cpe_exponent"), values, strict=True))

    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        return constants["dynamic_resistivity"], constants["permittivity"], constants["cpe_exponent"]

    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        """Return starts with the capacitance of the branches at the frequency of the slowest one."""
        slowest = max(r * c for r, c in pairs)
        coefficient = sum(c for _, c in pairs) * slowest ** (_EXPONENT - 1)
        return [0.8 / sum(1 / r for r, _ in pairs), coefficient, _EXPONENT]

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        s = 1j * omega

        def start(ions: ComplexArray, place: float) -> list[float]:
            exponent = 0.3 + 0.68 * place
            series, amount = amounts(np.column_stack([np.ones_like(s), cpe_impedance(s, 1.0, exponent)]), ions)
            return [series, 1 / amount, exponent]

        return scattered(z, random, start)

    def shown_element(self, constants: Sequence[float]) -> list[Shown]:
        coefficient, exponent = constants
        return [
            ("cpe_coefficient", coefficient, "F s^(a-1)", "Z = 1/(Q s^a); Q is the capacitance at 1 rad/s"),
            ("cpe_exponent", exponent, "", "a"),
        ]

    def library(self, port: Port, area_over_thickness: float) -> LibraryText:
        """Return the ladder's text. Sections keep their proportions: resistances go with 1/Q, capacitances with Q."""
        ladder = port.ladder
        assert ladder is not None
        q = ladder.constants[0]
        return LibraryText(
            SCALED,
            tuple((f"{r * q!r}/cion1", f"{c / q!r}*cion1") for r, c in ladder.sections),
            f"rion1+{ladder.resistance * q!r}/cion1",
            f"{ladder.capacitance / q!r}*cion1",
        )


CPE = ConstantPhase()


def cpe_impedance(s: ArrayLike, coefficient: float | Array, exponent: float | Array) -> ComplexArray:
    """Return 1/(Q s^a) [ohm]."""
    return np.asarray(1 / (coefficient * np.asarray(s, dtype=complex) ** exponent))


def _ladder(coefficient: float, exponent: float, band: tuple[float, float], sections: int) -> Ladder:
    """Return the ladder by the trapezoidal rule over ln(lambda), which converges exponentially.

    Beyond both ends the sums are closed. The ends reach so far beyond the band that capacitor and resistor are right
    to half the error allowed there.
    """
    below = (LADDER_ERROR / 2) ** (1 / (2 - exponent))
    above = (LADDER_ERROR / 2) ** (-1 / (1 + exponent))
    low, high = 2 * np.pi * band[0] * below, 2 * np.pi * band[1] * above
    step = math.log(high / low) / sections
    rates = low * np.exp(step * (np.arange(sections) + 0.5))
    scale = math.sin(math.pi * exponent) / (math.pi * coefficient) * step
    weights = scale * rates ** (1 - exponent)
    ratio = math.exp(-step * (1 - exponent))
    elastance = weights[0] * ratio / (1 - ratio)
    ratio = math.exp(-step * exponent)
    rest = weights[-1] / rates[-1] * ratio / (1 - ratio)
    pairs = tuple((float(w / x), float(1 / w)) for x, w in zip(rates, weights, strict=True))
    return Ladder(CPE, (coefficient, exponent), float(rest), float(1 / elastance), pairs, band)
