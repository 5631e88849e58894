"""What ngspice's `wrdata` writes: columns of numbers, a time before each value, names where wr_vecnames is set."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..kind import RECORD, Kind
from ..table import Rows, Table, parse_rows

NAME = "ngspice wrdata"
KINDS: tuple[Kind, ...] = (RECORD,)

_VOLTAGE, _CURRENT = (
    re.compile(r"v\([^()]{1,60}\)", re.IGNORECASE),
    re.compile(r"i\([^()]{1,60}\)|\S{1,60}#branch|@\S{1,60}\[i\]"),
)


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return RECORD for a row of names that begins with a time and has vectors of ngspice."""
    words = lines[0].split() if lines and len(lines[0]) < 2000 else []
    vectors = [word for word in words[1:] if word != "time"]
    named = bool(vectors) and all(_VOLTAGE.fullmatch(w) or _CURRENT.fullmatch(w) for w in vectors)
    return RECORD if words[:1] == ["time"] and named else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the times and the vectors, v(...) in volts and currents in amperes.

    Raises
    ------
    InputError
        There is no voltage or no current, or more than one of them; ``--columns`` says which.
    """
    titles = lines[0].split()
    kept = [k for k, title in enumerate(titles) if k == 0 or title != "time"]
    known = {"time": ("time", "s")}
    rows: Rows = [(1, [titles[k] for k in kept])]
    units = ["s", *("V" if _VOLTAGE.fullmatch(titles[k]) else "A" for k in kept[1:])]
    rows.append((1, units))
    for k, line in enumerate(lines[1:], 2):
        if line.strip():
            cells = line.split()
            rows.append((k, [cells[j] if j < len(cells) else "" for j in kept]))
    return parse_rows(rows, name, kind.knowing(known), ())
