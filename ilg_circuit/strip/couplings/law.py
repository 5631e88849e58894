"""What every law of bending gives: the response of the free displacement to the voltage or the charge of the ions.

    y1 = k D(s) x,   k = 3 L_F^2/b^2,   x = v_p, or q/C_ref with C_ref the capacitance of the ion path near 0 V

The curvature of the free strip is kappa = (6/b^2) D(s) x, uniform along it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from typing import ClassVar, Self

from ...errors import InputError

BEAMS = ("dynamic", "static")


@dataclass(frozen=True)
class Relaxation:
    """One first-order relaxation, gain [m/V] over 1 + s time [s], with both as expressions of a library."""

    gain: float
    time: float
    gain_text: str
    time_text: str


@dataclass(frozen=True)
class CouplingLaw(ABC):
    """The law by which a strip bends. ``kind`` is its name in files, ``follows_charge`` says what x is.

    ``beam`` is the one that the law was fitted with, where a fit says so: ``static`` if the tip's whole motion is in
    it, the beam's inertia included, which a ``dynamic`` beam would count again.
    """

    kind: ClassVar[str]
    section: ClassVar[str] = "coupling"
    follows_charge: ClassVar[bool] = False

    @property
    @abstractmethod
    def beam(self) -> str | None:
        """Return the beam that the law was fitted with; None where nothing says so."""

    @property
    @abstractmethod
    def static(self) -> float:
        """Return D(0) [m/V]."""

    @property
    @abstractmethod
    def time(self) -> float:
        """Return the time constant [s] of its slower part; 0 where it has none."""

    @property
    def rate(self) -> float:
        """Return the angular frequency [rad/s] at which its slower part follows no more; 0 where it has none."""
        return 1 / self.time if self.time else 0.0

    @abstractmethod
    def response(self, s: complex) -> complex:
        """Return D(s) [m/V] for a small signal near 0 V at ``s`` [rad/s]."""

    @property
    def linear(self) -> bool:
        """Return whether the displacement is linear in x."""
        return True

    def bent(self, x: float) -> float:
        """Return x [V] as it bends: with its odd and even parts, where the law has any."""
        return x

    def scaled(self, factor: float) -> Self:
        """Return the law of a strip that bends ``factor`` times as much."""
        gains = {f.name: getattr(self, f.name) for f in fields(self) if f.metadata.get("unit", "").startswith("m/")}
        return replace(self, **{name: factor * value for name, value in gains.items() if value is not None})

    def require_beam(self) -> None:
        """Raise InputError for a beam that there is not."""
        if self.beam not in (None, *BEAMS):
            raise InputError(f"coupling.beam is {self.beam!r}; choose one of {', '.join(BEAMS)}, or leave it out")
