"""The command ``design``: the inverse problem."""

from __future__ import annotations

from typing import Any

import click

from ..errors import InputError, SolveError
from .emit import emit
from .help import group
from .options import DRIVE_TABLE, SEED, actuator_argument, plot_option, run_options
from .paths import JSON, PICTURE, STRIP, TABLE, LongCommand, force_option
from .progress import ProgressBar


@click.command(
    cls=LongCommand,
    examples=(
        "design paper --require 'displacement_final>=4mm' --vary thickness=0.2mm:1mm --drive step:4V "
        "--duration 300s --out best.toml",
        "design paper --pareto displacement_final,force_blocked --vary thickness=0.2mm:1mm "
        "--drive step:4V --duration 300s --front front.csv --plot front.png",
    ),
    tables=DRIVE_TABLE,
)
@actuator_argument
@group(
    "Design",
    click.option("--vary", multiple=True, metavar="NAME=FROM:TO", help="thickness=0.2mm:1mm; width=5mm fixes it."),
    click.option(
        "--require",
        multiple=True,
        metavar="NAME>=VALUE",
        help="displacement_final>=4mm, settling_time<=60s, energy=2J; or the word valid: within the model's limits. "
        "May be repeated.",
    ),
    click.option(
        "--minimise",
        metavar="NAME",
        help="Output to make small, such as energy.  [default: the largest margin to all requirements]",
    ),
    click.option("--maximise", metavar="NAME", help="Output to make large, such as displacement_final."),
    click.option(
        "--pareto",
        metavar="NAMES",
        help="Trade-off between two or three outputs: displacement_final,force_blocked,min:time_of_90.",
    ),
    click.option(
        "--points", type=int, metavar="N", help="Points of the front.  [default: 25 for two outputs, 60 for three]"
    ),
)
@run_options
@group(
    "Uncertainty",
    click.option("--sensitivity", is_flag=True, help="Spread of the design's outputs from the errors of the fit."),
    click.option(
        "--confidence",
        metavar="PERCENT",
        help="Meet each requirement with this probability, such as 95%, given the errors of the fit.",
    ),
    click.option("--sobol", is_flag=True, help="Sobol indices of all outputs asked for, over the ranges."),
)
@group(
    "Solver",
    click.option(
        "--engine",
        type=click.Choice(["ngspice", "exact", "auto"]),
        default="auto",
        help="Solver of the search; auto: exact for linear circuits, else ngspice, which always simulates the answer.",
    ),
    click.option("--seed", type=SEED, default=0, help="Seed of the search's first designs."),
)
@group(
    "Output",
    click.option("--json", type=JSON, help="JSON file to write."),
    click.option("--out", type=STRIP, help="TOML file of the best strip."),
    click.option("--front", type=TABLE, help="CSV file of the front."),
)
@plot_option(
    "Picture of the front, or of the design without one (.png, .pdf, .svg).",
    click.option("--sobol-plot", type=PICTURE, help="Picture of the Sobol indices."),
)
@force_option
def design(actuator: str, **options: Any) -> None:
    """Find the strip, within ranges, that meets requirements best.

    Requirements limit outputs (displacement_final, settling_time and others, listed by sweep --help), varied values,
    or the validity numbers slenderness, window and gravity. If no strip meets all of them, the nearest one is shown
    with the requirements that it fails, and the exit code is 1.
    """
    written = ("json", "out", "front", "plot", "sobol_plot")
    outputs = {f"--{name.replace('_', '-')}": options.pop(name) for name in written}
    _require_consistent(options, outputs)
    from ..extras import require_sensitivity
    from ..report.axes import save
    from ..report.design import sobol_figure
    from ..study.design import design as find

    if options["sobol"]:
        require_sensitivity()
    progress = ProgressBar("point") if options["pareto"] else None
    with ProgressBar("simulation", doing="searching") as bar:
        report = find(actuator, count=bar.count, progress=progress, **options)
    emit(
        report,
        outputs,
        inputs=(actuator, options["drive"].removeprefix("file:")),
        seed=options["seed"],
        writers={
            "--out": lambda result, path: result.write_strip(path) if result.feasible else None,
            "--front": lambda result, path: result.front.write_csv(path) if result.front else None,
            "--sobol-plot": lambda result, path: (
                save(sobol_figure(result.sobol), path, result.provenance) if result.sobol else None
            ),
        },
    )
    if report.design and not report.feasible:
        asked = " and ".join(r.text for r in report.design.problem.requirements)
        raise SolveError(
            f"no design within the ranges meets {asked}; the nearest one is shown above"
            + (f" and '{outputs['--out']}' is not written" if outputs["--out"] else "")
        )


def _require_consistent(options: dict[str, Any], outputs: dict[str, Any]) -> None:
    """Refuse options that have no effect."""
    if options["pareto"] and not (options["require"] or options["minimise"] or options["maximise"]):
        given = {"out": outputs["--out"], "sensitivity": options["sensitivity"], "confidence": options["confidence"]}
        for name in (name for name, value in given.items() if value):
            raise InputError(f"--{name} is about one best design; give --require, --minimise or --maximise too")
    for name, needed in (("--front", "pareto"), ("--sobol-plot", "sobol")):
        if outputs[name] and not options[needed]:
            raise InputError(f"{name} goes with --{needed}")
