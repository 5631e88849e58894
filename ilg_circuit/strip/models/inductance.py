"""The inductance of leads and cell in series with the port, visible in spectra above some 50 kHz.

Z = L s + Re + Rdc || Zp
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, ComplexArray
from ...fit.parameter import Parameter
from .model import Addition

#: Least starting value of its reactance at the highest frequency, as a fraction of the impedance there.
_LITTLE = 0.02


class Inductance(Addition):
    """A series inductance."""

    name = "inductance"
    equation = "L s in series"
    parameter = Parameter("inductance", "L", "H", "leads and cell, in series")
    of = "terminals"
    linear = True
    spectra_only = True

    def start(self, largest_voltage: float) -> float:
        return 1e-7

    def spectrum_start(self, z: ComplexArray, omega: Array) -> float:
        return float(max(_LITTLE * abs(z[-1]), z[-1].imag) / omega[-1])

    def in_series(self, values: Array, s: ComplexArray) -> ComplexArray:
        return np.asarray(values[:, None] * s)


INDUCTANCE = Inductance()
