"""ZPlot's data files (.z), old and new: an impedance spectrum below a row of names such as Freq(Hz) and Z'(a)."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ..kind import SPECTRUM, Kind
from ..table import Table, spectrum_of_cells

NAME = "ZPlot"
KINDS: tuple[Kind, ...] = (SPECTRUM,)

_TITLES = ("Freq(Hz)", "Z'(a)", "Z''(b)")


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return SPECTRUM if the first line begins with ZPlot's name."""
    return SPECTRUM if lines and lines[0].lstrip('\ufeff" ').lower().startswith("zplot") else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the spectrum.

    Raises
    ------
    InputError
        The row of names or one of its columns is missing, or a cell is no number.
    """
    start = next((k for k, line in enumerate(lines) if "freq(hz)" in line.lower()), None)
    if start is None:
        raise InputError(f"{name}: a ZPlot file without a row of names (Freq(Hz) ... Z'(a) Z''(b))")
    header = lines[start].replace('"', " ").lower().split()
    rows = [
        (k, re.split(r"\s*[,\t]\s*|\s+", line.strip()))
        for k, line in enumerate(lines[start + 1 :], start + 2)
        if line.strip() and "end comments" not in line.lower()
    ]
    return spectrum_of_cells(header, _TITLES, rows, name, kind)
