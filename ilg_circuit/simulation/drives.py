"""Makes drives from texts such as ``step:4V``: each form has an entry in `FORMS` and a case in `_made`.

The entries of `FORMS` appear in errors and in the commands' help. To keep the help fast, without importing numpy, the
makers of drives are imported when a drive is made.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..errors import InputError, visible
from ..measurements.said import NOTHING, Said
from ..units import parse, require_positive

if TYPE_CHECKING:
    from ..arrays import Array
    from ..drive import Drive
    from ..findings import Finding


@dataclass(frozen=True)
class Form:
    """One form of drive: its ``name`` before the colon, ``examples`` of a voltage and of a motion, its ``meaning``.

    The text after the colon is split at commas; ``parts`` are the allowed numbers of parts (None: not split). Help
    shows the meaning beside the first example.
    """

    name: str
    examples: tuple[str, str]
    parts: range | None
    meaning: str


FORMS: tuple[Form, ...] = (
    Form("step", ("step:4V", "step:1mm"), range(1, 2), "A constant value from t = 0 on."),
    Form(
        "square",
        ("square:4V,30s[,duty], square:-4V..4V,30s", "square:1mm,30s[,duty]"),
        range(2, 4),
        "The value and zero alternate. 30 s is the period; its first half (or the fraction duty) has the value. "
        "LOW..HIGH gives both levels.",
    ),
    Form(
        "triangle",
        ("triangle:4V,30s, triangle:-2V..2V,30s", "triangle:1mm,30s"),
        range(2, 3),
        "A triangular wave from zero to the value. 30 s is the period. LOW..HIGH gives both ends.",
    ),
    Form(
        "cv",
        ("cv:-1V..1V,50mV/s[,cycles]", "cv:-1mm..1mm,0.1mm/s[,cycles]"),
        range(2, 4),
        "Cyclic voltammetry: a triangle between two values at this rate, endless or for a number of cycles.",
    ),
    Form(
        "pulse",
        ("pulse:4V,1s,10s[,count]", "pulse:1mm,1s,10s[,count]"),
        range(3, 5),
        "The value for 1 s in each period of 10 s, endless or count times.",
    ),
    Form("sine", ("sine:2V,0.1Hz", "sine:1mm,0.1Hz"), range(2, 3), "A sine of this amplitude and frequency."),
    Form(
        "chirp",
        ("chirp:1V,0.01Hz..1Hz", "chirp:1mm,0.01Hz..1Hz"),
        range(2, 3),
        "A sine whose frequency rises or falls from the first to the second during the run.",
    ),
    Form(
        "multisine",
        ("multisine:1V,0.01Hz..1Hz[,tones]", "multisine:1mm,0.01Hz..1Hz[,tones]"),
        range(2, 4),
        "A sum of 10 (or tones) sines between two frequencies, with this peak.",
    ),
    Form("ramp", ("ramp:1V/s", "ramp:0.1mm/s"), range(1, 2), "A straight line from zero."),
    Form(
        "file",
        ("file:drive.csv", "file:motion.csv"),
        None,
        "The rows of a CSV file: time_s and a voltage or, for a motion, a displacement.",
    ),
    Form("repeat", ("repeat:5,drive.csv", "repeat:5,motion.csv"), None, "The rows of a file, repeated 5 times."),
)

#: A drive by current: any of the forms, with amperes.
CURRENT = Form(
    "current",
    ("current:10mA[,limit=4V], current:square:-10mA..10mA,30s, current:file.csv", ""),
    None,
    "A current in place of a voltage: a value, any form above with amperes, or a file's column of current; the source "
    "gives way beyond the limit.",
)

#: The forms as errors list them.
DRIVE_FORMS = ", ".join(form.examples[0] for form in (*FORMS, CURRENT))
MOTION_FORMS = ", ".join(form.examples[1] for form in FORMS)
FORCE_FORMS = MOTION_FORMS.replace("mm", "nN").replace("motion.csv", "force.csv")
#: The forms as help lists them: an example and its meaning.
DRIVES = tuple((form.examples[0].split(", ")[0], form.meaning) for form in (*FORMS, CURRENT))
MOTIONS = tuple((form.examples[1].split(", ")[0], form.meaning) for form in FORMS)

#: The limit of a source of current, at the end of the text; a value of the form's first part, with amperes.
_LIMIT = re.compile(r",\s*limit\s*=([^,]*)$")
_AMPERES = re.compile(r"[\d.]\s*([fpnum\u00b5\u03bck]?A|amperes?)(/s)?\s*$")


def forms_of(unit: str) -> str:
    """Return the forms, as errors list them, of drives in a ``unit``: "m", "N", "rad", "1/m" or another."""
    if unit in ("1/m", "rad"):
        return MOTION_FORMS.replace("mm/s", f" {unit}/s").replace("mm", f" {unit}").replace("motion.csv", "shape.csv")
    return {"m": MOTION_FORMS, "N": FORCE_FORMS}.get(unit, DRIVE_FORMS)


def parse_drive(text: str, duration: float, unit: str = "V", said: Said = NOTHING) -> Drive:
    """Return the drive for a text such as ``step:4V`` and a run of ``duration`` [s].

    With the ``unit`` "m" it is a motion with values in metres, such as ``sine:1mm,0.1Hz``; with "N" a force. A text
    such as ``current:10mA`` or ``step:10mA`` is a drive by current, see `ilg_circuit.drive.by_current`. ``said`` states
    what the headers of a file do not.

    Raises
    ------
    InputError
        The text is none of the forms, or a value or a file of it cannot be read.
    """
    name, _, rest = text.partition(":")
    if unit == "V" and (name == CURRENT.name or _AMPERES.search(rest.partition(",")[0])):
        return _by_current(text, duration, said)
    form = next((form for form in FORMS if form.name == name), None)
    whole = form is not None and form.parts is None
    parts = [rest] if whole else [part.strip() for part in rest.split(",")]
    if form is None or not all(parts) or (form.parts is not None and len(parts) not in form.parts):
        raise InputError(f"drive '{text}' is not understood; write one of {forms_of(unit)}")
    return _made(name, parts, duration, unit, said)


#: A drive of one segment of a strip with electrodes: its number, or a pair of them, before the drive.
_OF_SEGMENT = re.compile(r"\s*([+-]?\d+(?::-?\d+)?)\s*=(.*)", re.DOTALL)


def segment_drives(texts: Sequence[str]) -> str | dict[str, str]:
    """Return the one drive of a whole strip, or the drives of its segments by their numbers: ``2=step:4V``.

    Raises InputError for several drives of which one names no segment, and for a segment that is named twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        match = _OF_SEGMENT.fullmatch(text)
        if match is None:
            if len(texts) == 1:
                return text
            raise InputError(f"drive '{text}' is one of {len(texts)}: say of which segment each is, such as 1={text}")
        if match[1] in found:
            raise InputError(f"segment {match[1]} has two drives, '{found[match[1]]}' and '{match[2]}'; give it one")
        found[match[1]] = match[2].strip()
    return found


