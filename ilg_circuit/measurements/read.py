"""Reading measured files: which format a file has and what it holds, its content tells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import overload

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..findings import Finding
from .formats import FORMATS, Format
from .kind import LOAD_TEST, RECORD, SPECTRUM, Kind
from .load_test import LOAD_MODES, LoadTest, load_test_of
from .onset import Stated
from .prepare import prepare
from .record import Record
from .spectrum import Spectrum, spectrum_of
from .table import Table
from .text import TextFile, read_lines


@overload
def read(path: str | Path, *, onset: Stated = None) -> Record | Spectrum: ...
@overload
def read(path: str | Path, mode: str) -> Record | Spectrum | LoadTest: ...
def read(path: str | Path, mode: str | None = None, onset: Stated = None) -> Record | Spectrum | LoadTest:
    """Read a file of any kind and format, ready for a fit.

    Parameters
    ----------
    path
        CSV with a name and a unit for every column, EC-Lab's text, Gamry's .DTA, ZPlot's .z, or bare numbers.
    mode
        Of a load test, which its file does not say: uniaxial, equibiaxial or planar.
    onset
        Of a record: when its excitation began, see `prepare`.

    Raises
    ------
    InputError
        The file cannot be read; the message names file, line and column, and says what to do.
    """
    file = read_lines(path, RECORD)
    format_, kind = _recognised(file)
    if kind == LOAD_TEST:
        if mode is None:
            raise InputError(
                f"{file.name}: holds a load test, whose mode is not known; fit it with the command ogden, or give its "
                f"mode: {', '.join(LOAD_MODES)}"
            )
        return load_test_of(_table(file, format_, kind), mode)
    table = _table(file, format_, kind)
    return spectrum_of(table) if kind == SPECTRUM else record_of(table, onset)


def read_record(path: str | Path, onset: Stated = None) -> Record:
    """Read a record over time: columns of time, voltage, current and, if there is one, displacement.

    ``onset`` says when its excitation began, see `prepare`.

    Raises
    ------
    InputError
        The file cannot be read, holds no record, or nothing was excited in it; see `prepare`.
    """
    return record_of(read_columns(path, RECORD), onset)


def read_spectrum(path: str | Path) -> Spectrum:
    """Read an impedance spectrum; `spectrum.prepare_spectrum` says what is dropped.

    Raises
    ------
    InputError
        The file cannot be read or holds no spectrum.
    """
    return spectrum_of(read_columns(path, SPECTRUM))


def read_load_test(path: str | Path, mode: str) -> LoadTest:
    """Read a load test: columns ``stretch`` and ``stress_<unit>`` (nominal) or ``true_stress_<unit>``.

    A true stress is divided by the stretch. Rows with a blank in either column are gaps.

    Raises
    ------
    InputError
        The file cannot be read, holds no load test, or ``mode`` is none of uniaxial, equibiaxial and planar.
    """
    return load_test_of(read_columns(path, LOAD_TEST), mode)


def read_waveform(path: str | Path, quantity: str) -> tuple[Array, Array, tuple[Finding, ...]]:
    """Read the times [s] and values [SI] of one quantity of a waveform, both (n,), and findings; gaps are left out.

    Times do not decrease; one that stands twice is an edge.

    Raises
    ------
    InputError
        The file cannot be read, or its column for ``quantity`` is missing or blank.
    """
    table = read_columns(path, RECORD.drawn("time", quantity))
    values = table.columns[quantity]
    known = np.isfinite(values)
    if not known.any():
        raise InputError(f"{table.source}: the column for {quantity} has no number in it")
    return table.time[known], values[known], table.notes


def read_columns(path: str | Path, kind: Kind) -> Table:
    """Read the columns of a file that holds a ``kind``, in SI units and as they are.

    Raises
    ------
    InputError
        The file cannot be read, or a column that ``kind`` requires is missing.
    """
    file = read_lines(path, kind)
    return _table(file, _format(file, kind), kind)


def record_of(table: Table, onset: Stated = None) -> Record:
    """Return the record in the columns of a table, see `prepare`."""
    return replace(prepare(table, onset), headers=table.headers)


def _recognised(file: TextFile) -> tuple[Format, Kind]:
    """Return the format of a file and the kind of data in it; a file too large for a spectrum holds a record."""
    for format_ in FORMATS:
        kind = format_.recognises(file.lines)
        if kind == SPECTRUM and file.size > SPECTRUM.most_bytes:
            return _format(file, RECORD), RECORD
        if kind is not None:
            return format_, kind
    raise AssertionError("the last format takes every file")


def _format(file: TextFile, kind: Kind) -> Format:
    """Return the first format that recognises a file, among those whose files may hold a ``kind``."""
    return next(f for f in FORMATS if kind in f.KINDS and f.recognises(file.lines))


def _table(file: TextFile, format_: Format, kind: Kind) -> Table:
    if not any(line.strip() for line in file.lines):
        raise InputError(f"{file.name}: the file is empty; it needs a header row such as {kind.example}")
    if kind.most_rows and len(file.lines) > 5 * kind.most_rows:
        raise InputError(f"{file.name}: {len(file.lines)} lines; that is no {kind.name}")
    return format_.read(file.lines, file.name, kind)
