"""Reads what a controller is tuned for, gains, and the drift of a strip from texts."""

from __future__ import annotations

from collections.abc import Mapping

from ..control.laws import kind_of
from ..errors import InputError, argument, unknown_name
from ..units import si


def goals_of(text: str | None) -> dict[str, float]:
    """Return the goals of a text such as "settling=30s"."""
    units = {"settling": "s", "bandwidth": "Hz"}
    found: dict[str, float] = {}
    for part in (text or "").split(",") if text else ():
        name, _, value = part.partition("=")
        if name.strip() not in units:
            raise unknown_name("goal", name.strip(), units)
        found[name.strip()] = si(value, units[name.strip()], f"{argument('to')}, {name.strip()}")
        if not found[name.strip()] > 0:
            raise InputError(f"{argument('to')}: '{part}' must be more than zero")
    return found


def gains_of(kind: str, given: str | Mapping[str, str | float] | None) -> dict[str, float] | None:
    """Return gains [SI] by name from a text or a mapping."""
    if given is None:
        return None
    units = kind_of(kind).units
    if isinstance(given, str):
        given = dict(part.partition("=")[::2] for part in given.split(","))
    found = {}
    for name, value in given.items():
        key = str(name).strip()
        if key not in units:
            raise unknown_name(f"gain of {kind}", key, units)
        found[key] = si(value, units[key], f"{argument('gains')}, {key}")
    return found


def drift_of(given: str | Mapping[str, str | float] | None) -> dict[str, float] | None:
    """Return the factors that values end at, by name, from changes such as "capacitance=-40%"."""
    if not given:
        return None
    if isinstance(given, str):
        given = dict(part.partition("=")[::2] for part in given.split(","))
    name = argument("drift")
    return {str(key).strip(): 1 + si(value, "", f"{name}, {str(key).strip()}") for key, value in given.items()}
