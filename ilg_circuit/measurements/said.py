"""Statements of a user on a file: columns and units of quantities, which of its measurements to take."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from ..errors import InputError, argument
from ..units import parse, require_positive

T = TypeVar("T")

#: Largest number of measurements of a file that are listed.
_LISTED = 12
#: Prefix of a quantity in statements on a separate file of the displacement.
TRACK_PREFIX = "displacement."
_OF_TRACK = frozenset(("displacement", "x", "y", "likelihood", "frame"))
_SCALE = re.compile(
    r"(?P<number>[-+]?[\d.]{1,20}(?:e[-+]?\d{1,3})?) {0,3}"
    r"(?:(?P<unit>[a-z\u00b5\u03bc]{1,10}) ?/ ?(?:px|pixels?)|(?:px|pixels?) ?/ ?(?P<per>[a-z\u00b5\u03bc]{1,10}))",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Said:
    """Titles of ``columns`` and ``units`` by quantity, the ``part`` of the file (from 1) and the ``cycle`` in it.

    A column may also be given by its number, from 1. ``length`` [m] and ``section`` [m^2] are a specimen's dimensions;
    ``scale`` [m] is the size of a camera's pixel. For a track, ``rate`` [Hz] is its frame rate, ``axis`` the direction
    of the displacement and ``point`` the name of the tracked point. A statement on a quantity such as
    ``displacement.time`` applies to the separate file of the displacement.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    part: int | None = None
    cycle: int | None = None
    length: float | None = None
    section: float | None = None
    scale: float | None = None
    rate: float | None = None
    axis: str | None = None
    point: str | None = None

    @property
    def quantities(self) -> set[str]:
        """The quantities on which there are statements."""
        return {*self.columns, *self.units}

    @property
    def of_track(self) -> Said:
        """The statements on the separate file of the displacement, whose unit also applies to x and y."""
        columns, units = ({_own(q): text for q, text in d.items() if _of_track(q)} for d in (self.columns, self.units))
        if "displacement" in units:
            units = {"x": units["displacement"], "y": units["displacement"], **units}
        return replace(self, columns=columns, units=units, part=None, cycle=None)

    @property
    def of_film(self) -> Said:
        """The statements on a file that holds a displacement alone, whose quantities need no prefix."""
        columns, units = (
            {_own(q): text for q, text in sorted(d.items(), key=lambda each: _of_track(each[0]))}
            for d in (self.columns, self.units)
        )
        whole = replace(self, columns=columns, units=units)
        return replace(whole.of_track, columns=columns, part=self.part, cycle=self.cycle)

    @property
    def of_data(self) -> Said:
        """The statements on the electrical data, without the statements on a separate file of the displacement."""
        columns, units = ({q: text for q, text in d.items() if not _of_track(q)} for d in (self.columns, self.units))
        return Said(columns, units, self.part, self.cycle, self.length, self.section)


NOTHING = Said()


def said_of(
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | str | None = None,
    cycle: int | None = None,
    length: float | None = None,
    section: float | None = None,
    *,
    scale: float | str | None = None,
    rate: float | None = None,
    axis: str | None = None,
) -> Said:
    """Return the statements in mappings, or in texts such as ``voltage=Potential applied (V)``; else raise InputError.

    A ``part`` that is not a number names a point of a track; a ``scale`` is a size in metres or a text, see `pixel`.
    """
    point = None
    if isinstance(part, str):
        part, point = (int(part), None) if re.fullmatch(r"-?\d{1,9}", part.strip()) else (None, part.strip())
    for name, number in (("part", part), ("cycle", cycle)):
        if number is not None and number < (name == "part"):
            raise InputError(f"{argument(name)} is {number}; count from 1")
    sizes = (part, cycle, length, section, pixel(scale) if isinstance(scale, str) else scale)
    return Said(_by_quantity(columns, "columns"), _by_quantity(units, "units"), *sizes, rate, axis, point)


