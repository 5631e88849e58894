"""Converts users' arguments into the objects of the rooms: strips, drives, loads and times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from ..arrays import Array, row
from ..circuit.load import Hung, load_of
from ..circuit.wiring import OPEN, Wiring, wiring
from ..drive import Drive, Drives, PiecewiseLinear, Sine
from ..errors import InputError, argument, visible
from ..measurements.said import NOTHING, Said
from ..measurements.segments import read_voltages
from ..simulation.drives import drawn, forms_of, parse_drive, whole_number
from ..simulation.response import sample_times
from ..simulation.shapes import repeated
from ..solve.library import chosen_engine
from ..strip.actuator import PAPER, Actuator
from ..strip.file import load_actuator
from ..strip.specimen import Specimen
from ..units import si

#: A strip: an object, the path of its TOML file, or a preset's name.
Strip: TypeAlias = Actuator | str | Path
#: A drive: an object, a text such as "step:4V", or rows of times [s] and values.
Driven: TypeAlias = Drive | str | tuple[ArrayLike, ArrayLike]
#: Drives of segments by their numbers, see `circuit.wiring.wiring`; "open" leaves one unconnected.
Segmented: TypeAlias = Mapping[Any, Driven]
#: A quantity: a number in SI units, or a text with a unit.
Given: TypeAlias = float | str


def load(strip: Strip = "paper") -> Actuator:
    """Return the strip of a preset's name or of a TOML file; a strip itself is returned unchanged.

    Parameters
    ----------
    strip : Actuator, str or Path
        Preset's name, path of a TOML file, or a strip.

    Returns
    -------
    Actuator
        The strip: geometry, material, coupling, mounting. A value outside the usual range issues an `IlgWarning`.

    Raises
    ------
    InputError
        There is no such file or preset, or the file holds no strip; the message names the key.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> strip = ilg.load("paper")
    >>> f"{1e3 * strip.geometry.thickness:.1f} mm"
    '0.5 mm'
    """
    if isinstance(strip, Actuator):
        return strip
    if isinstance(strip, Specimen):
        raise InputError(f"strip '{strip.name}' has no circuit yet: fit one, ilg.identify(data, strip).actuator")
    return PAPER if strip == "paper" else load_actuator(strip)


def engine_of(engine: str | None, strip: Actuator) -> str:
    """Return the engine for a strip, see `solve.library.chosen_engine`."""
    return chosen_engine(engine, linear=strip.linear)


def run_of(
    drive: Driven,
    duration: Given | None,
    unit: str = "V",
    *,
    samples: int | None = None,
    step: Given | None = None,
    times: ArrayLike | None = None,
    said: Said = NOTHING,
) -> tuple[Drive, Array]:
    """Return a drive, its values in ``unit``, and the times [s] (n,) of a run.

    They are ``times`` themselves; or ``samples``, or one every ``step``, over ``duration``, by default the last time of
    a drive that is rows. ``said`` is about the file of a drive. Raises InputError for what is not understood.
    """
    if times is not None:
        if duration is not None or samples is not None or step is not None:
            raise InputError("give either times, or a duration with samples or step")
        given = row(times, "times")
        return drive_of(drive, float(given[-1]) if len(given) else 0.0, unit, said), given
    if duration is None:
        if isinstance(drive, PiecewiseLinear):
            duration = float(drive.times[-1])
        elif isinstance(drive, tuple) and len(drive) == 2:
            duration = float(row(drive[0], "times of the drive")[-1])
        else:
            raise InputError(f"{argument('duration')} is missing: say how long, such as '300 s'")
    seconds = quantity(duration, "s", "duration")
    at = sample_times(seconds, samples=samples, step=optional(step, "s", "step"))
    return drive_of(drive, seconds, unit, said), at


def wired_run(
    strip: Actuator, drive: Driven | Segmented, duration: Given | None, **how: Any
) -> tuple[Drive, Array, Wiring | None]:
    """Return `run_of` a drive, or of the drives of a strip's segments, and the wiring of these, None for one drive.

    A file with columns voltage_1_V, voltage_2_V, ... drives the segments of a strip with electrodes. Raises InputError
    for segments of a strip without them, and for segments that are not there.
    """
    drive = _by_segments(strip, drive, duration, how.get("said", NOTHING))
    if not isinstance(drive, Mapping):
        return *run_of(drive, duration, **how), None
    if strip.electrodes is None:
        raise InputError(
            f"actuator '{strip.name}' has no [electrodes], so no segments: give it one drive, such as step:4V"
        )
    given = {str(key): value for key, value in drive.items()}
    opened = [key for key, value in given.items() if isinstance(value, str) and value.strip() == OPEN]
    driven = [key for key in given if key not in opened]
    wires = wiring(strip.electrodes, driven, opened)
    first, at = run_of(given[driven[0]], duration, **how)
    said = how.get("said", NOTHING)
    others = [drive_of(given[key], float(at[-1]), said=said) for key in driven[1:]]
    return Drives(tuple(zip(driven, [first, *others], strict=True))), at, wires


def _by_segments(strip: Actuator, drive: Driven | Segmented, duration: Given | None, said: Said) -> Driven | Segmented:
    """Return the drives of segments that stand in one file or in `Drives`; other drives unchanged."""
    if isinstance(drive, Drives):
        return dict(drive.named)
    form, _, file = drive.partition(":") if isinstance(drive, str) else ("", "", "")
    if strip.electrodes is None or form not in ("file", "repeat"):
        return drive
    times, _, name = file.partition(",") if form == "repeat" else ("1", "", file)
    rows = read_voltages(name, said)
    found: dict[str, Driven] = {}
    for number, (at, volts) in rows.items():
        at, volts = repeated(at, volts, whole_number(times, "repeat")) if form == "repeat" else (at, volts)
        lasts = float(at[-1]) if duration is None else quantity(duration, "s", "duration")
        text = f"column voltage_{number} of {visible(Path(name).name)}"
        part = drawn(at, volts, lasts, text)
        found[number] = replace(part, findings=()) if found and isinstance(part, PiecewiseLinear) else part
    return found or drive


def drive_of(drive: Driven, duration: float, unit: str = "V", said: Said = NOTHING) -> Drive:
    """Return the drive of a run of ``duration`` [s]. Raises InputError for what is none."""
    if isinstance(drive, str):
        return parse_drive(drive, duration, unit, said)
    if isinstance(drive, tuple) and len(drive) == 2:
        return PiecewiseLinear(row(drive[0], "times of the drive"), row(drive[1], "values of the drive"), "given rows")
    if not isinstance(drive, PiecewiseLinear | Sine):
        raise InputError(f"a drive is a text ({forms_of(unit)}) or a pair of times and values, not {_kind(drive)}")
    return drive


def lasting(source: Drive, seconds: float | None) -> float:
    """Return the duration [s] given, or that of a file or rows. Raises InputError for a form without an end."""
    if seconds is None:
        if not (isinstance(source, PiecewiseLinear) and source.times[-1] > 0):
            raise InputError(f"{argument('duration')} is missing: say how long, such as '300 s'")
        seconds = float(source.times[-1])
    return seconds


def mounted(tip: str, beam: str | None, hung: Hung) -> dict[str, Any]:
    """Return tip, beam (None for the strip's own) and load in the form for solvers."""
    return {"tip": tip, "beam": beam, "load": load_of(hung)}


def quantity(value: Given, unit: str, name: str) -> float:
    """Return a number in SI units from one, or from a text with a unit. Raises InputError naming it."""
    return si(value, unit, argument(name))


def optional(value: Given | None, unit: str, name: str) -> float | None:
    """Return `quantity`, or None where nothing was given."""
    return None if value is None else quantity(value, unit, name)


def _kind(thing: object) -> str:
    """Return type and value of a thing, for an error."""
    return f"{type(thing).__name__} {thing!r}"[:60]
