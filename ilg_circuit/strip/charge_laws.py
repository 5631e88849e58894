"""Laws of the charge on a capacitance, which need not be linear in the voltage across it.

    linear       q = C v
    growing      q = C (v + k v abs(v)/2), k of either sign  (Zubieta and Bonert 2000)
    saturating   q = C V0 tanh(v/V0)
    steric       q = sgn(v) q0 sqrt((2/nu) ln(1 + 2 nu sinh^2(v1/(2 VT))))  (Kilic, Bazant and Ajdari 2007)

In the last two double layers in series share the voltage, v1 = v/2, so C = q0/(2 VT) near 0 V. Here x = q/C [V] stands
for the charge. What netlists need is the voltage of a charge, which all of these give in closed form.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError

#: kT/e [V] at 25 degrees Celsius.
THERMAL = 1.380649e-23 * 298.15 / 1.602176634e-19
#: So many times its constant a saturating charge is still told apart from its limit.
_TOLD = 8.0
#: Voltage, in units of two double layers' thermal ones, below which a steric charge is linear to the last digit.
_LINEAR = 1e-100
#: Derivative dx/dv below which a charge no longer rises with the voltage.
_LEAST_SLOPE = 1e-12
#: Exponent beyond which a steric law's is taken apart, so that it does not overflow.
_EXPONENT = 1200.0
#: Largest exponent of a steric law in a netlist, and a small number that keeps 0/0 out of it.
_MOST, _LITTLE = 600.0, 1e-6
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(100)


@dataclass(frozen=True)
class ChargeLaw(ABC):
    """A law with one ``constant``. ``field`` is the constant's name in a `Port` and in [material]."""

    constant: float

    @property
    @abstractmethod
    def field(self) -> str:
        """Return the name of the constant."""

    @abstractmethod
    def charge(self, voltage: ArrayLike) -> Array:
        """Return x [V] at ``voltage`` [V], any shape."""

    @abstractmethod
    def voltage(self, x: ArrayLike) -> Array:
        """Return the voltage [V] at ``x`` [V]: the inverse of `charge`."""

    @abstractmethod
    def slope(self, voltage: ArrayLike) -> Array:
        """Return dx/dv, the differential capacitance over C."""

    def inverse(self, x: ArrayLike) -> tuple[Array, Array]:
        """Return the voltage [V] at ``x`` [V] and its derivative dv/dx, which is kept below 1e12."""
        v = self.voltage(x)
        return v, 1 / np.maximum(self.slope(v), _LEAST_SLOPE)

    @property
    @abstractmethod
    def largest(self) -> float:
        """Return the voltage [V] up to which the charge rises with the voltage."""

    @abstractmethod
    def expression(self, charge: str, capacitance: str, constant: str) -> str:
        """Return the voltage of a ``charge`` as SPICE writes it, all three of them expressions."""

    def energy(self, voltage: ArrayLike) -> Array:
        """Return the energy over C [V^2] at ``voltage``: the integral of v dx."""
        x = self.charge(voltage)
        parts = (self.voltage(x * (1 + node) / 2) * weight / 2 for node, weight in zip(_NODES, _WEIGHTS, strict=True))
        return np.asarray(x * sum(parts))


@dataclass(frozen=True)
class GrowingLaw(ChargeLaw):
    """A capacitance that grows, or falls, evenly with the size of the voltage; ``constant`` is k [1/V]."""

    field = "capacitance_slope"

    def charge(self, voltage: ArrayLike) -> Array:
        v = np.asarray(voltage, dtype=float)
        return np.asarray(v + self.constant * v * np.abs(v) / 2)

    def voltage(self, x: ArrayLike) -> Array:
        q = np.asarray(x, dtype=float)
        return np.asarray(2 * q / (1 + np.sqrt(np.maximum(1 + 2 * self.constant * np.abs(q), 0.0))))

    def slope(self, voltage: ArrayLike) -> Array:
        return np.asarray(1 + self.constant * np.abs(np.asarray(voltage, dtype=float)))

    @property
    def largest(self) -> float:
        return math.inf if self.constant > 0 else -1 / self.constant

    def energy(self, voltage: ArrayLike) -> Array:
        v = np.asarray(voltage, dtype=float)
        return np.asarray(v**2 / 2 + self.constant * np.abs(v) ** 3 / 3)

    def expression(self, charge: str, capacitance: str, constant: str) -> str:
        inside = f"1+({constant})*2/({capacitance})*abs({charge})"
        return f"2*{charge}/({capacitance})/(1+sqrt({inside if self.constant > 0 else f'max(0,{inside})'}))"


