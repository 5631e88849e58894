"""What the two papers print beside what it recomputes to: the tables of ``data/``, read for comparison."""

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

#: Units of the tables that are no SI units, and the one that each stands for.
_SI = {
    "mm": "m",
    "cm": "m",
    "kPa": "Pa",
    "uN": "N",
    "mm/V": "m/V",
    "mm/(V s)": "m/(V s)",
    "mN/(m V s)": "N/(m V s)",
}
#: Kept as they are: no number of the package is in another unit.
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
        """What a number in ``unit`` is multiplied by to be SI (percent and degrees stay as they are)."""
        return 1.0 if self.unit in _PLAIN else float(scale(self.unit, _SI.get(self.unit, self.unit)))

    @property
    def rounding(self) -> float:
        """Half a unit in the last digit of ``recomputed``, in ``unit``."""
        return half_a_digit(self.recomputed)


@dataclass(frozen=True)
class Misprint:
    """A place of a ``paper`` that cannot stand as it is ``printed``, and what is ``correct``."""

    paper: str
    where: str
    printed: str
    correct: str
    reason: str


def half_a_digit(text: str) -> float:
    """Half a unit in the last digit given."""
    exponent = Decimal(text).as_tuple().exponent
    if not isinstance(exponent, int):
        raise InputError(f"'{text}' is no finite number")
    return 0.5 * 10.0**exponent


def folder() -> Path:
    """Where the tables are: beside the package in an installation, in ``data`` beside it in a checkout."""
    here = Path(__file__).parents[1]
    for place in (here / "data", here.parent / "data"):
        if (place / "ec_table1.csv").is_file():
            return place
    raise InputError(f"the papers' tables are not in '{here / 'data'}'; install the package again")


@lru_cache(maxsize=16)
def table(name: str) -> tuple[Published, ...]:
    """All lines of one table, such as ``ec_table1``."""
    return tuple(
        Published(name, row["item"], row["symbol"], row["equation_or_table"], *(row[c] for c in COLUMNS[3:]))
        for row in _rows(name, COLUMNS)
    )


@lru_cache(maxsize=1)
def misprints() -> tuple[Misprint, ...]:
    """The places of both papers that cannot stand as they are printed."""
    return tuple(Misprint(**row) for row in _rows("misprints", MISPRINT_COLUMNS))


def published(name: str, item: str) -> Published:
    """One line of a table. Raises InputError where there is none."""
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
