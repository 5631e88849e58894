"""The command ``new``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .emit import say
from .help import argument, group
from .options import strip_options
from .paths import STRIP, Command


@click.command(
    cls=Command,
    examples=(
        "new strip.toml --length 35mm --free-length 30mm --width 5mm --thickness 0.5mm",
        "new long.toml --length 50mm --free-length 45mm --width 5mm --thickness 0.4mm --youngs-modulus 7.6kPa",
    ),
)
@group("Output", argument("file", "TOML file to write.", type=STRIP))
@strip_options(required=True)
@group(
    "Output",
    click.option("--name", metavar="NAME", help="The strip's name.  [default: that of the file]"),
    click.option("--force", is_flag=True, help="Replace a file that is there."),
)
def new(file: Path, force: bool, **options: Any) -> None:
    """Write the file of a strip from its sizes.

    FILE is a TOML file with a comment on every key; identify fits the rest.
    """
    from ..front.strips import new_strip, save_new

    given = {key: value for key, value in options.items() if value is not None}
    made = new_strip(**{"name": file.stem} | given)
    save_new(made, file, force=force)
    say(f"{file}: written; fit it with ilg-circuit identify DATA.csv --actuator {file}")
    if not made.modulus_known:
        say("warning: no Young's modulus is given: a fit takes the paper's (--youngs-modulus)", err=True)
