"""The command ``show``."""

from __future__ import annotations

import json

import click

from ..errors import InputError
from ..units import parse
from .emit import say
from .paths import Command


@click.command(cls=Command)
@click.argument("actuator")
@click.option("--from", "low", default="0.1mHz", help="Low end of the band of use.")
@click.option("--to", "high", default="10Hz", help="High end of the band of use.")
@click.option("--voltage", help="Largest voltage, for the electrochemical window and the deflection.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def show(actuator: str, low: str, high: str, voltage: str | None, as_json: bool) -> None:
    """Geometry, lumped elements, and where the model holds."""
    from ..report.strip import summary
    from ..strip.describe import describe
    from ..strip.file import load_actuator

    band = (parse(low, "Hz", "--from"), parse(high, "Hz", "--to"))
    if not 0 < band[0] < band[1]:
        raise InputError(f"band from {low} to {high}: give two frequencies above zero, the lower one first")
    volts = abs(parse(voltage, "V", "--voltage")) if voltage else None
    description = describe(load_actuator(actuator), band=band, voltage=volts)
    say(json.dumps(description, indent=2) if as_json else summary(description))
