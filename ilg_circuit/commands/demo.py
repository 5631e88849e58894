"""The command ``demo``."""

from __future__ import annotations

from pathlib import Path

import click

_OUT = click.Path(path_type=Path)


@click.command()
@click.option("--out", type=_OUT, default=Path("demo"), show_default=True, help="Folder for the results.")
def demo(out: Path) -> None:
    """The whole flow once, with pictures: simulate, check, measure with noise, identify, hand out."""
    from ..reproduce.demo import run

    for line in run(out):
        click.echo(line)
