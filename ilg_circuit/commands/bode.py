"""The command ``bode``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from .completing import strips
from .emit import emit
from .help import argument, group
from .options import beam_option, load_option, output_options, outputs, reading_options
from .paths import FILE, LongCommand


@click.command(
    cls=LongCommand,
    examples=(
        "bode paper --from 1mHz --to 10Hz --out bode.csv --plot bode.png",
        "bode fitted.toml --bias 1V --band",
        "bode fitted.toml --record chirp.csv --record sine.csv --plot bode.png",
    ),
)
@group(
    "Input",
    argument(
        "actuator",
        "TOML file of a strip, or the preset paper; with --record it may be left out.",
        shell_complete=strips,
        required=False,
    ),
    click.option(
        "--record",
        multiple=True,
        type=FILE,
        help="Record of a sine, of sines one after another or together, of a chirp or of noise: find the response in "
        "it, and compare the strip's; may be repeated.",
    ),
)
@group(
    "Frequencies",
    click.option(
        "--from", "low", metavar="FREQUENCY", help="Lowest frequency.  [default: 1mHz; the lowest of the records]"
    ),
    click.option(
        "--to", "high", metavar="FREQUENCY", help="Highest frequency.  [default: 10Hz; the highest of the records]"
    ),
    click.option(
        "--points",
        type=int,
        metavar="N",
        help="Number of frequencies, evenly spaced in logarithm.  [default: ten a decade]",
    ),
)
@group(
    "Frequencies",
    click.option(
        "--skip",
        metavar="TIME",
        help="With --record: time at the beginning of sines that is left out.  [default: as long as periods differ]",
    ),
)
@beam_option
@load_option
@group(
    "Solver",
    click.option(
        "--bias", metavar="VOLTAGE", help="Constant voltage under the small signal.  [default: 0V; the records']"
    ),
    click.option(
        "--engine",
        type=click.Choice(["exact", "ngspice"]),
        default="exact",
        help="exact: the circuit's equations solved directly.",
    ),
    click.option("--band", is_flag=True, help="Add standard errors from the covariance of a fitted strip."),
)
@reading_options
@output_options("CSV file to write: frequency_Hz, magnitudes per volt, phases.", "Plot to write (.png, .pdf, .svg).")
def bode(actuator: str | None, record: tuple[Path, ...], **options: Any) -> None:
    """Compute how displacement, current and force follow frequency."""
    from ..front.bode import bode as solve
    from ..front.bode import bode_of

    written = outputs(options)
    own = {name: options.pop(name) for name in ("skip", "columns", "units", "part", "cycle")}
    options = {name: value for name, value in options.items() if value is not None}
    if record:
        if wrong := [name for name in ("points", "band") if options.pop(name, None)]:
            raise InputError(
                f"--{wrong[0]} does not go with --record, whose frequencies and bands are the record's own"
            )
        emit(bode_of(list(record), actuator, **options, **own), written, inputs=(*record, actuator))
        return
    if wrong := [name for name, value in own.items() if value]:
        raise InputError(f"--{wrong[0]} goes with --record")
    if actuator is None:
        raise InputError("give a strip, such as paper, or a record: --record chirp.csv")
    emit(solve(actuator, **options), written, inputs=[actuator])
