"""The command ``simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from .options import beam_of, run_options
from .progress import progress_bar

if TYPE_CHECKING:
    from ..identify.comparison import Compared
    from ..strip.actuator import Actuator

_OUT = click.Path(path_type=Path)


@click.command()
@click.argument("actuator")
@run_options
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option(
    "--accuracy",
    type=float,
    help="Error allowed, relative to each maximum.  [default: 1e-09; with nonlinear elements 1e-06]",
)
@click.option("--samples", type=int, help="Number of samples.  [default: 601]")
@click.option("--step", help="Time between samples, such as 0.1s; instead of --samples.")
@click.option("--check", is_flag=True, help="Compare with the exact solver and the closed forms.")
@click.option("--out", type=_OUT, help="CSV file to write.")
@click.option("--band", is_flag=True, help="Standard errors from the fit that the actuator comes from.")
@click.option(
    "--compare", type=_OUT, help="Measured record to compare with.  [default: the drive's file, if it is one]"
)
@click.option("--with-energy", is_flag=True, help="Add a column energy_J to the CSV.")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
def simulate(actuator: str, drive: str, duration: str, load_text: str | None, step: str | None, **options: Any) -> None:
    """Drive a strip and write its current, displacement, force and charge over time.

    Where the drive is a file that holds a measured current (and displacement) too, the prediction is compared with it.
    """
    from ..circuit.strip import parse_load
    from ..files import require_writable
    from ..report.plots import plot_response, require_picture
    from ..simulation.check import check, report, require_agreement
    from ..simulation.drives import parse_drive
    from ..simulation.response import sample_times
    from ..simulation.response import simulate as solve
    from ..strip.file import load_actuator
    from ..units import parse

    strip = load_actuator(actuator)
    seconds = parse(duration, "s", "--duration")
    times = sample_times(seconds, samples=options["samples"], step=parse(step, "s", "--step") if step else None)
    source = parse_drive(drive, seconds)
    load = parse_load(load_text)
    how = {"tip": options["tip"], "beam": beam_of(strip, options["beam"], load), "load": load}
    if options["out"]:
        require_writable(options["out"])
    if options["plot"]:
        require_picture(options["plot"])
    how_solved = {"engine": options["engine"], "accuracy": options["accuracy"], "progress": progress_bar()}
    response = solve(strip, source, times, **how_solved, **how)
    stderr = None
    if options["band"]:
        from ..simulation.prediction_band import prediction_band

        stderr = prediction_band(strip, source, response.time, engine=options["engine"], **how).stderr
    compared = _compared(strip, options, drive, seconds, how)
    if options["out"]:
        response.write_csv(options["out"], energy=options["with_energy"], stderr=stderr)
    if options["plot"]:
        plot_response(response, options["plot"], stderr, compared)
    click.echo(f"{response.netlist.title}: {source.text}, {seconds:g} s, {len(times)} samples")
    click.echo(response.summary())
    click.echo(response.account.summary())
    if response.engine == "ngspice":
        click.echo(f"solved by ngspice, estimated error {response.error:.1e} of each maximum")
    for part in compared:
        click.echo(part.line())
    for line in response.warnings:
        click.echo(f"warning: {line}", err=True)
    if options["check"]:
        differences = check(response, **how)
        click.echo(report(differences))
        require_agreement(differences)


def _compared(
    strip: Actuator, options: dict[str, Any], drive: str, seconds: float, how: dict[str, Any]
) -> tuple[Compared, ...]:
    """The prediction beside what was measured, where the drive's file is a record with a current."""
    from ..identify.comparison import compare
    from ..measurements.kind import RECORD
    from ..measurements.prepare import prepare
    from ..measurements.read import read_columns

    if not drive.startswith("file:"):
        return ()
    table = read_columns(drive.removeprefix("file:"), RECORD.requiring("time"))
    if table.get("current") is None:
        return ()
    try:
        return compare(strip, prepare(table), until=seconds, band=options["band"], engine=options["engine"], **how)
    except InputError as error:
        click.echo(f"warning: not compared with what was measured: {error}", err=True)
        return ()
