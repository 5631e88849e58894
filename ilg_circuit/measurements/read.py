"""Reads measured files; format and kind of data are recognised by the content."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import overload

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument
from ..findings import Finding
from .formats import BINARIES, FORMATS, Format, bare, csv
from .kind import LOAD_TEST, RECORD, SPECTRUM, TRACK, Kind
from .load_test import LOAD_MODES, LoadTest, load_test_of
from .onset import Stated
from .prepare import prepare
from .record import Record
from .said import NOTHING, Said
from .spectrum import Spectrum, spectrum_of
from .table import Table
from .text import TextFile, read_raw, text_of


@overload
def read(path: str | Path, *, onset: Stated = None, said: Said = NOTHING) -> Record | Spectrum: ...
@overload
def read(path: str | Path, mode: str, *, said: Said = NOTHING) -> Record | Spectrum | LoadTest: ...
def read(
    path: str | Path, mode: str | None = None, onset: Stated = None, said: Said = NOTHING
) -> Record | Spectrum | LoadTest:
    """Read a file of any kind and format, ready for a fit.

    Parameters
    ----------
    path
        Text with a name and a unit for every column, or what one of `FORMATS` or `BINARIES` recognises.
    mode
        Mode of a load test, which its file does not state: uniaxial, equibiaxial or planar.
    onset
        When the excitation of a record began, see `prepare`.
    said
        Columns and units that the headers do not state, and which of several measurements to take.

    Raises
    ------
    InputError
        The file cannot be read; the message names file, line and column, and says what to do.
    """
    file, said = _lines(path, RECORD, said)
    format_, kind = _recognised(file, said)
    if kind == LOAD_TEST:
        if mode is None:
            raise InputError(
                f"{file.name}: holds a load test, whose mode is not known; fit it with the command ogden, or give its "
                f"mode: {', '.join(LOAD_MODES)}"
            )
        return load_test_of(_table(file, format_, kind), mode)
    if kind == TRACK:
        raise InputError(
            f"{file.name}: holds a displacement alone; give it by {argument('displacement')} beside a file of voltage "
            f"and current, or state what drove it: {argument('drive', 'step:2V')}"
        )
    table = _table(file, format_, kind)
    return spectrum_of(table) if kind == SPECTRUM else record_of(table, onset)


def read_record(path: str | Path, onset: Stated = None, said: Said = NOTHING) -> Record:
    """Read a record over time: columns of time, voltage, current and, if there is one, displacement.

    ``onset`` states when its excitation began, see `prepare`.

    Raises
    ------
    InputError
        The file cannot be read, holds no record, or nothing was excited in it; see `prepare`.
    """
    return record_of(read_columns(path, RECORD.told(said)), onset)


def read_spectrum(path: str | Path, said: Said = NOTHING) -> Spectrum:
    """Read an impedance spectrum; `spectrum.prepare_spectrum` lists the points that are dropped.

    Raises
    ------
    InputError
        The file cannot be read or holds no spectrum.
    """
    return spectrum_of(read_columns(path, SPECTRUM.told(said)))


def read_load_test(path: str | Path, mode: str, said: Said = NOTHING) -> LoadTest:
    """Read a load test: columns ``stretch`` and ``stress_<unit>`` (nominal) or ``true_stress_<unit>``.

    A true stress is divided by the stretch. Rows with a blank in either column are gaps. A strain is the stretch
    minus 1; displacements and forces need the specimen's length and section, from the file or from ``said``.

    Raises
    ------
    InputError
        The file cannot be read, holds no load test, or ``mode`` is none of uniaxial, equibiaxial and planar.
    """
    return load_test_of(read_columns(path, LOAD_TEST.told(said)), mode)


def read_waveform(path: str | Path, quantity: str, said: Said = NOTHING) -> tuple[Array, Array, tuple[Finding, ...]]:
    """Read the times [s] and values [SI] of one quantity of a waveform, both (n,), and findings; gaps are left out.

    Times do not decrease; a repeated time is an edge.

    Raises
    ------
    InputError
        The file cannot be read, or its column for ``quantity`` is missing or blank.
    """
    table = read_columns(path, RECORD.drawn("time", quantity).told(said))
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
    file, said = _lines(path, kind, kind.said)
    kind = kind.told(said)
    return _table(file, _format(file, kind), kind)


def record_of(table: Table, onset: Stated = None) -> Record:
    """Return the record in the columns of a table, see `prepare`."""
    return replace(prepare(table, onset), headers=table.headers)


def _lines(path: str | Path, kind: Kind, said: Said) -> tuple[TextFile, Said]:
    """Return the lines of a file that should hold a ``kind``; the format of a binary file makes them from its bytes.

    The second answer is ``said`` without the statements that were applied.
    """
    file = read_raw(path, kind)
    if Path(path).suffix.lower() == ".toml":
        raise InputError(
            f"{path}: is the file of a strip, not of a measurement; identify DATA.csv --actuator {path} fits a "
            "measurement of it, simulate runs it"
        )
    for binary in BINARIES:
        if binary.opens(file.raw):
            lines, left = binary.lines(file.raw, file.name, said)
            return TextFile(file.name, lines, len(file.raw)), left
    return text_of(file, kind), said


def _recognised(file: TextFile, said: Said) -> tuple[Format, Kind]:
    """Return the format of a file and the kind of data in it, with the user's statements on the file."""
    for kind in (SPECTRUM, RECORD, LOAD_TEST):
        if said.columns and said.quantities.issubset(kind.quantities):
            others = [k for k in (SPECTRUM, RECORD, LOAD_TEST) if k != kind]
            if not any(said.quantities.issubset(other.quantities) for other in others):
                return _format(file, kind.told(said)), kind.told(said)
    for format_ in FORMATS:
        found = csv.recognises(file.lines, said) if format_ is csv else format_.recognises(file.lines)
        if found == SPECTRUM and file.size > SPECTRUM.most_bytes:  # a file of this size holds a record
            found = RECORD
            format_ = _format(file, RECORD.told(said))
        if found is not None:
            return format_, found.told(said)
    raise AssertionError("the last format takes every file")


def _format(file: TextFile, kind: Kind) -> Format:
    """Return the first format that recognises a file, among those whose files may hold a ``kind``."""
    formats = [f for f in FORMATS if kind in f.KINDS and not (f is bare and kind.said.columns)]
    return next(f for f in formats if f.recognises(file.lines))


def _table(file: TextFile, format_: Format, kind: Kind) -> Table:
    if not any(line.strip() for line in file.lines):
        raise InputError(f"{file.name}: the file is empty; it needs a header row such as {kind.example}")
    if kind.said.point is not None and (kind != TRACK or format_ is csv):
        raise InputError(
            f"{file.name}: {argument('part', kind.said.point[:40])}: no points have names in it; leave it out, or "
            "count measurements from 1"
        )
    if kind.most_rows and len(file.lines) > 5 * kind.most_rows:
        raise InputError(f"{file.name}: {len(file.lines)} lines; that is no {kind.name}")
    return format_.read(file.lines, file.name, kind)
