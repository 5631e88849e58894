"""The laws of bending that a displacement can be fitted by: d(s), or relaxations of charge or voltage.

Gains have either sign, and fits are of positive parameters: the signs belong to the law, as the search for starting
values found them, and their sizes are fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import combinations

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..fit.parameter import Parameter
from ..strip.actuator import Actuator, Coupling, CouplingLaw
from ..strip.couplings import ChargeCoupling, RelaxingCoupling, VoltageRelaxations
from .modal import modal_displacements
from .start import CouplingSearch, thinned

#: Time constants of the search, from so many sampling intervals to so many times the record.
_GRID, _SHORTEST, _LONGEST = 15, 2.0, 4.0
#: Ratio of two time constants of one law, at least.
_APART = 1.8


@dataclass(frozen=True)
class MotionLaw:
    """A law by its ``name``: d(s), or ``relaxations`` of charge or of voltage, by the ``kind`` of coupling.

    ``signs`` are those of its gains. What follows charge has an instantaneous part, too, the first of its gains.
    """

    name: str
    kind: type[RelaxingCoupling] | None = None
    relaxations: int = 0
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
        every = ((f"coupling_gain_{k}", f"coupling_time_{k}") for k in range(1, self.relaxations + 1))
        relaxing = [p for gain, time in every for p in (Parameter(gain, unit="m/V"), Parameter(time, unit="s"))]
        direct = [Parameter("coupling_instantaneous", unit="m/V")] if self.follows_charge else []
        return tuple(direct + relaxing)

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
        return f"the charge and {some} of it" if self.follows_charge else f"{some} of the voltage"

    @property
    def negative(self) -> frozenset[str]:
        """The names of gains that are below zero, of which fits have the sizes."""
        gains = [p.name for p in self.parameters if p.unit == "m/V"]
        return frozenset(name for name, sign in zip(gains, self.signs, strict=False) if sign < 0)

    def coupling(self, values: Array, beam: str | None = None) -> CouplingLaw:
        """Return the coupling of ``values`` (n,), sizes of gains."""
        if self.kind is None:
            return Coupling(*values.tolist(), beam=beam)
        first = len(values) - 2 * self.relaxations
        signs = self.signs or (1.0,) * (first + self.relaxations)
        given: dict[str, float] = {"instantaneous": signs[0] * float(values[0])} if first else {}
        for k, (gain, time) in enumerate(values[first:].reshape(-1, 2).tolist(), 1):
            given |= {f"gain_{k}": signs[first + k - 1] * gain, f"time_{k}": time}
        return self.kind(**given, beam=beam)


EC31 = MotionLaw("ec31")
#: Laws by name, the simplest first.
LAWS = {
    law.name: law
    for law in (
        EC31,
        MotionLaw("charge1", ChargeCoupling, 1),
        MotionLaw("charge2", ChargeCoupling, 2),
        MotionLaw("voltage2", VoltageRelaxations, 2),
        MotionLaw("voltage3", VoltageRelaxations, 3),
    )
}


class RelaxationSearch:
    """Starting values of a law that relaxes, by linear fits on a grid of time constants; see `CouplingSearch`."""

    def __init__(self, t: Array, drive: PiecewiseLinear, actuator: Actuator, law: MotionLaw) -> None:
        assert law.kind is not None
        self.law = law
        self._keep = thinned(t)
        self._t = t[self._keep]
        after = self._t >= 0
        later = self._t[after]
        shortest = max(_SHORTEST * float(np.median(np.diff(later))), 1e-4 * float(later[-1]))
        self._times = np.geomspace(shortest, _LONGEST * float(later[-1]), _GRID)
        strips = [replace(actuator, coupling=law.kind(gain_1=1.0, time_1=float(time))) for time in self._times]
        self._waves = np.zeros((_GRID, len(self._t)))
        netlists = [strip_netlist(strip, beam="static") for strip in strips]
        self._waves[:, after] = modal_displacements(netlists, drive, later)
        self._first = int(law.follows_charge)
        if self._first:  # the instantaneous part, before all others
            direct = np.zeros((1, len(self._t)))
            strip = replace(actuator, coupling=law.kind(instantaneous=1.0))
            direct[:, after] = modal_displacements([strip_netlist(strip, beam="static")], drive, later)
            self._waves = np.concatenate([direct, self._waves])

    def signed(self, end: float, displacement: Array, nuisance: Array) -> MotionLaw:
        """Return the law with the signs of the best linear fit up to ``end`` [s]."""
        _, amounts, sign = self._fits(end, displacement, nuisance)[0]
        return replace(self.law, signs=tuple(np.sign(sign * amounts).tolist()))

    def start(self, end: float, displacement: Array, nuisance: Array) -> tuple[Array, float]:
        """Return values and the sign of the axis, as `CouplingSearch.start`."""
        return self.starts(end, displacement, nuisance, 1)[0]

    def starts(self, end: float, displacement: Array, nuisance: Array, count: int) -> list[tuple[Array, float]]:
        """Return the best ``count`` starts of the law's signs. Raises InputError where there is none."""
        found = [
            (self._values(np.abs(amounts), chosen), sign)
            for chosen, amounts, sign in self._fits(end, displacement, nuisance)
            if not self.law.signs or tuple(np.sign(sign * amounts).tolist()) == self.law.signs
        ]
        if not found:
            raise InputError("the displacement does not follow the voltage as the coupling's signs say")
        return found[:count]

    def _values(self, sizes: Array, chosen: tuple[int, ...]) -> Array:
        """Return the parameters of the law, from the sizes of its gains and the places of its time constants."""
        times = self._times[[k - self._first for k in chosen[self._first :]]]
        return np.append(sizes[: self._first], np.column_stack([sizes[self._first :], times]).ravel())

    def _fits(self, end: float, displacement: Array, nuisance: Array) -> list[tuple[tuple[int, ...], Array, float]]:
        """Return chosen time constants, gains (k,) [m/V] and the axis' sign, the best fit first."""
        part = self._t <= end
        data, extra, waves = displacement[self._keep][part], nuisance[self._keep][part], self._waves[:, part]
        # the rest and the drift are fitted along: what is left of all when they are taken out
        basis, _ = np.linalg.qr(extra)
        data = data - basis @ (basis.T @ data)
        left = waves - (waves @ basis) @ basis.T
        gram, moment = left @ left.T, left @ data
        found = []
        for relaxing in combinations(range(self._first, len(left)), self.law.relaxations):
            chosen = (*range(self._first), *relaxing)
            apart = np.diff(np.log(self._times[[k - self._first for k in relaxing]]))
            if len(apart) and apart.min() < np.log(_APART):
                continue
            at = np.ix_(chosen, chosen)
            amounts, *_ = np.linalg.lstsq(gram[at], moment[list(chosen)], rcond=1e-12)
            explained = float(amounts @ moment[list(chosen)])
            curve = amounts @ waves[list(chosen)]
            sign = float(np.sign(curve[np.argmax(np.abs(curve))])) or 1.0
            if np.isfinite(amounts).all() and (amounts != 0).all():
                found.append((-explained, chosen, amounts, sign))
        if not found:
            raise InputError("the displacement does not follow the voltage")
        return [each[1:] for each in sorted(found, key=lambda each: each[0])]


def search_of(
    law: MotionLaw, t: Array, drive: PiecewiseLinear, actuator: Actuator, ratio: float
) -> CouplingSearch | RelaxationSearch:
    """Return the search for starting values of a ``law`` at ``t`` [s]; ``ratio`` is 3 L_F^2/b^2."""
    return CouplingSearch(t, drive, ratio) if law.kind is None else RelaxationSearch(t, drive, actuator, law)
