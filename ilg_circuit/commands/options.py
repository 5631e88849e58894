"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from ..simulation.drives import DRIVE_FORMS

if TYPE_CHECKING:
    from ..circuit.strip import Load
    from ..strip.actuator import Actuator
    from ..study.parameters import Base

beam_option = click.option(
    "--beam",
    type=click.Choice(["dynamic", "static"]),
    help="static: without the beam's mass.  [default: the one that the coupling was fitted with, else dynamic]",
)


_RUN = (
    click.option("--drive", required=True, help=DRIVE_FORMS),
    click.option("--duration", required=True, help="How long, such as 300s."),
    click.option("--tip", type=click.Choice(["free", "clamped"]), default="free", show_default=True),
    beam_option,
    click.option("--load", "load_text", help="mass=1g,stiffness=1mN/m,damping=1uN*s/m: what hangs on the tip."),
)


def run_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say what a strip is made to do: drive, duration, tip, beam, load."""
    for option in reversed(_RUN):
        command = option(command)
    return command


def beam_of(actuator: Actuator, given: str | None, load: Load | None) -> str:
    """The beam asked for, or the usual one of this actuator."""
    return given or actuator.usual_beam(loaded=bool(load))


def base_of(actuator: str, options: dict[str, Any]) -> Base:
    """The strip and the run that a study varies, of a command's drive, duration, tip, beam and load."""
    from ..circuit.strip import parse_load
    from ..strip.file import load_actuator
    from ..study.parameters import NO_LOAD, Base
    from ..units import parse

    strip, load = load_actuator(actuator), parse_load(options["load_text"]) or NO_LOAD
    duration = parse(options["duration"], "s", "--duration")
    return Base(strip, options["drive"], duration, options["tip"], beam_of(strip, options["beam"], load), load)
