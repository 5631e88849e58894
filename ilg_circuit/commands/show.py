"""The command ``show``."""

from __future__ import annotations

import json

import click

from .emit import say
from .help import group
from .options import actuator_argument
from .paths import Command


@click.command(
    cls=Command, examples=("show paper", "show strip.toml --from 1mHz --to 1Hz --voltage 2V", "show paper --json")
)
@actuator_argument
@group(
    "Use of the strip",
    click.option(
        "--from", "low", default="0.1mHz", metavar="FREQUENCY", help="Lowest frequency at which the strip is used."
    ),
    click.option("--to", "high", default="10Hz", metavar="FREQUENCY", help="Highest frequency of use."),
    click.option("--voltage", metavar="VOLTAGE", help="Largest voltage: checks electrochemical window and deflection."),
)
@group("Output", click.option("--json", "as_json", is_flag=True, help="Print JSON."))
def show(actuator: str, low: str, high: str, voltage: str | None, as_json: bool) -> None:
    """Print a strip's geometry, elements and limits of the model."""
    from ..front.given import load
    from ..report.strip import summary

    description = load(actuator).describe(low, high, voltage)
    say(json.dumps(description, indent=2) if as_json else summary(description))
