"""What a user says of a file: the columns and units of quantities, which of its measurements is meant."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from ..errors import InputError, argument

T = TypeVar("T")

#: So many measurements of a file are listed.
_LISTED = 12


@dataclass(frozen=True)
class Said:
    """Titles of ``columns`` and ``units`` by quantity, the ``part`` of the file (from 1) and the ``cycle`` in it.

    A column may be given by its number too, from 1. ``length`` [m] and ``section`` [m^2] are those of a specimen.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    part: int | None = None
    cycle: int | None = None
    length: float | None = None
    section: float | None = None

    @property
    def quantities(self) -> set[str]:
        """The quantities that are spoken of."""
        return {*self.columns, *self.units}


NOTHING = Said()


def said_of(
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
    length: float | None = None,
    section: float | None = None,
) -> Said:
    """Return what mappings, or texts such as ``voltage=Potential applied (V)``, say. Raises InputError for others."""
    for name, number in (("part", part), ("cycle", cycle)):
        if number is not None and number < (name == "part"):
            raise InputError(f"{argument(name)} is {number}; count from 1")
    return Said(_by_quantity(columns, "columns"), _by_quantity(units, "units"), part, cycle, length, section)


def pick(parts: Sequence[tuple[str, T]], said: Said, name: str) -> T:
    """Return the measurement that is meant of those in a file, each with a label.

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


def options(*said: tuple[str, str, str]) -> str:
    """Return how users say (columns or units, quantity, value): as a shell takes it, or as arguments in Python.

    >>> print(options(("columns", "voltage", "Bias"), ("units", "voltage", "mV")))
    columns={'voltage': 'Bias'}, units={'voltage': 'mV'}
    """
    pairs = [(argument(kind), quantity.replace(" ", "_"), value.strip()) for kind, quantity, value in said]
    if any(kind != kind.name for kind, _, _ in pairs):
        return " ".join(f"{kind} {quantity}={shlex.quote(value)}" for kind, quantity, value in pairs)
    found: dict[str, dict[str, str]] = {}
    for kind, quantity, value in pairs:
        found.setdefault(kind, {})[quantity] = value
    return ", ".join(f"{kind}={values}" for kind, values in found.items())


def _by_quantity(given: Mapping[str, str] | Iterable[str], what: str) -> dict[str, str]:
    """Return values by quantity. Raises InputError for a text without "=", an unknown quantity, one said twice."""
    from .kind import LOAD_TEST, RECORD, SPECTRUM

    known = {q.replace(" ", "_"): q for kind in (RECORD, SPECTRUM, LOAD_TEST) for q in kind.quantities}
    pairs = list(given.items()) if isinstance(given, Mapping) else [tuple(text.partition("=")[::2]) for text in given]
    found: dict[str, str] = {}
    for word, value in pairs:
        quantity = known.get(str(word).strip().lower().replace("-", "_").replace(" ", "_"))
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
