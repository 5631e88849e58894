"""Plans of designs: the full grid of some axes, a random sample of ranges, or a list from a file."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError, argument, visible, wrong_choice
from ..files import read_bytes
from ..measurements.header import split_header
from ..strip.changes import Value, VariedParameter
from ..units import format_quantity, scale
from .parameters import PARAMETERS, varied_parameter

#: Values of one parameter: floats in SI units, or words.
Column = Array | NDArray[np.str_]
#: What is varied: texts such as "thickness=0.2mm:1mm", or by name a text, a pair, a triple or one value.
Vary: TypeAlias = "Mapping[str, Any] | Iterable[str]"

MOST_DESIGNS = 10_000_000
#: Largest file of designs.
_MOST_BYTES = 300_000_000
METHODS = ("lhs", "sobol", "uniform")
VARY_FORMS = (
    "thickness=0.2mm:1mm:20 (values from, to, how many; :log after it for equal ratios), thickness=0.2mm,0.5mm,1mm, or "
    "for random designs thickness=0.2mm:1mm"
)


@dataclass(frozen=True)
class Range:
    """Range of one parameter: its ``values``, or all between ``low`` and ``high`` (by equal ratios if ``log``).

    ``text`` is what it was parsed from; ``count`` the number of values it asks for. Raises InputError where ``low``
    is not below ``high``, or not positive for equal ratios.
    """

    parameter: VariedParameter
    values: tuple[Value, ...] = ()
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    count: int | None = None
    text: str = ""

    def __post_init__(self) -> None:
        if self.values:
            return
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise InputError(f"{self.parameter.name} from {self.low:g} to {self.high:g}: give the smaller end first")
        if self.log and self.low <= 0:
            raise InputError(f"{self.parameter.name}: a range by equal ratios begins above zero, not at {self.low:g}")

    def at(self, share: Array) -> Column:
        """Return the values at ``share`` (n,), numbers from 0 to 1 along the range or the list of values."""
        if self.values:
            pick = np.minimum((share * len(self.values)).astype(int), len(self.values) - 1)
            return np.asarray(self.values)[pick]
        if self.log:
            return self.low * (self.high / self.low) ** share
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, eq=False)
class Plan:
    """Designs in order. ``columns``: parameter -> values; of a grid its axes, else one value a design.

    The designs of a grid are counted with the last axis running fastest. ``text`` describes the plan. Raises InputError
    for no designs, or more than `MOST_DESIGNS`.
    """

    columns: dict[str, Column]
    grid: bool
    text: str

    def __post_init__(self) -> None:
        if not self.columns or not self.count:
            raise InputError(f"no designs: say what to vary, such as {VARY_FORMS}")
        if self.count > MOST_DESIGNS:
            raise InputError(f"{self.count} designs are more than {MOST_DESIGNS}; vary less or more coarsely")

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.columns)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of a grid's axes; otherwise the number of designs."""
        lengths = [len(column) for column in self.columns.values()]
        return tuple(lengths) if self.grid else (lengths[0],)

    @property
    def count(self) -> int:
        return math.prod(self.shape)

    def designs(self, start: int, stop: int) -> dict[str, Column]:
        """Return the values of every parameter for the designs from ``start`` up to ``stop``."""
        if not self.grid:
            return {name: column[start:stop] for name, column in self.columns.items()}
        index = np.unravel_index(np.arange(start, stop), self.shape)
        return {name: column[k] for (name, column), k in zip(self.columns.items(), index, strict=True)}


def parse_range(text: str) -> Range:
    """Parse a text such as ``thickness=0.2mm:1mm:20``. Raises InputError for a text that is not understood."""
    name, separator, rest = (part.strip() for part in text.partition("="))
    if not separator or not rest:
        raise InputError(f"'{text[:60]}' is not understood; write {VARY_FORMS}")
    item = varied_parameter(name)
    parts = [part.strip() for part in rest.split(":")]
    log = len(parts) > 2 and parts[-1] == "log"
    parts = parts[:-1] if log else parts
    if len(parts) == 1:
        return Range(item, tuple(item.value(cell.strip()) for cell in rest.split(",")), text=text)
    if item.words or len(parts) > 3 or (len(parts) == 3 and not parts[2].isdecimal()):
        raise InputError(f"'{text[:60]}' is not understood; write {VARY_FORMS}")
    low, high = (float(item.value(part)) for part in parts[:2])
    count = int(parts[2][:20]) if len(parts) == 3 else None
    if count is not None and count > MOST_DESIGNS:
        raise InputError(f"'{text[:60]}': more than the {MOST_DESIGNS} designs that a study may have")
    return Range(item, low=low, high=high, log=log, count=count, text=text)


def parse_each(texts: Iterable[str]) -> list[Range]:
    """Return the range of each text. Raises InputError as `parse_range` does, and for a repeated parameter."""
    ranges = [parse_range(text) for text in texts]
    names = [interval.parameter.name for interval in ranges]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name} is varied twice; give it once")
    return ranges


