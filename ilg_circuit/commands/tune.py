"""The command ``tune``."""

from __future__ import annotations

from typing import Any

import click

from ..errors import SolveError
from .emit import emit
from .help import group
from .options import NUMBER, SEED, actuator_argument, beam_option, load_option, output_options, outputs
from .paths import FILE, LongCommand
from .progress import ProgressBar

#: Limit of the voltage, for commands that control a strip.
limit_option = click.option("--voltage", default="4V", metavar="VOLTAGE", help="Limit of the voltage, of either sign.")
#: Delay of the measurement.
delay_option = click.option("--delay", default="0s", metavar="TIME", help="Delay of the measurement, such as 40ms.")


@click.command(
    cls=LongCommand,
    examples=(
        "tune fitted.toml --step 3mm --kind lqg --delay 40ms --json tuned.json --plot tuned.png",
        "tune paper --step 3mm --gains gain=20V/mm,reset_time=10s --beam static",
    ),
)
@actuator_argument
@group(
    "Controller",
    click.option("--step", required=True, metavar="LENGTH", help="Step of the position, such as 3mm."),
    click.option(
        "--kind",
        type=click.Choice(["pi", "pid", "lqg", "adrc"]),
        default="pi",
        help="PI; PID; a regulator behind a Kalman filter; active disturbance rejection.",
    ),
    click.option("--to", metavar="GOAL", help="settling=30s or bandwidth=20mHz.  [default: the soonest settling]"),
    click.option(
        "--gains", metavar="GAINS", help="Gains to judge in place of tuned ones, such as gain=20V/mm,reset_time=10s."
    ),
    click.option("--controller", type=FILE, help="JSON file of tune, for any strip, to judge in place of tuned gains."),
    click.option(
        "--anti-windup",
        type=click.Choice(["back-calculation", "clamping", "none"]),
        default="back-calculation",
        help="What keeps the integral from winding up; clamping holds it within the limit.",
    ),
    click.option(
        "--tracking-time", metavar="TIME", help="Time constant of back-calculation.  [default: the reset time]"
    ),
)
@group(
    "Limits",
    limit_option,
    delay_option,
    click.option("--sensitivity", type=NUMBER, default=1.6, help="Largest abs(S) allowed at every sample."),
    click.option("--overshoot", default="5%", metavar="PERCENT", help="Largest overshoot allowed."),
)
@beam_option
@load_option
@group(
    "Uncertainty",
    click.option(
        "--draws", type=int, metavar="N", help="Samples of the fit's covariance.  [default: 200, none without a fit]"
    ),
    click.option("--seed", type=SEED, default=0, help="Seed of the samples and of the search."),
)
@output_options("CSV file of the step response.", "Picture to write (.png, .pdf, .svg).")
def tune(actuator: str, **options: Any) -> None:
    """Tune a position controller that is robust over a strip's fit.

    The controller settles a step of the position as soon as it can, or in the time that --to gives, at every sample
    of the fit's covariance with abs(S) below --sensitivity. Where it cannot, or where the controller of --gains or
    --controller does not, the exit code is 1.
    """
    from ..front.tuning import tune as run

    written = outputs(options)
    with ProgressBar("round", doing="tuning") as bar:
        tuned = run(actuator, progress=bar, **options)
    given = options["controller"]
    emit(tuned, written, inputs=(actuator, *([given] if given else [])), seed=options["seed"])
    if not tuned.met:
        raise SolveError("the controller above is not what was asked for; the warnings say why")
