"""An ion path whose element is given by a function: the impedance of a user's own model.

Zp = Rs + Z(s; constants). In other units of impedance the resistances among the constants are multiplied and the
capacitances divided by one factor, and Z with them: so starting values get the size of the data, and the constants of
a strip those of its size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, ComplexArray
from ...errors import InputError, first_line
from ...fit.parameter import Parameter
from .ladder_path import LadderPath
from .model import Pair
from .starts import amounts, scattered

#: Units of constants, and of their keys in [material].
UNITS = {"ohm": "ohm m", "F": "F/m", "s": "s", "Hz": "Hz", "": ""}
#: Decades about the typical values within which starting values lie.
_DECADES = 1.5
#: Two very small s [rad/s], and the least growth of the impedance between them for an element that stores charge.
_STILL, _GROWS = (1e-9j, 1e-10j), 2.0


@dataclass(frozen=True, repr=False)
class GivenPath(LadderPath):
    """A series resistance and an element of impedance ``function`` (s, *constants); ``typical`` are values (k,)."""

    word: str
    function: Callable[..., Any]
    own: tuple[Parameter, ...]
    typical: tuple[float, ...]
    text: str = ""
    auto: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return name, equation and typical values in a line."""
        values = (f"{p.name} {x:g} {p.unit}".rstrip() for p, x in zip(self.own, self.typical, strict=True))
        return f"<model {self.name}: {self.text}; typically {', '.join(values)}>"

    @property
    def name(self) -> str:
        return self.word

    @property
    def equation(self) -> str:
        return self.text

    @property
    def constants(self) -> tuple[Parameter, ...]:
        return self.own

    def __post_init__(self) -> None:
        s = 2j * np.pi * np.geomspace(1e-3, 1e3, 7)
        try:
            found = np.asarray(self.function(s, *self.typical), dtype=complex)
        except Exception as error:  # a user's function may raise anything
            raise InputError(
                f"model '{self.name}': its impedance fails at typical values: {first_line(error)}"
            ) from error
        if found.shape != s.shape or not np.isfinite(found).all() or (found.real < 0).any():
            raise InputError(
                f"model '{self.name}': its impedance must return one finite number for every s, with a real part of "
                "zero or more"
            )
        self._charged()

    @property
    def title(self) -> str:  # type: ignore[override]
        return f"element of model {self.name}"

    @property
    def material(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        return tuple(
            Parameter(_key(p), p.symbol, UNITS[p.unit], p.meaning) for p in self.constants if p.name != self._charged()
        )

    @property
    def stores(self) -> bool:  # type: ignore[override]
        """True if its impedance grows without limit as the frequency falls."""
        with np.errstate(all="ignore"):
            low, higher = np.abs(self.element(np.array([self.typical]), np.array(_STILL))[0])
        return not higher < _GROWS * low

    def element(self, values: Array, s: ComplexArray) -> ComplexArray:
        found: ComplexArray = np.broadcast_to(self.function(s, *values.T[:, :, None]), (len(values), len(s)))
        return found.astype(complex)

    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        series, *constants = values
        given = {p.name: value for p, value in zip(self.constants, constants, strict=True)}
        charged = self._charged()
        own = given[charged] if self._unit(charged) == "F" else given[self._first("s")] / given[charged]
        kept = {_key(p): given[p.name] for p in self.constants if p.name != charged}
        return {"dynamic_resistivity": series, "permittivity": own, **kept}

    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        charged, permittivity = self._charged(), constants["permittivity"]
        own = permittivity if self._unit(charged) == "F" else constants[self._first("s")] / permittivity
        found = (own if p.name == charged else constants[_key(p)] for p in self.constants)
        return constants["dynamic_resistivity"], *found

    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        return [0.5 / sum(1 / r for r, _ in pairs), *self.typical]

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        s: ComplexArray = 1j * omega.astype(complex)
        limits = np.array([p.upper for p in self.constants])

        def start(ions: ComplexArray, _: float) -> list[float]:
            spread = 10 ** random.uniform(-_DECADES, _DECADES, len(limits))
            trial = np.minimum(self.typical * spread, 0.99 * limits)
            series, size = amounts(np.column_stack([np.ones_like(s), self.element(trial[None], s)[0]]), ions)
            power = [{"ohm": 1, "F": -1}.get(p.unit, 0) for p in self.constants]
            return [series, *(trial * size ** np.array(power, dtype=float)).tolist()]

        return scattered(z, random, start)

    def _charged(self) -> str:
        """Return the constant from which a strip's permittivity is computed: in F, or in ohm beside a time constant."""
        name = self._first("F") or (self._first("s") and self._first("ohm"))
        if not name:
            raise InputError(f"model '{self.name}' needs a constant in F, or one in ohm and one in s: it stores charge")
        return name

    def _first(self, unit: str) -> str:
        return next((p.name for p in self.constants if p.unit == unit), "")

    def _unit(self, name: str) -> str:
        return next(p.unit for p in self.constants if p.name == name)


def _key(parameter: Parameter) -> str:
    """Return the key of a constant in [material]."""
    return parameter.name.replace("resistance", "resistivity") if parameter.unit == "ohm" else parameter.name
