"""The command ``sense``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..simulation.drives import MOTION_FORMS

_OUT = click.Path(path_type=Path)


@click.command()
@click.argument("actuator")
@click.option("--motion", required=True, help=f"Of the point L_F: {MOTION_FORMS}.")
@click.option("--duration", required=True, help="Such as 300s.")
@click.option("--terminals", type=click.Choice(["open", "short"]), default="open", show_default=True)
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option("--samples", type=int, help="Number of samples.  [default: 601]")
@click.option("--step", help="Time between samples, such as 0.1s; instead of --samples.")
@click.option("--out", type=_OUT, help="CSV file to write.")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
def sense(actuator: str, motion: str, duration: str, step: str | None, **options: Any) -> None:
    """Move a strip's tip and write what its terminals show."""
    from ..files import require_writable
    from ..report.plots import plot_sensed, require_picture
    from ..simulation.drives import parse_drive
    from ..simulation.response import sample_times
    from ..simulation.sensing import sense as solve
    from ..strip.file import load_actuator
    from ..units import parse

    strip = load_actuator(actuator)
    seconds = parse(duration, "s", "--duration")
    times = sample_times(seconds, samples=options["samples"], step=parse(step, "s", "--step") if step else None)
    source = parse_drive(motion, seconds, "m")
    if options["out"]:
        require_writable(options["out"])
    if options["plot"]:
        require_picture(options["plot"])
    found = solve(strip, source, times, terminals=options["terminals"], engine=options["engine"])
    if options["out"]:
        found.write_csv(options["out"])
    if options["plot"]:
        plot_sensed(found, options["plot"])
    click.echo(f"{strip.name}, {options['terminals']} terminals: {source.text}, {seconds:g} s, {len(times)} samples")
    click.echo(found.summary())
    if found.engine == "ngspice":
        click.echo(f"solved by ngspice, estimated error {found.error:.1e} of each maximum")
