"""The command ``impedance``."""

from __future__ import annotations

from typing import Any

import click

from ..units import parse
from .emit import emit, show_check
from .options import beam_option, engine_option, mounted, output_options, outputs, tip_option
from .paths import LongCommand


@click.command(cls=LongCommand)
@click.argument("actuator")
@click.option("--from", "low", default="1mHz", help="Lowest frequency.")
@click.option("--to", "high", default="10kHz", help="Highest frequency.")
@click.option("--points", type=int, help="Number of frequencies, even in logarithm.  [default: ten a decade]")
@click.option("--bias", default="0V", help="Voltage about which the signal is small.")
@tip_option
@beam_option
@click.option("--load", help="What hangs on the tip, as for simulate.")
@engine_option
@click.option("--check", is_flag=True, help="Compare with the other engine and the closed form.")
@output_options(
    "CSV file to write: frequency_Hz, re_ohm, im_ohm.", "Bode and Nyquist plot to write (.png, .pdf, .svg)."
)
def impedance(actuator: str, low: str, high: str, **options: Any) -> None:
    """The small-signal spectrum at the strip's terminals, by AC analysis about a bias voltage."""
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
