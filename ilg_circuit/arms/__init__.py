"""The soft arm: a plane lattice of masses and springs with cells of constant area, driven segment by segment.

In: an arm and activations, or voltages through strips. Out: a motion. May import: the rooms up to `cpg`.
"""

from .activation import Activation, activation, passive, sampled, sine, stiffening_wave
from .dynamics import TOLERANCE, Stiffness, choose, simulate, stiffness
from .lattice import OCTOPUS, Arm, Fluid, Muscle, Plane, strip_arm
from .motion import Event, Motion, read_motion

__all__ = [
    "OCTOPUS",
    "TOLERANCE",
    "Activation",
    "Arm",
    "Event",
    "Fluid",
    "Motion",
    "Muscle",
    "Plane",
    "Stiffness",
    "activation",
    "choose",
    "passive",
    "read_motion",
    "sampled",
    "simulate",
    "sine",
    "stiffening_wave",
    "stiffness",
    "strip_arm",
]
