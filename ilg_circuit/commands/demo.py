"""The command ``demo``."""

from __future__ import annotations

from pathlib import Path

import click

from .emit import say
from .help import group
from .paths import ANY_FOLDER, LongCommand


@click.command(cls=LongCommand, examples=("demo", "demo --out results"))
@group("Output", click.option("--out", type=ANY_FOLDER, default=Path("demo"), help="Folder for the results."))
def demo(out: Path) -> None:
    """Run the whole flow once: simulate, measure, identify, export."""
    from ..report.axes import load_plainly
    from ..reproduce.demo import run

    load_plainly()
    for line in run(out):
        say(line)
