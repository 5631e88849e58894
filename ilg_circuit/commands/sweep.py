"""The command ``sweep``: many strips, varied over grids, at random, or as a file lists them."""

from __future__ import annotations

import math
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from .options import run_options, template_of
from .progress import progress_bar

if TYPE_CHECKING:
    from ..study.plan import Plan
    from ..study.spec import SweepSpec
    from ..study.sweep import Swept

_OUT = click.Path(path_type=Path)
_MOST_REASONS = 5
#: Up to so many varied parameters a design is named by their values.
_MOST_NAMED = 3


@click.command()
@click.argument("actuator")
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="NAME=...",
    help="thickness=0.2mm:1mm:20[:log], thickness=0.2mm,0.5mm,1mm; with --random thickness=0.2mm:1mm[:log]. Several "
    "make a full grid.",
)
@click.option("--random", "count", type=int, help="So many random designs over the ranges of --vary.")
@click.option("--method", type=click.Choice(["lhs", "sobol", "uniform"]), help="Of random designs.  [default: lhs]")
@click.option("--seed", type=int, help="Of random designs.  [default: 0]")
@click.option("--designs", type=_OUT, help="CSV file of designs instead: headers such as thickness_mm, a design a row.")
@run_options
@click.option(
    "--outputs", help="Names, such as displacement_final,settling_time,force_blocked.  [default: all of one run]"
)
@click.option("--waveforms", help="Keep whole waveforms: current,charge,displacement,force.")
@click.option("--samples", type=int, help="Samples of each waveform.  [default: 601]")
@click.option(
    "--engine",
    type=click.Choice(["ngspice", "exact", "auto"]),
    default="ngspice",
    show_default=True,
    help="auto: exact for linear circuits, ngspice for others.",
)
@click.option("--accuracy", type=float, default=1e-6, show_default=True, help="Of ngspice, relative to each maximum.")
@click.option("--jobs", type=int, help="Processes.  [default: one a core]")
@click.option("--cluster", help="Workers of a dask cluster: tcp://HOST:PORT, or local:4.")
@click.option("--out", type=_OUT, required=True, help="netCDF file to write.")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
@click.option("--plot-outputs", help="What the picture shows.  [default: up to four that differ]")
def sweep(actuator: str, **options: Any) -> None:
    """Vary a strip, its drive or its load, and write what each design does: one netCDF file with units.

    A sweep that was interrupted goes on where it was when it is started again. A design that fails is a row with its
    reason. What can be varied: the keys of an actuator's file, voltage, period, duty, frequency or rate of the drive,
    load_mass, load_stiffness, load_damping, orientation.
    """
    from ..extras import require_study
    from ..files import require_writable
    from ..report.axes import require_picture
    from ..study.sweep import sweep as solve

    require_study(cluster=bool(options["cluster"]))
    spec = _spec(actuator, options)
    require_writable(options["out"])
    drawn = _names(options["plot_outputs"])
    if options["plot"]:
        require_picture(options["plot"])
        if options["plot"].resolve() == options["out"].resolve():
            raise InputError("--out and --plot name the same file; give each its own")
        if drawn and not set(drawn) <= set(spec.outputs):
            missing = next(n for n in drawn if n not in spec.outputs)
            raise InputError(f"--plot-outputs: '{missing}' is not among the outputs of this sweep")
    elif drawn:
        raise InputError("--plot-outputs goes with --plot; give a picture to write")
    done = solve(
        spec,
        options["out"],
        jobs=options["jobs"],
        cluster=options["cluster"],
        progress=ProgressBar("design", begun=True),
        command="ilg-circuit " + shlex.join(sys.argv[1:]),
    )
    _report(spec, done)
    if options["plot"]:
        from ..report.sweep import plot_sweep

        plot_sweep(options["out"], options["plot"], drawn)


