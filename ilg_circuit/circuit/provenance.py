"""Writes the origin of a netlist into its header, and formats its lines."""

from __future__ import annotations

from textwrap import TextWrapper

from .. import __version__
from ..strip.actuator import Actuator
from ..units import format_quantity

#: Tolerances with which ngspice's own step control follows the exact solution within 1e-6 of the maximum.
TIGHT_OPTIONS = ".options reltol=1e-8 trtol=1 abstol=1e-12 vntol=1e-10 chgtol=1e-4 method=trap"
#: Longest and first step that go with them, relative to the run; only later steps are controlled by their error.
LONGEST_STEP = 2e-4
FIRST_STEP = 1e-9
#: Lines of the header of a netlist with inductors.
INDUCTORS = (
    "LTspice puts 1 mohm into every inductor that does not say otherwise, which is not nothing here: append Rser=0 to",
    "     the lines that begin with L (LTspice alone reads it), or set the default in its control panel, Hacks:",
    "     Always default inductors to rser=0",
)


def provenance(title: str, actuator: Actuator) -> list[str]:
    """Return the header lines: what it is, what wrote it, and the strip's sizes."""
    g = actuator.geometry
    sizes = {"L": g.length, "L0": g.free_length, "L_F": g.load_distance, "w": g.width, "b": g.thickness}
    strip = ", ".join(f"{symbol} {format_quantity(size, 'm', 6)}" for symbol, size in sizes.items())
    return [title, f"written by ilg_circuit {__version__}; strip {strip}"]


def folded(lines: list[str], width: int = 101) -> list[str]:
    """Return long lines (a measured PWL) continued with ``+``, as SPICE requires."""
    fold = TextWrapper(width, subsequent_indent="+ ", break_long_words=False, break_on_hyphens=False)
    return [part for line in lines for part in fold.wrap(line) or [""]]
