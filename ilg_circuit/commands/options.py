"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ..simulation.drives import DRIVES
from ..units import parse, si
from .completing import models, strips
from .help import argument, group
from .paths import FILE, JSON, PAGE, PICTURE, TABLE, OutputFile

if TYPE_CHECKING:
    from ..arrays import Array


class _Number(click.types.FloatParamType):
    """A pure number of a plausible size."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        name = param.opts[-1] if param else "number"
        try:
            return si(value, "", name)
        except InputError as error:
            self.fail(str(error).removeprefix(name).lstrip(": "), param, ctx)


class _Seed(click.types.IntParamType):
    """A seed of random numbers: any whole number of 63 bits."""

    name = "seed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        number: int = super().convert(value, param, ctx)
        return number if 0 <= number < 2**63 else self.fail("give a whole number from 0 to 2^63 - 1", param, ctx)


NUMBER, SEED = _Number(), _Seed()

engine_option = group(
    "Solver",
    click.option(
        "--engine",
        type=click.Choice(["ngspice", "exact"]),
        help="exact: matrix exponentials, for linear circuits only.  [default: ngspice; exact where it is missing]",
    ),
)
tip_option = group(
    "Mounting",
    click.option(
        "--tip",
        type=click.Choice(["free", "clamped"]),
        default="free",
        help="clamped: the tip is held still, which gives the blocked force.",
    ),
)
beam_option = group(
    "Mounting",
    click.option(
        "--beam",
        type=click.Choice(["dynamic", "static"]),
        help="How the strip moves as an elastic beam: dynamic with its mass and damping (it swings), static without "
        "them (it follows the charge at once).  [default: as the coupling was fitted, else dynamic]",
    ),
)
load_option = group(
    "Mounting",
    click.option(
        "--load",
        metavar="LOAD",
        help="Load on the tip: mass=1g,stiffness=1mN/m,damping=1uN*s/m, or some of these.",
    ),
)


def _together(*options: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return one decorator for several options, which stand in the help in this order."""
    return lambda command: reduce(lambda decorated, option: option(decorated), reversed(options), command)


#: Below the options of a command that takes a drive.
DRIVE_TABLE = {"Forms of DRIVE": DRIVES}

#: What is simulated.
actuator_argument = group(
    "Input", argument("actuator", "TOML file of a strip, or the preset paper.", shell_complete=strips)
)

_DRIVE = "Voltage over time; its forms are listed below."
_duration = click.option("--duration", required=True, metavar="TIME", help="How long the run is, such as 300s.")

#: What a strip is made to do.
run_options = _together(
    group("Drive", click.option("--drive", required=True, metavar="DRIVE", help=_DRIVE), _duration),
    tip_option,
    beam_option,
    load_option,
)


def segment_drive_option(**how: Any) -> Callable[..., Any]:
    """Return the option --drive, which may be repeated for the segments of a strip; ``how`` are click's settings."""
    return click.option(
        "--drive",
        multiple=True,
        metavar="DRIVE",
        help=f"{how.pop('help', _DRIVE)} K=DRIVE for segment K of a cut electrode, repeated for others; K=open.",
        **how,
    )


#: The same for a strip whose segments may have drives of their own; `segment_drives` reads them.
segment_run_options = _together(
    group("Drive", segment_drive_option(required=True), _duration), tip_option, beam_option, load_option
)


class ModelOption(click.Option):
    """An option for an electrical model; its help names the registered models, which are read when it is shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from ..strip.models import MODELS, model_names

        plain = ", ".join(MODELS)
        added = ", ".join(dict.fromkeys(f"+{name.split('+')[1]}" for name in model_names() if "+" in name))
        self.help = f"{plain}; {added}; auto."
        return super().get_help_record(ctx)


_SIZES = {
    "length": "Total length of the strip, such as 35mm.",
    "free-length": "From the clamp to the tip, such as 30mm.",
    "width": "Width, such as 5mm.",
    "thickness": "Total thickness, such as 0.5mm.",
}
_KNOWN = {
    "load-position": "Where the displacement is measured, from the clamp.  [default: the tip]",
    "youngs-modulus": "Young's modulus, such as 7.6kPa.  [default: the paper's, with a warning]",
    "density": "Density, such as 1.25g/cm^3.  [default: 1250 kg/m^3]",
    "bending-stiffness": "EI of the composite strip, such as '1 uN m^2', in place of the modulus.",
}


def strip_options(*, required: bool) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the options for a strip's sizes, which may be ``required``, and what else no fit gives; see `sizes`."""
    return group(
        "Strip",
        *(click.option(f"--{name}", required=required, metavar="LENGTH", help=text) for name, text in _SIZES.items()),
        *(click.option(f"--{name}", metavar="QUANTITY", help=text) for name, text in _KNOWN.items()),
        click.option(
            "--orientation",
            type=click.Choice(["weightless", "hanging", "horizontal"]),
            help="How the strip is held against gravity.",
        ),
    )


