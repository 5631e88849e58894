"""Units as instruments write them in headers: which texts look like one, and their factors to SI."""

from __future__ import annotations

import math
import re
from functools import lru_cache

from ..errors import InputError
from ..units import scale

_PURE_NUMBER = ("", "-", "1", "mm/mm", "m/m", "in/in", "mm / mm")
_ANGLES = {**dict.fromkeys(("deg", "degree", "degrees", "\u00b0", "\u00ba", "grad"), 1.0), "rad": 180 / math.pi}
#: The unit of an angular frequency.
_ANGULAR = re.compile(r"rad ?(?:/ ?s|[*\u00b7.]? ?s\^?-1)", re.IGNORECASE)
#: A cell that is likely a unit.
UNIT_LIKE = re.compile(
    r"[\[(]?(?:[pnu\u00b5\u03bcmkMG]?(?:s|sec|min|h|V|A|m|N|C|Hz|[Oo]hms?|\u03a9|\u2126|Pa|S|F)"
    r"|px|pixels?|deg|\u00b0|%|mm/mm|[Vv]olts?|[Aa]mp(?:ere)?s?|[Ss]econds?)[\])]?"
)
#: The units of a picture.
PIXELS = re.compile(r"px|pix|pixels?", re.IGNORECASE)
_OHM = re.compile(r"ohms?\b|[\u03a9\u2126]", re.IGNORECASE)
#: The reference electrode behind a unit or a name.
REFERENCE = re.compile(r"[ (]{1,3}(?:vs|versus)\b.*", re.IGNORECASE)
_WRITTEN_OUT = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "秒", "초"), "s"),
    **dict.fromkeys(("msec", "msecs", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("minute", "minutes", "mins"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("millivolt", "millivolts"), "mV"),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), "A"),
    **dict.fromkeys(("milliamp", "milliamps", "milliampere", "milliamperes"), "mA"),
    **dict.fromkeys(("microamp", "microamps", "microampere", "microamperes"), "uA"),
    **{
        "hz": "Hz",
        "khz": "kHz",
        "siemens": "S",
        "ohm-1": "S",
        "ohm^-1": "S",
        "1/ohm": "S",
    },
    **dict.fromkeys(("h:min:s.ms", "h:min:s", "hh:mm:ss", "hh:mm:ss.sss", "h:m:s", "hms"), "s"),
}


@lru_cache(maxsize=4096)
def tried(unit: str, si: str) -> tuple[float, str]:
    """Return the factor from a unit to SI and no complaint, or zero and the complaint."""
    try:
        return _factor(unit, si), ""
    except InputError as error:
        return 0.0, f": {error}"


def _factor(unit: str, si: str) -> float:
    """Return the factor from a unit, as instruments write it, to SI. Raises InputError where there is none."""
    if si == "deg":
        angle = _ANGLES.get(clean_unit(unit).removeprefix("\u00c2").lower())
        if angle is None:
            raise InputError(f"unit '{unit[:40]}' is not an angle; give it in 'deg' or 'rad'")
        return angle
    if si == "Hz" and _ANGULAR.fullmatch(unit.strip(" ()[]")):
        return 1 / (2 * math.pi)
    if not si:
        unit = clean_unit(unit)
        if unit in _PURE_NUMBER:
            return 1.0
        try:
            return float(scale(unit, si))
        except InputError:
            raise InputError(f"unit '{unit[:40]}' does not measure a pure number; leave it out") from None
    if not unit:
        raise InputError(f"it has no unit; give it in '{si}' or a multiple of it")
    clean = clean_unit(unit)
    if si == "s" and clean == "S":
        clean = "s"
    try:
        return float(scale(clean, si))
    except InputError as error:
        try:
            scale(re.sub(r"([A-Za-z])(-?\d)", r"\1^\2", clean).replace(".", "*"), f"{si}/m^2")
        except InputError:
            raise error from None
    raise InputError(f"unit '{unit[:40]}' is one per area; multiply by the electrode's area and give it in '{si}'")


def clean_unit(unit: str) -> str:
    """Return a unit as it is looked up: without brackets and reference electrode, with ASCII letters where possible."""
    unit = unit.strip().strip("\"'").strip()
    if unit[:1] + unit[-1:] in ("()", "[]", "<>"):
        unit = unit[1:-1].strip()
    for wrong, right in (("\u00c2\u00b5", "u"), ("\u00b5", "u"), ("\u03bc", "u")):
        unit = unit.replace(wrong, right)
    unit = _OHM.sub("ohm", REFERENCE.sub("", unit))
    return _WRITTEN_OUT.get(unit.lower(), unit)
