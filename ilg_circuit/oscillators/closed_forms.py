"""Closed forms for the two-neuron unit, independent of the solvers here and used to check them."""

from __future__ import annotations

import math

from ..errors import InputError


def window(adaptation: float, rise_time: float, adaptation_time: float) -> tuple[float, float]:
    """Return the mutual inhibition a between which two neurons oscillate: 1 + Tr/Ta < a < 1 + d.

    Below the window both rest at the same output; above it one suppresses the other. The window
    follows from the eigenvalues of the piece with both active: s^2 Tr Ta + s (Tr + Ta (1 - a)) + 1 - a + d = 0 for the
    mode in which they differ. It is empty where Tr >= d Ta.
    """
    return 1 + rise_time / adaptation_time, 1 + adaptation


def describing_frequency(inhibition: float, adaptation: float, rise_time: float, adaptation_time: float) -> float:
    """Return the angular frequency [rad/s] of the two-neuron unit by the describing function of max(0, x).

    It is within 2 % of the exact one for a = 1.5 to 3 with the paper's constants.

    w = (1/Ta) sqrt(((Tr + Ta) d - Tr a)/(Tr a)); InputError where the root has no real value.
    """
    square = ((rise_time + adaptation_time) * adaptation - rise_time * inhibition) / (rise_time * inhibition)
    if not square > 0:
        raise InputError(f"with inhibition {inhibition:g} the describing function has no frequency; it must be less")
    return math.sqrt(square) / adaptation_time
