"""The command ``design``: the inverse problem."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError, SolveError
from .options import run_options, template_of
from .progress import progress_bar, simulation_counter

if TYPE_CHECKING:
    from ..study.design import DesignReport
    from ..study.problem import DesignProblem
    from ..study.quantities import Quantity
    from ..study.space import Counter, Space

_OUT = click.Path(path_type=Path)
_PICTURES = ("plot", "sobol_plot")


@click.command()
@click.argument("actuator")
@click.option(
    "--require",
    "required",
    multiple=True,
    metavar="NAME>=VALUE",
    help="displacement_final>=4mm, settling_time<=60s, energy=2J; or the word valid: where the model holds. Several.",
)
@click.option(
    "--vary", "varied", multiple=True, metavar="NAME=FROM:TO", help="thickness=0.2mm:1mm; width=5mm fixes it."
)
@click.option("--minimise", help="What is to be small, such as energy.  [default: the largest margin to all]")
@click.option("--maximise", help="What is to be large, such as displacement_final.")
@click.option("--pareto", help="Front of two or three: displacement_final,force_blocked,min:time_of_90.")
@click.option("--points", type=int, help="Points of the front.  [default: 25 of two, 60 of three]")
@run_options
@click.option(
    "--engine",
    type=click.Choice(["ngspice", "exact", "auto"]),
    default="auto",
    show_default=True,
    help="Of the search; auto: exact for linear circuits, else ngspice. ngspice always simulates the answer.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the scattered designs.")
@click.option("--sensitivity", is_flag=True, help="What the uncertainty of the fit makes of the design.")
@click.option(
    "--confidence", help="Meet each requirement with this probability, such as 95%, whatever the fit left open."
)
@click.option("--sobol", is_flag=True, help="Sobol indices of all that is asked for, over the ranges.")
@click.option("--json", "json_path", type=_OUT, help="JSON file to write.")
@click.option("--out", type=_OUT, help="TOML file of the best strip.")
@click.option("--front", "front_path", type=_OUT, help="CSV file of the front.")
@click.option("--plot", type=_OUT, help="Picture of the front, or of the design without one (.png, .pdf, .svg).")
@click.option("--sobol-plot", type=_OUT, help="Picture of the indices.")
def design(actuator: str, **options: Any) -> None:
    """Look for the strip, within ranges, that does what is required: best, or on a Pareto front.

    Requirements are on outputs of a sweep (displacement_final, force_blocked, settling_time, energy, current_peak,
    ...), on what is varied, and on slenderness, window, gravity. Where nothing meets all of them, the
    nearest strip is shown with what stands in its way, and the exit code is 1.
    """
    confidence = _confidence(options)
    _require_sense(options)
    from ..report.design_text import describe
    from ..study.design import write_design, write_front
    from ..study.threads import one_thread

    _require_paths(options)
    with simulation_counter() as count, one_thread():
        problem, findings = _find(actuator, options, confidence, count)
    feasible = findings.design is None or findings.design.feasible
    if options["json_path"]:
        findings.write_json(options["json_path"])
    if options["out"] and findings.design and feasible:
        write_design(findings.design, options["out"])
    if options["front_path"] and findings.front:
        write_front(findings.front, options["front_path"])
    _draw(findings, options)
    click.echo(describe(findings))
    for line in findings.warnings:
        click.echo(f"warning: {line}", err=True)
    if not feasible:
        asked = " and ".join(r.text for r in problem.requirements)
        raise SolveError(
            f"no design within the ranges meets {asked}; the nearest one is shown above"
            + (f" and '{options['out']}' is not written" if options["out"] else "")
        )


def _find(
    actuator: str, options: dict[str, Any], confidence: float | None, count: Counter
) -> tuple[DesignProblem, DesignReport]:
    from ..study.constraints import active_constraints, without_each_requirement
    from ..study.design import DesignReport
    from ..study.pareto import pareto_front, parse_objectives
    from ..study.problem import DesignProblem, Objective, best_design
    from ..study.quantities import quantity
    from ..study.requirements import parse_requirements
    from ..study.sensitivity import confident_design, sensitivity
    from ..study.sobol import sobol_indices

    space = _space(actuator, options, count)
    named, sense = (options["minimise"], 1) if options["minimise"] else (options["maximise"], -1)
    objective = Objective(quantity(named, space.names), sense) if named else None
    front_of = parse_objectives(options["pareto"], space.names) if options["pareto"] else ()
    requirements = parse_requirements(options["required"], space.names, space.template.actuator)
    wanted = DesignProblem(space, requirements, objective or (front_of[0] if front_of else None), options["seed"])
    best = bounds = left_out = sure = front = indices = None
    if objective or not front_of or any(r.maximised for r in requirements):
        problem = DesignProblem(space, requirements, objective, options["seed"])
        extra: tuple[Quantity, ...] = tuple(o.quantity for o in front_of)
        if space.template.actuator.coupling is not None:
            extra = (*extra, quantity("displacement_peak", space.names))
        best = confident_design(problem, confidence, extra) if confidence else best_design(problem, extra)
        bounds, left_out = active_constraints(best), [] if best.feasible else without_each_requirement(best)
        if options["sensitivity"] or confidence:
            sure = sensitivity(best)
        wanted = DesignProblem(space, best.problem.requirements, wanted.objective, options["seed"])
    if front_of and (best is None or best.feasible):
        front = pareto_front(wanted, front_of, points=options["points"], progress=ProgressBar("point"))
    if options["sobol"]:
        asked = {q.name: q for q in (*wanted.quantities, *(o.quantity for o in front_of)) if q.outputs}
        indices = sobol_indices(space, tuple(asked.values()), seed=options["seed"])
    return wanted, DesignReport(best, bounds or (), left_out or (), sure, confidence, front, indices)


def _space(actuator: str, options: dict[str, Any], count: Counter) -> Space:
    from ..study.space import Space, parse_ranges, resolve_engine

    template = template_of(actuator, options)
    template.parsed_drive()  # a drive that is no drive is told at once
    ranges, fixed = parse_ranges(options["varied"])
    return Space(template, ranges, fixed, resolve_engine(template, ranges, fixed, options["engine"]), count)


def _confidence(options: dict[str, Any]) -> float | None:
    from ..units import parse

    return parse(options["confidence"], "", "--confidence") if options["confidence"] else None


def _require_sense(options: dict[str, Any]) -> None:
    """Refuse options that contradict one another, or have nothing to say something about."""
    if options["minimise"] and options["maximise"]:
        raise InputError("--minimise and --maximise: give one of them, or --pareto for several")
    if not (options["required"] or options["minimise"] or options["maximise"]):
        if not options["pareto"]:
            raise InputError(
                "nothing is asked of the design; give --require displacement_final>=4mm, --minimise or --maximise, or "
                "--pareto"
            )
        given = next((n for n in ("out", "sensitivity", "confidence") if options[n]), None)
        if given:
            raise InputError(f"--{given} is about one best design; give --require, --minimise or --maximise too")
    if options["confidence"] and not options["required"]:
        raise InputError("--confidence is that of requirements; give --require")
    for name, needed in (("points", "pareto"), ("front_path", "pareto"), ("sobol_plot", "sobol")):
        if options[name] and not options[needed]:
            raise InputError(f"--{name.removesuffix('_path').replace('_', '-')} goes with --{needed}")


def _require_paths(options: dict[str, Any]) -> None:
    """Refuse files that cannot be written, and a missing library, before the work is done."""
    from ..extras import require_sensitivity
    from ..files import require_writable
    from ..report.axes import require_picture

    paths = [options[n].resolve() for n in ("json_path", "out", "front_path", *_PICTURES) if options[n]]
    if len(set(paths)) < len(paths):
        raise InputError("two of --json, --out, --front, --plot and --sobol-plot name the same file; give each its own")
    for name in ("json_path", "out", "front_path"):
        if options[name]:
            require_writable(options[name])
    for name in _PICTURES:
        if options[name]:
            require_picture(options[name])
    if options["sobol"]:
        require_sensitivity()


def _draw(findings: DesignReport, options: dict[str, Any]) -> None:
    from ..report.design import plot_design, plot_front, plot_sobol

    if options["plot"]:
        if findings.front:
            plot_front(findings.front, options["plot"], findings.design)
        elif findings.design:
            plot_design(findings.design, options["plot"])
    if options["sobol_plot"] and findings.sobol:
        plot_sobol(findings.sobol, options["sobol_plot"])
