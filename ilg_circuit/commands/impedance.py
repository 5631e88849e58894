"""The command ``impedance``."""

from __future__ import annotations

from typing import Any

import click

from ..units import parse
from .emit import emit, show_check
from .help import group
from .options import (
    actuator_argument,
    beam_option,
    engine_option,
    load_option,
    mounted,
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
)
@engine_option
@group("Solver", click.option("--check", is_flag=True, help="Compare with the other engine and the closed form."))
@output_options(
    "CSV file to write: frequency_Hz, re_ohm, im_ohm.", "Bode and Nyquist plot to write (.png, .pdf, .svg)."
)
def impedance(actuator: str, low: str, high: str, **options: Any) -> None:
    """Compute the impedance spectrum at a strip's terminals."""
    from ..report.impedance import text
    from ..simulation.impedance import frequencies
    from ..simulation.impedance import impedance as solve
    from ..strip.file import load_actuator

    strip = load_actuator(actuator)
    f = frequencies(parse(low, "Hz", "--from"), parse(high, "Hz", "--to"), options["points"])
    written = outputs(options)
    how = mounted(options) | {"bias": parse(options["bias"], "V", "--bias")}
    result = solve(strip, f, engine=options["engine"], **how)
    emit(result, written, inputs=[actuator], text=text(result))
    if options["check"]:
        from ..simulation.check import check_impedance

        show_check(check_impedance(result, **how))