def range_texts(vary: Vary) -> list[str]:
    """Return what is varied as texts such as ``thickness=0.2mm:1mm``.

    A mapping has for each name a text, a pair (low, high), a triple with a number of points, or one value; numbers are
    in SI units. Raises InputError for a name that is not known.
    """
    if isinstance(vary, str):
        return [vary]
    if not isinstance(vary, Mapping):
        texts = list(vary) if isinstance(vary, Iterable) else [vary]
        for text in texts:
            if not isinstance(text, str):
                raise InputError(f"{argument('vary')} holds {text!r}; write {VARY_FORMS}")
        return texts
    found = []
    for name, value in vary.items():
        parts = list(value) if isinstance(value, tuple | list) else [value]
        unit = varied_parameter(str(name)).unit
        if not parts or not all(isinstance(part, str | int | float | np.number) for part in parts):
            raise InputError(
                f"{argument('vary')}: {name} is {value!r}; give a text, a number, or low, high and a count"
            )
        words = [part if isinstance(part, str) else format_quantity(part, unit) for part in parts[:2]]
        found.append(f"{name}={':'.join([*words, *map(str, parts[2:])])}")
    return found


def grid_plan(texts: Sequence[str]) -> Plan:
    """Return the full grid of axes such as ``thickness=0.2mm:1mm:20`` and ``width=2mm,5mm``. Raises InputError."""
    columns: dict[str, Column] = {}
    for interval in parse_each(texts):
        name, text = interval.parameter.name, interval.text
        if interval.values:
            columns[name] = np.asarray(interval.values)
            continue
        if interval.count is None:
            raise InputError(f"'{text}' does not say how many values; write {text}:20, or give {argument('random')}")
        if interval.count == 1:
            raise InputError(f"'{text}': one value is not a range; write {text.partition(':')[0].strip()}")
        columns[name] = interval.at(np.linspace(0.0, 1.0, interval.count))
        columns[name][-1:] = interval.high
    return Plan(columns, True, "grid of " + ", ".join(texts))


def random_plan(texts: Sequence[str], count: int, method: str = "lhs", seed: int = 0) -> Plan:
    """Return ``count`` random designs over ranges such as ``thickness=0.2mm:1mm``, or lists of values.

    ``method``: lhs (Latin hypercube), sobol (scrambled), uniform. Raises InputError.
    """
    from scipy.stats import qmc

    if method not in METHODS:
        raise wrong_choice("method", method, METHODS)
    if not 1 <= count <= MOST_DESIGNS:
        raise InputError(f"{count} random designs: give 1 to {MOST_DESIGNS}")
    ranges = parse_each(texts)
    for r in ranges:
        if r.count is not None:
            raise InputError(f"'{r.text}': random designs have no number of values a parameter; leave out ':{r.count}'")
    if not ranges:
        raise InputError(f"no designs: say what to vary, such as {VARY_FORMS}")
    random = np.random.default_rng(seed)
    if method == "uniform":
        shares = random.random((count, len(ranges)))
    elif method == "lhs":
        shares = qmc.LatinHypercube(len(ranges), rng=random).random(count)
    else:
        shares = sobol_points(len(ranges), count, seed)[:count]
    columns = {r.parameter.name: r.at(share) for r, share in zip(ranges, shares.T, strict=True)}
    return Plan(columns, False, f"{count} random designs ({method}, seed {seed}) of {', '.join(texts)}")


def sobol_points(dimension: int, count: int, seed: int) -> Array:
    """Return points (count, n) of a scrambled Sobol sequence; count is rounded up to a power of two."""
    from scipy.stats import qmc

    return qmc.Sobol(dimension, rng=np.random.default_rng(seed)).random_base2(math.ceil(math.log2(count)))


def read_plan(path: Path) -> Plan:
    """Read the designs of a CSV file: in each header a parameter with its unit (``thickness_mm``), one design a row.

    A design with a blank cell is impossible. Raises InputError naming file, line and column.
    """
    name = visible(path.name)
    try:
        text = StringIO(read_bytes(path, _MOST_BYTES, "list of designs").decode("utf-8-sig"), newline="")
        rows = [(k, row) for k, row in enumerate(csv.reader(text), 1) if any(c.strip() for c in row)]
    except (UnicodeDecodeError, csv.Error):
        raise InputError(f"{name}: not a table of text; export it as CSV") from None
    if len(rows) < 2:
        raise InputError(f"{name}: give a header row such as thickness_mm,width_mm and at least one design")
    (_, header), *body = rows
    for line, row in body:
        if len(row) > len(header):
            raise InputError(f"{name}: line {line} has {len(row)} cells, the header {len(header)}")
    columns: dict[str, Column] = {}
    for k, title in enumerate(header):
        item, factor = _heading(title.strip(), name)
        if item.name in columns:
            raise InputError(f"{name}: two columns give {item.name}; leave one out")
        cells = [(row[k].strip() if k < len(row) else "", f"{name}: line {line}") for line, row in body]
        values = [_cell(cell, item, factor, where) for cell, where in cells]
        columns[item.name] = np.asarray(values, dtype=None if item.words else float)
    return Plan(columns, False, f"designs of {name}")


def _heading(title: str, source: str) -> tuple[VariedParameter, float]:
    """Return the parameter of a column and the factor to its SI unit."""
    name, unit = (title, "") if title in PARAMETERS else split_header(title)
    try:
        item = varied_parameter(name or title)
        if item.unit and not unit:
            raise InputError(f"no unit; write it like '{title}_{item.unit}'")
        factor = 1.0 if unit in ("", "-", "1") and not item.unit else float(scale(unit, item.unit))
    except InputError as error:
        raise InputError(f"{source}: column '{title[:60]}': {error}") from None
    return item, factor


def _cell(text: str, item: VariedParameter, factor: float, where: str) -> Value:
    if item.words:
        return text
    try:
        return factor * float(text or "nan")
    except ValueError:
        raise InputError(f"{where}: {item.name}: '{text[:40]}' is not a number") from None
