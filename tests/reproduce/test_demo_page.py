"""The demonstration's last page: pictures that are in it, and commands that every shell takes as they stand."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from html import unescape
from pathlib import Path

import click
import numpy as np
import pytest
from command import Run

from ilg_circuit.cli import cli
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import Identification
from ilg_circuit.report.page import render
from ilg_circuit.reproduce import demo_page
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import save_actuator


@pytest.fixture(scope="module")
def text(step_fit: Identification) -> str:
    drive = PiecewiseLinear.step(4.0)
    response = simulate(PAPER, drive, np.linspace(0, 300, 61), engine="exact", beam="static")
    return render(demo_page.demo_page(Path("my demo"), response, response, step_fit))


def test_the_page_needs_nothing_else(text: str) -> None:
    assert not re.search(r'(src|href)="(?!data:|#)', text)
    assert text.count('src="data:image/png') == 3
    assert text.count('src="data:image/svg+xml') == 1
    assert all(alt.strip() for alt in re.findall(r'alt="([^"]*)"', text))
    assert re.search(r"capacitance, fitted</dt><dd>3[45]\d(\.\d)? mF \(95 %: \d", text)


def test_the_commands_are_known_to_the_program(text: str) -> None:
    shown = [unescape(line) for line in re.findall(r"<pre>(.*?)</pre>", text)]
    assert len(shown) >= 6
    for line in shown:
        program, name, *arguments = shlex.split(line)
        assert Path(program).name in ("ilg-circuit", "python", "python3", Path(sys.executable).name)
        if name == "-m":
            _, name, *arguments = arguments
        _, command, rest = cli.resolve_command(click.Context(cli), [name, *arguments])
        assert command is not None
        command.make_context(name, rest, parent=click.Context(cli, **cli.context_settings))


def test_the_first_ones_work(run: Run) -> None:
    save_actuator(PAPER, Path("own.toml"))
    lines = [shlex.split(line) for _, line in demo_page.next_commands(Path())]
    for name in ("new", "netlist"):
        (line,) = (line for line in lines if name in line)
        done = run(*line[line.index(name) :])
        assert done.code == 0, done.err
    assert Path("strip.toml").is_file()
    assert Path("own.lib").is_file()


def test_the_program_is_named_as_it_must_be_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "en v" / "bin" / "ilg-circuit"
    program.parent.mkdir(parents=True)
    program.touch(0o755)
    monkeypatch.setattr(sys, "executable", str(program.with_name("python")))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.defpath)
    assert shlex.split(demo_page._program()) == ["en v/bin/ilg-circuit"]
    monkeypatch.chdir(program.parent)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.defpath}")
    assert shutil.which("ilg-circuit")
    assert demo_page._program() == "ilg-circuit"
    program.unlink()
    assert demo_page._program().endswith("-m ilg_circuit")
