"""Names of columns: the quantity that a title names, its unit, and which of several columns is taken."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from ..errors import InputError, argument
from ..findings import Finding
from .kind import Kind, Quantities
from .said import in_words, options
from .unit_words import PIXELS, REFERENCE, UNIT_LIKE, clean_unit, tried

#: Longest title that may name a quantity.
_LONGEST_TITLE = 200
#: Ranks of names: the column of lowest rank is taken for a quantity. An instrument's own names rank first.
_STATED, _EXACT, _GENERIC, _ENDING, _SET = -1000, 0, 10, 20, 30
_RANKS = {
    **{"ewe-ece": 0, "<ewe>": 1, "ewe": 2, "control": _SET, "<i>": 0, "time": 0},
    **{"re(z)": 0, "im(z)": 0, "-im(z)": 0, "resistance": _ENDING, "reactance": _ENDING},
}

#: Words beside a quantity's name. A set value is used only where none was measured, a part's time where no other is.
_OF_THE_SOURCE = frozenset(
    (
        *("set", "setpoint", "source", "sourced", "applied", "app", "command", "control", "programmed", "target"),
        *("nominal", "step", "cycle", "segment", "corrected"),
    )
)
_AFTER = frozenset(
    ("applied", "set", "measured", "meas", "avg", "mean", "we", "signal", "value", "reading", "ch", "channel")
)
#: Titles of a recorder's channels: the unit determines the quantity.
_CHANNEL = re.compile(
    r"(?:ch|chan|channel|math|trace|untitled|ai|input|dev\d{1,2}/ai|column|y)[ _]?(?:\d{0,3}|[a-d])|\d{1,3}|[a-d]",
    re.IGNORECASE,
)
#: Titles without a quantity's name: the unit determines the quantity.
_ANY = frozenset(("value", "reading", "measure", "measurement", "source"))

_TIMES = re.compile(r"(\d{1,9}(?:\.\d{1,9})?(?:e-?\d{1,2})?)? ?(\D.{0,40})")


@dataclass(frozen=True)
class Column:
    """One column that names a ``quantity``: its ``place`` in the row, ``title``, ``unit``, and ``factor`` to SI.

    If several columns hold a quantity, the column of lowest ``rank`` is taken. A column that cannot be read has a
    ``complaint``.
    """

    place: int
    title: str
    quantity: str
    unit: str
    factor: float
    rank: int
    complaint: str = ""


def columns_of(titles: Sequence[str], units: Sequence[str], kind: Kind) -> list[Column]:
    """Return the columns that name a quantity of a ``kind``, in the file's order, readable or not.

    The user's statements take precedence, then the words of the format, then the titles. ``units`` are the cells of a
    row of units below the titles, empty where there is none. A title that is only a unit stands for the quantity which
    this unit measures.
    """
    quantities, said = kind.quantities, kind.said
    filled = [title for title in titles if title.strip()]
    bare = len(filled) > 1 and all(UNIT_LIKE.fullmatch(title.strip()) for title in filled)
    there = {q: text for q, text in said.columns.items() if q in quantities}
    meant = {place: q for q, text in there.items() if (place := _place(text, titles)) is not None}
    found = []
    for place, title in enumerate(titles):
        if not title.strip() or len(title.strip()) > _LONGEST_TITLE:
            continue
        below = units[place] if place < len(units) else ""
        if place in meant:
            column: Column | None = _stated(place, title, below, meant[place], "", _STATED, kind)
        elif title.strip().lower() in kind.known:
            quantity, unit = kind.known[title.strip().lower()]
            column = None
            if quantity in quantities:
                rank = list(kind.known).index(title.strip().lower()) - len(kind.known)
                column = _stated(place, title, below, quantity, unit, rank, kind)
        else:
            column = _by_unit(place, title, title, quantities, _EXACT) if bare else None
            column = column or _column(place, title, below, quantities)
        if column is None or (column.quantity in said.columns and place not in meant):
            continue
        if column.quantity in said.units:
            column = _in_unit(column, said.units[column.quantity], quantities)
        found.append(_in_pixels(column, said.scale) if quantities[column.quantity][0] == "m" else column)
    return found


def _in_pixels(column: Column, scale: float | None) -> Column:
    """Return a column of lengths in pixels with the ``scale`` [m] of a pixel; other columns unchanged.

    Without a scale the column gets a complaint. With a scale, a length without a unit is taken to be in pixels.
    """
    bare = column.unit == "" and bool(column.complaint) and scale is not None
    if not bare and not PIXELS.fullmatch(clean_unit(column.unit)):
        return column
    if scale is None:
        return replace(column, complaint=f" is in pixels; say the size of one: {argument('scale', '0.042mm/px')}")
    return replace(column, unit="px", factor=scale, complaint="")


def _in_unit(column: Column, unit: str, quantities: Quantities) -> Column:
    """Return a column in a stated unit, such as mA, or 0.1A: the size of one unit of the file."""
    match = _TIMES.fullmatch(unit.strip())
    times, plain = match.groups() if match else ("1", unit)
    found = _read(column.place, column.title, column.quantity, column.rank, plain, quantities)
    return replace(found, unit=unit, factor=found.factor * float(times or 1))


def _place(text: str, titles: Sequence[str]) -> int | None:
    """Return the index of the title that a user gave: whole, without its unit, or by number from 1; else None."""
    plain = [_word(_plain(title)) for title in titles]
    wanted = _word(_plain(text))
    if wanted in plain:
        return plain.index(wanted)
    short = [{word for word, _ in _splits(_plain(title))} if title.strip() else set() for title in titles]
    found = [place for place, words in enumerate(short) if wanted in words]
    if len(found) == 1:
        return found[0]
    return int(text) - 1 if text.isdecimal() and 0 < len(text) < 5 and 0 < int(text) <= len(titles) else None


def _stated(place: int, title: str, below: str, quantity: str, unit: str, rank: int, kind: Kind) -> Column:
    """Return the column of a known ``quantity``, with the unit of the row below, of the title, or else ``unit``."""
    texts = [below, *(said for _, said in _splits(_plain(title))), unit]
    columns = [_read(place, title, quantity, rank, text, kind.quantities) for text in texts if text.strip()]
    readable = next((c for c in columns if not c.complaint), None)
    if readable is not None or not kind.quantities[quantity][0]:
        return readable or _read(place, title, quantity, rank, "", kind.quantities)
    said = f" has no unit; give it in '{kind.quantities[quantity][0]}' or a multiple of it"
    return next((c for c in columns if below.strip()), Column(place, title, quantity, "", 0.0, rank, said))


def chosen(columns: Sequence[Column], kind: Kind, name: str) -> tuple[dict[str, Column], tuple[Finding, ...]]:
    """Return the column that is taken for each quantity, and a finding where there was a choice.

    Raises
    ------
    InputError
        Two columns give a quantity that ``kind`` needs, and neither has a lower rank.
    """
    taken: dict[str, Column] = {}
    notes = []
    needed = {*kind.required, *kind.way({c.quantity for c in columns if not c.complaint}), *kind.used}
    for quantity in kind.quantities:
        readable = sorted((c for c in columns if c.quantity == quantity and not c.complaint), key=lambda c: c.rank)
        if not readable:
            continue
        first, *others = readable
        if others and others[0].rank == first.rank and quantity != "time":  # one time in two units is one time
            if quantity not in needed:
                continue
            said = [in_words("columns", quantity, first.title, kind.prefix)]
            missing = [q for q in kind.required if all(c.quantity != q for c in columns)]
            if len(missing) == 1:  # as with an oscilloscope, where a shunt's voltage is the current
                si = kind.quantities[missing[0]][0]
                said += [
                    in_words("columns", missing[0], others[0].title, kind.prefix),
                    in_words("units", missing[0], si, kind.prefix),
                ]
            raise InputError(
                f"{name}: columns '{first.title}' and '{others[0].title}' both give the {quantity}; leave one out or "
                f"say which: {options(*said)}"
            )
        taken[quantity] = first
        if others:
            beside = [c.title for c in others]
            notes.append(
                Finding("column-taken", values={"quantity": quantity, "column": first.title, "beside": beside})
            )
    return taken, tuple(notes)


def is_unit_row(cells: Sequence[str]) -> bool:
    """Return True if the cells of a row are units, at least half of them, and none is a number."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    likely = sum(bool(UNIT_LIKE.fullmatch(clean_unit(cell))) or cell in ("-", "#") for cell in filled)
    return bool(filled) and 2 * likely >= len(filled)


