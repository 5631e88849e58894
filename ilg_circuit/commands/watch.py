"""The command ``watch``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .emit import emit, origin, say
from .options import ModelOption, engine_option, outputs, reading_options, result_options, sizes, strip_options
from .paths import FILE, FOLDER, LOG, PARAMETERS, LongCommand, forced, forcing


@click.command(cls=LongCommand)
@click.argument("folder", type=FILE)
@click.option("--pattern", default="*", help="Names of the files that are measurements, such as '*.csv'.")
@click.option("--settle", default="2s", help="A file is taken when it has not changed for so long.")
@click.option("--idle", help="End when no file has changed for so long.  [default: go on until Ctrl-C]")
@click.option("--actuator", help="The strip that is measured. TOML file or preset.")
@strip_options(required=False)
@click.option("--model", cls=ModelOption, default="auto")
@click.option("--electrode-resistance", help="Held, such as 2ohm; fit: nonlinear models.  [default: the actuator's]")
@click.option("--bias", help="Of spectra, such as 1V.")
@click.option("--onset", help="When the voltage began: 4s, last-rest or first-level.")
@reading_options
@click.option("--until", help="Fit records up to this time after the onset, such as 16s.  [default: all]")
@engine_option
@click.option("--into", type=FOLDER, help="Folder for the fits and their table.  [default: each.fit in FOLDER]")
@click.option("--table", type=PARAMETERS, help="Table at the end, too (.csv, .tex, .md).")
@result_options("Picture at the end: parameters over the files.")
@click.option("--jobs", type=int, help="Processes.  [default: one a core]")
@click.option("--log", type=LOG, help="File to which a line a file is appended.")
@forcing("Let --into be any folder.")
@click.pass_context
def watch(context: click.Context, /, folder: Path, **options: Any) -> None:
    """Fit what an instrument writes into a folder, each file as it arrives.

    A file is taken once its size is still, and again when it changes. What was fitted before is not fitted again, so
    that it goes on where it was. Ctrl-C ends it, with exit code 130; the table holds all files up to then.
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
