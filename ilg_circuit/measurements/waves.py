"""Readings of a record as they are, all quantities at the same times: no onset is sought, no level averaged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..findings import Finding
from .columns import columns_table
from .kind import RECORD
from .read import read_columns
from .record import Record
from .said import NOTHING, Said
from .table import Table

#: Fewest readings of a record.
_FEWEST = 32
#: Largest part of the readings that may be missing, and be read off between the others.
_MISSING = 0.1
#: What a record may answer with.
ANSWERS = ("displacement", "current", "force")


@dataclass(frozen=True)
class Waves:
    """A ``voltage`` [V] and what answered it, ``answers`` [SI] by quantity, at ``time`` [s], all (n,)."""

    source: str
    time: Array
    voltage: Array
    answers: Mapping[str, Array]
    notes: tuple[Finding, ...] = ()


def read_waves(data: str | Path | Record | Mapping[str, ArrayLike], name: str, said: Said = NOTHING) -> Waves:
    """Return the readings of a file, of columns by header, or of a record that was read.

    Raises
    ------
    InputError
        The file cannot be read, or has no time or no voltage; too few readings, or too many blanks among them.
    """
    kind = replace(RECORD.requiring("time", "voltage"), used=("voltage", *ANSWERS)).told(said)
    if isinstance(data, Record):
        name, data = data.source, data.columns()
    table = read_columns(data, kind) if isinstance(data, str | Path) else columns_table(data, name, kind)
    return _waves(table)


def _waves(table: Table) -> Waves:
    voltage = table.get("voltage")
    if voltage is None:
        raise InputError(f"{table.source}: the column for voltage has no number in it")
    if len(table.time) < _FEWEST:
        raise InputError(f"{table.source}: {len(table.time)} readings; a response needs {_FEWEST} and more")
    every = {name: values for name in ANSWERS if (values := table.get(name)) is not None}
    found = {name: values for name, values in every.items() if np.nanmax(values) > np.nanmin(values)}
    filled = {name: _filled(table, name, values) for name, values in {"voltage": voltage, **found}.items()}
    return Waves(table.source, table.time, filled.pop("voltage"), filled, table.notes)


def _filled(table: Table, name: str, values: Array) -> Array:
    """Return readings with the blanks read off between their neighbours. Raises InputError for too many of them."""
    known = np.isfinite(values)
    if known.all():
        return values
    missing = len(values) - int(known.sum())
    if missing > _MISSING * len(values):
        raise InputError(
            f"{table.source}: {missing} of {len(values)} readings of the {name} are blank; a response needs nine of "
            "ten: give a record with one row for each reading"
        )
    return np.interp(table.time, table.time[known], values[known])
