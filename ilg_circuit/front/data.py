"""Measured data as users have them: paths, data frames, arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, argument, checked
from ..measurements.columns import read_data
from ..measurements.load_test import LoadTest
from ..measurements.onset import Stated
from ..measurements.read import read as read_file
from ..measurements.read import read_load_test
from ..measurements.record import Record
from ..measurements.said import NOTHING, Said, said_of
from ..measurements.spectrum import Spectrum
from ..units import si
from .each_file import values_of

#: One set of data that was read.
Measured: TypeAlias = Record | Spectrum | LoadTest
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
    part: int | None = None,
    cycle: int | None = None,
    length: str | float | None = None,
    section: str | float | None = None,
    **arrays: ArrayLike,
) -> Any:
    """Return measured data, ready for a fit: one set, or a list where several are given.

    Parameters
    ----------
    *data : str, Path, DataFrame, mapping, Record, Spectrum or a list of these
        Paths of files; or columns by header, such as ``current_mA``: a pandas data frame, or a mapping of arrays.
    mode : {"uniaxial", "equibiaxial", "planar"}, optional
        Of a load test: uniaxial, equibiaxial or planar.
    onset : float or str, optional
        When a record's excitation began: a time [s] or a text such as "4 s"; "last-rest" or "first-level" (default:
        found, and left open between two readings).
    columns : mapping of str to str, optional
        Titles of columns by quantity, where headers do not tell: ``{"voltage": "Potential (V)"}``.
    units : mapping of str to str, optional
        Units by quantity, likewise: ``{"time": "s"}``.
    part : int, optional
        Which of several measurements in a file, from 1.
    cycle : int, optional
        Which cycle of a record.
    length : float or str, optional
        Free length of a load test's specimen [m], where a displacement was measured.
    section : float or str, optional
        Its undeformed section [m^2], where a force was measured.
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
    )
    found = [
        _read(source, mode, at, said, f"data {k + 1}" if len(sources) > 1 else "data")
        for k, source in enumerate(sources)
    ]
    return found if len(found) > 1 else found[0]


def sets_of(
    data: Source | Sequence[Source], onset: Stated | str | Mapping[str, Stated | str] = None, said: Said = NOTHING
) -> list[Measured]:
    """Return the sets of data of one source or of several, read where they are not; ``onset`` may be by file."""
    several = list(data) if isinstance(data, list | tuple) else [data]
    if not several:
        raise InputError("no data were given; give paths, data frames, or what ilg.read returned")
    onsets = values_of(onset, several, "onset") if isinstance(onset, Mapping) else [onset] * len(several)
    begun = [onset_of(each) for each in onsets]
    names = [f"data {k + 1}" if len(several) > 1 else "data" for k in range(len(several))]
    return [_read(source, None, at, said, name) for source, at, name in zip(several, begun, names, strict=True)]


def onset_of(given: Stated | str) -> Stated:
    """Return when an excitation began, from a time with a unit or the name of a reading. Raises InputError else."""
    if not isinstance(given, str):
        return given
    for reading in ("last-rest", "first-level"):
        if given == reading:
            return cast(Stated, reading)
    if given.replace("-", "").isalpha():
        raise InputError(f"{argument('onset', given)}: write a time such as 4s, or last-rest or first-level")
    return si(given, "s", argument("onset"))


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
            raise InputError(f"'{name}' is no array that is read; these are: {', '.join([*_HEADERS, 'impedance'])}")
    return found


def _read(source: Source, mode: str | None, onset: Stated, said: Said, name: str) -> Measured:
    if isinstance(source, Record | Spectrum | LoadTest):
        return source
    if isinstance(source, str | Path):
        return read_file(source, onset=onset, said=said) if mode is None else read_load_test(source, mode, said)
    titles = getattr(source, "columns", source)
    try:
        columns = {str(title): source[title] for title in titles}
    except (TypeError, KeyError, IndexError):
        raise InputError(
            f"data are a path, a data frame or columns by header, such as time_s; not {type(source).__name__}"
        ) from None
    return read_data(columns, name, mode=mode, onset=onset, said=said)