def pixel(text: str) -> float:
    """Return the size [m] of a pixel from a text such as ``0.042mm/px``, or ``23.8px/mm``. Raises InputError."""
    match = _SCALE.fullmatch(text.strip())
    if not match:
        raise InputError(f"scale '{text[:40]}' is not understood; write the size of a pixel, such as 0.042mm/px")
    number, unit, per = match.group("number", "unit", "per")
    require_positive("scale", parse(number, "", "scale"))
    return parse(f"{number} {unit}", "m", "scale") if unit else parse(f"1 {per}", "m", "scale") / float(number)


def pick(parts: Sequence[tuple[str, T]], said: Said, name: str) -> T:
    """Return the chosen measurement from the labelled ``parts`` of a file.

    Raises
    ------
    InputError
        There are several and none was chosen, or the one chosen is not there; the message lists them.
    """
    if said.part is None and len(parts) == 1:
        return parts[0][1]
    listed = "; ".join(f"{k} ({label[:60]})" for k, (label, _) in enumerate(parts[:_LISTED], 1))
    listed += f" ... {len(parts)}" if len(parts) > _LISTED else ""
    count = f"{len(parts)} measurement{'s' * (len(parts) != 1)}"
    if said.part is None:
        raise InputError(f"{name}: holds {count}: {listed}; choose one with {argument('part', 1)}")
    if said.part > len(parts):
        raise InputError(f"{name}: no part {said.part}; it holds {count}: {listed}")
    return parts[said.part - 1][1]


def in_words(what: str, quantity: str, value: str, prefix: str = "") -> tuple[str, str, str]:
    """Return a statement on a quantity for `options`; ``prefix`` belongs to the kind of file."""
    return what, quantity if quantity in _OF_TRACK else prefix + quantity, value


def options(*said: tuple[str, str, str]) -> str:
    """Return statements (columns or units, quantity, value) as options for a shell, or as arguments in Python.

    >>> print(options(("columns", "voltage", "Bias"), ("units", "voltage", "mV")))
    columns={'voltage': 'Bias'}, units={'voltage': 'mV'}
    """
    pairs = [
        (argument(kind), quantity.replace(" ", "_"), value.strip()) for kind, quantity, value in dict.fromkeys(said)
    ]
    if any(kind != kind.name for kind, _, _ in pairs):
        return " ".join(f"{kind} {quantity}={shlex.quote(value)}" for kind, quantity, value in pairs)
    found: dict[str, dict[str, str]] = {}
    for kind, quantity, value in pairs:
        found.setdefault(kind, {})[quantity] = value
    return ", ".join(f"{kind}={values}" for kind, values in found.items())


def _by_quantity(given: Mapping[str, str] | Iterable[str], what: str) -> dict[str, str]:
    """Return values by quantity. Raises InputError for a text without "=", an unknown or a repeated quantity."""
    from .kind import LOAD_TEST, RECORD, SPECTRUM, TRACK

    known = {q.replace(" ", "_"): q for kind in (RECORD, SPECTRUM, LOAD_TEST, TRACK) for q in kind.quantities}
    own = {f"{TRACK_PREFIX}{q}": f"{TRACK_PREFIX}{q}" for q in TRACK.quantities}
    pairs = list(given.items()) if isinstance(given, Mapping) else [tuple(text.partition("=")[::2]) for text in given]
    found: dict[str, str] = {}
    for word, value in pairs:
        quantity = {**known, **own}.get(str(word).strip().lower().replace("-", "_").replace(" ", "_"))
        if quantity is None or not str(value).strip():
            example = "voltage='Potential (V)'" if what == "columns" else "voltage=mV"
            raise InputError(
                f"{argument(what)} {str(word)[:40]}={str(value)[:40]}: write it like {example}; quantities are "
                f"{', '.join(known)}"
            )
        if quantity in found:
            raise InputError(f"{argument(what)}: {quantity} is given twice; give it once")
        found[quantity] = str(value).strip()
    return found


def _of_track(quantity: str) -> bool:
    return quantity.startswith(TRACK_PREFIX) or quantity in _OF_TRACK


def _own(quantity: str) -> str:
    return quantity.removeprefix(TRACK_PREFIX)
