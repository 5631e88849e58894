"""Suggests options for a file that was not understood, with the file's own headers in them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .cells import is_number
from .header import named_unit
from .kind import Kind
from .said import in_words, options

if TYPE_CHECKING:
    from .layout import Layout

#: Patterns of titles that are likely to mean a quantity.
_HINTS = {
    "time": re.compile(r"tim|zeit|temp[os]|sec|dur|elaps|^t\b", re.IGNORECASE),
    "voltage": re.compile(r"vol|pot|span|tens|bias|drive|ampli|vin|^[uev](?![a-z])", re.IGNORECASE),
    "current": re.compile(r"cur|amp|strom|cour|corr|intens|^i(?![a-z])", re.IGNORECASE),
    "displacement": re.compile(r"disp|defl|laser|pos|weg|ext|tip|trav|^[xyd]\b", re.IGNORECASE),
    "frequency": re.compile(r"fr[eé]|hz|omega|^f\b", re.IGNORECASE),
    "re": re.compile(r"re|z'|resist|^r\b|^x\b", re.IGNORECASE),
    "im": re.compile(r"im|z''|z\"|react|^y\b", re.IGNORECASE),
    "minus_im": re.compile(r"-|neg", re.IGNORECASE),
    "stretch": re.compile(r"stret|lam", re.IGNORECASE),
    "strain": re.compile(r"strai|dehn|eps|elong|def", re.IGNORECASE),
    "stress": re.compile(r"stre|span|sig|mpa|kpa", re.IGNORECASE),
    "force": re.compile(r"for|kraft|load|last", re.IGNORECASE),
}
#: Pattern of current densities, which are not currents.
_DENSITY = re.compile(r"dens|dichte|/ ?[cm]?m(?:2|\^2|\u00b2)", re.IGNORECASE)


def suggestion(layout: Layout, kind: Kind, missing: Sequence[str], left: Sequence[str]) -> str:
    """Return a clause with options that assign titles out of ``left`` to the ``missing`` quantities.

    Empty if there is no useful suggestion.
    """
    said: list[tuple[str, str, str]] = []
    numbers = all(is_number(title.strip()) for title in layout.titles)
    spoken = {c.title.strip() for c in layout.columns}
    titles = (
        [str(k) for k in range(1, len(layout.titles) + 1)] if numbers else [t for t in left if t not in ("", *spoken)]
    )
    if len(layout.titles) < 2:
        return ""
    wanted = [q for q in missing if q in kind.required or q in _spoken(layout, kind)]
    if "stretch" in wanted and not any(_HINTS["stretch"].search(t[:100]) for t in titles):
        strains = any(_HINTS["strain"].search(t[:100]) for t in titles)
        wanted = ["strain" if q == "stretch" and strains else q for q in wanted]
    for quantity in wanted:
        si = kind.quantities[quantity][0]
        columns = [c for c in layout.columns if c.quantity == quantity]
        if columns:
            garbled = any(not letter.isprintable() or letter in "?\ufffd\u00e6" for c in columns for letter in c.unit)
            if not si or not (garbled or any(c.unit == "" for c in columns)):
                return ""  # its unit belongs to another quantity
            said.append(_in_unit(kind, quantity, f"u{si}" if garbled else _unit(columns[0].title, si)))
            continue
        title = _likely(quantity, si, titles)
        if title is None:
            return ""
        titles.remove(title)
        shown = title if title.isprintable() else str([t.strip() for t in layout.titles].index(title) + 1)
        said.append(in_words("columns", quantity, shown, kind.prefix))
        if si and not named_unit(title, si):
            said.append(_in_unit(kind, quantity, _unit(title, si)))
    return f"; or say what it is, if so: {options(*said)}" if said else ""


def _in_unit(kind: Kind, quantity: str, unit: str) -> tuple[str, str, str]:
    """Return the statement on a unit; coordinates of a track have the unit of the displacement."""
    return in_words("units", "displacement" if quantity in ("x", "y") else quantity, unit, kind.prefix)


def _unit(title: str, si: str) -> str:
    """Return the unit that a title without one may have; a word such as millis gives its prefix."""
    usual = "m" if si == "m" else ""
    prefix = next((p for word, p in (("milli", "m"), ("micro", "u"), ("kilo", "k")) if word in title.lower()), usual)
    return prefix + si


def _spoken(layout: Layout, kind: Kind) -> tuple[str, ...]:
    """Return the way of a ``kind`` with the most columns; optional quantities count if they have a column."""
    there = {c.quantity for c in layout.columns}
    way = max(kind.ways, key=lambda w: sum(q in there for q in w))
    return (*way, *(q for q in kind.used if q in there))


def _likely(quantity: str, si: str, titles: Sequence[str]) -> str | None:
    """Return the title that most likely means a quantity, None if there is none."""
    hint = _HINTS.get(quantity)

    def worth(title: str) -> int:
        if quantity == "current" and _DENSITY.search(title[:100]):
            return -1
        readable, other = named_unit(title, si) is not None and bool(si), named_unit(title, None) is not None
        return (4 if readable else -8 if other else 0) + (3 if hint and hint.search(title[:100]) else 0)

    best = max(titles, key=worth, default=None)
    return best if best is not None and worth(best) >= 0 else None
