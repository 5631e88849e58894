"""What every netlist handed out says of its origin, and how its lines are written."""

from __future__ import annotations

from .. import __version__
from ..strip.actuator import Actuator
from ..units import format_quantity

#: Tolerances with which ngspice's own step control follows the exact solution within 1e-6 of the maximum.
TIGHT_OPTIONS = ".options reltol=1e-8 trtol=1 abstol=1e-12 vntol=1e-10 chgtol=1e-4 method=trap"
#: Longest and first step that go with them, relative to the run; only later steps are controlled by their error.
LONGEST_STEP = 2e-4
FIRST_STEP = 1e-9


def provenance(title: str, actuator: Actuator) -> list[str]:
    """Header lines: what it is, what wrote it, and the strip's sizes."""
    g = actuator.geometry
    sizes = ", ".join(
        f"{label} {format_quantity(value, 'm', 6)}"
        for label, value in (
            ("L", g.length),
            ("L0", g.free_length),
            ("L_F", g.load_distance),
            ("w", g.width),
            ("b", g.thickness),
        )
    )
    return [title, f"written by ilg_circuit {__version__}; strip {sizes}"]


def folded(lines: list[str], width: int = 100) -> list[str]:
    """Long lines (a measured PWL) continued with ``+``, as SPICE wants them."""
    result = []
    for line in lines:
        words, current = line.split(" "), ""
        for word in words:
            if current and len(current) + len(word) > width:
                result.append(current)
                current = "+ " + word
            else:
                current = f"{current} {word}" if current else word
        result.append(current)
    return result
