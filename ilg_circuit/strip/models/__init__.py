"""The electrical models of a strip, each complete in one file, and their registry.

To add a model write a file with a subclass of `IonPath` (or of `LadderPath`, for what a ladder stands for) and register
it: in `registry`, or from a package of your own by an entry point of the group ``ilg_circuit.models``.
"""

from ..ladder import Ladders
from .ladder_path import LadderPath
from .model import Addition, ElectricalModel, IonPath
from .registry import MODELS, candidates, electrical_model, ion_path, material_keys, model_names, register

__all__ = [
    "MODELS",
    "Addition",
    "ElectricalModel",
    "IonPath",
    "LadderPath",
    "Ladders",
    "candidates",
    "electrical_model",
    "ion_path",
    "material_keys",
    "model_names",
    "register",
]
