"""The command ``sweep``: many strips, varied over grids, at random, or as a file lists them."""

from __future__ import annotations

from typing import Any

import click

from ..errors import InputError
from .emit import emit, origin
from .help import group
from .options import DRIVE_TABLE, NUMBER, SEED, actuator_argument, plot_option, run_options
from .paths import FILE, LOG, SWEEP, LongCommand
from .progress import ProgressBar


@click.command(
    cls=LongCommand,
    examples=(
        "sweep paper --vary thickness=0.2mm:1mm:20 --drive step:4V --duration 300s --out grid.nc",
        "sweep paper --vary thickness=0.2mm:1mm --vary width=2mm:9mm --random 200 --drive step:2V "
        "--duration 60s --outputs displacement_final,energy --out designs.csv",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@group(
    "Designs",
    click.option(
        "--vary",
        multiple=True,
        metavar="NAME=RANGE",
        help="What is varied: thickness=0.2mm:1mm:20 (20 values), thickness=0.2mm:1mm:20:log, or "
        "thickness=0.2mm,0.5mm,1mm; with --random thickness=0.2mm:1mm[:log]. May be repeated: all combinations.",
    ),
    click.option("--random", type=int, metavar="N", help="Number of random designs within the ranges of --vary."),
    click.option(
        "--method",
        type=click.Choice(["lhs", "sobol", "uniform"]),
        help="How random designs are drawn: Latin hypercube, Sobol sequence, independently.  [default: lhs]",
    ),
    click.option("--seed", type=SEED, help="Seed of the random designs.  [default: 0]"),
    click.option(
        "--designs", type=FILE, help="CSV file of designs instead: headers such as thickness_mm, one design a row."
    ),
)
@run_options
@group(
    "Solver",
    click.option(
        "--engine",
        type=click.Choice(["ngspice", "exact", "auto"]),
        help="auto: exact for linear circuits, ngspice for others.  [default: ngspice; exact where it is missing]",
    ),
    click.option("--accuracy", type=NUMBER, default=1e-6, help="Error allowed of ngspice, relative to each maximum."),
    click.option("--jobs", type=int, metavar="N", help="Number of processes.  [default: one a core]"),
    click.option(
        "--cluster", metavar="ADDRESS", help="Workers of a dask cluster: tcp://HOST:PORT, or local:4 for four here."
    ),
)
@group(
    "Output",
    click.option(
        "--outputs",
        metavar="NAMES",
        help="Numbers kept of each run, such as displacement_final,energy: displacement, force, current or charge with "
        "_final, _peak or _rms; relative_deflection, time_of_peak, overshoot, time_of_90, settling_time, "
        "force_blocked, force_blocked_peak, energy, voltage_final, voltage_peak.  [default: all but the blocked forces "
        "and the voltage]",
    ),
    click.option(
        "--waveforms", metavar="NAMES", help="Whole waveforms kept of each run: current,charge,displacement,force."
    ),
    click.option("--samples", type=int, metavar="N", help="Samples of each waveform.  [default: 601]"),
    click.option("--out", type=SWEEP, required=True, help="netCDF file to write; or CSV (.csv)."),
    click.option("--log", type=LOG, help="File to which one line per design is appended: time, number, outcome."),
)
@plot_option(
    "Picture to write (.png, .pdf, .svg).",
    click.option("--plot-outputs", metavar="NAMES", help="Outputs in the picture.  [default: up to four that differ]"),
)
def sweep(actuator: str, **options: Any) -> None:
    """Simulate many strips: on a grid, at random, or from a list.

    The results are one netCDF file with units. An interrupted sweep continues when it is started again. A design that
    fails is a row with its reason. What can be varied: the keys of an actuator's file; voltage, period, duty, frequency
    or rate of the drive; load_mass, load_stiffness, load_damping; orientation.
    """
    from ..report.sweep import figure
    from ..study.outputs import DEFAULT_OUTPUTS, names_of
    from ..study.sweep import sweep as solve

    plot, drawn = options.pop("plot"), names_of(options.pop("plot_outputs"))
    missing = [name for name in drawn if name not in (names_of(options["outputs"]) or DEFAULT_OUTPUTS)]
    if drawn and not plot:
        raise InputError("--plot-outputs goes with --plot; give a picture to write")
    if missing:
        raise InputError(f"--plot-outputs: '{missing[0]}' is not among the outputs of this sweep")
    seed = None if options["random"] is None else options["seed"] or 0
    inputs = [x for x in (actuator, options["drive"].removeprefix("file:"), options["designs"]) if x]
    made_by = origin(inputs, seed)
    result = solve(actuator, progress=ProgressBar("design", begun=True), provenance=made_by, **options)
    shown = {"--plot": lambda made: figure(made, drawn)}
    emit(result, {"--plot": plot}, inputs=inputs, seed=seed, shown=shown)
