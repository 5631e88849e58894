"""The command ``page``."""

from __future__ import annotations

from pathlib import Path

import click

from .emit import origin, say
from .help import group
from .options import actuator_argument, beam_option
from .paths import PAGE, Command


@click.command(
    cls=Command,
    examples=("page paper --out strip.html", "page strip.toml --drive square:4V,30s --duration 120s --out strip.html"),
)
@actuator_argument
@group(
    "Drive",
    click.option(
        "--drive",
        default="step:4V",
        metavar="DRIVE",
        help="Drive shown first: step:4V, square:4V,30s[,duty] (30 s is the period), sine:2V,0.1Hz or triangle:4V,30s.",
    ),
    click.option("--duration", default="300s", metavar="TIME", help="How long the run is, such as 300s."),
)
@beam_option
@group("Output", click.option("--out", type=PAGE, required=True, help="One HTML file, which needs no network."))
def page(actuator: str, drive: str, duration: str, beam: str | None, out: Path) -> None:
    """Write a strip as a page that runs ngspice in any browser.

    Its sliders move geometry, material and drive; a measured CSV file that is dropped on it is drawn over the model.
    """
    from ..front.pages import page as write

    say(f"wrote {write(actuator, out, drive, duration, beam=beam, origin=origin([actuator]))}")
