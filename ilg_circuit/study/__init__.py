"""Studies of many strips: sweeps over grids, lists and random designs; designs that meet requirements.

In: a strip, a run and what to vary. Out: sweeps and designs. May import: the rooms up to `identify`.
"""

from __future__ import annotations

from ..strip.changes import VariedParameter
from .evaluate import Evaluation, evaluate, evaluate_designs
from .outputs import OUTPUTS, Output, choose_outputs
from .parameters import Scenario, ScenarioTemplate, apply, varied_parameter

__all__ = [
    "OUTPUTS",
    "Evaluation",
    "Output",
    "Scenario",
    "ScenarioTemplate",
    "VariedParameter",
    "apply",
    "choose_outputs",
    "evaluate",
    "evaluate_designs",
    "varied_parameter",
]
