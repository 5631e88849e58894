"""The command ``simulate``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from .emit import emit, say, show_check
from .help import group
from .options import (
    DRIVE_TABLE,
    NUMBER,
    actuator_argument,
    engine_option,
    mounted,
    output_options,
    outputs,
    reading_options,
    run_options,
    said,
    sample_options,
    sampled,
)
from .paths import FILE, LongCommand
from .progress import ProgressBar

if TYPE_CHECKING:
    from ..identification.comparison import Compared
    from ..measurements.said import Said
    from ..strip.actuator import Actuator


@click.command(
    cls=LongCommand,
    examples=(
        "simulate paper --drive step:4V --duration 300s --out run.csv --plot run.png",
        "simulate strip.toml --drive square:-2V..2V,30s --duration 2min --tip clamped --check",
        "simulate fitted.toml --drive file:record.csv --duration 60s --band --report run.html",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@run_options
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
def simulate(actuator: str, drive: str, duration: str, **options: Any) -> None:
    """Simulate a strip's current, displacement, force and charge.

    Where the drive is a file that holds a measured current (and displacement) too, the prediction is compared with it.
    """
    from ..report import response as shown
    from ..simulation.drives import parse_drive
    from ..simulation.response import simulate as solve
    from ..strip.file import load_actuator

    strip = load_actuator(actuator)
    seconds, times = sampled(duration, options)
    meant = said(options)
    source = parse_drive(drive, seconds, said=meant)
    how = mounted(options)
    written = outputs(options)
    solver = {"engine": options["engine"], "accuracy": options["accuracy"]}
    response = solve(strip, source, times, progress=ProgressBar(), **solver, **how)
    if options["band"]:
        from ..simulation.prediction_band import prediction_band

        band = prediction_band(strip, source, response.time, engine=options["engine"], **how)
        response = replace(response, stderr=band.stderr)
    compared = _compared(strip, options, drive, seconds, how, meant)
    emit(
        response,
        written,
        inputs=(actuator, drive.removeprefix("file:"), options["compare"]),
        writers={"--out": lambda result, path: result.write_csv(path, energy=options["with_energy"])},
        shown={
            "--plot": lambda result: shown.figure(result, compared),
            "--report": lambda result: shown.page(result, compared),
        },
        text=shown.text(response, compared),
    )
    if options["check"]:
        from ..simulation.check import check

        show_check(check(response, **how))


def _compared(
    strip: Actuator, options: dict[str, Any], drive: str, seconds: float, how: dict[str, Any], meant: Said
) -> tuple[Compared, ...]:
    """The prediction beside what was measured: in the file of --compare, or the drive's file if it has a current."""
    from ..identification.comparison import compare
    from ..measurements.kind import RECORD
    from ..measurements.prepare import prepare
    from ..measurements.read import read_columns

    asked = options["compare"] is not None
    if not asked and not drive.startswith("file:"):
        return ()
    path = options["compare"] if asked else drive.removeprefix("file:")
    if not asked and not Path(path).is_file():  # a pipe, which has been read
        return ()
    if not asked and read_columns(path, RECORD.drawn("time").told(meant)).get("current") is None:
        return ()
    try:
        table = read_columns(path, RECORD.requiring("time").told(meant))
        return compare(strip, prepare(table), until=seconds, band=options["band"], engine=options["engine"], **how)
    except InputError as error:
        if asked:
            raise
        say(f"warning: not compared with what was measured: {error}", err=True)
        return ()
