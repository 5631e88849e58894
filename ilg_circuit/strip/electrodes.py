"""The electrodes of a strip as sheets: their resistance along the strip, their segments and their contacts.

A strip with electrodes is a line: current flows along two sheets and through the strip between them. Without electrodes
it is one lump, whose electrode resistance EC (13) lies across the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from ..errors import InputError, wrong_choice
from .fields import checked, quantity, validate_quantities
from .geometry import Geometry

CONTACTS = ("clamp", "end", "each")
#: Largest numbers of segments of a foil, and of cells.
MOST_SEGMENTS, MOST_CELLS = 50, 400
#: What rounding may add to lengths that fill the strip.
_ROUNDING = 1e-9


def _lengths(meaning: str) -> Any:
    return field(default=(), metadata={"each": "m", "meaning": meaning})


@dataclass(frozen=True)
class Electrodes:
    """Two sheets, 1 at the plus side and 2 at the minus side, each cut into segments along the free length.

    ``segments_1`` and ``segments_2`` are numbers of equal segments; ``lengths_1`` and ``lengths_2`` [m] give their
    lengths instead, from the clamp on. Segments are ``gap`` [m] apart, where the gel is bare, and the first one covers
    the clamped part too. ``gap_resistance`` [ohm] leaks from each segment to the next one (None: nothing does).

    ``contact`` is "clamp" (the first segment is at its source's potential over ``contact_length`` [m] from the inner
    end of the strip on, by default the whole clamped part; further ones are wired at their inner ends), "end" (all are
    wired at their inner ends), or "each" (all are wired at the middle of their free parts). ``lead_resistance`` [ohm]
    is that of each wire. ``cells`` is the number of cells of the free length; None takes as many as a stated error
    needs.
    """

    sheet_resistance_1: float = quantity("ohm", "resistance of sheet 1 (plus side), per square", zero=True)
    sheet_resistance_2: float = quantity("ohm", "resistance of sheet 2 (minus side), per square", zero=True)
    segments_1: float = quantity("", "number of equal segments of sheet 1", default=1)
    segments_2: float = quantity("", "number of equal segments of sheet 2", default=1)
    lengths_1: tuple[float, ...] = _lengths("lengths of the segments of sheet 1, from the clamp on")
    lengths_2: tuple[float, ...] = _lengths("lengths of the segments of sheet 2, from the clamp on")
    gap: float = quantity("m", "gap between segments", zero=True, default=0.0)
    gap_resistance: float | None = quantity(
        "ohm", "leakage resistance from each segment to the next; none if absent", default=None
    )
    contact: str = "clamp"
    contact_length: float | None = quantity(
        "m", "length of the contact in the clamp; the clamped part if absent", zero=True, default=None
    )
    lead_resistance: float = quantity("ohm", "resistance of the wire to each segment", zero=True, default=0.0)
    cells: float | None = quantity(
        "", "cells of the free length; as many as a stated error needs if absent", default=None
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            if "each" in item.metadata:
                object.__setattr__(self, item.name, _checked_lengths(item.name, getattr(self, item.name)))
        validate_quantities(self)
        for name, most in (("segments_1", MOST_SEGMENTS), ("segments_2", MOST_SEGMENTS), ("cells", MOST_CELLS)):
            value = getattr(self, name)
            if value is not None:
                if not (float(value).is_integer() and 1 <= value <= most):
                    raise InputError(f"electrodes.{name} is {value:g}; give a whole number from 1 to {most}")
                object.__setattr__(self, name, int(value))
        for side, given in ((1, self.segments_1), (2, self.segments_2)):
            if (count := len(self.lengths(side))) and given not in (1, count):
                raise InputError(
                    f"electrodes.segments_{side} is {given}, and lengths_{side} has {count} lengths; "
                    "leave one of them out"
                )
        if self.contact not in CONTACTS:
            raise wrong_choice("electrodes.contact", self.contact, CONTACTS)
        if self.contact_length is not None and self.contact != "clamp":
            raise InputError(f"electrodes.contact_length goes with contact 'clamp', not with '{self.contact}'")

    def lengths(self, side: int) -> tuple[float, ...]:
        """Return the lengths [m] that are given for the segments of a side, 1 or 2; empty for equal ones."""
        return self.lengths_1 if side == 1 else self.lengths_2

    def segments(self, side: int) -> int:
        """Return the number of segments of a side, 1 or 2."""
        return len(self.lengths(side)) or int(self.segments_1 if side == 1 else self.segments_2)

    def spans(self, side: int, geometry: Geometry) -> tuple[tuple[float, float], ...]:
        """Return start and end [m] of the free part of each segment of a side, from the clamp's edge.

        Raises InputError where the segments do not fit the free length.
        """
        free, count = geometry.free_length, self.segments(side)
        gaps = (count - 1) * self.gap
        if gaps >= free:
            raise InputError(
                f"electrodes.gap {self.gap:g} m, {count - 1} times, leaves nothing of the free length {free:g} m; "
                "give smaller gaps or fewer segments"
            )
        lengths = self.lengths(side) or ((free - gaps) / count,) * count
        whole = sum(lengths) + gaps
        if whole > free * (1 + _ROUNDING):
            raise InputError(
                f"electrodes.lengths_{side} with {count - 1} gaps are {whole:g} m long, the free length is {free:g} m; "
                "segments must not be longer than the strip"
            )
        spans, start = [], 0.0
        for length in lengths:
            spans.append((start, start + length))
            start += length + self.gap
        if abs(whole - free) <= _ROUNDING * free:
            spans[-1] = (spans[-1][0], free)
        return tuple(spans)

    def contacted(self, geometry: Geometry) -> float:
        """Return the length [m] of the contact in the clamp. Raises InputError for one longer than the clamped part."""
        clamped = geometry.length - geometry.free_length
        if self.contact != "clamp":
            return 0.0
        given = self.contact_length
        if given is not None and given > clamped * (1 + _ROUNDING) + _ROUNDING * geometry.length:
            raise InputError(
                f"electrodes.contact_length {given:g} m is longer than the clamped part, {clamped:g} m; "
                "shorten it, or leave it out"
            )
        return clamped if given is None else min(given, clamped)

    def require_fits(self, geometry: Geometry) -> None:
        """Raise InputError unless segments and contact fit the strip."""
        self.contacted(geometry)
        for side in (1, 2):
            self.spans(side, geometry)


def require_lump(actuator: Any, what: str) -> None:
    """Raise InputError where a strip has electrodes, and ``what`` is for a strip that is one lump."""
    if actuator.electrodes is not None:
        raise InputError(
            f"actuator '{actuator.name}' has [electrodes], and {what} is for a strip that is one lump; "
            "leave that section out"
        )


def _checked_lengths(name: str, given: Any) -> tuple[float, ...]:
    """Return the lengths [m]. Raises InputError for what is no list of them."""
    if isinstance(given, str) or not hasattr(given, "__iter__"):
        raise InputError(f"electrodes.{name} is {given!r}; give a list of lengths, from the clamp on")
    lengths = tuple(checked(f"electrodes.{name}", value, "m") for value in given)
    if len(lengths) > MOST_SEGMENTS:
        raise InputError(f"electrodes.{name} has {len(lengths)} lengths; give {MOST_SEGMENTS} at most")
    return lengths
