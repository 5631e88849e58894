"""Fields of dataclasses that hold SI floats, with unit, meaning and limits."""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import Any

from ..errors import InputError
from ..units import require_plausible


def quantity(unit: str, meaning: str, *, zero: bool = False, signed: bool = False, default: Any = ...) -> Any:
    """Return a dataclass field that holds an SI float, with its unit and meaning for files, tables and validation."""
    metadata = {"unit": unit, "meaning": meaning, "zero": zero, "signed": signed}
    return field(metadata=metadata) if default is ... else field(default=default, metadata=metadata)


def validate_quantities(record: Any, where: str = "") -> None:
    """Check every `quantity` field: a finite float; positive, not negative where zero is allowed, or of any sign.

    Errors name it after ``where``, by default the record's kind.
    """
    for item in fields(record):
        if "unit" not in item.metadata:
            continue
        value = getattr(record, item.name)
        if value is None and item.default is None:
            continue
        section = getattr(record, "section", type(record).__name__.lower())
        name = f"{where or f'{section}.'}{item.name}"
        zero, signed = item.metadata["zero"], item.metadata["signed"]
        number = checked(name, value, item.metadata["unit"], zero=zero, signed=signed)
        object.__setattr__(record, item.name, number)


def checked(name: str, value: Any, unit: str, *, zero: bool = False, signed: bool = False) -> float:
    """Return ``value`` as a float. Raises InputError unless it is finite, and positive, or an allowed zero or sign."""
    try:
        number = float(value) if not isinstance(value, (bool, str)) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if math.isnan(number) and not isinstance(value, float):
        raise InputError(f"{name} is {str(value)[:40]!r}; give a number in {unit or 'no unit'}")
    if not math.isfinite(number):
        raise InputError(f"{name} is {number}; give a finite value")
    if not signed and (number < 0 or (number == 0 and not zero)):
        raise InputError(f"{name} is {number:g}; it must be {'zero or more' if zero else 'more than zero'}")
    require_plausible(name, abs(number), unit)
    return number
