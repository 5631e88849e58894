"""The signal of a strip whose tip is moved, as it was measured: a law of its own, in place of reciprocity.

    e = S(s) eps,   eps = b y/L_F^2,   S(s) = g_0 + sum of g_j/(1 + s tau_j)

``e`` [V] is a source in series with the ions, positive towards plus; ``eps`` is the strain of the face that the
tip's displacement y, towards the anode, makes by bending alone (b the thickness, L_F where it is moved). Gains [V] have
either sign: an instantaneous part and a relaxation against it are a signal that decays while the tip is held.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..errors import InputError
from .couplings import Relaxation
from .fields import quantity, validate_quantities

MOST_RELAXATIONS = 2


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """A measured law of sensing; see this module."""

    section: ClassVar[str] = "sensing"

    instantaneous: float | None = quantity(
        "V", "gain g_0 of the part without delay, per strain", signed=True, default=None
    )
    gain_1: float | None = quantity("V", "gain g_1 of the first relaxation", signed=True, default=None)
    time_1: float | None = quantity("s", "its time constant tau_1", default=None)
    gain_2: float | None = quantity("V", "gain g_2 of the second relaxation", signed=True, default=None)
    time_2: float | None = quantity("s", "its time constant tau_2", default=None)

    def __post_init__(self) -> None:
        validate_quantities(self)
        for k in range(1, MOST_RELAXATIONS + 1):
            pair = f"gain_{k}", f"time_{k}"
            for one, other in (pair, pair[::-1]):
                if getattr(self, one) is not None and getattr(self, other) is None:
                    raise InputError(f"sensing.{one} is given and sensing.{other} is not; give both, or neither")
        if self.instantaneous is None and not self.relaxations:
            raise InputError("[sensing] has no gain: give instantaneous, or gain_1 with time_1")

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The relaxations, in the order of the file."""
        found = []
        for k in range(1, MOST_RELAXATIONS + 1):
            gain, time = getattr(self, f"gain_{k}"), getattr(self, f"time_{k}")
            if gain is not None:
                found.append(Relaxation(gain, time, f"sensing_gain_{k}", f"sensing_time_{k}"))
        return tuple(found)

    def response(self, s: complex) -> complex:
        """Return S(s) [V]."""
        return complex((self.instantaneous or 0.0) + sum(r.gain / (1 + s * r.time) for r in self.relaxations))