def split_header(title: str) -> tuple[str, str]:
    """Return name and unit of a header: ``voltage_V``, ``Voltage [V]``, ``voltage (V)`` or ``voltage/V``."""
    return next(((word, unit) for word, unit in _splits(_plain(title)) if word), ("", ""))


def named(word: str, quantities: Quantities) -> str | None:
    """Return the quantity that a column's name, without its unit, stands for; None for other names."""
    match = _match(_word(word), _words(quantities))
    return match[0] if match else None


def named_unit(title: str, si: str | None) -> str | None:
    """Return the unit in a title that is compatible with ``si``, or any text that looks like a unit, or None."""
    for _, unit in _splits(_plain(title)):
        if si is None:
            if UNIT_LIKE.fullmatch(clean_unit(unit)) or (unit.isalpha() and len(unit) <= 2):
                return unit
        elif unit and not tried(unit, si)[1]:
            return unit
    return None


def _column(place: int, title: str, unit_below: str, quantities: Quantities) -> Column | None:
    """Return the column of one title if it can be divided into a known name and a known unit, else None."""
    plain, words = _plain(title), _words(quantities)
    whole = _match(_word(plain), words)
    if whole and (unit_below.strip() or not quantities[whole[0]][0]):
        return _read(place, title, *whole, unit_below, quantities)
    wrong: Column | None = None
    if whole:
        si = quantities[whole[0]][0]
        said = f" has no unit; write it like '{plain[:80]}_{si}'"
        wrong = Column(place, title, whole[0], "", 0.0, whole[1], said)
    for word, unit in _splits(plain):
        match = _match(word, words)
        if match is not None:
            column = _read(place, title, *match, unit, quantities)
            if not column.complaint or PIXELS.fullmatch(clean_unit(unit)):
                return column
            if not plain.endswith(f" {unit}"):  # else a word of the name, as in "current range"
                wrong = wrong or column
        elif word.rpartition("_")[2] in _ANY:
            rank = _SET if _OF_THE_SOURCE.intersection(word.split("_")) else _EXACT + _GENERIC
            measured = _by_unit(place, title, unit, quantities, rank)
            if measured is not None:
                return measured
        elif _CHANNEL.fullmatch(word) and not unit_below.strip() and (word[-1:].isdigit() or plain[-1:] in ")]"):
            wrong = wrong or _by_unit(place, title, unit, quantities, _EXACT + _GENERIC)
    if wrong is None and unit_below.strip() and _CHANNEL.fullmatch(plain):
        return _by_unit(place, title, unit_below, quantities, _EXACT + _GENERIC)
    return wrong


