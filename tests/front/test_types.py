"""What an editor and mypy are told: the front door's functions return the classes of results, not Any."""

from __future__ import annotations

from collections.abc import Callable
from inspect import unwrap
from pathlib import Path
from typing import Any, get_overloads

import pytest
from PySpice.Spice.Netlist import SubCircuit

import ilg_circuit as ilg
from ilg_circuit.arms.run import ArmResult
from ilg_circuit.circuit.text import SpiceText
from ilg_circuit.control.adaptive import Adaptive
from ilg_circuit.control.close import Closed
from ilg_circuit.control.learn import Learned
from ilg_circuit.control.track import Tracked
from ilg_circuit.control.tracked_shape import TrackedShape
from ilg_circuit.control.tune import Tuned
from ilg_circuit.fit.result import FitResult
from ilg_circuit.front.data import Measured
from ilg_circuit.hyperelastic import Characterisation
from ilg_circuit.identification.batch import Batch
from ilg_circuit.identification.frequency_response import BodeOfRecords
from ilg_circuit.identification.identification import Identification
from ilg_circuit.identification.sensing import SensingFit
from ilg_circuit.identification.shape import ShapeFit
from ilg_circuit.identification.sheets import SheetsFit
from ilg_circuit.oscillators.entrainment import Entrainment
from ilg_circuit.oscillators.loop_run import ReflexRun, ReflexSweep
from ilg_circuit.oscillators.run import RhythmRun, RhythmSweep
from ilg_circuit.simulation.bode import Bode
from ilg_circuit.simulation.impedance import Impedance
from ilg_circuit.simulation.response import Response
from ilg_circuit.simulation.sensing import Sensed
from ilg_circuit.simulation.shape import Shape
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.strip.models import IonPath
from ilg_circuit.strip.specimen import Specimen
from ilg_circuit.study.design import DesignReport
from ilg_circuit.study.sweep import SweepResult

RETURNED = {
    "adaptive": Adaptive,
    "app": None,
    "arm": ArmResult,
    "bode": Bode,
    "bode_of": BodeOfRecords,
    "close_loop": Closed,
    "cpg": RhythmRun | RhythmSweep,
    "reflex": ReflexRun | ReflexSweep | Entrainment,
    "design": DesignReport,
    "fit_curve": FitResult,
    "identify": Identification,
    "identify_each": Batch,
    "identify_sensing": SensingFit,
    "identify_shape": ShapeFit,
    "identify_sheets": SheetsFit,
    "impedance": Impedance,
    "kit": Path,
    "learn": Learned,
    "library": SpiceText,
    "load": Actuator,
    "netlist": SpiceText,
    "new_strip": Specimen,
    "ogden": Characterisation,
    "page": Path,
    "pareto": DesignReport,
    "read": Measured | list[Measured],  # one set of data, or a list
    "register_model": IonPath,
    "sense": Sensed,
    "shape": Shape,
    "simulate": Response,
    "subcircuit": SubCircuit,
    "sweep": SweepResult,
    "to_control": Any,  # python-control's, which ships no types
    "track": Tracked | TrackedShape,
    "tune": Tuned,
}
#: Names that modules import for types alone.
NAMES = {"ArmResult": ArmResult, "FitResult": FitResult, "Shape": Shape, "SubCircuit": SubCircuit}


def returned(function: Callable[..., Any]) -> Any:
    """The class that a function's annotation says it returns."""
    plain: Any = unwrap(function)
    return eval(plain.__annotations__["return"], {**plain.__globals__, **NAMES})


def test_every_function_is_listed() -> None:
    functions = {name for name in ilg.__all__ if not isinstance(getattr(ilg, name), type)} - {"PAPER", "results"}
    assert functions == set(RETURNED)


@pytest.mark.parametrize(("name", "expected"), RETURNED.items(), ids=list(RETURNED))
def test_it_returns_the_class_of_its_result(name: str, expected: Any) -> None:
    assert returned(getattr(ilg, name)) == expected


def test_the_classes_of_results_are_names_of_one_module() -> None:
    classes = {cls for cls in RETURNED.values() if isinstance(cls, type) and cls.__module__.startswith("ilg_circuit")}
    listed = {name: getattr(ilg.results, name) for name in ilg.results.__all__}
    assert classes <= set(listed.values())
    assert all(name == cls.__name__ and f"`{name}`" in str(ilg.results.__doc__) for name, cls in listed.items())


def test_a_rhythm_and_a_sweep_of_rhythms_are_told_apart() -> None:
    function = unwrap(ilg.cpg)
    assert [returned(f) for f in get_overloads(function)] == [RhythmRun, RhythmSweep]
