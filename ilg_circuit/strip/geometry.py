"""The sizes of a strip and how it is held."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError, wrong_choice
from .fields import quantity, validate_quantities

ORIENTATIONS = ("weightless", "hanging", "horizontal")


@dataclass(frozen=True)
class Geometry:
    """Sizes of the strip, clamped at one end. ``load_position`` is L_F, where load and displacement are taken."""

    length: float = quantity("m", "total length L")
    free_length: float = quantity("m", "free length L0")
    width: float = quantity("m", "width w")
    thickness: float = quantity("m", "total thickness b")
    load_position: float | None = quantity(
        "m", "distance L_F of load and displacement from the clamp; free_length if absent", default=None
    )

    def __post_init__(self) -> None:
        validate_quantities(self)
        if self.free_length > self.length:
            raise InputError(
                f"geometry.free_length {self.free_length:g} m is longer than geometry.length {self.length:g} m; "
                "the free part cannot exceed the whole"
            )
        if self.load_position is not None and self.load_position > self.free_length:
            raise InputError(
                f"geometry.load_position {self.load_position:g} m lies beyond geometry.free_length "
                f"{self.free_length:g} m; give a distance from the clamp within the free part"
            )

    @property
    def load_distance(self) -> float:
        """L_F [m]: ``load_position``, or the free end where none is given."""
        return self.free_length if self.load_position is None else self.load_position


@dataclass(frozen=True)
class Mounting:
    """How the strip is held against gravity. ``weightless``: the coupling was fitted with gravity already in it."""

    orientation: str = "weightless"

    def __post_init__(self) -> None:
        if self.orientation not in ORIENTATIONS:
            raise wrong_choice("mounting.orientation", self.orientation, ORIENTATIONS)
