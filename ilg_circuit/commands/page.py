"""The command ``page``."""

from __future__ import annotations

from pathlib import Path

import click

from .emit import origin, say
from .options import beam_option
from .paths import PAGE, Command


@click.command(cls=Command)
@click.argument("actuator")
@click.option(
    "--drive", default="step:4V", help="At first: step:4V, square:4V,30s[,duty], sine:2V,0.1Hz or triangle:4V,30s."
)
@click.option("--duration", default="300s", help="How long, such as 300s.")
@beam_option
@click.option("--out", type=PAGE, required=True, help="One HTML file, which needs no network.")
def page(actuator: str, drive: str, duration: str, beam: str | None, out: Path) -> None:
    """Write the strip as a page for any browser: sliders, and ngspice in the page."""
    from ..front.pages import page as write

    say(f"wrote {write(actuator, out, drive, duration, beam=beam, origin=origin([actuator]))}")
