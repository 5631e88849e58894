"""Responses, spectra and sensed waveforms as text, pictures and pages."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.provenance import Provenance
from ilg_circuit.report.axes import save
from ilg_circuit.report.page import render
from ilg_circuit.report.tables import aligned
from ilg_circuit.result import Result
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.simulation.sensing import sense
from ilg_circuit.strip.actuator import PAPER, Actuator

T = np.linspace(0, 100, 51)


@pytest.fixture(scope="module")
def response() -> Response:
    return simulate(PAPER, parse_drive("step:4V", 100.0), T, engine="exact")


def drawn(result: Result, path: Path) -> str:
    """The picture as SVG, its text as text."""
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save(result.figure(), path)
    return path.read_text(encoding="utf-8")


def test_axes_have_names_and_units(response: Response, tmp_path: Path) -> None:
    text = drawn(response, tmp_path / "run.svg")
    for label in ("current [mA]", "charge [C]", "displacement [mm]", "energy [J]", "voltage [V]", "time [s]"):
        assert label in text
    assert "force" not in text  # a free tip has none
    assert "step 4 V" in text


def test_what_is_not_known_is_not_drawn(strips: dict[str, Actuator], tmp_path: Path) -> None:
    known = simulate(strips["no coupling"], parse_drive("step:4V", 100.0), T, engine="exact")
    assert "displacement" not in drawn(known, tmp_path / "run.svg")
    assert "the actuator has no [coupling]" in render(known.page())


@pytest.mark.parametrize("kind", ["response", "account", "impedance", "sensed"])
def test_every_result_has_the_same_doors(response: Response, kind: str) -> None:
    results: dict[str, Result] = {
        "response": response,
        "account": response.account,
        "impedance": impedance(PAPER, np.geomspace(1e-3, 10, 9), engine="exact"),
        "sensed": sense(PAPER, parse_drive("step:1mm", 100.0, "m"), T, engine="exact"),
    }
    result = results[kind]
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False)) == result.to_dict()
    assert result.summary()
    assert result.figure().get_axes()
    page = render(result.page(), Provenance(call="the call", inputs={"strip.toml": "abc"}, seed=7))
    for line in ("the call", "strip.toml, SHA-256 abc", "seed: 7", "<img"):
        assert line in page


def test_tables_are_aligned() -> None:
    rows = [("name", "value", "at"), ("a", "1 V", "12 s"), ("longer", "none", "because it is not known")]
    assert aligned(rows, "<>>") == [
        "name    value                       at",
        "a         1 V                     12 s",
        "longer   none  because it is not known",
    ]
    assert aligned([*rows[:2], ("x", "runs on over the rest")], "<>>", indent="  ") == [
        "  name  value    at",
        "  a       1 V  12 s",
        "  x     runs on over the rest",
    ]
