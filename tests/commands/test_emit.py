"""What every command does with its result: files with their origin, text, warnings; bad paths are refused first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import Run

from ilg_circuit import __version__
from ilg_circuit.provenance import digest
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import save_actuator

pytestmark = pytest.mark.usefixtures("drafts")
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
