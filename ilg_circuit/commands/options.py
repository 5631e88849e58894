"""Options that several commands have."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ..actuator import Actuator
    from ..circuit.strip import Load

beam_option = click.option(
    "--beam",
    type=click.Choice(["dynamic", "static"]),
    help="static: without the beam's mass.  [default: the one that the coupling was fitted with, else dynamic]",
)


def beam_of(actuator: Actuator, given: str | None, load: Load | None) -> str:
    """The beam asked for, or the usual one of this actuator."""
    return given or actuator.usual_beam(loaded=bool(load))
