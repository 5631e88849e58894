"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ..simulation.drives import DRIVE_FORMS
from ..units import parse, si
from .paths import FILE, JSON, PAGE, PICTURE, TABLE, OutputFile

if TYPE_CHECKING:
    from ..arrays import Array
    from ..measurements.said import Said


class _Number(click.types.FloatParamType):
    """A pure number of a plausible size."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        name = param.opts[-1] if param else "number"
        try:
            return si(value, "", name)
        except InputError as error:
            self.fail(str(error).removeprefix(name).lstrip(": "), param, ctx)


class _Seed(click.types.IntParamType):
    """What begins random numbers: any count of 63 bits."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        number: int = super().convert(value, param, ctx)
        return number if 0 <= number < 2**63 else self.fail("give a whole number from 0 to 2^63 - 1", param, ctx)


NUMBER, SEED = _Number(), _Seed()

engine_option = click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice")
tip_option = click.option("--tip", type=click.Choice(["free", "clamped"]), default="free")
beam_option = click.option(
    "--beam",
    type=click.Choice(["dynamic", "static"]),
    help="static: without the beam's mass.  [default: the one that the coupling was fitted with, else dynamic]",
)


def _together(*options: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return one decorator for several options, which stand in the help in this order."""
    return lambda command: reduce(lambda decorated, option: option(decorated), reversed(options), command)


#: What a strip is made to do.
run_options = _together(
    click.option("--drive", required=True, help=DRIVE_FORMS),
    click.option("--duration", required=True, help="How long, such as 300s."),
    tip_option,
    beam_option,
    click.option("--load", help="mass=1g,stiffness=1mN/m,damping=1uN*s/m: what hangs on the tip."),
)

#: What a data file does not say of itself; `said` reads them.
reading_options = _together(
    click.option(
        "--columns", multiple=True, help="The column that holds a quantity: voltage='Potential (V)'; may be repeated."
    ),
    click.option("--units", multiple=True, help="The unit of a quantity, such as time=s; may be repeated."),
    click.option("--part", help="Which of several measurements in a file, from 1; or the point that a camera tracked."),
    click.option("--cycle", type=int, help="Which cycle of a record."),
)


def said(options: dict[str, Any]) -> Said:
    """Return what `reading_options` say (and --length, --section, `displacement_options`); ``options`` lose them."""
    from ..measurements.said import said_of

    def size(name: str, unit: str) -> float | None:
        text = options.pop(name, None)
        return parse(text, unit, f"--{name}") if text else None

    columns, units, part, cycle = (options.pop(name) for name in ("columns", "units", "part", "cycle"))
    film = {name: options.pop(option, None) for name, option in (("scale", "scale"), ("rate", "fps"), ("axis", "axis"))}
    return said_of(columns, units, part, cycle, size("length", "m"), size("section", "m^2"), **film)


#: The displacement in files of its own; `said` reads how, `filmed` reads them.
displacement_options = _together(
    click.option(
        "--displacement", multiple=True, type=FILE, help="The displacement in a file of its own, for each DATA."
    ),
    click.option(
        "--displacement-delay",
        help="How much later its clock reads: 0.1s, or fit.  [default: fit with --displacement, else 0s]",
    ),
    click.option("--scale", help="Size of a camera's pixel: 0.042mm/px, or 23.8px/mm."),
    click.option("--fps", type=NUMBER, help="Frames a second, where a camera's file has no times."),
    click.option(
        "--axis",
        help="Direction of the displacement of a point: x, y, -x, -y or an angle from x to y.  "
        "[default: in which it moves most]",
    ),
)


def filmed(files: list[Any], options: dict[str, Any], meant: Said) -> list[Any]:
    """Return ``files`` with the displacements of `displacement_options`; ``options`` lose --displacement."""
    from ..measurements.track import beside, read_track

    paths = options.pop("displacement")
    return beside(files, [read_track(path, meant.of_track) for path in paths]) if paths else files


#: When a run is sampled; `sampled` reads them.
sample_options = _together(
    click.option("--samples", type=int, help="Number of samples.  [default: 601]"),
    click.option("--step", help="Time between samples, such as 0.1s; instead of --samples."),
)


def output_options(
    table: str, plot: str, kind: OutputFile = TABLE
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The options --out (a ``kind`` of file, with the help ``table``), --json, --plot, --report; see `outputs`."""
    return _together(
        click.option("--out", type=kind, help=table),
        click.option("--json", type=JSON, help="JSON file of the result."),
        click.option("--plot", type=PICTURE, help=plot),
        click.option("--report", type=PAGE, help="One HTML file with all of it."),
    )


class ModelOption(click.Option):
    """An option for an electrical model; its help names those of the registry, which is read when help is shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from ..strip.models import MODELS, model_names

        plain = ", ".join(MODELS)
        added = ", ".join(dict.fromkeys(f"+{name.split('+')[1]}" for name in model_names() if "+" in name))
        self.help = f"{plain}; {added}; auto."
        return super().get_help_record(ctx)


def outputs(options: dict[str, Any]) -> dict[str, Path | None]:
    """The files that `output_options` name, for `emit`; ``options`` lose them."""
    return {f"--{name}": options.pop(name) for name in ("out", "json", "plot", "report")}


def sampled(duration: str, options: dict[str, Any]) -> tuple[float, Array]:
    """Duration [s] and sample times [s] from ``--duration``, ``--samples`` and ``--step``."""
    from ..simulation.response import sample_times

    seconds = parse(duration, "s", "--duration")
    step = parse(options["step"], "s", "--step") if options["step"] else None
    return seconds, sample_times(seconds, samples=options["samples"], step=step)


def mounted(options: dict[str, Any]) -> dict[str, Any]:
    """Tip, beam (None for the strip's own) and load, from the options of these names."""
    from ..circuit.strip import load_of

    return {"tip": options["tip"], "beam": options["beam"], "load": load_of(options["load"])}
