"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ..arrays import Array
    from ..circuit.strip import Load
    from ..strip.actuator import Actuator

FILE = click.Path(path_type=Path)

engine_option = click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
tip_option = click.option("--tip", type=click.Choice(["free", "clamped"]), default="free", show_default=True)
beam_option = click.option(
    "--beam",
    type=click.Choice(["dynamic", "static"]),
    help="static: without the beam's mass.  [default: the one that the coupling was fitted with, else dynamic]",
)


_RUN = (
    click.option(
        "--drive", required=True, help="step:4V, square:4V,30s[,duty], sine:2V,0.1Hz, ramp:1V/s, file:drive.csv"
    ),
    click.option("--duration", required=True, help="How long, such as 300s."),
    tip_option,
    beam_option,
    click.option("--load", "load_text", help="mass=1g,stiffness=1mN/m,damping=1uN*s/m: what hangs on the tip."),
)


_SAMPLES = (
    click.option("--samples", type=int, help="Number of samples.  [default: 601]"),
    click.option("--step", help="Time between samples, such as 0.1s; instead of --samples."),
)


def run_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say what a strip is made to do: drive, duration, tip, beam, load."""
    return _with(_RUN, command)


def sample_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say when a run is sampled; `sampled` reads them."""
    return _with(_SAMPLES, command)


def output_options(table: str, plot: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The options --out (with the help ``table``), --json, --plot and --report; `outputs` collects them."""
    options = (
        click.option("--out", type=FILE, help=table),
        click.option("--json", "json_path", type=FILE, help="JSON file of the result."),
        click.option("--plot", type=FILE, help=plot),
        click.option("--report", type=FILE, help="One HTML file with all of it."),
    )
    return lambda command: _with(options, command)


def _with(options: tuple[Callable[..., Any], ...], command: Callable[..., None]) -> Callable[..., None]:
    for option in reversed(options):
        command = option(command)
    return command


def outputs(options: dict[str, Any]) -> dict[str, Path | None]:
    """The files that `output_options` name, for `emit`."""
    return {f"--{name.removesuffix('_path')}": options[name] for name in ("out", "json_path", "plot", "report")}


def sampled(duration: str, options: dict[str, Any]) -> tuple[float, Array]:
    """Duration [s] and sample times [s] from ``--duration``, ``--samples`` and ``--step``."""
    from ..simulation.response import sample_times
    from ..units import parse

    seconds = parse(duration, "s", "--duration")
    step = parse(options["step"], "s", "--step") if options["step"] else None
    return seconds, sample_times(seconds, samples=options["samples"], step=step)


def beam_of(actuator: Actuator, given: str | None, load: Load | None) -> str:
    """The beam asked for, or the usual one of this actuator."""
    return given or actuator.usual_beam(loaded=bool(load))
