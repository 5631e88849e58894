"""The command ``design``: the inverse problem."""

from __future__ import annotations

from typing import Any

import click

from ..errors import InputError, SolveError
from .emit import emit
from .options import SEED, run_options
from .paths import JSON, PICTURE, STRIP, TABLE, LongCommand, force_option
from .progress import ProgressBar


@click.command(cls=LongCommand)
@click.argument("actuator")
@click.option(
    "--require",
    multiple=True,
    metavar="NAME>=VALUE",
    help="displacement_final>=4mm, settling_time<=60s, energy=2J; or the word valid: where the model holds. Several.",
)
@click.option("--vary", multiple=True, metavar="NAME=FROM:TO", help="thickness=0.2mm:1mm; width=5mm fixes it.")
@click.option("--minimise", help="What is to be small, such as energy.  [default: the largest margin to all]")
@click.option("--maximise", help="What is to be large, such as displacement_final.")
@click.option("--pareto", help="Front of two or three: displacement_final,force_blocked,min:time_of_90.")
@click.option("--points", type=int, help="Points of the front.  [default: 25 of two, 60 of three]")
@run_options
@click.option(
    "--engine",
    type=click.Choice(["ngspice", "exact", "auto"]),
    default="auto",
    help="Of the search; auto: exact for linear circuits, else ngspice. ngspice always simulates the answer.",
)
@click.option("--seed", type=SEED, default=0, help="Of the scattered designs.")
@click.option("--sensitivity", is_flag=True, help="What the uncertainty of the fit makes of the design.")
@click.option(
    "--confidence", help="Meet each requirement with this probability, such as 95%, whatever the fit left open."
)
@click.option("--sobol", is_flag=True, help="Sobol indices of all that is asked for, over the ranges.")
@click.option("--json", type=JSON, help="JSON file to write.")
@click.option("--out", type=STRIP, help="TOML file of the best strip.")
@click.option("--front", type=TABLE, help="CSV file of the front.")
@click.option("--plot", type=PICTURE, help="Picture of the front, or of the design without one (.png, .pdf, .svg).")
@click.option("--sobol-plot", type=PICTURE, help="Picture of the indices.")
@force_option
def design(actuator: str, **options: Any) -> None:
    """Look for the strip, within ranges, that does what is required: best, or on a Pareto front.

    Requirements are on outputs of a sweep (displacement_final, force_blocked, settling_time, energy, current_peak,
    ...), on what is varied, and on slenderness, window, gravity. Where nothing meets all of them, the
    nearest strip is shown with what stands in its way, and the exit code is 1.
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
