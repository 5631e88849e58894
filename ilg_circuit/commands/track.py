"""The command ``track``."""

from __future__ import annotations

from typing import Any

import click

from ..simulation.drives import MOTIONS
from .emit import emit
from .help import group
from .options import actuator_argument, beam_option, engine_option, load_option, output_options, outputs
from .paths import LongCommand


@click.command(
    cls=LongCommand,
    examples=(
        "track paper --path sine:3mm,5mHz --duration 400s --out drive.csv --plot track.png",
        "track fitted.toml --path file:path.csv --voltage 3V --slew 1V/s --band --json track.json",
        "track paper --quantity force --path sine:100nN,5mHz --duration 400s --out drive.csv --plot force.png",
        "track four.toml --quantity shape --path file:shape.csv --voltage 4V,4V,2V,2V --out drive.csv --plot shape.png",
    ),
    tables={"Forms of MOTION": MOTIONS},
)
@actuator_argument
@group(
    "Path",
    click.option(
        "--path",
        required=True,
        multiple=True,
        metavar="MOTION",
        help="Position of the tip, or its force, over time; forms below. Of a shape file:shape.csv, or for each of its "
        "targets TARGET=MOTION: displacement, angle, curvature_1 (of segment 1), ...",
    ),
    click.option(
        "--quantity",
        type=click.Choice(["displacement", "force", "shape"]),
        help="force: the blocked force of the clamped tip follows the path, with newtons in its forms: step:100nN. "
        "shape: the curvatures of segments, the angle, the displacement, with a voltage for each segment.  "
        "[default: displacement; of several targets shape]",
    ),
    click.option("--alike", is_flag=True, help="One voltage for all segments, for a shape."),
    click.option("--duration", metavar="TIME", help="How long, such as 300s.  [default: to the end of the file]"),
    click.option("--nodes", type=int, default=301, metavar="N", help="Points between which the voltage is straight."),
)
@group(
    "Limits",
    click.option(
        "--voltage",
        default="4V",
        metavar="VOLTAGE",
        help="Limit of the voltage, of either sign; of segments one for all, or 4V,3V,2V.",
    ),
    click.option("--slew", metavar="RATE", help="Limit of the voltage's rate, such as 1V/s; it starts from zero."),
    click.option("--current", metavar="CURRENT", help="Limit of the current, such as 50mA."),
    click.option("--energy", metavar="ENERGY", help="Limit of the energy delivered, such as 2J."),
)
@beam_option
@load_option
@engine_option
@group("Solver", click.option("--band", is_flag=True, help="Add the standard error, from the strip's fit."))
@output_options("CSV file of the voltage, for simulate --drive file:.", "Picture to write (.png, .pdf, .svg).")
def track(actuator: str, **options: Any) -> None:
    """Find the voltage that makes a strip's tip follow a path.

    The displacement, the blocked force, or the shape of a strip with segments comes as near to the path as the limits
    allow, in the mean square. A path that the strip cannot follow is a result, too: the warnings say by how much, and
    what holds it back.
    """
    from ..front.control import track as run
    from ..simulation.drives import target_paths

    path = options["path"] = target_paths(options["path"])
    written = outputs(options)
    tracked = run(actuator, **options)
    files = [path] if isinstance(path, str) else list(path.values())
    emit(
        tracked,
        written,
        inputs=(actuator, *(of.removeprefix("file:") for of in files)),
        writers={"--out": lambda result, path: result.write_drive(path)},
    )
