"""The help of every command: what it does, examples that parse, options in groups, lines that fit a terminal."""

from __future__ import annotations

import shlex
from importlib import import_module
from pathlib import Path

import click
import pytest
from command import Run

from ilg_circuit import commands
from ilg_circuit.cli import cli
from ilg_circuit.commands.help import GENERAL, HelpedCommand

#: Commands whose help is checked.
NAMES = list(commands.COMMANDS)
#: Metavars of click that say nothing of a value.
BARE = {"TEXT", "INTEGER", "FLOAT", "PATH", "FILENAME", "BOOLEAN"}


def context_of(name: str) -> click.Context:
    """The context of a command as the program makes it."""
    whole = click.Context(cli, info_name="ilg-circuit", **cli.context_settings)
    return click.Context(command_of(name), info_name=name, parent=whole)


def command_of(name: str) -> HelpedCommand:
    command = getattr(import_module(f"ilg_circuit.commands.{name}"), name)
    assert isinstance(command, HelpedCommand)
    return command


@pytest.mark.parametrize("name", NAMES)
def test_examples_parse_as_they_are_written(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    command = command_of(name)
    assert len(command.examples) >= 2
    for example in command.examples:
        line = example.partition(" > ")[0]
        words = list(shlex.shlex(line, posix=True, punctuation_chars="<>|&;()"))
        assert not any(set(word) <= set("<>|&;()") for word in words), "a shell would take it as its own"
        first, *rest = shlex.split(line)
        assert first == name
        # raises for an unknown option, a missing one, a wrong choice
        command.make_context(name, rest, parent=context_of(name).parent).close()


@pytest.mark.parametrize("name", NAMES)
def test_options_are_in_groups_and_their_values_named(name: str) -> None:
    command = command_of(name)
    context = context_of(name)
    for option in command.get_params(context):
        record = option.get_help_record(context)
        assert record is not None
        assert record[1].strip(), f"{record[0]} has no help"
        assert not BARE & set(record[0].split()), record[0]
        if not {"--help", "--time-limit"} & set(option.opts):
            assert getattr(option, "group", GENERAL) != GENERAL, record[0]


@pytest.mark.parametrize("name", ["", *NAMES])
def test_the_help_fits_a_terminal(name: str, run: Run) -> None:
    done = run(*([name] if name else []), "--help")
    assert done.code == 0
    long = [line for line in done.out.splitlines() if len(line) > 80]
    assert not long
    if name:
        for title in ("Examples:", "General:"):
            assert f"\n{title}\n" in done.out
        for example in command_of(name).examples:
            shown = " ".join(done.out.replace("\\\n", " ").split())
            assert " ".join(f"ilg-circuit {example}".split()) in shown


def test_summaries_fit_the_line_in_the_list_of_commands(run: Run) -> None:
    out = run("--help").out
    for summary in commands.COMMANDS.values():
        assert summary in out
