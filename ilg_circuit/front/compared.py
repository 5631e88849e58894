"""Compares the prediction of a run with a measurement."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import InputError
from ..findings import Finding
from ..measurements.kind import RECORD
from ..measurements.prepare import prepare
from ..measurements.read import read_columns
from ..measurements.record import Record
from ..measurements.said import Said
from ..simulation.compared import Compared
from ..strip.actuator import Actuator
from .data import Source, read
from .given import Driven


def compared(
    strip: Actuator, drive: Driven, measured: Source | bool, until: float, said: Said, **how: Any
) -> tuple[tuple[Compared, ...], tuple[Finding, ...]]:
    """Return the prediction up to ``until`` [s] beside a ``measured`` record, and findings.

    With ``measured`` True it is the drive's own file, if it holds a current; a file that cannot be compared is then a
    finding. ``how`` are the options of `identification.comparison.compare`. Raises InputError for other data that are
    no record.
    """
    path = _file_of(drive) if measured is True else None
    if measured is True and (path is None or not path.is_file()):  # a pipe has been read already
        return (), ()
    from ..identification.comparison import compare, outside_findings

    if path is None:
        parts = compare(strip, _record(measured, said), until=until, **how)
        return parts, outside_findings(parts)
    held = read_columns(path, RECORD.drawn("time").told(said))
    if held.get("current") is None or held.get("voltage") is None:
        return (), ()
    try:
        parts = compare(strip, _record(path, said), until=until, **how)
    except InputError as error:
        return (), (Finding("not-compared", values={"reason": str(error)}),)
    return parts, outside_findings(parts)


def _file_of(drive: Driven) -> Path | None:
    """Return the file that a drive's text names: of a voltage, or of a current without a limit of its source."""
    if not isinstance(drive, str):
        return None
    text = drive.removeprefix("current:")
    if text.startswith("file:"):
        return Path(text.removeprefix("file:"))
    return Path(text) if text != drive and Path(text).is_file() else None


def _record(measured: Source | bool, said: Said) -> Record:
    if isinstance(measured, str | Path):
        return prepare(read_columns(measured, RECORD.requiring("time").told(said)))
    found = read(measured)
    if not isinstance(found, Record):
        raise InputError(f"compare is a {type(found).__name__}; give a record: time, voltage, current")
    return found
