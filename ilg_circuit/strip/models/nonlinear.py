"""Nonlinear additions to a model: an electron path that follows a sinh law, and laws of the charge on capacitances.

sinh       i = (Vt/Rdc) sinh(v/Vt): two antiparallel diodes; Rdc is the resistance near 0 V
growing, saturating, steric laws of the charge on capacitances:    see `ilg_circuit.strip.charge_laws`
"""

from __future__ import annotations

from ...fit.parameter import Parameter
from ..port import Port
from .model import Addition, IonPath, Shown

#: Starting value of the growth of a capacitance at the largest voltage of a record.
_GROWTH = 0.2


class Sinh(Addition):
    """An electron path whose current is a sinh of the voltage."""

    name = "sinh"
    equation = "electron path i = (Vt/Rdc) sinh(v/Vt)"
    parameter = Parameter("emission_voltage", "Vt", "V", "electron path, two antiparallel diodes")
    of = "electrons"
    several_voltages = True
    constant_voltage_hides = True

    def shown(self, port: Port) -> list[Shown]:
        assert port.emission_voltage is not None
        return [
            ("emission_voltage", port.emission_voltage, "V", "electron path i = Is sinh(v/Vt)"),
            ("saturation_current", port.saturation_current, "A", "Is = Vt/Rdc"),
        ]


class OfCharge(Addition):
    """A law of the charge on the capacitances of R-C branches."""

    of = "ions"
    several_voltages = True
    charges = True

    def goes_with(self, ions: IonPath) -> bool:
        return ions.grows


class Growing(OfCharge):
    """Capacitances of R-C branches that grow with voltage."""

    name = "growing"
    equation = "q = C (v + k v abs(v)/2)"
    parameter = Parameter("capacitance_slope", "k", "1/V", "growth of the capacitance with voltage, relative to it")
    of_either_sign = True

    def start(self, largest_voltage: float) -> float:
        return _GROWTH / largest_voltage


class Saturating(OfCharge):
    """Capacitances of R-C branches whose charge saturates."""

    name = "saturating"
    equation = "q = C V0 tanh(v/V0)"
    parameter = Parameter("saturation_voltage", "V0", "V", "the charge saturates at C V0")
    contested = False

    def start(self, largest_voltage: float) -> float:
        return 2 * largest_voltage


class Steric(OfCharge):
    """Capacitances of R-C branches that are two double layers of ions that have a size."""

    name = "steric"
    equation = "q = q0 sqrt((2/nu) ln(1 + 2 nu sinh^2(v/(4 VT)))), q0 = 2 C VT"
    parameter = Parameter("packing_fraction", "nu", "", "share of space that ions fill in bulk, steric law", upper=1.0)
    contested = False

    def start(self, largest_voltage: float) -> float:
        return 0.1


SINH, GROWING, SATURATING, STERIC = Sinh(), Growing(), Saturating(), Steric()
