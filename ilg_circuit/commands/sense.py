"""The command ``sense``."""

from __future__ import annotations

from typing import Any

import click

from ..simulation.drives import MOTIONS
from .emit import emit
from .help import group
from .options import (
    actuator_argument,
    engine_option,
    output_options,
    outputs,
    reading_options,
    sample_options,
)
from .paths import LongCommand


@click.command(
    cls=LongCommand,
    examples=(
        "sense paper --motion sine:1mm,0.1Hz --duration 60s --out sensed.csv --plot sensed.png",
        "sense strip.toml --motion file:motion.csv --duration 20s --terminals short --engine exact",
    ),
    tables={"Forms of MOTION": MOTIONS},
)
@actuator_argument
@group(
    "Motion",
    click.option(
        "--motion",
        required=True,
        metavar="MOTION",
        help="Position over time of the point L_F, where the laser reads; its forms are listed below.",
    ),
    click.option("--duration", required=True, metavar="TIME", help="How long the run is, such as 300s."),
    click.option(
        "--terminals",
        type=click.Choice(["open", "short"]),
        default="open",
        help="open: the voltage between them is computed; short: the current through them.",
    ),
)
@sample_options
@engine_option
@reading_options
@output_options("CSV file to write.", "Picture to write (.png, .pdf, .svg).")
def sense(actuator: str, **options: Any) -> None:
    """Move a strip's tip; compute the voltage or current it makes."""
    from ..front.runs import sense as solve
    from ..report.sensing import text

    written = outputs(options)
    result = solve(actuator, **options)
    emit(result, written, inputs=(actuator, options["motion"].removeprefix("file:")), text=text(result))
