"""Measurements -> Actuator: the step found, circuit and coupling fitted with an ngspice transient in the loop."""

from .identification import Identification, identify
from .measurement import Measurement, read_measurement

__all__ = ["Identification", "Measurement", "identify", "read_measurement"]
