"""Converts what users ask of a shape: the paths of its targets, the limits of each segment's voltage."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ..control.programme import Limits
from ..control.tracked_shape import UNITS, unit_of
from ..drive import Drive, PiecewiseLinear
from ..errors import InputError, argument, visible
from ..measurements.segments import read_shape
from ..simulation.drives import drawn
from ..simulation.response import Response
from .given import Driven, Given, drive_of, lasting, quantity

#: Paths of a shape's targets by name, or by the number of a segment whose curvature it is; or a run that has them.
Targets: TypeAlias = Mapping[Any, Driven] | Response

#: What separates limits of segments: a comma after a unit, since one between digits is a decimal comma.
_BETWEEN = re.compile(r"(?<=[A-Za-z])\s*,\s*")


def targets_of(path: Driven | Targets, duration: float) -> dict[str, Drive]:
    """Return the paths of a shape's targets over ``duration`` [s].

    A text, or rows, without a target is a path of the tip's displacement, and a file is one of all columns that tell a
    shape. Raises InputError for what is not understood.
    """
    if isinstance(path, Response):
        return _of_run(path)
    if not isinstance(path, Mapping):
        if isinstance(path, str) and path.startswith("file:"):
            return _of_file(path.removeprefix("file:"), duration)
        return {"displacement": drive_of(path, duration, "m")}
    found: dict[str, Drive] = {}
    for key, given in path.items():
        name = f"curvature_{key}" if str(key).strip().isdecimal() else str(key).strip()
        if name.partition("_")[0] not in UNITS:
            raise InputError(f"a shape has no '{name[:40]}'; its targets are displacement, angle, curvature_1, ...")
        if name in found:
            raise InputError(f"{name} has two paths; give it one")
        if isinstance(given, str) and given.startswith("file:"):
            columns = _of_file(given.removeprefix("file:"), duration)
            if name not in columns:
                raise InputError(f"{given.removeprefix('file:')} has no column for {name}; it has {', '.join(columns)}")
            found[name] = columns[name]
        else:
            found[name] = drive_of(given, duration, unit_of(name))
    return found


def _of_file(file: str, duration: float) -> dict[str, Drive]:
    """Return the paths in the columns of a file; what is told of its end is told once."""
    found: dict[str, Drive] = {}
    for name, (times, values) in read_shape(file).items():
        found[name] = drawn(times, values, duration or float(times[-1]), f"of {visible(Path(file).name)}")
    return found


def _of_run(run: Response) -> dict[str, Drive]:
    """Return the targets of a run as paths. Raises InputError for one of a strip without segments."""
    names = [name for name in run.segments if name.partition("_")[0] in UNITS]
    if not names:
        raise InputError("the run has no shape of segments: its strip has no [electrodes], or no [coupling]")
    values = {"displacement": run.displacement, **{name: run.segments[name] for name in names}}
    return {name: PiecewiseLinear(run.time, np.asarray(wave), "of a run") for name, wave in values.items()}


def lasting_all(sources: Mapping[str, Drive], seconds: float | None) -> float:
    """Return the duration [s] given, or that of the longest path that ends. Raises InputError without any."""
    if seconds is not None:
        return seconds
    ends = [float(s.times[-1]) for s in sources.values() if isinstance(s, PiecewiseLinear)]
    return max(ends) if ends and max(ends) > 0 else lasting(next(iter(sources.values())), seconds)


def limits_of(
    voltage: Given | Sequence[Given],
    slew: Given | Sequence[Given] | None,
    current: Given | Sequence[Given] | None,
    energy: Given | None,
    most: int | None = None,
) -> tuple[Limits, ...]:
    """Return the limits of one voltage for all, or of each, from numbers or texts such as "4V,3V,2V".

    Raises InputError for lists of different lengths, and for more than ``most`` limits.
    """
    spent = None if energy is None else quantity(energy, "J", "energy")
    given = {"voltage": _list(voltage, "V", "voltage"), "slew": _list(slew, "V/s", "slew"),
             "current": _list(current, "A", "current")}  # fmt: skip
    count = max(len(values) for values in given.values())
    for name, values in given.items():
        if len(values) not in (1, count) or (most is not None and len(values) > most):
            allowed = "one for all" if most == 1 else f"one for all, or {count}"
            raise InputError(f"{argument(name)} has {len(values)} limits; give {allowed}")
    wide = [values * count if len(values) == 1 else values for values in given.values()]
    found = []
    for volts, rate, flowing in zip(*wide, strict=True):
        assert volts is not None
        found.append(Limits(volts, rate, flowing, spent))
    return tuple(found)


def _list(given: Given | Sequence[Given] | None, unit: str, name: str) -> list[float | None]:
    """Return the limits in SI units."""
    if given is None:
        return [None]
    if isinstance(given, str):
        given = _BETWEEN.split(given.strip())
    values = [given] if isinstance(given, float | int) else list(given)
    if not values:
        raise InputError(f"{argument(name)} is empty; give one limit for all, or one for each segment")
    return [quantity(value, unit, name) for value in values]
