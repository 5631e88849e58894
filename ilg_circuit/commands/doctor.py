"""The command ``doctor``."""

from __future__ import annotations

import click


@click.command()
def doctor() -> None:
    """Versions, the ngspice library, and a self-check against the closed form."""
    from ..doctor import examine

    for line in examine():
        click.echo(line)
