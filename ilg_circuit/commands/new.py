"""The command ``new``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .emit import say
from .options import strip_options
from .paths import STRIP, Command


@click.command(cls=Command)
@click.argument("file", type=STRIP)
@strip_options(required=True)
@click.option("--name", help="The strip's name.  [default: that of the file]")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def new(file: Path, force: bool, **options: Any) -> None:
    """Write the file of a strip from its sizes; identify fits the rest.

    FILE is a TOML file with a comment on every key.
    """
    from ..front.strips import new_strip, save_new

    given = {key: value for key, value in options.items() if value is not None}
    made = new_strip(**{"name": file.stem} | given)
    save_new(made, file, force=force)
    say(f"{file}: written; fit it with ilg-circuit identify DATA.csv --actuator {file}")
    if not made.modulus_known:
        say("warning: no Young's modulus is given: a fit takes the paper's (--youngs-modulus)", err=True)
