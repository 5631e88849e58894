"""Electrical models of a user's own."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from ..errors import InputError, checked
from ..fit.parameter import Parameter
from ..strip.models import IonPath, register
from ..strip.models.given import UNITS, GivenPath
from ..units import parse

_NUMBER = re.compile(r"[-+0-9.eE]+\s*")


@checked
def register_model(
    name: str,
    impedance: Callable[..., Any],
    constants: Mapping[str, str | float],
    *,
    upper: Mapping[str, float] | None = None,
    auto: bool = False,
    replace: bool = False,
) -> IonPath:
    """Add an electrical model, Z = Re + Rdc || (Rs + element), and return it: fits, runs and files then know its name.

    Parameters
    ----------
    name : str
        A word; "name+sinh" and the like then exist too.
    impedance : callable
        Function of complex ``s`` [rad/s] and the constants in their order, written with numpy; it returns the
        element's impedance [ohm]. Rs and Rdc are added to it.
    constants : mapping of str to str or float
        Name of each constant and a typical value with its unit, where fits start: "40 ohm", "0.3 F", "20 s", "1 Hz",
        or a plain number. One is in F, or one in ohm and one in s.
    upper : mapping of str to float, optional
        Upper limits of constants, such as 1 for an exponent; all are positive.
    auto : bool
        True if the choice of a model for spectra tries it too.
    replace : bool
        True if it may take the place of a model of that name that was registered before, as in a cell of a notebook
        that runs again; never that of one of the package.

    Returns
    -------
    IonPath
        The model; it is in the registry from then on.

    Raises
    ------
    InputError
        The name is taken, a value is not understood, or the function fails.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> def arc(s, resistance, time, exponent, capacitance):
    ...     return resistance / (1 + (s * time) ** exponent) + 1 / (capacitance * s)
    >>> typical = {"arc_resistance": "40 ohm", "arc_time": "20 s", "arc_exponent": 0.6, "arc_capacitance": "0.3 F"}
    >>> ilg.register_model("arc", arc, typical, upper={"arc_exponent": 1}).name
    'arc'
    """
    limits = dict(upper or {})
    unknown = [key for key in limits if key not in constants]
    if unknown:
        raise InputError(f"model '{name}': upper names '{unknown[0]}', which is no constant of it")
    if not constants or not all(isinstance(value, str | int | float) for value in constants.values()):
        raise InputError(f"model '{name}': constants are {dict(constants)}; give a typical value of each, as a text")
    units = {key: _unit(name, key, value) for key, value in constants.items()}
    typical = tuple(
        float(value) if isinstance(value, int | float) else parse(value, units[key], f"model '{name}': {key}")
        for key, value in constants.items()
    )
    for key, value in zip(constants, typical, strict=True):
        if not 0 < value < limits.get(key, math.inf):
            raise InputError(f"model '{name}': {key} is typically {value:g}; give a value above 0 and below its limit")
    parameters = tuple(
        Parameter(key, key, unit, f"of model {name}", upper=limits.get(key, math.inf)) for key, unit in units.items()
    )
    text = f"Z = Re + Rdc || (Rs + {name}(s; {', '.join(constants)}))"
    return register(
        GivenPath(name, impedance, parameters, typical, text, ("spectrum",) if auto else ()), replace=replace
    )


def _unit(model: str, key: str, value: str | float) -> str:
    """Return the unit of a constant that is given as text: one of `UNITS`, of whatever prefix."""
    given = _NUMBER.sub("", value, count=1).strip() if isinstance(value, str) else ""
    for unit in UNITS:
        if given.endswith(unit) and (unit or not given):
            return unit
    raise InputError(
        f"model '{model}': {key} is in '{given}'; constants are in {', '.join(filter(None, UNITS))} or numbers"
    )
