"""The command ``simulate``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ..simulation.mechanics import MECHANICS
from .emit import emit
from .help import group
from .options import (
    DRIVE_TABLE,
    NUMBER,
    actuator_argument,
    engine_option,
    output_options,
    outputs,
    reading_options,
    sample_options,
    segment_run_options,
)
from .paths import ANY, FILE, PICTURE, TABLE, LongCommand
from .progress import ProgressBar

if TYPE_CHECKING:
    from ..simulation.response import Response
    from ..simulation.shape import Shape


@click.command(
    cls=LongCommand,
    examples=(
        "simulate paper --drive step:4V --duration 300s --out run.csv --plot run.png",
        "simulate strip.toml --drive square:-2V..2V,30s --duration 2min --tip clamped --check",
        "simulate fitted.toml --drive file:record.csv --duration 60s --band --report run.html",
        "simulate four.toml --drive 1=step:4V --drive 2=square:-4V..4V,30s --duration 60s --out run.csv",
        "simulate strip.toml --drive square:-4V..4V,30s --duration 2min --shape shape.csv --animate strip.gif",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@segment_run_options
@sample_options
@engine_option
@group(
    "Solver",
    click.option(
        "--accuracy",
        type=NUMBER,
        help="Error allowed, relative to each maximum.  [default: 1e-09; with nonlinear elements 1e-06]",
    ),
    click.option("--check", is_flag=True, help="Compare with the other engine and the closed forms."),
    click.option("--band", is_flag=True, help="Add standard errors, from the fit that the strip comes from."),
)
@group(
    "Data files",
    click.option(
        "--compare", type=FILE, help="Measured record to compare with.  [default: the drive's file, if it holds one]"
    ),
)
@reading_options
@group("Output", click.option("--with-energy", is_flag=True, help="Add a column energy_J to the CSV file."))
@output_options("CSV file to write.", "Picture to write (.png, .pdf, .svg).")
@group(
    "Shape",
    click.option("--shape", type=TABLE, help="CSV file to write: time, distance s along the strip, x, y, theta."),
    click.option("--plot-shape", type=PICTURE, help="Picture of the strip at several instants (.png, .pdf, .svg)."),
    click.option("--animate", "animation", type=ANY, help="Animation of the strip (.gif, or .mp4 where ffmpeg is)."),
    click.option(
        "--mechanics",
        type=click.Choice(MECHANICS),
        help="elastica: at rest in each instant under weight and load; free: without these; arm: with inertia.  "
        "[default: elastica]",
    ),
)
def simulate(
    actuator: str,
    compare: Path | None,
    with_energy: bool,
    shape: Path | None,
    plot_shape: Path | None,
    animation: Path | None,
    mechanics: str | None,
    **options: Any,
) -> None:
    """Simulate a strip's current, displacement, force and charge.

    Where the drive is a file that holds a measured current (and displacement) too, the prediction is compared with it.
    """
    from ..front.runs import simulate as run
    from ..report.animation import require_animation
    from ..report.response import text
    from ..simulation.drives import segment_drives

    shaped = {"--shape": shape, "--plot-shape": plot_shape, "--animate": animation}
    if mechanics and not any(shaped.values()):
        raise InputError("--mechanics is that of a shape; ask for one with --shape, --plot-shape or --animate")
    if animation:
        require_animation(animation)
    drive = options["drive"] = segment_drives(options["drive"])
    files = [drive] if isinstance(drive, str) else list(drive.values())
    written = outputs(options) | shaped
    # the drive's file is compared with where it holds a measurement
    response = run(actuator, compare=compare or True, progress=ProgressBar(), **options)
    lines, warnings, writers = [text(response)], [*response.warnings], {}
    if any(shaped.values()):
        from ..front.shapes import shape as shape_of

        found = shape_of(response, mechanics or "elastica")
        lines, warnings = [*lines, found.summary()], [*warnings, *found.warnings]
        writers = shape_writers(found)
    emit(
        response,
        written,
        inputs=(actuator, *(of.removeprefix("file:") for of in files), compare),
        writers={"--out": lambda result, path: result.write_csv(path, energy=with_energy), **writers},
        text="\n".join(lines),
        warnings=warnings,
    )


def shape_writers(found: Shape) -> dict[str, Callable[[Response, Path], object]]:
    """Return what writes a shape, by option, with the provenance of the response that it belongs to."""
    from ..report.axes import save
    from ..report.shape import animate

    return {
        "--shape": lambda _, path: found.write_csv(path),
        "--plot-shape": lambda made, path: save(found.figure(), path, made.provenance),
        "--animate": lambda _, path: animate(found, path),
    }
