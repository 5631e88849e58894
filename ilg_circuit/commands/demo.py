"""The command ``demo``."""

from __future__ import annotations

from pathlib import Path

import click

from .paths import FILE, LongCommand


@click.command(cls=LongCommand)
@click.option("--out", type=FILE, default=Path("demo"), help="Folder for the results.")
def demo(out: Path) -> None:
    """The whole flow once, with pictures: simulate, check, measure with noise, identify, hand out."""
    from ..reproduce.demo import run

    for line in run(out):
        click.echo(line)
