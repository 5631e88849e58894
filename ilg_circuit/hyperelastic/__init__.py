"""Hyperelastic materials from load tests: incompressible Ogden, with neo-Hookean and Mooney-Rivlin as special cases.

In: load tests. Out: an Ogden material with its verdict. May import: the top level, `fit` and `measurements`.
"""

from ..measurements.load_test import LoadTest
from ..measurements.read import read_load_test
from .analysis import characterise
from .characterisation import Characterisation
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
