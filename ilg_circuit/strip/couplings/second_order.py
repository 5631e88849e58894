"""The electromechanical coupling d(s) of a strip, EC (31)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from ..fields import quantity, validate_quantities
from .law import CouplingLaw


@dataclass(frozen=True)
class Coupling(CouplingLaw):
    """Electromechanical coupling d(s) = Kd (s + Zd)/(s^2 + 2 zeta' wn' s + wn'^2) [m/V], EC (31).

    ``beam`` is the one that d(s) was fitted with, where a fit says so: ``static`` if the tip's whole motion is in d(s),
    the beam's inertia included, which a ``dynamic`` beam would count again.
    """

    kind: ClassVar[str] = "voltage"

    gain: float = quantity("m/(V s)", "Kd")
    zero: float = quantity("1/s", "Zd")
    damping_ratio: float = quantity("", "zeta'")
    natural_frequency: float = quantity("rad/s", "wn'")
    beam: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        validate_quantities(self)
        self.require_beam()

    @property
    def static(self) -> float:
        """d0 = d(0) = Kd Zd/wn'^2 [m/V]."""
        return self.gain * self.zero / self.natural_frequency**2

    @property
    def time(self) -> float:
        return max(2 * self.damping_ratio, 1.0) / self.natural_frequency

    @property
    def rate(self) -> float:
        return self.natural_frequency

    def response(self, s: complex) -> complex:
        """Return d(s) [m/V]."""
        square = s**2 + 2 * self.damping_ratio * self.natural_frequency * s + self.natural_frequency**2
        return self.gain * (s + self.zero) / square
