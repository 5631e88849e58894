"""Measured data as users have them: paths, data frames, arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, argument, checked
from ..measurements.columns import read_data
from ..measurements.film import Film
from ..measurements.load_test import LoadTest
from ..measurements.onset import Stated
from ..measurements.read import read as read_file
from ..measurements.read import read_load_test
from ..measurements.record import Record
from ..measurements.said import NOTHING, Said, said_of
from ..measurements.spectrum import Spectrum
from ..measurements.track import Track, beside, read_track, track_data
from ..units import si
from .each_file import values_of
from .films import film
from .given import Driven

#: One set of data that was read.
Measured: TypeAlias = Record | Spectrum | LoadTest | Film
#: One set of data: a path, what was read of one, or columns by header: a data frame or a mapping of arrays.
Source: TypeAlias = "str | Path | Measured | Mapping[str, ArrayLike] | Any"

#: Arrays by keyword -> the headers of their columns, SI units.
_HEADERS = {
    "time": "time_s",
    "voltage": "voltage_V",
    "current": "current_A",
    "displacement": "displacement_m",
    "force": "force_N",
    "charge": "charge_C",
    "frequency": "frequency_Hz",
    "stretch": "stretch",
    "stress": "stress_Pa",
}


@checked
def read(
    *data: Source,
    mode: str | None = None,
    onset: Stated | str = None,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | str | None = None,
    cycle: int | None = None,
    length: str | float | None = None,
    section: str | float | None = None,
    displacement: Any = None,
    scale: str | float | None = None,
    fps: float | None = None,
    axis: str | None = None,
    **arrays: ArrayLike,
) -> Measured | list[Measured]:
    """Return measured data, ready for a fit: one set, or a list where several are given.

    Parameters
    ----------
    *data : str, Path, DataFrame, mapping, Record, Spectrum or a list of these
        Paths of files; or columns by header, such as ``current_mA``: a pandas data frame, or a mapping of arrays.
    mode : {"uniaxial", "equibiaxial", "planar"}, optional
        Kind of a load test.
    onset : float or str, optional
        When a record's excitation began: a time [s] or a text such as "4 s", or the reading "last-rest" or
        "first-level" (default: found in the data, between two readings).
    columns : mapping of str to str, optional
        Titles of columns by quantity, if headers are not understood: ``{"voltage": "Potential (V)"}``.
    units : mapping of str to str, optional
        Units by quantity, likewise: ``{"time": "s"}``.
    part : int or str, optional
        Which of several measurements in a file, from 1; or the name of the point that a camera's file tracks.
    cycle : int, optional
        Which cycle of a record.
    length : float or str, optional
        Free length of a load test's specimen [m], where a displacement was measured.
    section : float or str, optional
        Its undeformed section [m^2], where a force was measured.
    displacement : str, Path, DataFrame, mapping, tuple of two arrays, or list of these; optional
        The displacement of each record, on a clock of its own: a file, columns by header, or times [s] and
        values [m]. Statements on ``displacement.time`` in ``columns`` and ``units`` apply to it. With arrays by keyword
        it may also be one of them.
    scale : str or float, optional
        Size of a camera's pixel: "0.042mm/px", "23.8px/mm", or metres.
    fps : float, optional
        Frames a second, where a camera's file has frames and no times.
    axis : str, optional
        Direction of the displacement of a point with x and y: "x", "y", "-x", "-y" or an angle from x to y such as
        "30deg" (default: the direction of largest motion, stated in a finding).
    **arrays : array_like
        Arrays (n,) in SI units in place of ``data``: ``time``, ``voltage``, ``current``, ``displacement``, ``force``,
        ``charge``; or ``frequency`` and complex ``impedance``; or ``stretch`` and ``stress``.

    Returns
    -------
    Record, Spectrum or LoadTest, or a list
        The data in SI units, with findings on what was left out.

    Raises
    ------
    InputError
        A file or a column cannot be read, or one that is needed is missing; the message names it.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> t = np.arange(-5.0, 60.0, 0.5)
    >>> current = np.where(t < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-t / 7))
    >>> record = ilg.read(time=t, voltage=np.where(t < 0, 0.0, 4.0), current=current)
    >>> record.step
    4.0
    """
    arrays, displacement = one_of(arrays, displacement)
    if bool(data) == bool(arrays):
        raise InputError("give paths, a data frame or columns; or arrays by keyword, such as time=, voltage=, current=")
    at = onset_of(onset)
    sources = data or (by_header(arrays),)
    said = said_of(
        columns,
        units,
        part,
        cycle,
        None if length is None else si(length, "m", argument("length")),
        None if section is None else si(section, "m^2", argument("section")),
        scale=scale,
        rate=fps,
        axis=axis,
    )
    own = said if displacement is None else said.of_data
    found = [_read(s, mode, at, own, f"data {k + 1}" if len(sources) > 1 else "data") for k, s in enumerate(sources)]
    if displacement is not None:
        found = beside(found, _tracks(displacement, said.of_track))
    return found if len(found) > 1 else found[0]


def sets_of(
    data: Source | Sequence[Source],
    onset: Stated | str | Mapping[str, Stated | str] = None,
    said: Said = NOTHING,
    displacement: Any = None,
    drive: Driven | Mapping[str, Driven] | None = None,
    until: float | None = None,
) -> list[Measured]:
    """Return the sets of data of one source or of several, read where they are not; ``onset`` may be by file.

    A ``displacement`` of its own, or a list of them, is set beside the records. A source with a ``drive``, which may be
    by file too, is a displacement alone, used ``until`` so long [s] after the onset.
    """
    several = list(data) if isinstance(data, list | tuple) else [data]
    if not several:
        raise InputError("no data were given; give paths, data frames, or what ilg.read returned")
    onsets = values_of(onset, several, "onset") if isinstance(onset, Mapping) else [onset] * len(several)
    drives = values_of(drive, several, "drive") if isinstance(drive, Mapping) else [drive] * len(several)
    names = [f"data {k + 1}" if len(several) > 1 else "data" for k in range(len(several))]
    own = said if displacement is None else said.of_data
    found = [
        _read(s, None, onset_of(at), own, name) if driven is None else _film(s, driven, onset_of(at), said, name, until)
        for s, driven, at, name in zip(several, drives, onsets, names, strict=True)
    ]
    return found if displacement is None else beside(found, _tracks(displacement, said.of_track))


def onset_of(given: Stated | str) -> Stated:
    """Return when an excitation began, from a time with a unit or the name of a reading. Raises InputError else."""
    if given is None:
        return None
    for reading in ("last-rest", "first-level"):
        if given == reading:
            return cast(Stated, reading)
    if isinstance(given, str) and given.replace("-", "").isalpha():
        raise InputError(f"{argument('onset', given)}: write a time such as 4s, or last-rest or first-level")
    return si(given, "s", argument("onset"))


def one_of(arrays: Mapping[str, ArrayLike], displacement: Any) -> tuple[dict[str, ArrayLike], Any]:
    """Return arrays by keyword with a ``displacement`` that is one of them, or apart from one of its own times."""
    if not arrays or displacement is None or _of_its_own(displacement):
        return dict(arrays), displacement
    return {**arrays, "displacement": displacement}, None


def _of_its_own(displacement: Any) -> bool:
    """Return True if a displacement has times of its own: a path, columns, or two rows; not one row of numbers."""
    if isinstance(displacement, str | Path | Mapping) or hasattr(displacement, "columns"):
        return True
    several = isinstance(displacement, list | tuple) and len(displacement) > 0
    return several and not np.isscalar(displacement[0])


def _tracks(displacement: Any, said: Said) -> list[Track]:
    """Return the tracks of one displacement or of a list of them."""
    several = displacement if isinstance(displacement, list) else [displacement]
    return [
        _track(each, f"displacement {k + 1}" if len(several) > 1 else "displacement", said)
        for k, each in enumerate(several)
    ]


def _track(given: Any, name: str, said: Said) -> Track:
    if isinstance(given, str | Path):
        return read_track(given, said)
    if isinstance(given, tuple) and len(given) == 2:
        given = {"time_s": given[0], "displacement_m": given[1]}
    return track_data(columns_of(given), name, said)


def by_header(arrays: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    """Return arrays in SI units by the headers of their columns. Raises InputError for a keyword that is none."""
    found: dict[str, ArrayLike] = {}
    for name, values in arrays.items():
        if name == "impedance":
            try:
                z = np.asarray(values, dtype=complex)
            except (TypeError, ValueError):
                raise InputError("impedance holds something else than complex numbers") from None
            found |= {"re_ohm": z.real, "im_ohm": z.imag}
        elif name in _HEADERS:
            found[_HEADERS[name]] = values
        else:
            raise InputError(f"'{name}' is not a known array; give {', '.join([*_HEADERS, 'impedance'])}")
    return found


def _film(source: Source, drive: Driven, onset: Stated, said: Said, name: str, until: float | None) -> Film:
    """Return a displacement alone under its drive. Raises InputError for data with a voltage of their own."""
    if isinstance(source, Record | Spectrum | LoadTest):
        raise InputError(
            f"{source.source}: is a {type(source).__name__}, which needs no {argument('drive')}; that is for a "
            "displacement alone"
        )
    if isinstance(source, Film):
        return source
    return film(
        source if isinstance(source, str | Path) else columns_of(source),
        drive,
        name,
        onset=onset,
        said=said,
        until=until,
    )


def _read(source: Source, mode: str | None, onset: Stated, said: Said, name: str) -> Measured:
    if isinstance(source, Record | Spectrum | LoadTest | Film):
        return source
    if isinstance(source, str | Path):
        return read_file(source, onset=onset, said=said) if mode is None else read_load_test(source, mode, said)
    return read_data(columns_of(source), name, mode=mode, onset=onset, said=said)


def columns_of(source: Any) -> dict[str, ArrayLike]:
    """Return the columns of a mapping or a data frame, with its index where that has a name.

    Raises InputError for what is none.
    """
    titles = getattr(source, "columns", source)
    index: Any = getattr(source, "index", None)
    named = getattr(index, "name", None)
    try:
        found = {str(title): source[title] for title in titles}
    except (TypeError, KeyError, IndexError):
        raise InputError(
            f"data are a path, a data frame or columns by header, such as time_s; not {type(source).__name__}"
        ) from None
    return found if named is None or str(named) in found else {str(named): index, **found}
