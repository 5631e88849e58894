"""Bad input through the front door: every name refuses it in one line, as an InputError that says what is allowed."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import ilg_circuit as ilg

RUN: dict[str, Any] = {"strip": "paper", "drive": "step:4V", "duration": "10 s"}
VARY = {"thickness": ("0.2 mm", "1 mm")}
GRID = {"vary": {"thickness": ("0.4 mm", "0.6 mm", 3)}}
GEL = {"uniaxial": {"stretch": [1.1, 1.2, 1.3], "stress_Pa": [1, 2, 3]}}
T = np.arange(-5.0, 60.0, 0.5)
RECORD = {"time": T, "voltage": 4.0 * (T >= 0), "current": (T >= 0) * 0.2 * np.exp(-np.maximum(T, 0) / 7)}


def element(s: Any, capacitance: float) -> Any:
    return 1 / (s * capacitance)


MODEL: dict[str, Any] = {"name": "own", "impedance": element, "constants": {"capacitance": "1 F"}}

#: Function, what is always given, and values that are wrong by argument.
WRONG: list[tuple[str, dict[str, Any], dict[str, list[Any]]]] = [
    ("load", {}, {"strip": [3, None, b"paper", "", "/"]}),
    ("read", RECORD, {"time": [3, None, [], [[1]], T[::-1], T * math.nan], "onset": [[1], math.nan, "soon"]}),
    ("read", RECORD, {"columns": [3], "units": [{"time": "V"}], "part": ["a", 0], "cycle": [1.5], "colour": [1]}),
    ("read", {"frequency": [1, 2]}, {"impedance": [["a", "b"], None, [1 + 1j]]}),
    ("read", {"stretch": [1, 2], "stress": [0, 1]}, {"mode": [3, None, "shear"], "length": [[1]]}),
    (
        "simulate",
        RUN,
        {"strip": [None, 3], "drive": [None, "", 4.0, ([], []), ([0, 1], [math.nan, 1]), ([1, 0], [0, 1])]},
    ),
    ("simulate", RUN, {"duration": [-1, math.nan, math.inf, "long", "", "10 V", [1]], "samples": ["many", 2.5, -3]}),
    ("simulate", RUN, {"step": ["1 V", [1], 0], "tip": [3, None, "loose"], "beam": ["elastic", 3]}),
    ("simulate", RUN, {"load": ["mass=1V", {"mass": None}, {1: 2}, "mass=-1g", 3], "engine": [3, "spice"]}),
    ("simulate", RUN, {"accuracy": ["tight", -1, math.nan], "band": [True, "yes"], "part": ["x"], "colour": [1]}),
    ("simulate", RUN | {"engine": "exact", "samples": 3}, {"compare": [3, "none.csv", {"frequency_Hz": [1, 2]}]}),
    ("bode", {"strip": "paper"}, {"low": ["a", -1, None], "bias": ["x", math.nan], "beam": [3], "load": ["x"]}),
    ("impedance", {"strip": "paper"}, {"low": ["a", -1, None], "points": ["x", 2.5], "frequency": [[], [-1]]}),
    ("impedance", {"strip": "paper"}, {"bias": ["x", math.nan], "engine": [3]}),
    (
        "sense",
        {"strip": "paper", "duration": 1, "motion": "step:1mm"},
        {"motion": [3, "step:1V"], "terminals": ["both"]},
    ),
    ("identify", RECORD, {"own": [3, ["capacitanc"]], "model": [3, "rc9"], "engine": ["x"], "weighting": ["x"]}),
    (
        "identify",
        RECORD,
        {"progress": [3], "fps": ["x"], "part": [[2]], "units": [3], "intervals": ["x"], "drive": [3]},
    ),
    ("ogden", GEL, {"uniaxial": [3, {"stretch": [1.1, 1.2], "stress": [1, 2]}], "model": ["x"], "terms": ["x", 9]}),
    ("ogden", GEL, {"at": [["x"]], "weighting": [3, "x"], "branch": [3], "seed": ["x"], "section": ["1 mm"]}),
    ("sweep", RUN, {"vary": [(), 3, [3], {"thickness": None}, {"thickness": "x"}, {"thickness": ("1 V", "2 V", 3)}]}),
    ("sweep", RUN | GRID, {"outputs": [3, ["x"]], "waveforms": [["x"]], "random": ["x", -1], "jobs": ["x", 0]}),
    (
        "sweep",
        RUN | GRID,
        {"engine": ["x"], "accuracy": ["x"], "drive": [3], "strip": [3], "duration": [None, math.nan]},
    ),
    ("sweep", RUN | GRID, {"out": [3], "tip": ["loose"], "designs": [3, "none.csv"], "cluster": [3]}),
    ("design", RUN | {"vary": VARY}, {"require": [3, "x", "energy<=1V"], "minimise": [3, "x"], "pareto": [3]}),
    ("design", RUN | {"vary": VARY, "minimise": "energy"}, {"seed": ["x"], "confidence": ["x", 2], "drive": [None]}),
    ("pareto", RUN | {"vary": VARY}, {"objectives": [3, ["energy"], ["energy", "x"]]}),
    (
        "pareto",
        RUN | {"vary": VARY, "objectives": ["displacement_final", "force_blocked"]},
        {"points": ["x", 0], "colour": [1]},
    ),
    ("netlist", RUN, {"strip": [3], "drive": [3], "duration": [0, None], "tip": ["x"]}),
    ("library", {"strip": "paper"}, {"strip": [3], "name": [3, "", "1strip"], "beam": ["x", 3]}),
    ("subcircuit", {"strip": "paper"}, {"strip": [3], "name": [3], "beam": [3]}),
    ("cpg", {"duration": 1}, {"duration": [None, math.nan, -1, [1]], "topology": ["x"], "neurons": ["x", -1]}),
    ("cpg", {"duration": 1}, {"weights": ["none.csv", [[1, 2]]], "inhibition": ["x"], "rise_time": [[1], "1 V"]}),
    (
        "reflex",
        {"duration": 1},
        {"gain": ["x", [1]], "strip": ["none.toml", 3], "voltage": ["1 s"], "rest_angle": ["x"]},
    ),
    ("cpg", {"duration": 1}, {"start": ["a", [1]], "engine": ["x"], "sweep": [3, "x", "inhibition=1:2:3"]}),
    ("arm", {"duration": "20 ms"}, {"duration": [None, math.nan, -1], "segments": ["x", 0], "strip": [3]}),
    ("arm", {"duration": "20 ms"}, {"formulation": ["x"], "coupling": ["x"], "rhythm": ["x"], "reach": [3, "a,b"]}),
    ("arm", {"duration": "20 ms", "activation": "sine"}, {"tolerance": ["x"], "method": ["x"], "amplitude": ["x"]}),
    ("register_model", MODEL, {"name": [3, "rc", ""], "impedance": [3], "constants": [3, {}, {"capacitance": None}]}),
    ("register_model", MODEL, {"upper": [3, {"x": 1}]}),
    (
        "fit_curve",
        {"model": element, "x": [1, 2], "y": [1, 2], "start": [1]},
        {"model": [3], "seed": ["x"], "function": [1]},
    ),
]
CASES = [
    pytest.param(name, given | {argument: value}, id=f"{name}-{argument}-{k}")
    for name, given, wrong in WRONG
    for argument, values in wrong.items()
    for k, value in enumerate(values)
]


@pytest.mark.parametrize(("name", "given"), CASES)
def test_it_is_refused_in_one_line(name: str, given: dict[str, Any]) -> None:
    function: Callable[..., Any] = getattr(ilg, name)
    with pytest.raises(ilg.InputError) as raised:
        function(**given)
    message = str(raised.value)
    assert message
    assert "\n" not in message
    assert "--" not in message  # no option of a command
    assert "object at 0x" not in message


def test_arguments_given_twice_or_too_many_are_one_line() -> None:
    call: Any = ilg.simulate
    with pytest.raises(ilg.InputError, match="strip is given twice, by its place and by its name"):
        call("paper", "step:1V", "1 s", strip="paper")
    with pytest.raises(ilg.InputError, match="simulate takes 3 arguments by their place, and 4 are given"):
        call("paper", "step:1V", "1 s", 50)


def test_a_missing_argument_is_named() -> None:
    with pytest.raises(ilg.InputError, match="drive is missing; simulate needs it"):
        ilg.simulate("paper")  # type: ignore[call-arg]
    with pytest.raises(ilg.InputError, match="unknown argument of simulate 'accuray'; perhaps accuracy"):
        ilg.simulate("paper", "step:4V", 10, accuray=1)  # type: ignore[call-arg]


def test_a_result_names_its_own_way_to_what_pandas_calls_otherwise() -> None:
    run = ilg.simulate("paper", "step:4V", 10, samples=3, engine="exact")
    with pytest.raises(AttributeError, match=r"'Response' has no attribute 'to_csv'; use \.save\(\"x\.csv\"\)"):
        run.to_csv("x.csv")  # type: ignore[attr-defined]
    assert not hasattr(run, "curent")


def test_signatures_stay_for_help_and_editors() -> None:
    assert list(inspect.signature(ilg.simulate).parameters)[:3] == ["strip", "drive", "duration"]
    assert (ilg.sweep.__doc__ or "").startswith("Return the outputs of many designs")


def test_masked_readings_are_blanks() -> None:
    """The mask was left aside: masked after 60 s, Rdc came out half as large, 24 standard errors off."""
    mask = (T > 30) & (T < 40)
    masked = RECORD | {"current": np.ma.array(np.where(mask, 1e6, RECORD["current"]), mask=mask)}
    blank = RECORD | {"current": np.where(mask, np.nan, RECORD["current"])}
    found = [ilg.read(**record).current.values for record in (masked, blank)]
    assert found[0].tolist() == found[1].tolist()
    assert len(found[0]) == len(T) - mask.sum()
