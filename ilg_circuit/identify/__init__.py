"""Measurements -> Actuator: the step found, the circuit and the coupling fitted with an ngspice transient in the loop."""

from .identification import Identification, identify
from .measurement import Measurement, read_measurement

__all__ = ["Identification", "Measurement", "identify", "read_measurement"]
