"""The command ``bode``."""

from __future__ import annotations

from typing import Any

import click

from .emit import emit
from .help import group
from .options import actuator_argument, beam_option, load_option, output_options, outputs
from .paths import LongCommand


@click.command(
    cls=LongCommand,
    examples=(
        "bode paper --from 1mHz --to 10Hz --out bode.csv --plot bode.png",
        "bode fitted.toml --bias 1V --band",
    ),
)
@actuator_argument
@group(
    "Frequencies",
    click.option("--from", "low", default="1mHz", metavar="FREQUENCY", help="Lowest frequency."),
    click.option("--to", "high", default="10Hz", metavar="FREQUENCY", help="Highest frequency."),
    click.option(
        "--points",
        type=int,
        metavar="N",
        help="Number of frequencies, evenly spaced in logarithm.  [default: ten a decade]",
    ),
)
@beam_option
@load_option
@group(
    "Solver",
    click.option("--bias", default="0V", metavar="VOLTAGE", help="Constant voltage under the small signal."),
    click.option(
        "--engine",
        type=click.Choice(["exact", "ngspice"]),
        default="exact",
        help="exact: the circuit's equations solved directly.",
    ),
    click.option("--band", is_flag=True, help="Add standard errors from the covariance of a fitted strip."),
)
@output_options("CSV file to write: frequency_Hz, magnitudes per volt, phases.", "Plot to write (.png, .pdf, .svg).")
def bode(actuator: str, **options: Any) -> None:
    """Compute how displacement, current and force follow frequency."""
    from ..front.bode import bode as solve

    written = outputs(options)
    emit(solve(actuator, **options), written, inputs=[actuator])
