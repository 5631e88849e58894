"""Load tests -> hyperelastic material: incompressible Ogden, with neo-Hookean and Mooney-Rivlin as its simple cases."""

from .analysis import Characterisation, characterise
from .data import LoadTest, read_load_test
from .fit import HyperelasticFit, fit_model
from .material import CONVENTION, MODES, OTHER_CONVENTION, Ogden

__all__ = [
    "CONVENTION",
    "MODES",
    "OTHER_CONVENTION",
    "Characterisation",
    "HyperelasticFit",
    "LoadTest",
    "Ogden",
    "characterise",
    "fit_model",
    "read_load_test",
]
