"""The command ``sense``."""

from __future__ import annotations

from typing import Any

import click

from ..simulation.drives import MOTION_FORMS
from .emit import emit
from .options import engine_option, output_options, outputs, reading_options, said, sample_options, sampled
from .paths import LongCommand


@click.command(cls=LongCommand)
@click.argument("actuator")
@click.option("--motion", required=True, help=f"Of the point L_F: {MOTION_FORMS}.")
@click.option("--duration", required=True, help="Such as 300s.")
@click.option("--terminals", type=click.Choice(["open", "short"]), default="open")
@engine_option
@sample_options
@reading_options
@output_options("CSV file to write.", "Picture to write (.png, .pdf, .svg).")
def sense(actuator: str, motion: str, duration: str, **options: Any) -> None:
    """Move a strip's tip and write what its terminals show."""
    from ..report.sensing import text
    from ..simulation.drives import parse_drive
    from ..simulation.sensing import sense as solve
    from ..strip.file import load_actuator

    strip = load_actuator(actuator)
    seconds, times = sampled(duration, options)
    source = parse_drive(motion, seconds, "m", said(options))
    written = outputs(options)
    result = solve(strip, source, times, terminals=options["terminals"], engine=options["engine"])
    emit(result, written, inputs=(actuator, motion.removeprefix("file:")), text=text(result))
