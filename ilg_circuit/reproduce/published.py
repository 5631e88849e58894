"""Printed numbers of the two papers beside their recomputed values: the tables of ``data/``."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from pathlib import Path

from ..errors import InputError
from ..units import scale

COLUMNS = ("item", "symbol", "equation_or_table", "unit", "printed", "recomputed", "reason")
MISPRINT_COLUMNS = ("paper", "where", "printed", "correct", "reason")

#: Units of the tables -> SI units.
_SI = {"mm": "m", "cm": "m", "kPa": "Pa", "uN": "N", "mm/V": "m/V", "mm/(V s)": "m/(V s)", "mN/(m V s)": "N/(m V s)"}
#: Units that are not converted.
_PLAIN = ("", "%", "deg")


@dataclass(frozen=True)
class Published:
    """One line of a table: ``printed`` digit for digit, ``recomputed`` with every digit right; blank: there is none.

    Both are in ``unit``; ``where`` names the equation or table, ``reason`` says why they differ, blank if they do not.
    """

    table: str
    item: str
    symbol: str
    where: str
    unit: str
    printed: str
    recomputed: str
    reason: str

    @property
    def si_factor(self) -> float:
        """Factor from ``unit`` to SI units (percent and degrees are kept)."""
        return 1.0 if self.unit in _PLAIN else float(scale(self.unit, _SI.get(self.unit, self.unit)))

    @property
    def rounding(self) -> float:
        """Half a unit in the last digit of ``recomputed``, in ``unit``."""
        return half_a_digit(self.recomputed)


@dataclass(frozen=True)
class Misprint:
    """A misprint of a ``paper``: as ``printed``, and ``correct``."""

    paper: str
    where: str
    printed: str
    correct: str
    reason: str


def half_a_digit(text: str) -> float:
    """Return half a unit in the last digit of ``text``. Raises InputError where it is not a finite number."""
    exponent = Decimal(text).as_tuple().exponent
    if not isinstance(exponent, int):
        raise InputError(f"'{text}' is no finite number")
    return 0.5 * 10.0**exponent


def folder() -> Path:
    """Return the folder of the tables: in the package if installed, in ``data`` beside it in a checkout.

    Raises InputError where they are missing.
    """
    here = Path(__file__).parents[1]
    for place in (here / "data", here.parent / "data"):
        if (place / "ec_table1.csv").is_file():
            return place
    raise InputError(f"the papers' tables are not in '{here / 'data'}'; install the package again")


@lru_cache(maxsize=16)
def table(name: str) -> tuple[Published, ...]:
    """Return all lines of one table, such as ``ec_table1``."""
    return tuple(Published(name, *row.values()) for row in _rows(name, COLUMNS))


@lru_cache(maxsize=1)
def misprints() -> tuple[Misprint, ...]:
    """Return the places of both papers that are misprinted."""
    return tuple(Misprint(**row) for row in _rows("misprints", MISPRINT_COLUMNS))


def published(name: str, item: str) -> Published:
    """Return one line of a table. Raises InputError where there is none."""
    for row in table(name):
        if row.item == item:
            return row
    raise InputError(f"table '{name}' has no item '{item}'")


def _rows(name: str, columns: tuple[str, ...]) -> list[dict[str, str]]:
    with (folder() / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if tuple(reader.fieldnames or ()) != columns:
            raise InputError(f"table '{name}' has the columns {reader.fieldnames}; they must be {', '.join(columns)}")
        return [dict(row) for row in reader]
