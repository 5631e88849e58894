"""Warns of sizes and materials that no strip of these gels has: most often the unit is a slip."""

from __future__ import annotations

from collections.abc import Container
from typing import TYPE_CHECKING

from ..errors import warn
from ..units import format_quantity

if TYPE_CHECKING:
    from .actuator import Actuator
    from .specimen import Specimen

#: Key of a strip's file -> the range of its SI values, and the unit.
USUAL = {
    "length": (1e-3, 0.5, "m"),
    "free_length": (1e-3, 0.5, "m"),
    "width": (1e-4, 0.2, "m"),
    "thickness": (1e-6, 1e-2, "m"),
    "youngs_modulus": (1e2, 1e11, "Pa"),
    "density": (50.0, 2.5e4, "kg/m^3"),
}


def warn_of_sizes(strip: Actuator | Specimen, keys: Container[str] = tuple(USUAL)) -> None:
    """Issue an `IlgWarning` for each value of a strip, among these ``keys`` of its file, that lies outside `USUAL`."""
    material = vars(strip.material) if hasattr(strip, "material") else dict(strip.known)
    values = vars(strip.geometry) | material
    for key, (low, high, unit) in USUAL.items():
        value = values.get(key) if key in keys else None
        if value is not None and not low <= value <= high:
            ends = f"{format_quantity(low, unit)} to {format_quantity(high, unit)}"
            warn(f"{key} is {format_quantity(value, unit, 6)}; usual strips have {ends}: check the unit")
