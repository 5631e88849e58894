"""The command ``app``."""

from __future__ import annotations

from pathlib import Path

import click

from .emit import say
from .help import argument, group
from .paths import FILE, Command


@click.command(cls=Command, examples=("app", "app strip.toml step.csv", "app --port 8080 --no-browser"))
@group(
    "Input",
    argument("files", "Measurements, and the TOML file of a strip or a preset, to begin with.", type=FILE, nargs=-1),
)
@group(
    "Window",
    click.option("--port", type=int, metavar="N", help="Port of this machine.  [default: a free one]"),
    click.option("--browser/--no-browser", default=True, help="Open the window in the browser.  [default: yes]"),
)
def app(files: tuple[Path, ...], port: int | None, browser: bool) -> None:
    """Open a window with sliders: fit, move, sweep, design, export.

    It is a page in your browser, served on this machine for this machine only; nothing is fetched from any other.
    Every tab of the browser has its own strip, files and solver process. Ctrl-C ends it with exit code 130.
    """
    from ..window.serve import app as serve

    serve(*files, port=port, browser=browser, ready=lambda at: say(f"window at {at}; Ctrl-C ends it", err=True))
