"""Electrical models defined by users."""

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
    """Add an electrical model of one's own and return it; fits, runs and files then accept its name.

    The impedance of the strip is Z = Re + 1/(1/Rdc + 1/(Rs + element)). Only the element is yours: Re, Rdc and the
    series resistance Rs are added to it and fitted too (as electrode_resistance, dc_resistance, series_resistance).

    Parameters
    ----------
    name : str
        Name of the model, one word. Its combinations such as "name+sinh" then exist too.
    impedance : callable
        Function ``impedance(s, constant_1, constant_2, ...)``, written with numpy, that returns the element's
        impedance [ohm] for an array of complex angular frequencies ``s`` [rad/s]. The constants come in the order of
        ``constants``, each as a number in SI units.
    constants : mapping of str to str or float
        Name of each constant -> a typical value with its unit, from which fits start: "40 ohm", "0.3 F", "20 s",
        "1 Hz", or a plain number for a constant without a unit. At least one must be in F, or one in ohm and one in s.
    upper : mapping of str to float, optional
        Name of a constant -> its upper limit, such as ``{"exponent": 1}``. All constants are positive.
    auto : bool
        True if ``identify(..., model="auto")`` is to try it on spectra too.
    replace : bool
        True to replace a model of that name that was registered before, as a notebook's cell does that runs again. A
        model of the package is never replaced.

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
        raise InputError(f"model '{name}': upper names '{unknown[0]}', which is not one of its constants")
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
