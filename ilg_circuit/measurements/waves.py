"""Readings of a record as they are, all quantities at the same times: no onset is sought, no level averaged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, argument
from ..findings import Finding
from .columns import columns_table
from .kind import RECORD, Kind
from .read import read_columns
from .record import Record
from .said import NOTHING, Said
from .table import Table

#: Fewest readings of a record.
FEWEST = 32
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


@dataclass(frozen=True)
class Sensed:
    """The ``displacement`` [m] of a tip that was moved, and the ``signal`` of the strip, at ``time`` [s] from 0, (n,).

    The ``quantity`` is a voltage [V] between open ``terminals`` ("open"), or a current [A] through shorted ones
    ("short").
    """

    source: str
    time: Array
    displacement: Array
    signal: Array
    terminals: str
    notes: tuple[Finding, ...] = ()

    @property
    def quantity(self) -> str:
        """ "voltage" or "current"."""
        return "voltage" if self.terminals == "open" else "current"

    @property
    def unit(self) -> str:
        """Unit of the signal."""
        return "V" if self.terminals == "open" else "A"


#: A file, columns by header, or a record that was read.
Readings = str | Path | Record | Mapping[str, ArrayLike]


def read_sensed(data: Readings, name: str, terminals: str | None = None, said: Said = NOTHING) -> Sensed:
    """Return the readings of a sense record; its ``terminals`` by default by which of voltage and current it has.

    Raises
    ------
    InputError
        The file cannot be read, or has no motion, or no signal, or both and ``terminals`` does not say which.
    """
    used = ("displacement", "voltage", "current")
    table = _read(data, name, replace(RECORD.requiring("time"), used=used), said)
    found = {q: values for q in used if (values := table.get(q)) is not None}
    motion = found.pop("displacement", None)
    if motion is None or not np.nanmax(motion) > np.nanmin(motion):
        what = "no column of the displacement" if motion is None else "its displacement does not move"
        raise InputError(
            f"{table.source}: a sense record without motion: {what}; give time_s, displacement_mm and voltage_mV or "
            "current_uA of a strip whose tip is moved"
        )
    signals = {q: values for q, values in found.items() if np.nanmax(values) > np.nanmin(values)}
    if terminals is not None:
        signals = {q: v for q, v in signals.items() if q == ("voltage" if terminals == "open" else "current")}
    if len(signals) != 1:
        what = "both a voltage and a current" if signals else "no voltage or current that changes"
        raise InputError(
            f"{table.source}: has {what}; a sense record has one of them"
            + (
                f": say which by {argument('terminals', 'open')} or short"
                if signals
                else ", between or through the terminals"
            )
        )
    if len(table.time) < FEWEST:
        raise InputError(f"{table.source}: {len(table.time)} readings; sensing needs {FEWEST} and more")
    ((quantity, signal),) = signals.items()
    moved, shown = _filled(table, "displacement", motion), _filled(table, quantity, signal)
    ends = "open" if quantity == "voltage" else "short"
    return Sensed(table.source, table.time - table.time[0], moved, shown, ends, table.notes)


def _read(data: Readings, name: str, kind: Kind, said: Said) -> Table:
    """Return the table of a file, of columns or of a record."""
    kind = kind.told(said)
    if isinstance(data, Record):
        name, data = data.source, data.columns()
    return read_columns(data, kind) if isinstance(data, str | Path) else columns_table(data, name, kind)


def read_waves(data: Readings, name: str, said: Said = NOTHING) -> Waves:
    """Return the readings of a file, of columns by header, or of a record that was read.

    Raises
    ------
    InputError
        The file cannot be read, or has no time or no voltage; too few readings, or too many blanks among them.
    """
    return _waves(_read(data, name, replace(RECORD.requiring("time", "voltage"), used=("voltage", *ANSWERS)), said))


def _waves(table: Table) -> Waves:
    voltage = table.get("voltage")
    if voltage is None:
        raise InputError(f"{table.source}: the column for voltage has no number in it")
    if len(table.time) < FEWEST:
        raise InputError(f"{table.source}: {len(table.time)} readings; a response needs {FEWEST} and more")
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
