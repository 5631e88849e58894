"""What a shell is told to complete: commands, options, choices, strips, models, examples, files."""

from __future__ import annotations

import pytest
from click.shell_completion import ShellComplete

from ilg_circuit.cli import cli


@pytest.mark.parametrize(
    ("words", "begun", "items"),
    [
        ([], "si", ["simulate"]),
        ([], "ex", ["examples"]),
        (["simulate", "paper"], "--eng", ["--engine"]),
        (["simulate", "paper", "--engine"], "e", ["exact"]),
        (["simulate"], "pa", ["paper", "file:pa"]),
        (["identify", "step.csv", "--actuator"], "st", ["file:st"]),
        (["identify"], "step", ["file:step"]),
        (["identify", "step.csv", "--model"], "warb", ["warburg", "warburg+sinh", "warburg+inductance"]),
        (["identify", "step.csv", "--model"], "au", ["auto"]),
        (["examples"], "soft", ["soft_arm"]),
        (["examples", "soft_arm"], "soft", []),
    ],
)
def test_completions(words: list[str], begun: str, items: list[str]) -> None:
    completing = ShellComplete(cli, {}, "ilg-circuit", "_ILG_CIRCUIT_COMPLETE")
    found = completing.get_completions(words, begun)
    shown = [item.value if item.type == "plain" else f"{item.type}:{item.value}" for item in found]
    assert shown == items
