"""What every command does with its result: files with their origin, text, warnings; bad paths are refused first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import Run, assert_one_line

from ilg_circuit import __version__
from ilg_circuit.commands.emit import require_outputs
from ilg_circuit.errors import InputError
from ilg_circuit.provenance import digest
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import save_actuator

COMMANDS = {
    "simulate": ("--drive", "step:5V", "--duration", "10s", "--engine", "exact", "--samples", "11"),
    "sense": ("--motion", "step:1mm", "--duration", "10s", "--engine", "exact", "--samples", "11"),
    "impedance": ("--engine", "exact", "--points", "5"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_file_says_where_it_comes_from(run: Run, command: str) -> None:
    save_actuator(PAPER, "strip.toml")
    files = ("--json", "r.json", "--report", "r.html", "--plot", "r.svg", "--out", "r.csv")
    done = run(command, "strip.toml", *COMMANDS[command], *files)
    assert done.code == 0, done.err
    assert all(line.startswith("warning: ") for line in done.err.splitlines())
    origin = json.loads(Path("r.json").read_text())["provenance"]
    assert origin["version"] == __version__
    assert origin["call"].startswith(f"ilg-circuit {command} strip.toml ")
    assert origin["inputs"] == {"strip.toml": digest("strip.toml")}
    for name in ("r.html", "r.svg"):
        text = Path(name).read_text(encoding="utf-8")
        assert f"strip.toml, SHA-256 {digest('strip.toml')}" in text
        assert f"ilg_circuit {__version__}" in text
    assert "SHA" not in Path("r.csv").read_text()


def test_a_netlist_says_where_it_comes_from(run: Run) -> None:
    save_actuator(PAPER, "strip.toml")
    for name in ("strip.cir", "strip.lib"):
        assert run("netlist", "strip.toml", "--out", name).code == 0
        lines = Path(name).read_text().splitlines()
        assert f"* input: strip.toml, SHA-256 {digest('strip.toml')}" in lines[:5]


def test_two_outputs_are_two_files(run: Run) -> None:
    done = run("simulate", "paper", *COMMANDS["simulate"], "--out", "a.json", "--json", "./a.json")
    assert_one_line(done, "two of --out, --json, --plot and --report name the same file; give each its own")
    assert not Path("a.json").exists()


def test_paths_are_refused_before_the_work(tmp_path: Path) -> None:
    data = [tmp_path / "a.csv", tmp_path / "b.csv"]
    require_outputs({"--out": tmp_path / "f.toml", "--plot": None}, {"DATA": data})
    refused = (
        ({"--out": data[1]}, {"DATA": data}, "DATA and --out name the same file; give each its own"),
        ({"--out": data[1], "--plot": None}, {"DATA": data}, "two of DATA, --out and --plot name the same file"),
        ({"--out": tmp_path}, {}, "it is a folder"),
        ({"--sobol-plot": tmp_path / "a.gif"}, {}, r"end its name in \.png"),
    )
    for outputs, inputs, message in refused:
        with pytest.raises(InputError, match=message):
            require_outputs(outputs, inputs)
