"""Says which pins of a strip's segments are driven, held at 0 V, or open.

Segment k of side 1 has the pin pk, segment k of side 2 the pin mk. Every pin is driven by a source, held at the common
0 V, or open.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import InputError
from ..strip.electrodes import Electrodes
from .netlist import GROUND

#: The word that leaves a pin unconnected, in place of a drive.
OPEN = "open"
_KEY = re.compile(r"\s*([+-]?\d+)\s*(?::\s*-(\d+)\s*)?")


@dataclass(frozen=True)
class Wiring:
    """The ``sources`` of a strip, in the order of their drives, and its ``opened`` pins; all others are at 0 V.

    A source is (plus pins, minus pin); the minus pin "0" is the common 0 V. Several plus pins are joined.
    """

    sources: tuple[tuple[tuple[str, ...], str], ...]
    opened: tuple[str, ...] = ()


def joined(electrodes: Electrodes) -> Wiring:
    """Return the wiring of one source for all segments: side 1 joined at its plus, side 2 at 0 V."""
    return Wiring(((tuple(f"p{k}" for k in range(1, electrodes.segments(1) + 1)), GROUND),))


def wiring(electrodes: Electrodes, driven: Sequence[str], opened: Sequence[str] = ()) -> Wiring:
    """Return the wiring of a source for each key of ``driven``, in their order, and open pins for those of ``opened``.

    A key is a segment's number: "2" drives segment 2 of side 1 against the common 0 V, at which side 2 is; "-2" drives
    segment 2 of side 2 against it; "3:-1" puts the source between segment 3 of side 1 and segment 1 of side 2. Raises
    InputError for other keys, segments that are not there, and pins that two sources drive.
    """
    if not driven:
        raise InputError("no segment is driven; give one a voltage, such as --drive 1=step:4V")
    sources = []
    taken: dict[str, str] = {}
    for key in (*driven, *opened):
        plus, minus = _pins(key, electrodes)
        if key in opened and minus != GROUND:
            raise InputError(f"segment '{key}': one segment is open, such as 3=open or -3=open, not a pair")
        if plus in taken:
            raise InputError(f"segments '{taken[plus]}' and '{key}' are one; give it one drive")
        taken[plus] = key
        if key not in opened:
            sources.append(((plus,), minus))
    left = tuple(_pins(key, electrodes)[0] for key in opened)
    return Wiring(tuple(sources), left)


def one_segment(electrodes: Electrodes, segment: int) -> Wiring:
    """Return the wiring that drives one segment of side 1, all others at 0 V."""
    return wiring(electrodes, [str(segment)])


def _pins(key: str, electrodes: Electrodes) -> tuple[str, str]:
    """Return the plus and the minus pin of a key."""
    match = _KEY.fullmatch(str(key))
    if match is None:
        raise InputError(
            f"segment '{str(key)[:40]}' is not understood; write its number, such as 2, -2 for one of side 2, or 3:-1"
        )
    number = int(match[1])
    plus = _pin(number, key, electrodes)
    if match[2] is None:
        return plus, GROUND
    if number < 0:
        raise InputError(f"segment '{key}': the first of a pair is of side 1, such as 3:-1")
    return plus, _pin(-int(match[2]), key, electrodes)


def _pin(number: int, key: str, electrodes: Electrodes) -> str:
    side = 1 if number > 0 else 2
    count = electrodes.segments(side)
    if not 1 <= abs(number) <= count:
        raise InputError(
            f"segment '{key}' is not there: side {side} has {count} segment{'s' * (count > 1)}, "
            f"{'1' if side == 1 else '-1'}{f' to {count if side == 1 else -count}' * (count > 1)}"
        )
    return f"{'p' if side == 1 else 'm'}{abs(number)}"