#: A path of one target of a shape: its name, or the number of a segment whose curvature it is, before the path.
_OF_TARGET = re.compile(r"\s*([A-Za-z_]+\w*|\d+)\s*=(.*)", re.DOTALL)


def target_paths(texts: Sequence[str]) -> str | dict[str, str]:
    """Return the one path of a tip, or of a file, or the paths of a shape's targets: ``curvature_1=step:20 1/m``.

    Raises InputError for several paths of which one names no target, and for a target that is named twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        match = _OF_TARGET.fullmatch(text)
        if match is None:
            if len(texts) == 1:
                return text
            raise InputError(f"path '{text}' is one of {len(texts)}: say of what each is, such as curvature_1={text}")
        if match[1] in found:
            raise InputError(f"{match[1]} has two paths, '{found[match[1]]}' and '{match[2]}'; give it one")
        found[match[1]] = match[2].strip()
    return found


def _by_current(text: str, duration: float, said: Said) -> Drive:
    """Return the drive by current of a text such as ``current:10mA,limit=4V`` or ``step:10mA``."""
    whole = text.removeprefix(f"{CURRENT.name}:")
    match = _LIMIT.search(whole)
    limit = None
    if match is not None:
        limit = parse(match[1], "V", "current, limit")
        require_positive("current, limit", limit, "V")
        whole = whole[: match.start()]
    if whole.partition(":")[0] not in {form.name for form in FORMS}:
        is_value = _AMPERES.search(whole) or not Path(whole).suffix or whole.strip()[:1] in "+-.0123456789"
        whole = f"step:{whole}" if is_value and not Path(whole).is_file() else f"file:{whole}"
    drive: Any = parse_drive(whole, duration, "A", said)
    return cast("Drive", replace(drive, unit="A", limit=limit))


def _made(name: str, parts: list[str], duration: float, unit: str, said: Said) -> Drive:
    """Return the drive of a form for ``duration`` [s], from the ``parts`` after the colon; values are in ``unit``."""
    from ..drive import PiecewiseLinear, Sine
    from . import shapes

    def lines(rows: shapes.Rows) -> Drive:
        return PiecewiseLinear(*rows, f"{name} {', '.join(parts)}")

    match name:
        case "step":
            return PiecewiseLinear.step(parse(parts[0], unit, name), unit=unit)
        case "square":
            duty = parse(parts[2], "", "square, duty") if len(parts) == 3 else 0.5
            return PiecewiseLinear.square(
                *two(parts[0], unit, name), parse(parts[1], "s", "square, period"), duration, duty, unit
            )
        case "triangle":
            return lines(
                shapes.triangle(*two(parts[0], unit, name), parse(parts[1], "s", "triangle, period"), duration)
            )
        case "cv":
            low, high = two(parts[0], unit, name)
            rate, cycles = parse(parts[1], f"{unit}/s", name), _count(parts, 2, "cv, cycles")
            require_positive("cv, rate", rate, f"{unit}/s")
            return lines(shapes.triangle(low, high, 2 * (high - low) / rate, duration, cycles))
        case "pulse":
            width, period = (parse(part, "s", name) for part in parts[1:3])
            count = _count(parts, 3, "pulse, count")
            return lines(shapes.pulses(parse(parts[0], unit, name), width, period, duration, count))
        case "sine":
            return Sine(parse(parts[0], unit, name), parse(parts[1], "Hz", "sine, frequency"), unit)
        case "chirp":
            return lines(shapes.chirp(parse(parts[0], unit, name), *two(parts[1], "Hz", name), duration))
        case "multisine":
            tones = int(_count(parts, 2, "multisine, tones", 10))
            return lines(shapes.multisine(parse(parts[0], unit, name), *two(parts[1], "Hz", name), duration, tones))
        case "ramp":
            return PiecewiseLinear.ramp(parse(parts[0], f"{unit}/s", name), duration, unit)
        case _:
            from ..measurements.read import read_waveform

            count_text, _, file = parts[0].partition(",") if name == "repeat" else ("", "", parts[0])
            path = Path(file)
            quantity = {"V": "voltage", "A": "current", "N": "force"}.get(unit, "displacement")
            times, values, notes = read_waveform(path, quantity, said)
            text = f"file {visible(path.name)}"
            if name == "repeat":
                times, values = shapes.repeated(times, values, whole_number(count_text, "repeat"))
                text = f"{count_text} times {text}"
            return drawn(times, values, duration, text, [note.about(text) for note in notes])


def two(text: str, unit: str, name: str) -> tuple[float, float]:
    """Return the two values of ``low..high``; a single value is the higher one, with zero as the lower."""
    low, separator, high = text.partition("..")
    return parse(low, unit, name) if separator else 0.0, parse(high if separator else low, unit, name)


def whole_number(text: str, what: str) -> int:
    """Return a whole number of one or more. Raises InputError for another text."""
    return int(_count([text], 0, what))


def _count(parts: Sequence[str], place: int, what: str, usual: float = math.inf) -> float:
    """Return the whole number at a place of the parts, or the default."""
    if place >= len(parts):
        return usual
    value = parse(parts[place], "", what)
    if not (value >= 1 and value == int(value)):
        raise InputError(f"{what}: '{parts[place]}' is not a whole number of one or more")
    return value


def drawn(times: Array, values: Array, duration: float, text: str, notes: Sequence[Finding] = ()) -> Drive:
    """Return the drive through the rows of a file, with findings where it and the run of ``duration`` [s] differ.

    The run begins at t = 0, or at the file's first row if that is earlier and the strip is not at rest until t = 0.

    Parameters
    ----------
    times, values
        Times [s] and values [SI] of the rows (n,); a repeated time is an edge.
    text
        Name of the drive.
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
