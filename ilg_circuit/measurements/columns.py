"""Reads measurements that are in memory: columns by header, as in a data frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, is_clock, row
from ..errors import InputError
from .derived import impedance_of, stretch_of
from .header import Column, columns_of
from .kind import LOAD_TEST, RECORD, SPECTRUM, Kind
from .layout import Layout, choose, readable
from .load_test import LOAD_MODES, LoadTest, load_test_of
from .onset import Stated
from .read import record_of
from .record import Record
from .said import NOTHING, Said
from .spectrum import Spectrum, spectrum_of
from .table import Table, table_of


def read_data(
    columns: Mapping[str, ArrayLike],
    name: str = "data",
    *,
    mode: str | None = None,
    onset: Stated = None,
    said: Said = NOTHING,
) -> Record | Spectrum | LoadTest:
    """Return the measurement in ``columns``, arrays (n,) by headers as in a CSV file, such as ``current_mA``.

    ``name`` stands for the data in messages; ``mode`` is for a load test, ``onset`` for a record, ``said`` for columns
    and units that the headers do not state, see `read.read`.

    Raises
    ------
    InputError
        A column is missing, has no unit or holds no numbers, or times decrease; the message names it.
    """
    if said.part is not None or said.cycle is not None or said.point is not None:
        raise InputError(f"{name}: columns in memory are one measurement; part and cycle choose in files")
    kind, layout = _recognised(columns, said)
    table = _table(columns, name, kind, layout)
    if kind == LOAD_TEST:
        if mode is None:
            raise InputError(f"{name}: a load test needs its mode: {', '.join(LOAD_MODES)}")
        return load_test_of(stretch_of(table, kind), mode)
    return spectrum_of(impedance_of(table, kind)) if kind == SPECTRUM else record_of(table, onset)


def columns_table(columns: Mapping[str, ArrayLike], name: str, kind: Kind) -> Table:
    """Return the table of ``columns`` of a ``kind`` in SI units. Raises InputError as `read_data` does."""
    return _table(columns, name, kind, _layout(columns, kind))


def _table(columns: Mapping[str, ArrayLike], name: str, kind: Kind, layout: Layout) -> Table:
    """Return the table of columns in SI units, named by a layout."""
    taken, left, notes = choose(layout, kind, name, 1)
    titles = {quantity: layout.titles[c.place] for quantity, c in taken.items()}
    arrays = {
        quantity: _in_si(columns[titles[quantity]], c, f"{name}: column '{titles[quantity][:80]}'")
        for quantity, c in taken.items()
    }
    if len({len(values) for values in arrays.values()}) > 1:
        sizes = ", ".join(f"{title}: {len(arrays[quantity])}" for quantity, title in titles.items())
        raise InputError(f"{name}: columns have different lengths ({sizes})")
    return table_of(arrays, taken, left, notes, range(len(next(iter(arrays.values())))), name, kind)


def _in_si(values: ArrayLike, column: Column, what: str) -> Array:
    """Return values in SI units (n,); durations and dates have a unit of their own, dates count from midnight on."""
    if column.quantity == "time" and is_clock(values):
        clock = np.asarray(values)
        if clock.dtype.kind == "M" and len(clock):
            clock = clock - clock[0].astype("datetime64[D]")
        return row(clock / np.timedelta64(1, "s"), what)
    return row(values, what) * column.factor


def _recognised(columns: Mapping[str, ArrayLike], said: Said) -> tuple[Kind, Layout]:
    """Return the kind of data whose columns are complete; a record if there is none."""
    layouts = {}
    for kind in (SPECTRUM, RECORD, LOAD_TEST):
        kind = kind.told(said)
        layouts[kind.name] = _layout(columns, kind)
        if layouts[kind.name].complete:
            return kind, layouts[kind.name]
    return RECORD.told(said), layouts[RECORD.name]


def _layout(columns: Mapping[str, ArrayLike], kind: Kind) -> Layout:
    titles = tuple(columns)
    found = tuple(columns_of(titles, ["s" if is_clock(columns[title]) else "" for title in titles], kind))
    return Layout(0, titles, found, 1, ",", kind.complete(readable(found)))
