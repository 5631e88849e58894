"""Drives named by text, such as ``step:4V``: one entry of `FORMS` a form."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..drive import Drive, PiecewiseLinear, Sine
from ..errors import InputError
from ..measurements.record_files import read_waveform
from ..units import parse

DRIVE_FORMS = "step:4V, square:4V,30s[,duty], square:-4V..4V,30s, sine:2V,0.1Hz, ramp:1V/s, file:drive.csv"

MOTION_FORMS = "step:1mm, square:1mm,30s[,duty], sine:1mm,0.1Hz, ramp:0.1mm/s, file:motion.csv"


def parse_drive(text: str, duration: float, unit: str = "V") -> Drive:
    """The drive that a text such as ``step:4V`` names, for a run of ``duration`` [s].

    With the ``unit`` "m" it is a motion, its values in metres, such as ``sine:1mm,0.1Hz``. Raises InputError that says
    what was given and which forms there are.
    """
    kind, _, rest = text.partition(":")
    parts = [part.strip() for part in rest.split(",")]
    makers: dict[str, tuple[range, Callable[[list[str]], Drive]]] = {
        "step": (range(1, 2), lambda p: PiecewiseLinear.step(parse(p[0], unit, "step"), unit=unit)),
        "ramp": (range(1, 2), lambda p: PiecewiseLinear.ramp(parse(p[0], f"{unit}/s", "ramp"), duration, unit)),
        "sine": (range(2, 3), lambda p: Sine(parse(p[0], unit, "sine"), parse(p[1], "Hz", "sine"), unit)),
        "square": (range(2, 4), lambda p: _square(p, duration, unit)),
    }
    if kind == "file" and rest:
        times, values = read_waveform(Path(rest), "voltage" if unit == "V" else "displacement")
        return PiecewiseLinear(times, values, f"file {Path(rest).name}")
    if kind not in makers or len(parts) not in makers[kind][0] or not all(parts):
        raise InputError(
            f"drive '{text}' is not understood; write one of {DRIVE_FORMS if unit == 'V' else MOTION_FORMS}"
        )
    return makers[kind][1](parts)


def _square(parts: list[str], duration: float, unit: str) -> PiecewiseLinear:
    low, separator, high = parts[0].partition("..")
    levels = (parse(low, unit, "square") if separator else 0.0, parse(high if separator else low, unit, "square"))
    duty = parse(parts[2], "", "square, duty") if len(parts) == 3 else 0.5
    return PiecewiseLinear.square(*levels, parse(parts[1], "s", "square"), duration, duty, unit)