def _read(place: int, title: str, quantity: str, rank: int, unit: str, quantities: Quantities) -> Column:
    unit = unit.strip()
    factor, complaint = tried(unit, quantities[quantity][0])
    return Column(place, title, quantity, unit, factor, rank, complaint)


def _by_unit(place: int, title: str, unit: str, quantities: Quantities, rank: int) -> Column | None:
    """Return a column of the quantity that its unit measures."""
    for quantity, (si, _) in quantities.items():
        if si:
            column = _read(place, title, quantity, rank, unit, quantities)
            if not column.complaint:
                return column
    return None


def _plain(title: str) -> str:
    """Return a title with plain minus signs and primes, without quotation marks."""
    title = title.strip().strip('"').strip() if title.count('"') > 1 else title.strip()
    title = title.replace("{", "[").replace("}", "]")
    for written, sign in (("\u2212", "-"), ("\u2013", "-"), ("\u2019", "'"), ("\u2032", "'"), ("\u2033", "''")):
        title = title.replace(written, sign)
    return title


def _word(text: str) -> str:
    """Return a name in lower case, its parts joined by underscores."""
    joined = "_".join(text.lower().replace(".", " ").replace(":", " ").replace("_", " ").split())
    return joined.replace("_(", "(").replace("-_", "-")


def _splits(title: str) -> Iterator[tuple[str, str]]:
    """Yield the divisions of a title into a name, as `_word` writes it, and a unit: the likeliest first."""
    if not title.endswith((")", "]")):
        title = REFERENCE.sub("", title)
    if title.endswith((")", "]")):
        start = _opening(title)
        if start > 0:
            yield _word(title[:start]), title[start + 1 : -1].strip()
    slash = _outside(title, "/")
    if slash > 0:
        yield _word(title[:slash]), title[slash + 1 :].strip()
    for separator in (",", "_", " "):
        word, found, unit = title.rpartition(separator)
        if found and word.strip():
            yield _word(word.removesuffix(" in")), unit.strip()


def _opening(title: str) -> int:
    """Return the position of the bracket that is closed by the end of a title; -1 if there is none."""
    depth = 0
    for k in range(len(title) - 1, -1, -1):
        depth += (title[k] in ")]") - (title[k] in "([")
        if depth == 0:
            return k
    return -1


def _outside(title: str, sign: str) -> int:
    """Return the first position of a sign outside all brackets; -1 if there is none."""
    depth = 0
    for k, letter in enumerate(title):
        depth += (letter in "([") - (letter in ")]")
        if letter == sign and depth == 0:
            return k
    return -1


Words = tuple[tuple[str, tuple[str, ...]], ...]


def _words(quantities: Quantities) -> Words:
    return tuple((quantity, words) for quantity, (_, words) in quantities.items())


@lru_cache(maxsize=4096)
def _match(word: str, quantities: Words) -> tuple[str, int] | None:
    """Return the quantity that a word names and the rank of such a name."""
    for quantity, words in quantities:
        if word in words:
            return quantity, _EXACT + _RANKS.get(word, _GENERIC)
    for quantity, words in quantities:
        for w in words:
            if len(w) < 3:
                continue
            if word.endswith("_" + w):
                beside = word[: -len(w) - 1].split("_")
            elif word.startswith(w + "_"):
                beside = word[len(w) + 1 :].split("_")
                if not all(part.lstrip("ch").isdigit() or part in _AFTER for part in beside):
                    continue
            else:
                continue
            ending = _GENERIC if quantity != "time" else _ENDING
            return quantity, _SET if _OF_THE_SOURCE.intersection(beside) else ending
    plain, bracket, remark = word.partition("(")
    if bracket and len(remark) > 4 and remark[:-1].isalpha() and remark.endswith(")"):  # a remark, not a unit
        return _match(plain, quantities)
    return None
