"""The command ``examples``."""

from __future__ import annotations

from pathlib import Path

import click

from .completing import example_names
from .emit import say
from .help import argument, group
from .paths import ANY_FOLDER, Command, forced, forcing


@click.command(
    cls=Command,
    examples=("examples", "examples simulate_and_plot own_driver", "examples --out examples"),
)
@group(
    "Output",
    argument("names", "Names of examples to copy; none: all that there are.", nargs=-1, shell_complete=example_names),
)
@group("Output", click.option("--out", type=ANY_FOLDER, help="Folder to copy them into.  [default: this one]"))
@forcing("Replace files that are there with another content.")
@click.pass_context
def examples(context: click.Context, names: tuple[str, ...], out: Path | None) -> None:
    """List the example scripts, or copy them with their notebooks.

    Without NAMES and --out it lists them.
    """
    from ..front.examples import copy_examples, titles
    from ..report.tables import aligned

    if not names and out is None:
        for line in aligned([(name, title) for name, title in titles().items()], "<<"):
            say(line)
        say("to copy them with their notebooks: ilg-circuit examples NAME --out FOLDER")
        return
    for path in copy_examples(names, out or Path(), force=forced(context)):
        say(f"wrote {path}")
