"""Bending through relaxations of the ions' charge or voltage: back-relaxation, creep, a fractional element.

    D(s) = g_0 + sum of g_j/(1 + s tau_j) + g_f/(1 + (s tau_f)^a)      of w = x + odd x abs(x) + even x^2

with x = q/C_ref or v_p in volts. Gains [m/V] have either sign; g = 10 nm/V bends a strip of thickness b by a curvature
of 6 g/b^2 a volt. ``even`` is electrostriction, or the asymmetry of the polarities; ``odd`` saturates or stiffens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from ...errors import InputError
from ..fields import quantity, validate_quantities
from ..ladder import LADDER_BAND
from .fractional import FractionalLadder, fractional_ladder
from .law import CouplingLaw, Relaxation

MOST_RELAXATIONS = 3


@dataclass(frozen=True, kw_only=True)
class RelaxingCoupling(CouplingLaw):
    """Bending by an instantaneous part, up to three relaxations and a fractional one; see this module."""

    instantaneous: float | None = quantity("m/V", "gain g_0 of the part without delay", signed=True, default=None)
    gain_1: float | None = quantity("m/V", "gain g_1 of the first relaxation", signed=True, default=None)
    time_1: float | None = quantity("s", "its time constant tau_1", default=None)
    gain_2: float | None = quantity("m/V", "gain g_2 of the second relaxation", signed=True, default=None)
    time_2: float | None = quantity("s", "its time constant tau_2", default=None)
    gain_3: float | None = quantity("m/V", "gain g_3 of the third relaxation", signed=True, default=None)
    time_3: float | None = quantity("s", "its time constant tau_3", default=None)
    fractional_gain: float | None = quantity("m/V", "gain g_f of the fractional relaxation", signed=True, default=None)
    fractional_time: float | None = quantity("s", "its time constant tau_f", default=None)
    fractional_exponent: float | None = quantity("", "its exponent a, between 0 and 1", default=None)
    odd: float | None = quantity("1/V", "odd part: x becomes x + odd x abs(x)", signed=True, default=None)
    even: float | None = quantity("1/V", "even part: x becomes x + even x^2", signed=True, default=None)
    beam: str | None = field(default=None)

    def __post_init__(self) -> None:
        validate_quantities(self)
        self.require_beam()
        pairs = [(f"gain_{k}", f"time_{k}") for k in range(1, MOST_RELAXATIONS + 1)]
        pairs += [("fractional_gain", "fractional_time"), ("fractional_gain", "fractional_exponent")]
        for given, needed in pairs:
            for one, other in ((given, needed), (needed, given)):
                if getattr(self, one) is not None and getattr(self, other) is None:
                    raise InputError(f"coupling.{one} is given and coupling.{other} is not; give both, or neither")
        if self.instantaneous is None and not self.relaxations and self.fractional_gain is None:
            raise InputError("[coupling] has no gain: give gain_1 with time_1, fractional_gain, or instantaneous")
        if self.fractional_exponent is not None and not self.fractional_exponent < 1:
            raise InputError(
                f"coupling.fractional_exponent is {self.fractional_exponent:g}; it must be less than 1, which would be "
                "a relaxation: give gain_1 and time_1"
            )

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The relaxations of first order, in the order of the file."""
        return tuple(self._first_order())

    def _first_order(self) -> Iterator[Relaxation]:
        for k in range(1, MOST_RELAXATIONS + 1):
            gain, time = getattr(self, f"gain_{k}"), getattr(self, f"time_{k}")
            if gain is not None:
                yield Relaxation(gain, time, f"coupling_gain_{k}", f"coupling_time_{k}")

    def ladder(self, band: tuple[float, float] = LADDER_BAND) -> FractionalLadder | None:
        """Return the ladder of the fractional element over ``band`` [Hz]; None where the law has none."""
        if self.fractional_exponent is None or self.fractional_time is None:
            return None
        return fractional_ladder(self.fractional_exponent, self.fractional_time, band)

    def modes(self, band: tuple[float, float] = LADDER_BAND) -> tuple[Relaxation, ...]:
        """Return all relaxations, those of the fractional element over ``band`` [Hz] among them."""
        ladder, gain, time = self.ladder(band), self.fractional_gain, self.fractional_time
        if ladder is None or gain is None or time is None:
            return self.relaxations
        sections = (
            Relaxation(m * gain, r * time, f"{m!r}*coupling_fractional_gain", f"{r!r}*coupling_fractional_time")
            for m, r in ladder.sections
        )
        return (*self.relaxations, *sections)

    @property
    def static(self) -> float:
        gains = [r.gain for r in self.relaxations]
        return math.fsum([*gains, self.instantaneous or 0.0, self.fractional_gain or 0.0])

    @property
    def time(self) -> float:
        return max([r.time for r in self.relaxations] + [self.fractional_time or 0.0])

    @property
    def linear(self) -> bool:
        return not (self.odd or self.even)

    def bent(self, x: float) -> float:
        return x + (self.odd or 0.0) * x * abs(x) + (self.even or 0.0) * x * x

    def response(self, s: complex) -> complex:
        found = (self.instantaneous or 0.0) + sum(r.gain / (1 + s * r.time) for r in self.relaxations)
        if self.fractional_gain is not None and self.fractional_time and self.fractional_exponent:
            found += self.fractional_gain / (1 + (complex(s) * self.fractional_time) ** self.fractional_exponent)
        return complex(found)


@dataclass(frozen=True, kw_only=True)
class ChargeCoupling(RelaxingCoupling):
    """Bending that follows the charge of the ions, x = q/C_ref, through relaxations.

    Gains in m/V, time constants in s; C_ref is the capacitance of the ion path near 0 V.
    """

    kind: ClassVar[str] = "charge"
    follows_charge: ClassVar[bool] = True


@dataclass(frozen=True, kw_only=True)
class VoltageRelaxations(RelaxingCoupling):
    """Bending that follows the voltage across the ion path, x = v_p, through relaxations.

    Gains in m/V, time constants in s.
    """

    kind: ClassVar[str] = "voltage-relaxations"
