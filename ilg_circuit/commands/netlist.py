"""The command ``netlist``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..units import parse
from .emit import origin, say
from .help import group
from .options import DRIVE_TABLE, actuator_argument, beam_option, load_option, mounted, tip_option
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
    from ..circuit.deck import deck
    from ..circuit.library import library
    from ..circuit.strip import strip_netlist
    from ..drive import drive_findings
    from ..files import write_text
    from ..simulation.drives import parse_drive
    from ..strip.file import load_actuator

    strip, how = load_actuator(actuator), mounted(options)
    if out.suffix.lower() == ".lib":
        if how["load"] or how["tip"] == "clamped":
            raise InputError("a .lib leaves the tip to who wires its pin: leave out --tip and --load, or write a .cir")
        text = library(strip, beam=how["beam"])
    elif out.suffix.lower() in (".cir", ".sp", ".spice", ".net"):
        seconds = parse(duration, "s", "--duration")
        if not seconds > 0:
            raise InputError(f"duration {duration} must be more than zero")
        source = parse_drive(drive, seconds)
        text = deck(strip_netlist(strip, **how), source, seconds, strip)
        for finding in drive_findings(source):
            say(f"warning: {finding}", err=True)
    else:
        raise InputError(f"cannot tell what to write to '{out}': end its name in .cir (a deck) or .lib (a subcircuit)")
    made = origin([actuator, drive.removeprefix("file:")])
    write_text(out, _with_origin(text, made.lines()[1:]))
    say(f"wrote {out}")


def _with_origin(text: str, lines: list[str]) -> str:
    """The netlist with its origin as comments after the line that says what wrote it."""
    from ..circuit.netlist import plain

    written = text.index("\n", text.index("* written by ")) + 1
    return text[:written] + "".join(f"* {plain(line)}\n" for line in lines) + text[written:]
