"""Files of every format: those that 0.1.0 wrote are read for good, and what is written says where it comes from."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from every_model import VALUES

from ilg_circuit.errors import InputError
from ilg_circuit.provenance import Provenance
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import dumps, load_actuator, loads, save_actuator

OLD = sorted((Path(__file__).parent / "files_0_1_0").glob("*.toml"))


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_files_of_0_1_0_are_read(path: Path) -> None:
    assert "format" not in tomllib.loads(path.read_text(encoding="utf-8"))
    strip = load_actuator(path)
    if path.stem == "paper":
        assert strip == PAPER
        return
    kind, port = strip.material.model, lumped_elements(strip).port
    assert kind.name.replace("+", "_") == path.stem
    assert kind.values(port) == pytest.approx([VALUES[name] for name in kind.names], rel=1e-12)
    assert port.electrode_resistance == pytest.approx(5.0)
    assert strip.mounting.orientation == "horizontal"
    assert strip.coupling is not None
    if path.stem == "cpe":
        assert strip.coupling.beam == "static"
        assert strip.uncertainty is not None
        assert strip.uncertainty.names == ("dc_resistance", "cpe_exponent")
    assert loads(dumps(strip)) == strip


def test_a_file_says_its_format_and_where_it_comes_from(tmp_path: Path) -> None:
    origin = Provenance("0.2.0", 'identify "a b.csv"', {"a b.csv": "00ff"}, 3)
    save_actuator(PAPER, tmp_path / "strip.toml", "a comment", origin)
    table = tomllib.loads((tmp_path / "strip.toml").read_text(encoding="utf-8"))
    assert table["format"] == 2
    assert table["provenance"] == origin.to_dict()
    assert load_actuator(tmp_path / "strip.toml") == PAPER
    assert "provenance" not in tomllib.loads(dumps(PAPER))


@pytest.mark.parametrize("written", ["3", "0", "-1", '"2"', "true", "2.0"])
def test_formats_that_are_not_known(written: str) -> None:
    with pytest.raises(InputError, match="this version reads formats 1 to 2: update ilg_circuit"):
        loads(dumps(PAPER).replace("format = 2", f"format = {written}"))


def test_provenance_is_a_table() -> None:
    with pytest.raises(InputError, match=r"'provenance' must be a section"):
        loads("provenance = 1\n" + dumps(PAPER))
