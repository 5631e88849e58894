"""Measurements -> Actuator: steps and waveforms with ngspice in the loop, impedance spectra by their closed form."""

from .curve import CurveFit, fit_curve
from .identification import Identification, identify
from .joint import JointFit, fit_jointly
from .measurement import Measurement, read_measurement
from .spectrum_files import Spectrum, prepare_spectrum, read_spectrum
from .spectrum_identification import SpectrumIdentification, identify_spectra, identify_spectrum

__all__ = [
    "CurveFit",
    "Identification",
    "JointFit",
    "Measurement",
    "Spectrum",
    "SpectrumIdentification",
    "fit_curve",
    "fit_jointly",
    "identify",
    "identify_spectra",
    "identify_spectrum",
    "prepare_spectrum",
    "read_measurement",
    "read_spectrum",
]
