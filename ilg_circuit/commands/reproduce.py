"""The command ``reproduce``."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError
from .emit import origin, say
from .help import argument, group
from .paths import ANY_FOLDER, LongCommand
from .progress import ProgressBar


@click.command(
    cls=LongCommand, examples=("reproduce results", "reproduce results --only EC-T1,EC-F9", "reproduce --list")
)
@group(
    "Items",
    click.option("--only", metavar="IDS", help="Items to make, such as EC-T1,EC-F9.  [default: all]"),
    click.option("--list", "listed", is_flag=True, help="List the items and make nothing."),
)
@group("Output", argument("outdir", "Folder for the results; it is made if absent.", type=ANY_FOLDER, required=False))
def reproduce(outdir: Path | None, only: str | None, listed: bool) -> int:
    """Remake every table and figure of both papers, and compare.

    OUTDIR, made if absent, gets index.html (one page that opens offline), a picture for each figure, and reproduce.json
    with every number. Each item says whose error it is: the paper's in print, or our run's. Exit code 1 where our run
    is off or could not be made; the page says why.
    """
    from ..report.axes import load_plainly
    from ..reproduce import output_folder, run, select, write
    from ..reproduce.items import WHOSE

    items = select(only)
    if listed:
        for item in items:
            say(f"{item.id:<10}{item.title}")
        return 0
    if outdir is None:
        raise InputError("OUTDIR is missing; name a folder for the results, or --list the items")
    output_folder(outdir)
    load_plainly()
    outcomes = run(items, ProgressBar("item"))
    written = write(outcomes, outdir, origin())
    for outcome in outcomes:
        say(f"{outcome.item.id:<10}{WHOSE[outcome.status]:<16}{outcome.agreement}")
    say(f"{len(written)} files in '{outdir}'; open {written[-1]}")
    failed = [outcome.item.id for outcome in outcomes if outcome.status == "fails"]
    if failed:
        say(f"warning: {len(failed)} of {len(outcomes)} items fail: {', '.join(failed)}", err=True)
    return 1 if failed else 0
