"""The command ``netlist``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from .emit import emit
from .help import group
from .options import DRIVE_TABLE, actuator_argument, beam_option, load_option, tip_option
from .paths import ANY, Command


@click.command(
    cls=Command,
    examples=(
        "netlist paper --drive square:4V,30s --duration 300s --out strip.cir",
        "netlist fitted.toml --beam static --out strip.lib",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@group(
    "Drive",
    click.option(
        "--drive", default="step:4V", metavar="DRIVE", help="Voltage over time of a .cir deck; forms are listed below."
    ),
    click.option("--duration", default="300s", metavar="TIME", help="Duration of a .cir deck."),
)
@tip_option
@beam_option
@load_option
@group(
    "Output",
    click.option("--out", type=ANY, required=True, help=".cir: a deck that runs as it is; .lib: a subcircuit."),
)
def netlist(actuator: str, drive: str, duration: str, out: Path, **options: Any) -> None:
    """Write a strip as a SPICE deck or subcircuit."""
    from ..circuit.text import DECK, SUBCIRCUIT, SpiceText
    from ..front.circuits import library
    from ..front.circuits import netlist as deck

    suffix = out.suffix.lower()
    if suffix in SUBCIRCUIT:
        if options["load"] or options["tip"] == "clamped":
            raise InputError("a .lib leaves the tip to who wires its pin: leave out --tip and --load, or write a .cir")
        text = library(actuator, beam=options["beam"])
    elif suffix in DECK:
        text = deck(actuator, drive, duration, **options)
    else:
        raise InputError(f"cannot tell what to write to '{out}': end its name in .cir (a deck) or .lib (a subcircuit)")
    inputs = (actuator, drive.removeprefix("file:"))
    emit(text, {"--out": out}, inputs=inputs, writers={"--out": SpiceText.save}, text=f"wrote {out}")