#: The circuit that is fitted, and by what.
fit_options = _together(
    group(
        "Model",
        click.option("--model", cls=ModelOption, default="auto", metavar="MODEL", shell_complete=models),
        click.option(
            "--electrode-resistance",
            metavar="RESISTANCE",
            help="Resistance Re: a fixed value such as 2ohm, or fit (nonlinear models).  [default: the strip's]",
        ),
        click.option(
            "--until",
            metavar="TIME",
            help="Fit records up to this time after the onset, such as 16s.  [default: all]",
        ),
    ),
    engine_option,
)


def sizes(options: dict[str, Any]) -> dict[str, str | None]:
    """Remove the values of `strip_options` from ``options`` and return them by the keys of a strip."""
    return {key: options.pop(key) for key in [name.replace("-", "_") for name in (*_SIZES, *_KNOWN)] + ["orientation"]}


#: What a data file does not say of itself; `said` reads them.
reading_options = group(
    "Data files",
    click.option(
        "--columns",
        multiple=True,
        metavar="NAME=TITLE",
        help="The column that holds a quantity: voltage='Potential (V)'; may be repeated.",
    ),
    click.option(
        "--units", multiple=True, metavar="NAME=UNIT", help="The unit of a quantity, such as time=s; may be repeated."
    ),
    click.option(
        "--part",
        metavar="PART",
        help="Which of several measurements in a file, from 1; or the point that a camera tracked.",
    ),
    click.option("--cycle", type=int, metavar="N", help="Which cycle of a record."),
)


#: Options for a displacement in files of its own.
displacement_options = group(
    "Displacement",
    click.option(
        "--displacement",
        multiple=True,
        type=FILE,
        help="The displacement in a file of its own, for each DATA; may be repeated.",
    ),
    click.option(
        "--displacement-delay",
        metavar="TIME",
        help="How much later the clock of this file reads: 0.1s, or fit.  [default: fit with --displacement, else 0s]",
    ),
    click.option("--scale", metavar="SCALE", help="Size of a camera's pixel: 0.042mm/px, or 23.8px/mm."),
    click.option("--fps", type=NUMBER, metavar="RATE", help="Frames a second, where a camera's file has no times."),
    click.option(
        "--axis",
        metavar="AXIS",
        help="Direction of the displacement of a point: x, y, -x, -y or an angle from x to y.  "
        "[default: the direction in which it moves most]",
    ),
)


#: When a run is sampled; `sampled` reads them.
sample_options = group(
    "Sampling",
    click.option("--samples", type=int, metavar="N", help="Number of samples.  [default: 601]"),
    click.option("--step", metavar="TIME", help="Time between samples, such as 0.1s; instead of --samples."),
)


def output_options(
    table: str, plot: str, kind: OutputFile = TABLE
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the options --out (a ``kind`` of file, its help ``table``), --json, --plot, --report; see `outputs`."""
    return _together(group("Output", click.option("--out", type=kind, help=table)), result_options(plot))


def result_options(plot: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the options --json, --plot (with --size and --style), --report; see `outputs`."""
    return _together(
        group(
            "Output",
            click.option("--json", type=JSON, help="JSON file to write; - for stdout, and nothing else there."),
        ),
        plot_option(plot),
        group("Output", click.option("--report", type=PAGE, help="HTML page to write, with all results.")),
    )


def plot_option(plot: str, *more: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the options --plot, --size and --style, with ``more`` options for pictures; see `emit`."""
    return group(
        "Output",
        click.option("--plot", type=PICTURE, help=plot),
        *more,
        click.option("--size", metavar="SIZE", help="Width of pictures, or width and height: 85mm, or 85mm,60mm."),
        click.option("--style", type=FILE, help="Matplotlib style file for pictures."),
    )


def outputs(options: dict[str, Any]) -> dict[str, Path | None]:
    """Remove the files of `output_options` from ``options`` and return them, for `emit`."""
    return {f"--{name}": options.pop(name) for name in ("out", "json", "plot", "report") if name in options}


def sampled(duration: str, options: dict[str, Any]) -> tuple[float, Array]:
    """Return the duration [s] and sample times [s] from ``--duration``, ``--samples`` and ``--step``."""
    from ..simulation.response import sample_times

    seconds = parse(duration, "s", "--duration")
    step = parse(options["step"], "s", "--step") if options["step"] else None
    return seconds, sample_times(seconds, samples=options["samples"], step=step)


def mounted(options: dict[str, Any]) -> dict[str, Any]:
    """Return tip, beam (None for the strip's own) and load, from the options of these names."""
    from ..circuit.load import load_of

    return {"tip": options["tip"], "beam": options["beam"], "load": load_of(options["load"])}
