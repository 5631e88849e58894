"""Parameters that a study can vary: every number that describes a strip, its drive, its load and its mounting.

Names are the keys of an actuator's TOML file (``thickness``, ``youngs_modulus``, ``gain``), those of further ionic
branches with the branch's number (``permittivity_2``), those of layers after their name (``gel_thickness``),
``load_mass`` ..., and what the drive's text holds (``voltage``, ``period``, ``duty``, ``frequency``, ``rate``). What a
change of a strip's value does to the others: `ilg_circuit.strip.changes`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..circuit.load import Hung, Load, load_of
from ..drive import Drive, PiecewiseLinear, Sine, by_current, voltage_limit
from ..errors import InputError, argument, unknown_name, visible
from ..simulation.drives import parse_drive
from ..strip.actuator import Actuator
from ..strip.changes import ORIENTATION, STRIP_PARAMETERS, Value, VariedParameter, changed, layer_parameter
from ..strip.file import load_actuator
from ..strip.layered import require_layer
from ..units import parse

NO_LOAD = Load()

_LOAD_UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N*s/m"}
#: Number in a drive's text -> unit, meaning, kinds of drive that have it, place after the colon.
DRIVE_KEYS = {
    "voltage": (
        "V",
        "largest voltage of the drive",
        ("step", "square", "triangle", "cv", "pulse", "sine", "chirp", "multisine", "file", "repeat"),
        0,
    ),
    "period": ("s", "period of a square or triangular wave", ("square", "triangle"), 1),
    "duty": ("", "part of the period for which a square wave is high", ("square",), 2),
    "frequency": ("Hz", "frequency of a sine", ("sine",), 1),
    "rate": ("V/s", "slope of a ramp", ("ramp",), 0),
    "current": ("A", "largest current of a drive by current", ("current",), 0),
}
#: Kinds of drive whose text begins with their voltage; others are scaled.
FIRST_IS_VOLTAGE = ("step", "sine")


@dataclass(frozen=True)
class ScenarioTemplate:
    """Actuator and run that all scenarios of a study share, apart from the varied parameters.

    ``drive`` is a text such as ``step:4V``, or a drive, of which only the voltage can be varied; ``duration`` [s];
    ``tip``, ``beam`` and ``load`` as in `ilg_circuit.circuit.strip.strip_netlist`. Raises InputError for a duration
    that is not positive.
    """

    actuator: Actuator
    drive: str | Drive
    duration: float
    tip: str = "free"
    beam: str | None = None
    load: Load = NO_LOAD

    def __post_init__(self) -> None:
        if not (math.isfinite(self.duration) and self.duration > 0):
            raise InputError(f"duration {self.duration:g} s must be more than zero")

    @property
    def usual_beam(self) -> str:
        """The beam of a scenario in which no load is varied."""
        return self.actuator.beam(self.beam, loaded=bool(self.load))

    @property
    def drive_text(self) -> str:
        """The drive as short text."""
        return visible(self.drive) if isinstance(self.drive, str) else self.drive.text

    def parsed_drive(self) -> Drive:
        """Return the drive with nothing varied. Raises InputError for a text that is not a drive."""
        return parse_drive(self.drive, self.duration) if isinstance(self.drive, str) else self.drive


@dataclass(frozen=True)
class Scenario(ScenarioTemplate):
    """One strip in one run: everything that a solve needs."""

    drive: Drive


def scenario_template(
    actuator: str | Path | Actuator,
    drive: str | Drive,
    duration: str | float,
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
) -> ScenarioTemplate:
    """Return the template of objects, or of texts: a TOML file or preset, ``step:4V``, ``300s``, ``mass=1g``.

    ``duration`` as a number is in seconds; ``beam`` is by default the one that the coupling was fitted with. Raises
    InputError for a text that is not understood.
    """
    if not isinstance(drive, str | PiecewiseLinear | Sine):
        raise InputError(f"a drive is a text such as step:4V or a drive, not {type(drive).__name__} {drive!r}"[:120])
    limited = "limit" in drive and drive.startswith("current:") if isinstance(drive, str) else voltage_limit(drive)
    if limited:
        raise InputError(f"a study has no limit of its source: '{drive}'; leave limit= out, or ask simulate")
    if tip not in ("free", "clamped"):
        raise InputError(f"{argument('tip')} is {tip!r}; choose free or clamped")
    strip = actuator if isinstance(actuator, Actuator) else load_actuator(actuator)
    hung = load_of(load) or NO_LOAD
    seconds = parse(duration, "s", argument("duration")) if isinstance(duration, str) else duration
    return ScenarioTemplate(strip, drive, seconds, tip, beam, hung)


_ALL = [
    *STRIP_PARAMETERS,
    *(VariedParameter(f"load_{n}", "load", u, f"{n} of the load at L_F") for n, u in _LOAD_UNITS.items()),
    *(VariedParameter(n, "drive", unit, meaning) for n, (unit, meaning, _, _) in DRIVE_KEYS.items()),
    ORIENTATION,
]
#: Every parameter by name.
PARAMETERS = {parameter.name: parameter for parameter in _ALL}


def varied_parameter(name: str) -> VariedParameter:
    """Return the parameter of that name. Raises InputError that lists the nearest names, or all."""
    found = PARAMETERS.get(name) or layer_parameter(name)
    if found is None:
        raise unknown_name("parameter", name, PARAMETERS)
    return found


def require_layers(actuator: Actuator, names: Iterable[str]) -> None:
    """Raise InputError where one of ``names`` is of a layer that the strip does not have."""
    for name in names:
        if varied_parameter(name).part == "layer":
            require_layer(actuator, name)


def apply(template: ScenarioTemplate, values: Mapping[str, Value]) -> Scenario:
    """Return the scenario of ``template`` with ``values`` (SI, by name; see the module).

    Raises InputError for an unknown name, a value out of range, an impossible strip (a free part longer than the
    whole), or a parameter that the template does not have (a second branch's, a period of a step).
    """
    changes: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        item = varied_parameter(name)
        changes.setdefault(item.part, {})[name] = value if item.words else item.checked(value)
    actuator = changed(template.actuator, changes)
    drive = _drive(template.drive, template.duration, changes.get("drive", {}))
    load = replace(template.load, **{name.removeprefix("load_"): v for name, v in changes.get("load", {}).items()})
    return Scenario(actuator, drive, template.duration, template.tip, template.beam, load)


_parsed = lru_cache(maxsize=4096)(parse_drive)


def _drive(given: str | Drive, duration: float, changed: Mapping[str, float]) -> Drive:
    """Return a drive, or the drive of a text, with some numbers replaced. ``voltage`` scales the whole waveform."""
    text = given if isinstance(given, str) else f"file:{given.text}"
    kind = text.partition(":")[0]
    if by_current(drive := given if not isinstance(given, str) else _parsed(text, duration)):
        kind = "current"
    for name in changed:
        kinds = DRIVE_KEYS[name][2]
        if kind not in kinds:
            raise InputError(f"{name} is not part of the drive '{text}'; it belongs to {' and '.join(kinds)}")
    if kind != "current" and isinstance(given, str):
        drive = _parsed(rewritten(text, changed), duration)
    wanted = changed.get("current" if kind == "current" else "voltage")
    if wanted is None or kind in FIRST_IS_VOLTAGE:
        return drive
    if not drive.largest():
        raise InputError(f"the drive '{text}' is zero, so no voltage or current can be given to it")
    return scaled(drive, wanted / drive.largest())


def rewritten(text: str, changed: Mapping[str, float]) -> str:
    """Return a drive's text with some numbers replaced; a voltage that only scales it (square, file) is left out."""
    kind, _, rest = text.partition(":")
    parts = rest.split(",")
    for name, (unit, _, _, place) in DRIVE_KEYS.items():
        if name in changed and (name != "voltage" or kind in FIRST_IS_VOLTAGE):
            parts[place : place + 1] = [f"{changed[name]!r} {unit}".strip()]
    return f"{kind}:{','.join(parts)}"


def scaled(drive: Drive, factor: float) -> Drive:
    """Return the drive times a factor. Raises InputError for a kind of drive from outside the package."""
    if isinstance(drive, Sine):
        return replace(drive, amplitude=factor * drive.amplitude)
    if isinstance(drive, PiecewiseLinear):
        return replace(drive, values=factor * drive.values, text=f"{drive.text} times {factor:.6g}")
    raise InputError(f"a drive of kind {type(drive).__name__} cannot be scaled")
