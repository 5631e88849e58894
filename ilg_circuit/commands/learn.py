"""The command ``learn``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..simulation.drives import MOTIONS
from .emit import emit
from .help import group
from .options import NUMBER, SEED, actuator_argument, beam_option, load_option, output_options, outputs
from .paths import FILE, LongCommand
from .tune import limit_option


@click.command(
    cls=LongCommand,
    examples=(
        "learn fitted.toml --path triangle:2mm,100s --duration 400s --out trial_0.csv --plot learn.png",
        "learn fitted.toml --path triangle:2mm,100s --duration 400s --trial measured_0.csv --out trial_1.csv",
    ),
    tables={"Forms of MOTION": MOTIONS},
)
@actuator_argument
@group(
    "Path",
    click.option(
        "--path", required=True, metavar="MOTION", help="Position of the tip over time; its forms are listed below."
    ),
    click.option("--duration", metavar="TIME", help="How long a trial is, such as 400s.  [default: to the file's end]"),
    click.option("--nodes", type=int, default=201, metavar="N", help="Points between which the voltage is straight."),
)
@group(
    "Learning",
    click.option("--trials", type=int, default=10, metavar="N", help="Number of trials after the first."),
    click.option(
        "--bandwidth",
        metavar="FREQUENCY",
        help="Highest frequency that is learnt.  [default: a fifth of the nodes a second]",
    ),
    click.option(
        "--gain",
        type=NUMBER,
        default=1.0,
        help="Part of the correction that is made, above 0 and below 2; less learns slower, and less of the noise.",
    ),
    click.option(
        "--trial",
        type=FILE,
        help="CSV file of a measured trial, from rest: time, voltage, displacement. --out is then what follows it.",
    ),
)
@group("Limits", limit_option)
@beam_option
@load_option
@group(
    "Uncertainty",
    click.option(
        "--draws", type=int, metavar="N", help="Samples of the fit's covariance.  [default: 200, none without a fit]"
    ),
    click.option("--seed", type=SEED, default=0, help="Seed of the samples."),
)
@output_options("CSV file of the next trial's voltage, for simulate.", "Picture to write (.png, .pdf, .svg).")
def learn(actuator: str, trial: Path | None, **options: Any) -> None:
    """Learn the voltage for a path over repeated trials.

    The factor by which the error falls each trial is computed for samples of the fit's covariance, before any trial;
    where it is 1 or more, or the voltage meets its limit, nothing is promised. Each trial begins at rest.
    """
    from ..front.learning import learn as run

    written = outputs(options)
    learned = run(actuator, trial=trial, **options)
    emit(
        learned,
        written,
        inputs=(actuator, options["path"].removeprefix("file:"), *([trial] if trial else [])),
        seed=options["seed"],
        writers={"--out": lambda result, path: result.write_drive(path)},
    )
