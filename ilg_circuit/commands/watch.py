"""The command ``watch``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .completing import strips
from .emit import emit, origin, say
from .help import argument, group
from .options import fit_options, outputs, reading_options, result_options, sizes, strip_options
from .paths import ANY_FOLDER, FOLDER, LOG, PARAMETERS, LongCommand, forced, forcing


@click.command(
    cls=LongCommand,
    examples=(
        "watch measurements --actuator strip.toml --model rc2",
        "watch measurements --pattern '*.mpt' --settle 5s --idle 10min --table all.csv",
    ),
)
@group(
    "Input",
    argument("folder", "Folder into which an instrument writes.", type=ANY_FOLDER),
    click.option(
        "--pattern",
        default="*",
        metavar="PATTERN",
        help="Names of the files that are measurements, such as '*.csv'.",
    ),
    click.option("--settle", default="2s", metavar="TIME", help="A file is fitted when unchanged for this time."),
    click.option(
        "--idle",
        metavar="TIME",
        help="End when no file has changed for this time.  [default: go on until Ctrl-C]",
    ),
)
@group(
    "Strip",
    click.option(
        "--actuator", metavar="STRIP", shell_complete=strips, help="The strip that is measured. TOML file or preset."
    ),
)
@strip_options(required=False)
@fit_options
@group(
    "Model",
    click.option("--bias", metavar="VOLTAGE", help="Bias voltage of spectra, such as 1V."),
    click.option("--onset", metavar="TIME", help="When the voltage began: 4s, last-rest or first-level."),
)
@reading_options
@group(
    "Output",
    click.option("--into", type=FOLDER, help="Folder for the fits and their table.  [default: each.fit in FOLDER]"),
    click.option("--table", type=PARAMETERS, help="Table of all fits, written at the end (.csv, .tex, .md)."),
)
@result_options("Picture at the end: parameters over the files.")
@group(
    "Many files",
    click.option("--jobs", type=int, metavar="N", help="Processes.  [default: one a core]"),
    click.option("--log", type=LOG, help="File to which one line per file is appended."),
)
@forcing("Let --into be a folder that holds other files.")
@click.pass_context
def watch(context: click.Context, /, folder: Path, **options: Any) -> None:
    """Fit each file that an instrument writes into a folder.

    A file is fitted once it no longer changes, and again when it changes later. Files that an earlier run has fitted
    are skipped. Ctrl-C ends the command with exit code 130; the table then holds all files fitted so far.
    """
    from ..front.each import TABLE, folder_of_all
    from ..front.watch import require_watchable
    from ..front.watch import watch as follow
    from ..report.batch import row
    from ..report.parameter_table import write_table

    require_watchable(folder)
    options |= sizes(options)
    written = outputs(options) | {"--table": options.pop("table")}
    into = options.pop("into") or folder_of_all([folder / "any"])
    actuator = options.pop("actuator")
    say(f"watching {folder}; fits and {TABLE} go to {into}; Ctrl-C ends it", err=True)
    batch = follow(
        folder,
        into,
        actuator,
        told=lambda file: say(row(file), err=written["--json"] is not None),
        call=origin().call,
        force=forced(context),
        **options,
    )
    emit(batch, written, inputs=(actuator,), writers={"--table": write_table})
    context.exit(batch.exit_code)
