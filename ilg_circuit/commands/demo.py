"""The command ``demo``."""

from __future__ import annotations

from pathlib import Path

import click

from .emit import say
from .paths import FILE, LongCommand


@click.command(cls=LongCommand)
@click.option("--out", type=FILE, default=Path("demo"), help="Folder for the results.")
def demo(out: Path) -> None:
    """The whole flow once, with pictures: simulate, check, measure with noise, identify, hand out."""
    from ..report.axes import load_plainly
    from ..reproduce.demo import run

    load_plainly()
    for line in run(out):
        say(line)
