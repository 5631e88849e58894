"""The command ``simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .emit import emit
from .help import group
from .options import (
    DRIVE_TABLE,
    NUMBER,
    actuator_argument,
    engine_option,
    output_options,
    outputs,
    reading_options,
    sample_options,
    segment_run_options,
)
from .paths import FILE, LongCommand
from .progress import ProgressBar


@click.command(
    cls=LongCommand,
    examples=(
        "simulate paper --drive step:4V --duration 300s --out run.csv --plot run.png",
        "simulate strip.toml --drive square:-2V..2V,30s --duration 2min --tip clamped --check",
        "simulate fitted.toml --drive file:record.csv --duration 60s --band --report run.html",
        "simulate four.toml --drive 1=step:4V --drive 2=square:-4V..4V,30s --duration 60s --out run.csv",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@segment_run_options
@sample_options
@engine_option
@group(
    "Solver",
    click.option(
        "--accuracy",
        type=NUMBER,
        help="Error allowed, relative to each maximum.  [default: 1e-09; with nonlinear elements 1e-06]",
    ),
    click.option("--check", is_flag=True, help="Compare with the other engine and the closed forms."),
    click.option("--band", is_flag=True, help="Add standard errors, from the fit that the strip comes from."),
)
@group(
    "Data files",
    click.option(
        "--compare", type=FILE, help="Measured record to compare with.  [default: the drive's file, if it holds one]"
    ),
)
@reading_options
@group("Output", click.option("--with-energy", is_flag=True, help="Add a column energy_J to the CSV file."))
@output_options("CSV file to write.", "Picture to write (.png, .pdf, .svg).")
def simulate(actuator: str, compare: Path | None, with_energy: bool, **options: Any) -> None:
    """Simulate a strip's current, displacement, force and charge.

    Where the drive is a file that holds a measured current (and displacement) too, the prediction is compared with it.
    """
    from ..front.runs import simulate as run
    from ..report.response import text
    from ..simulation.drives import segment_drives

    drive = options["drive"] = segment_drives(options["drive"])
    files = [drive] if isinstance(drive, str) else list(drive.values())
    written = outputs(options)
    # the drive's file is compared with where it holds a measurement
    response = run(actuator, compare=compare or True, progress=ProgressBar(), **options)
    emit(
        response,
        written,
        inputs=(actuator, *(of.removeprefix("file:") for of in files), compare),
        writers={"--out": lambda result, path: result.write_csv(path, energy=with_energy)},
        text=text(response),
    )
