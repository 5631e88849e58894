"""Nonlinear additions to a model: an electron path that follows a sinh law, capacitances that grow with voltage.

sinh       i = (Vt/Rdc) sinh(v/Vt): two antiparallel diodes; Rdc is the resistance near 0 V
growing    q = C (v + k v abs(v)/2)  (Zubieta and Bonert 2000)
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


class Growing(Addition):
    """Capacitances of R-C branches that grow with voltage."""

    name = "growing"
    equation = "q = C (v + k v abs(v)/2)"
    parameter = Parameter("capacitance_slope", "k", "1/V", "growth of the capacitance with voltage, relative to it")
    of = "ions"
    several_voltages = True

    def goes_with(self, ions: IonPath) -> bool:
        return ions.grows

    def start(self, largest_voltage: float) -> float:
        return _GROWTH / largest_voltage


SINH, GROWING = Sinh(), Growing()
