"""A displacement alone and the drive that is stated for it, as users give them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from numpy.typing import ArrayLike

from ..drive import PiecewiseLinear, require_voltage
from ..errors import InputError, argument
from ..findings import Finding
from ..measurements.film import Film, film_data, film_of, read_film
from ..measurements.onset import Stated
from ..measurements.said import NOTHING, Said
from ..measurements.track import beginning
from ..simulation.drives import FORMS
from ..simulation.shapes import sampled
from .given import Driven, drive_of

#: Largest time by which a film may begin before its drive, as a fraction of its length.
_EARLIER = 1.6


def film(
    source: str | Path | Mapping[str, ArrayLike],
    drive: Driven,
    name: str,
    *,
    onset: Stated = None,
    said: Said = NOTHING,
    until: float | None = None,
) -> Film:
    """Return the displacement of a file, or of columns by header, under a drive.

    ``onset`` [s] is when the drive's voltage began to change by the displacement's clock, where that is known. Where
    the drive is a file what is ``said`` of a time is said of the drive, of ``displacement.time`` of the displacement;
    that file may be the displacement's own, where it has a voltage beside it.
    Raises InputError where drive and displacement do not go together.
    """
    rows = _in_a_file(drive)
    itself = isinstance(source, str | Path) and drive == f"file:{source}"
    own, of_drive = (said.of_track, said.of_data) if rows else (said.of_film, NOTHING)
    if isinstance(source, str | Path):
        track = read_film(source, said.of_film if itself else own, drives=itself)
    else:
        track = film_data(source, name, own)
    span = float(track.time[-1] - track.time[0])
    swept = isinstance(drive, str) and drive.startswith("chirp:")
    lasts = float(track.time[-1]) - beginning(track.time, track.values)[0] if swept else _EARLIER * span
    driven = require_voltage(drive_of(drive, lasts, "V", of_drive), "a film")
    if not isinstance(driven, PiecewiseLinear):
        driven = PiecewiseLinear(*sampled(driven.value, driven.angular_frequency(), lasts), driven.text)
    if swept:
        told = Finding("chirp-assumed", values={"duration": lasts})
        driven = replace(driven, findings=(*driven.findings, told))
    ends = float(driven.times[-1]) if rows or isinstance(drive, tuple) else None
    made = film_of(track, driven, ends, until)
    if onset is None:
        return made
    if isinstance(onset, str):
        raise InputError(
            f"{argument('onset', onset)}: {track.source} has no voltage that determines it; give a time such as 4s"
        )
    return replace(made, delay=onset - made.onset)


def _in_a_file(drive: Driven) -> bool:
    """Return True if a drive is given by the rows of a file."""
    forms = [form.name for form in FORMS if form.parts is None]
    return isinstance(drive, str) and drive.partition(":")[0] in forms


def by_file(texts: tuple[str, ...]) -> dict[str, str]:
    """Return drives that were given as DRIVE or FILE=DRIVE, by file; a drive for all others as ``*``."""
    found = {}
    for text in texts:
        head, colon, tail = text.partition(":")
        name, _, form = head.rpartition("=")
        found[name or "*"] = f"{form}{colon}{tail}"
    return found
