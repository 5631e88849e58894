"""A short run of the fuzz: random command lines and damaged files end well, or in one line."""

from __future__ import annotations

import sys
from pathlib import Path

import click
import pytest

from ilg_circuit.cli import cli
from ilg_circuit.errors import InputError

sys.path.append(str(Path(__file__).parents[1] / "contract"))  # its inputs are what good command lines name

import fuzz_case
import fuzz_lines

#: What a command is called within; without it click would keep a help option of other names.
WHOLE = click.Context(cli, **cli.context_settings)
#: Of a long run's cases, some that take little time.
COMMANDS, FILES = (*range(3, 18), *range(19, 31), *range(32, 49)), range(150)


def test_every_option_has_good_values() -> None:
    for name, weight in fuzz_lines.WEIGHTS.items():
        for parameter in fuzz_lines.command(name).params if weight else ():
            known = {parameter.opts[0], f"{name} {parameter.opts[0]}"} & fuzz_lines.GOOD.keys()
            assert known or getattr(parameter, "is_flag", False) or hasattr(parameter.type, "choices"), parameter.opts


def test_most_command_lines_get_past_the_arguments() -> None:
    passed = []
    for seed in range(400):
        name, *words = fuzz_lines.command_line(seed)
        try:
            fuzz_lines.command(name).make_context(name, words, parent=WHOLE)
            passed.append(name)
        except (click.ClickException, click.exceptions.Exit, InputError):
            pass
    assert len(passed) > 240
    assert {name for name, weight in fuzz_lines.WEIGHTS.items() if weight} == set(passed)


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    fuzz_case.write_inputs(folder)
    fuzz_case.warm()
    return folder


@pytest.mark.parametrize("seed", COMMANDS)
def test_command_lines(seed: int, given: Path) -> None:
    found = fuzz_case.run_command(seed, given)
    assert not found.wrong, fuzz_lines.command_line(seed)


def test_damaged_files(tmp_path: Path) -> None:
    found = [fuzz_case.read_damaged(seed, tmp_path) for seed in FILES]
    assert not [(seed, one.wrong) for seed, one in zip(FILES, found, strict=True) if one.wrong]
    assert {one.code for one in found} == {0, 2}
