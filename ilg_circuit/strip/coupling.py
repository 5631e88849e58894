"""The electromechanical coupling d(s) of a strip, EC (31)."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..errors import InputError
from .fields import quantity, validate_quantities

BEAMS = ("dynamic", "static")


@dataclass(frozen=True)
class Coupling:
    """Electromechanical coupling d(s) = Kd (s + Zd)/(s^2 + 2 zeta' wn' s + wn'^2) [m/V], EC (31).

    ``beam`` is the one that d(s) was fitted with, where a fit says so: ``static`` if the tip's whole motion is in d(s),
    the beam's inertia included, which a ``dynamic`` beam would count again.
    """

    gain: float = quantity("m/(V s)", "Kd")
    zero: float = quantity("1/s", "Zd")
    damping_ratio: float = quantity("", "zeta'")
    natural_frequency: float = quantity("rad/s", "wn'")
    beam: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        validate_quantities(self)
        if self.beam not in (None, *BEAMS):
            raise InputError(f"coupling.beam is {self.beam!r}; choose one of {', '.join(BEAMS)}, or leave it out")

    @property
    def static(self) -> float:
        """d0 = d(0) = Kd Zd/wn'^2 [m/V]."""
        return self.gain * self.zero / self.natural_frequency**2