@dataclass(frozen=True)
class SaturatingLaw(ChargeLaw):
    """A charge that saturates as a hyperbolic tangent; ``constant`` is V0 [V]."""

    field = "saturation_voltage"

    def charge(self, voltage: ArrayLike) -> Array:
        return np.asarray(self.constant * np.tanh(np.asarray(voltage, dtype=float) / self.constant))

    def voltage(self, x: ArrayLike) -> Array:
        return self.inverse(x)[0]

    def inverse(self, x: ArrayLike) -> tuple[Array, Array]:
        part = np.clip(np.asarray(x, dtype=float) / self.constant, -1 + 1e-15, 1 - 1e-15)
        return np.asarray(self.constant * np.arctanh(part)), 1 / np.maximum((1 - part) * (1 + part), _LEAST_SLOPE)

    def slope(self, voltage: ArrayLike) -> Array:
        return np.asarray(1 / np.cosh(np.asarray(voltage, dtype=float) / self.constant) ** 2)

    @property
    def largest(self) -> float:
        return _TOLD * self.constant

    def energy(self, voltage: ArrayLike) -> Array:
        w = np.abs(np.asarray(voltage, dtype=float)) / self.constant
        # w tanh w - ln cosh w, whose terms cancel near 0
        near = w**2 / 2 - w**4 / 4 + w**6 / 9
        far = w * np.tanh(w) - (w + np.log1p(np.exp(-2 * w)) - math.log(2))
        return np.asarray(self.constant**2 * np.where(w < 0.03, near, far))

    def expression(self, charge: str, capacitance: str, constant: str) -> str:
        return f"({constant})*atanh(max(-1+1e-15,min(1-1e-15,{charge}/({capacitance})/({constant}))))"


@dataclass(frozen=True)
class StericLaw(ChargeLaw):
    """Two double layers in series whose ions have a size; ``constant`` is nu, the share of space they fill in bulk."""

    field = "packing_fraction"

    def charge(self, voltage: ArrayLike) -> Array:
        w = np.asarray(voltage, dtype=float) / (4 * THERMAL)
        size, nu = np.abs(w), self.constant
        # ln(1 + 2 nu sinh^2 w) as a sum of logarithms where sinh would overflow
        with np.errstate(over="ignore"):
            near = np.log1p(2 * nu * np.sinh(np.minimum(size, 1.0)) ** 2)
        far = 2 * size + np.log(nu / 2 * (1 + np.exp(-4 * size)) + (1 - nu) * np.exp(-2 * size))
        charge = 2 * THERMAL * np.sign(w) * np.sqrt(2 / nu * np.where(size < 1.0, near, far))
        return np.asarray(np.where(size < _LINEAR, voltage, charge))  # whose square is no number

    def voltage(self, x: ArrayLike) -> Array:
        return self.inverse(x)[0]

    def inverse(self, x: ArrayLike) -> tuple[Array, Array]:
        # sinh^2 w = (exp(z) - 1)/(2 nu), of which exp(z) is taken out: it may overflow
        half, nu = np.asarray(x, dtype=float) / (4 * THERMAL), self.constant
        size = np.abs(half)
        with np.errstate(over="ignore"):
            z = 2 * nu * size**2
        fallen = np.expm1(-z)
        rest = -fallen / (2 * nu)
        root = np.sqrt(rest)
        w = np.arcsinh(root * np.exp(np.minimum(z, _EXPONENT) / 2)) + np.maximum(z - _EXPONENT, 0.0) / 2
        linear = size < _LINEAR  # whose square is no number
        rise = size / np.where(linear, 1.0, root * np.sqrt(1 + fallen + rest))
        v = 4 * THERMAL * np.copysign(np.where(linear, size, w), half)
        return np.asarray(v), np.where(linear, 1.0, np.minimum(rise, 1 / _LEAST_SLOPE))

    def slope(self, voltage: ArrayLike) -> Array:
        v = np.asarray(voltage, dtype=float)
        w, nu = np.abs(v) / (4 * THERMAL), self.constant
        x = self.charge(np.abs(v)) / (2 * THERMAL)
        # sinh 2w/((1 + 2 nu sinh^2 w) x), divided by exp(2w)
        low = np.exp(-2 * w)
        part = -np.expm1(-4 * w) / 2 / (nu / 2 * (1 + low**2) + (1 - nu) * low)
        return np.asarray(np.where(x > 0, part / np.where(x > 0, x, 1.0), 1.0))

    @property
    def largest(self) -> float:
        return 2 * THERMAL * (_MOST - 2)

    def expression(self, charge: str, capacitance: str, constant: str) -> str:
        # (exp(z) - 1)/z is taken a little beside 0, and its root over the root there
        root = math.sqrt(math.expm1(_LITTLE) / _LITTLE)
        x = f"{charge}/({4 * THERMAL!r}*({capacitance}))"
        z = f"(min(2*({constant})*({x})*({x}),{_MOST!r})+{_LITTLE!r})"
        return f"{4 * THERMAL!r}*asinh({x}*sqrt((exp({z})-1)/{z})/{root!r})"


def require_rising(law: ChargeLaw, voltage: float) -> None:
    """Raise InputError where the charge does not rise up to a ``voltage`` [V] of either sign."""
    if abs(voltage) < law.largest:
        return
    allowed = f"{abs(voltage):.4g} V are reached, and the charge rises only up to {law.largest:.4g} V"
    what = "lower the voltage, or give a law that holds there"
    raise InputError(f"material.{law.field} is {law.constant:g}: {allowed}; {what}")


#: Laws by the name of the element's law in a netlist.
CHARGE_LAWS: dict[str, type[ChargeLaw]] = {"charge": GrowingLaw, "saturating": SaturatingLaw, "steric": StericLaw}
