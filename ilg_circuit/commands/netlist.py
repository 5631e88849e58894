"""The command ``netlist``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from .emit import emit, origin, say
from .help import group
from .options import DRIVE_TABLE, actuator_argument, beam_option, load_option, segment_drive_option, tip_option
from .paths import ANY, FOLDER, Command, forced, forcing

if TYPE_CHECKING:
    from ..circuit.text import SpiceText


@click.command(
    cls=Command,
    examples=(
        "netlist paper --drive square:4V,30s --duration 300s --out strip.cir",
        "netlist fitted.toml --beam static --out strip.lib",
        "netlist fitted.toml --kit kit",
        "netlist four.toml --drive 1=step:4V --drive 2=step:-4V --duration 60s --out four.cir",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@group(
    "Drive",
    segment_drive_option(default=("step:4V",), help="Voltage over time of a .cir deck; forms are listed below."),
    click.option("--duration", default="300s", metavar="TIME", help="Duration of a .cir deck."),
)
@tip_option
@beam_option
@load_option
@group(
    "Output",
    click.option("--out", type=ANY, help=".cir: a deck that runs as it is; .lib: a subcircuit."),
    click.option(
        "--kit",
        "folder",
        type=FOLDER,
        help="A folder for who builds the driver: library with a position pin, symbols, decks, a page.",
    ),
)
@forcing("Let --kit replace a folder that holds something else.")
def netlist(
    actuator: str, drive: tuple[str, ...], duration: str, out: Path | None, folder: Path | None, **options: Any
) -> None:
    """Write a strip as a SPICE deck, a subcircuit, or a kit of both."""
    from ..front.circuits import kit
    from ..simulation.drives import segment_drives

    if out is None and folder is None:
        raise InputError("say what to write: --out strip.cir or strip.lib, or --kit FOLDER")
    if folder is not None and (options["load"] or options["tip"] == "clamped"):
        raise InputError("a kit leaves the tip to who wires its pin: leave out --tip and --load")
    given = segment_drives(drive)
    files = [given] if isinstance(given, str) else list(given.values())
    inputs = (actuator, *(of.removeprefix("file:") for of in files))
    text = None if out is None else _text(actuator, given, duration, out, options)  # refused before a kit is written
    if folder is not None:
        if not isinstance(given, str):
            raise InputError("a kit has one drive for the whole strip; leave the numbers of segments out")
        how = {"beam": options["beam"], "force": forced(click.get_current_context()), "origin": origin(inputs)}
        say(f"wrote {kit(actuator, folder, given, duration, **how)}: README.md there says how to use each file")
    if text is not None and out is not None:
        emit(text, {"--out": out}, inputs=inputs, writers={"--out": type(text).save}, text=f"wrote {out}")


def _text(actuator: str, drive: str | dict[str, str], duration: str, out: Path, options: dict[str, Any]) -> SpiceText:
    """Return the deck or the subcircuit for a file. Raises InputError for a name that says neither."""
    from ..circuit.text import DECK, SUBCIRCUIT
    from ..front.circuits import library
    from ..front.circuits import netlist as deck

    suffix = out.suffix.lower()
    if suffix in SUBCIRCUIT:
        if options["load"] or options["tip"] == "clamped":
            raise InputError("a .lib leaves the tip to who wires its pin: leave out --tip and --load, or write a .cir")
        return library(actuator, beam=options["beam"])
    if suffix in DECK:
        return deck(actuator, drive, duration, **options)
    raise InputError(f"cannot tell what to write to '{out}': end its name in .cir (a deck) or .lib (a subcircuit)")