def _spec(actuator: str, options: dict[str, Any]) -> SweepSpec:
    from ..study.outputs import DEFAULT_OUTPUTS
    from ..study.spec import SweepSpec

    template = template_of(actuator, options)
    waveforms = _names(options["waveforms"])
    if options["samples"] is not None and not waveforms:
        raise InputError("--samples are those of --waveforms; say which to keep, such as --waveforms displacement")
    return SweepSpec(
        template,
        _plan(options),
        _names(options["outputs"]) or DEFAULT_OUTPUTS,
        options["engine"],
        options["accuracy"],
        waveforms,
        options["samples"] or 601,
    )


def _plan(options: dict[str, Any]) -> Plan:
    from ..study.plan import grid_plan, random_plan, read_plan

    if options["count"] is None:
        given = next((n for n in ("method", "seed") if options[n] is not None), None)
        if given:
            raise InputError(f"--{given} belongs to --random; say how many random designs")
    if options["designs"]:
        if options["varied"] or options["count"] is not None:
            raise InputError("--designs lists every design; leave out --vary and --random")
        return read_plan(options["designs"])
    if options["count"] is None:
        return grid_plan(options["varied"])
    return random_plan(options["varied"], options["count"], options["method"] or "lhs", options["seed"] or 0)


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(dict.fromkeys(n.strip() for n in text.split(",") if n.strip())) if text else ()


def _report(spec: SweepSpec, done: Swept) -> None:
    """What came of it, in short."""
    from ..strip.validity import deflection_warnings
    from ..study.outputs import OUTPUTS
    from ..units import format_quantity

    summary = done.summary
    solved = summary.count - summary.failed
    click.echo(f"{spec.plan.text}: {solved} of {summary.count} designs solved into {done.path}")
    if done.resumed:
        click.echo(f"{done.resumed} of them by an earlier run, which this one continued")
    if done.leftover:
        click.echo(f"'{done.leftover}' holds an interrupted sweep with other settings; remove it if you will not go on")
    if summary.worst_error:
        click.echo(f"solved by ngspice, estimated error at most {summary.worst_error:.1e} of each maximum")
    if summary.failed:
        click.echo(f"{summary.failed} failed, with their reasons in the variable 'failure':")
        for times, example in sorted(summary.reasons.values(), reverse=True)[:_MOST_REASONS]:
            click.echo(f"  {times} x {example}" if times == 1 else f"  {times} like: {example}")
        if len(summary.reasons) > _MOST_REASONS:
            click.echo(f"  and {len(summary.reasons) - _MOST_REASONS} other reasons")
    rows = [("output", "lowest", "with", "highest", "with")]
    for name in spec.outputs:
        if name not in summary.lowest:
            rows.append((name, "not known", "", "", ""))
            continue
        (low, first), (high, last) = summary.lowest[name], summary.highest[name]
        unit = OUTPUTS[name].unit
        if math.isclose(low, high, rel_tol=1e-9):
            rows.append((name, format_quantity(low, unit, 5), "all alike", "", ""))
            continue
        ends = format_quantity(low, unit, 5), format_quantity(high, unit, 5)
        rows.append((name, ends[0], _design(spec.plan, first), ends[1], _design(spec.plan, last)))
    widths = [max(len(row[k]) for row in rows) for k in range(5)]
    for row in rows:
        cells = (
            cell.rjust(w) if k in (1, 3) else cell.ljust(w) for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        click.echo("  ".join(cells).rstrip())
    for line in deflection_warnings(summary.bent):
        click.echo(f"warning: {line}", err=True)


def _design(plan: Plan, number: int) -> str:
    """A design in a few words, or its number where they would be many."""
    if len(plan.columns) > _MOST_NAMED:
        return f"design {number}"
    from ..study.parameters import PARAMETERS
    from ..units import format_quantity

    values = {name: column[0] for name, column in plan.designs(number, number + 1).items()}
    return ", ".join(
        f"{name} {value if PARAMETERS[name].words else format_quantity(float(value), PARAMETERS[name].unit, 4)}"
        for name, value in values.items()
    )
