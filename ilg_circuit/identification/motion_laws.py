"""The laws of bending that a displacement can be fitted by: d(s), or relaxations of charge or voltage.

Gains have either sign, and fits are of positive parameters: the signs belong to the law, as the search for starting
values found them, and their sizes are fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from ..arrays import Array
from ..fit.parameter import Parameter
from ..strip.actuator import Coupling, CouplingLaw
from ..strip.couplings import ChargeCoupling, RelaxingCoupling, VoltageRelaxations


@dataclass(frozen=True)
class MotionLaw:
    """A law by its ``name``: d(s), or ``relaxations`` of charge or of voltage, by the ``kind`` of coupling.

    ``signs`` are those of its gains. What follows charge has an instantaneous part, too, the first of its gains;
    ``fractional`` adds one fractional relaxation, the last of them.
    """

    name: str
    kind: type[RelaxingCoupling] | None = None
    relaxations: int = 0
    fractional: bool = False
    signs: tuple[float, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters, in the order in which `coupling` takes their values."""
        if self.kind is None:
            return tuple(
                Parameter(f"coupling_{f.name}", unit=f.metadata["unit"])
                for f in fields(Coupling)
                if "unit" in f.metadata
            )
        found = [Parameter("coupling_instantaneous", unit="m/V")] if self.follows_charge else []
        for k in range(1, self.relaxations + 1):
            found += [Parameter(f"coupling_gain_{k}", unit="m/V"), Parameter(f"coupling_time_{k}", unit="s")]
        if self.fractional:
            found += [
                Parameter("coupling_fractional_gain", unit="m/V"),
                Parameter("coupling_fractional_time", unit="s"),
                Parameter("coupling_fractional_exponent", upper=1.0),
            ]
        return tuple(found)

    @property
    def follows_charge(self) -> bool:
        """Return whether the law needs the charge, and so the circuit."""
        return self.kind is not None and self.kind.follows_charge

    @property
    def text(self) -> str:
        """The law in words."""
        if self.kind is None:
            return "d(s) of the voltage, EC (31)"
        some = f"{self.relaxations} relaxation{'s' * (self.relaxations > 1)}"
        if self.fractional:
            some = f"a fractional relaxation and {some}"
        return f"the charge and {some} of it" if self.follows_charge else f"{some} of the voltage"

    @property
    def gains(self) -> tuple[int, ...]:
        """The places of the gains among the parameters; of d(s), of its one gain."""
        return tuple(k for k, p in enumerate(self.parameters) if p.unit in ("m/V", "m/(V s)"))

    @property
    def negative(self) -> frozenset[str]:
        """The names of gains that are below zero, of which fits have the sizes."""
        names = [self.parameters[k].name for k in self.gains]
        return frozenset(name for name, sign in zip(names, self.signs, strict=False) if sign < 0)

    def coupling(self, values: Array, beam: str | None = None) -> CouplingLaw:
        """Return the coupling of ``values`` (n,), sizes of gains."""
        if self.kind is None:
            return Coupling(*values.tolist(), beam=beam)
        given = {p.name.removeprefix("coupling_"): v for p, v in zip(self.parameters, values.tolist(), strict=True)}
        for name in self.negative:
            given[name.removeprefix("coupling_")] *= -1
        return self.kind(**given, beam=beam)


EC31 = MotionLaw("ec31")
#: Laws by name, the simplest of each kind first.
LAWS = {
    law.name: law
    for law in (
        EC31,
        MotionLaw("charge1", ChargeCoupling, 1),
        MotionLaw("charge2", ChargeCoupling, 2),
        MotionLaw("voltage1", VoltageRelaxations, 1),
        MotionLaw("voltage2", VoltageRelaxations, 2),
        MotionLaw("voltage3", VoltageRelaxations, 3),
        MotionLaw("fractional", VoltageRelaxations, 1, fractional=True),
    )
}
