"""Measurements -> Actuator: steps and waveforms with ngspice in the loop, impedance spectra by their closed form.

In: records and spectra. Out: an `Identification`. May import: the rooms up to `simulation`.
"""

from .identification import Identification
from .identify import identify

__all__ = ["Identification", "identify"]
