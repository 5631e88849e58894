"""Drives named by text, such as ``step:4V``: one entry of `FORMS` a form.

A form that stands in `FORMS` is parsed, named in errors, and shown by the commands' help. As the help is made without
waiting for numpy, parsers import what they need when they are called.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..units import parse

if TYPE_CHECKING:
    from ..arrays import Array
    from ..drive import Drive
    from ..findings import Finding


@dataclass(frozen=True)
class Form:
    """One form of drive: its ``name`` before the colon, ``examples`` of a voltage and of a motion, and its parser.

    ``parse`` takes what is after the colon, split at commas into as many parts as ``parts`` allows (None: not split),
    the duration of the run [s], and the unit of the values, "V" or "m".
    """

    name: str
    examples: tuple[str, str]
    parts: range | None
    parse: Callable[[list[str], float, str], Drive]


def _step(parts: list[str], duration: float, unit: str) -> Drive:
    from ..drive import PiecewiseLinear

    return PiecewiseLinear.step(parse(parts[0], unit, "step"), unit=unit)


def _square(parts: list[str], duration: float, unit: str) -> Drive:
    from ..drive import PiecewiseLinear

    low, separator, high = parts[0].partition("..")
    levels = (parse(low, unit, "square") if separator else 0.0, parse(high if separator else low, unit, "square"))
    duty = parse(parts[2], "", "square, duty") if len(parts) == 3 else 0.5
    return PiecewiseLinear.square(*levels, parse(parts[1], "s", "square"), duration, duty, unit)


def _sine(parts: list[str], duration: float, unit: str) -> Drive:
    from ..drive import Sine

    return Sine(parse(parts[0], unit, "sine"), parse(parts[1], "Hz", "sine"), unit)


def _ramp(parts: list[str], duration: float, unit: str) -> Drive:
    from ..drive import PiecewiseLinear

    return PiecewiseLinear.ramp(parse(parts[0], f"{unit}/s", "ramp"), duration, unit)


def _file(parts: list[str], duration: float, unit: str) -> Drive:
    from ..measurements.read import read_waveform

    path = Path(parts[0])
    times, values, notes = read_waveform(path, "voltage" if unit == "V" else "displacement")
    text = f"file {path.name}"
    return drawn(times, values, duration, text, [note.about(text) for note in notes])


def drawn(times: Array, values: Array, duration: float, text: str, notes: Sequence[Finding] = ()) -> Drive:
    """Return the drive through the rows of a file, with findings where it and the run of ``duration`` [s] differ.

    The run begins at t = 0, or at the file's first row where that is earlier and the strip is not at rest until then.

    Parameters
    ----------
    times, values
        Of the rows (n,), in s and SI; a time that stands twice is an edge.
    text
        Names the drive.
    notes
        Findings on the file.
    """
    from ..drive import PiecewiseLinear
    from ..findings import Finding

    first = float(times[0])
    found = list(notes)
    if first < 0:
        before = int(times.searchsorted(0.0))  # rows up to the first at t = 0 or later, which ends the last line
        if values[: before + 1].any():
            found.append(Finding("drive-begins-earlier", text, {"first": first}))
            times = times - first
    elif first > 0:
        found.append(Finding("drive-held-before", text, {"first": first}))
    last = float(times[-1])
    if last < duration * (1 - 1e-9):
        found.append(Finding("drive-held-after", text, {"last": last, "duration": duration}))
    return PiecewiseLinear(times, values, text, findings=tuple(found))


FORMS: tuple[Form, ...] = (
    Form("step", ("step:4V", "step:1mm"), range(1, 2), _step),
    Form("square", ("square:4V,30s[,duty], square:-4V..4V,30s", "square:1mm,30s[,duty]"), range(2, 4), _square),
    Form("sine", ("sine:2V,0.1Hz", "sine:1mm,0.1Hz"), range(2, 3), _sine),
    Form("ramp", ("ramp:1V/s", "ramp:0.1mm/s"), range(1, 2), _ramp),
    Form("file", ("file:drive.csv", "file:motion.csv"), None, _file),
)

DRIVE_FORMS, MOTION_FORMS = (", ".join(form.examples[k] for form in FORMS) for k in (0, 1))


def parse_drive(text: str, duration: float, unit: str = "V") -> Drive:
    """Return the drive that a text such as ``step:4V`` names, for a run of ``duration`` [s].

    With the ``unit`` "m" it is a motion, its values in metres, such as ``sine:1mm,0.1Hz``.

    Raises
    ------
    InputError
        The text is none of the forms, or a value or a file of it cannot be read.
    """
    name, _, rest = text.partition(":")
    form = next((form for form in FORMS if form.name == name), None)
    whole = form is not None and form.parts is None
    parts = [rest] if whole else [part.strip() for part in rest.split(",")]
    if form is None or not all(parts) or (form.parts is not None and len(parts) not in form.parts):
        raise InputError(
            f"drive '{text}' is not understood; write one of {DRIVE_FORMS if unit == 'V' else MOTION_FORMS}"
        )
    return form.parse(parts, duration, unit)
