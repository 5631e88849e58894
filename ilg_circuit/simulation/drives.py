"""Drives named by text, such as ``step:4V``: one entry of `FORMS` a form.

A form that stands in `FORMS` is parsed, named in errors, and shown by the commands' help. As the help is made without
waiting for numpy, parsers import what they need when they are called.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..units import parse

if TYPE_CHECKING:
    from ..drive import Drive


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
    from ..drive import PiecewiseLinear
    from ..measurements.read import read_waveform

    path = Path(parts[0])
    times, values = read_waveform(path, "voltage" if unit == "V" else "displacement")
    return PiecewiseLinear(times, values, f"file {path.name}")


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
