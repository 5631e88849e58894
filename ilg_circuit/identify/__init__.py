"""Measurements -> Actuator: steps and waveforms with ngspice in the loop, impedance spectra by their closed form.

In: records and spectra. Out: an `Identification`. May import: the rooms up to `simulation`.
"""

from ..fit.curve import CurveFit, fit_curve
from ..measurements.read import read_record, read_spectrum
from ..measurements.record import Record
from ..measurements.spectrum import Spectrum, prepare_spectrum
from .identification import Identification, identify
from .joint import JointFit, fit_jointly
from .spectrum_identification import SpectrumIdentification, identify_spectra, identify_spectrum

__all__ = [
    "CurveFit",
    "Identification",
    "JointFit",
    "Record",
    "Spectrum",
    "SpectrumIdentification",
    "fit_curve",
    "fit_jointly",
    "identify",
    "identify_spectra",
    "identify_spectrum",
    "prepare_spectrum",
    "read_record",
    "read_spectrum",
]
