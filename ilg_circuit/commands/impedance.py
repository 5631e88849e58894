"""The command ``impedance``."""

from __future__ import annotations

from typing import Any

import click

from .emit import emit
from .help import group
from .options import (
    actuator_argument,
    beam_option,
    engine_option,
    load_option,
    output_options,
    outputs,
    tip_option,
)
from .paths import LongCommand


@click.command(
    cls=LongCommand,
    examples=(
        "impedance paper --from 1mHz --to 100Hz --out z.csv --plot z.png",
        "impedance strip.toml --bias 1V --tip clamped --engine exact --check",
    ),
)
@actuator_argument
@group(
    "Frequencies",
    click.option("--from", "low", default="1mHz", metavar="FREQUENCY", help="Lowest frequency."),
    click.option("--to", "high", default="10kHz", metavar="FREQUENCY", help="Highest frequency."),
    click.option(
        "--points",
        type=int,
        metavar="N",
        help="Number of frequencies, evenly spaced in logarithm.  [default: ten a decade]",
    ),
)
@tip_option
@beam_option
@load_option
@group(
    "Solver",
    click.option("--bias", default="0V", metavar="VOLTAGE", help="Constant voltage under the small signal."),
    click.option(
        "--segment", type=int, metavar="K", help="Segment of a cut electrode, others at 0 V.  [default: all joined]"
    ),
)
@engine_option
@group("Solver", click.option("--check", is_flag=True, help="Compare with the other engine and the closed form."))
@output_options(
    "CSV file to write: frequency_Hz, re_ohm, im_ohm.", "Bode and Nyquist plot to write (.png, .pdf, .svg)."
)
def impedance(actuator: str, **options: Any) -> None:
    """Compute the impedance spectrum at a strip's terminals."""
    from ..front.runs import impedance as solve
    from ..report.impedance import text

    written = outputs(options)
    result = solve(actuator, **options)
    emit(result, written, inputs=[actuator], text=text(result))
