"""`ilg-circuit reproduce`: choice of items, folder, exit codes, and that every command on the page exists."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
import pytest
from command import Run, assert_one_line

from ilg_circuit import extras
from ilg_circuit.cli import cli
from ilg_circuit.errors import SolveError
from ilg_circuit.reproduce import ITEMS


def test_list(run: Run) -> None:
    outcome = run("reproduce", "--list")
    assert outcome.code == 0
    assert [line.split()[0] for line in outcome.out.splitlines()] == [item.id for item in ITEMS]


def test_only_some(run: Run, tmp_path: Path) -> None:
    outcome = run("reproduce", "new/out", "--only", "ec-e37, EC-E39")
    assert outcome.code == 0, outcome.err
    assert {p.name for p in (tmp_path / "new/out").iterdir()} == {"index.html", "reproduce.json"}
    numbers = json.loads((tmp_path / "new/out/reproduce.json").read_text(encoding="utf-8"))
    assert [item["id"] for item in numbers["items"]] == ["EC-E37", "EC-E39"]
    assert "EC-E39" in outcome.out
    assert "0.1751" in (tmp_path / "new/out/index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["out", "--only", "EC-T9"], "there is no item 'EC-T9'"),
        (["out", "--only", " , "], "names no item"),
        ([], "OUTDIR is missing"),
        (["file"], "cannot make the folder 'file'"),
        (["taken"], "is a folder; give a file name in it"),
    ],
)
def test_wrong_input(run: Run, tmp_path: Path, arguments: list[str], hint: str) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "taken/index.html").mkdir(parents=True)
    assert_one_line(run("reproduce", *arguments), hint)
    assert not (tmp_path / "out").exists()


def test_an_item_that_fails_shows_in_page_and_exit_code(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(runs: Any) -> Any:
        raise SolveError("the circuit has no answer")

    items = [replace(ITEMS[0], make=fail), next(item for item in ITEMS if item.id == "EC-E37")]
    monkeypatch.setattr("ilg_circuit.reproduce.select", lambda only: items)
    outcome = run("reproduce", "out")
    assert outcome.code == 1
    assert "1 of 2 items fail: EC-T1" in outcome.err
    assert "not made: the circuit has no answer" in outcome.out
    assert "Not made: the circuit has no answer" in (tmp_path / "out/index.html").read_text(encoding="utf-8")


def test_without_the_arm_the_rest_is_made(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "numba" else find_spec(name))
    outcome = run("reproduce", "out", "--only", "EC-E37,CPG-F10")
    assert outcome.code == 1
    assert "install with pip install 'ilg-circuit[arm]'" in outcome.out
    text = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "the arm needs numba" in text
    assert "2.7642e-4" in text


@pytest.mark.parametrize("line", sorted({line for item in ITEMS for line in item.commands}))
def test_every_command_of_the_page_exists(line: str) -> None:
    program, name, *arguments = shlex.split(line)
    assert program == "ilg-circuit"
    _, command, _ = cli.resolve_command(click.Context(cli), [name])
    assert command is not None
    assert isinstance(command, click.Command)
    command.make_context(name, arguments, parent=click.Context(cli, **cli.context_settings))
