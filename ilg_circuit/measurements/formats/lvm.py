"""LabVIEW's measurement files (.lvm): segments with a header each, times in a column or by a start and a step."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ..cells import number
from ..kind import RECORD, Kind
from ..said import pick
from ..table import Rows, Table, parse_rows

NAME = "LabVIEW"
KINDS: tuple[Kind, ...] = (RECORD,)

_END = "***End_of_Header***"


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return RECORD for a file that begins with the format's name."""
    return RECORD if lines and lines[0].startswith("LabVIEW Measurement") else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the record in the segment that is meant: the units of its channels stand in its header.

    Raises
    ------
    InputError
        Several segments and none chosen, or a column is missing or cannot be read.
    """
    sign = (
        "," if any(line.replace(",", "\t").split("\t")[:2] == ["Separator", "Comma"] for line in lines[:40]) else "\t"
    )
    ends = [k for k, line in enumerate(lines) if line.startswith(_END)]
    if len(ends) < 2:
        raise InputError(f"{name}: a LabVIEW file without a segment of readings")
    parts = [(f"segment below line {k + 1}", k) for k in ends[1:]]
    end = pick(parts, kind.said, name)
    begin = ends[ends.index(end) - 1]
    head = {row[0].strip(): row[1:] for row in (line.split(sign) for line in lines[begin + 1 : end])}
    titles = [cell.strip() for cell in lines[end + 1].split(sign)] if end + 1 < len(lines) else []
    channels = [title for title in titles[1:] if title != "Comment"]
    units = [cell.strip() for cell in head.get("Y_Unit_Label", [])] + [""] * len(channels)
    rows: Rows = []
    for k in range(end + 2, len(lines)):
        cells = [cell.strip() for cell in lines[k].split(sign)]
        if not any(cells):
            continue
        if cells[0] == "Channels" or cells[0].startswith("***"):
            break
        rows.append((k + 1, cells[: len(channels) + 1]))
    if rows and not any(cells[0] for _, cells in rows):
        start, step = _setting(head, "X0", name), _setting(head, "Delta_X", name)
        rows = [(k, [repr(start + j * step), *cells[1:]]) for j, (k, cells) in enumerate(rows)]
    table = [(end + 2, ["X_Value", *channels]), (end + 2, ["s", *units[: len(channels)]]), *rows]
    return parse_rows(table, name, kind.whole.knowing({"x_value": ("time", "s")}), ())


def _setting(head: dict[str, list[str]], word: str, name: str) -> float:
    value = number((head.get(word) or [""])[0].strip(), "\t")
    if value is None:
        raise InputError(f"{name}: no times: the segment's header has no {word}")
    return value
