"""ZPlot's data files (.z), old and new: an impedance spectrum below a row of names such as Freq(Hz) and Z'(a)."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ..derived import impedance_of
from ..kind import SPECTRUM, Kind
from ..table import Table, parse_rows

NAME = "ZPlot"
KINDS: tuple[Kind, ...] = (SPECTRUM,)

_KNOWN = {"freq(hz)": ("frequency", "Hz"), "z'(a)": ("re", "ohm"), "z''(b)": ("im", "ohm")}


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return SPECTRUM if the first line begins with ZPlot's name."""
    return SPECTRUM if lines and lines[0].lstrip('\ufeff" ').lower().startswith("zplot") else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the spectrum.

    Raises
    ------
    InputError
        The row of names or one of its columns is missing, or a cell is not a number.
    """
    start = next((k for k, line in enumerate(lines) if "freq(hz)" in line.lower()), None)
    if start is None:
        raise InputError(f"{name}: a ZPlot file without a row of names (Freq(Hz) ... Z'(a) Z''(b))")
    header = lines[start].replace('"', " ").split()
    rows = [
        (k, re.split(r"\s*[,\t]\s*|\s+", line.strip()))
        for k, line in enumerate(lines[start + 1 :], start + 2)
        if line.strip() and "end comments" not in line.lower()
    ]
    if not rows:
        raise InputError(f"{name}: its table of impedances has no rows")
    kind = kind.knowing(_KNOWN)
    return impedance_of(parse_rows([(start + 1, header), *rows], name, kind, ()), kind)
