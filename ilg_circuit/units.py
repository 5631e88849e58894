"""Quantities with units at the boundary ("30 mm", "7.6 kPa"); inside the package everything is an SI float.

Both directions are lossless: the number is scaled in decimal arithmetic, so that ``parse(format(x)) == x`` bit for bit.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .errors import Argument, InputError

if TYPE_CHECKING:
    from pint import UnitRegistry

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*")

#: A number with a decimal comma, before its unit; 1,250 could be a thousand and more.
_COMMA = re.compile(r"\s*([+-]?\d*),(\d+(?:[eE][+-]?\d{1,3})?)(?=\s*[^\s\d.,]|\s*$)")
_THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}(?!\d)")

_UNIT = re.compile(r"[A-Za-z\u00b5\u03bc\u03a9\u2126\u00b7 _*/^().0-9+-]{0,40}|%")
#: A square or a cube without its sign, as in mm2.
_POWER, _POWERS = re.compile(r"(?<=[A-Za-z])(?:[23]\b|[\u00b2\u00b3])"), {"\u00b2": "2", "\u00b3": "3"}
_COUNTS = re.compile("degree|turn|revolution|cycle|count|per_minute|per_second|bel|neper|decade|octave")

#: Without a scale these are no length, voltage or anything else, though a unit library knows some: a pixel as
#: 1/96 inch, au as the astronomical unit.
_NEEDS_SCALE = re.compile(
    r"px|pix|pixels?|dots?|pels?|counts?|cts?|steps?|ticks?|divs?|divisions?|lsb|bits?|digits?|frames?|samples?|points?"
    r"|pts?|a\.?u\.?|arb\.?( ?u(nits?)?\.?)?|arbitrary( units?)?|didots?|ciceros?|picas?|%? ?fs",
    re.IGNORECASE,
)
#: What instruments and data sheets give, by pint's names without prefixes.
_IN_USE = re.compile(
    "meter|micron|angstrom|inch|thou|mil|foot|second|minute|hour|day|week|hertz|volt|ampere|ohm|siemens|farad|henry"
    "|coulomb|ampere_hour|newton|dyne|pond|force_kilogram|force_pound|force_gram|gram|pound|ounce|metric_ton|pascal|bar"
    "|barye|standard_atmosphere|torr|pound_force_per_square_inch|kip_per_square_inch|joule|erg|calorie|electron_volt"
    "|watt|watt_hour|liter|radian|degree|revolutions_per_minute|percent|kelvin|(delta_)?degree_Celsius|mole|molar|tesla"
    "|weber"
)

#: SI unit, or name of an argument -> least and largest size of such a quantity, with room around all that was ever
#: measured on a gel. Zero is no matter of size.
PLAUSIBLE = {
    "duration": (1e-9, 1e9),
    "rise_time": (1e-6, 1e6),
    "adaptation_time": (1e-6, 1e6),
    "slower": (1e-3, 1e3),
    "": (1e-15, 1e12),
    "m": (1e-12, 1e4),
    "s": (1e-12, 1e12),
    "Hz": (1e-12, 1e12),
    "1/s": (1e-15, 1e15),
    "rad/s": (1e-15, 1e15),
    "V": (1e-12, 1e6),
    "A": (1e-18, 1e9),
    "N": (1e-18, 1e9),
    "V/s": (1e-18, 1e15),
    "m/s": (1e-18, 1e9),
    "kg": (1e-18, 1e6),
    "kg/m^3": (1e-3, 1e6),
    "Pa": (1e-6, 1e15),
    "N/m": (1e-18, 1e12),
    "ohm": (1e-15, 1e21),
    "ohm m": (1e-15, 1e21),
    "F": (1e-21, 1e9),
    "F/m": (1e-18, 1e12),
    "H": (1e-21, 1e12),
}
ANY_SIZE = (1e-30, 1e30)

#: SI prefixes used when a value is written; larger or smaller values are written without one.
_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_PREFIXABLE = frozenset({"m", "Pa", "V", "A", "ohm", "F", "H", "N", "s", "C", "J", "W", "Hz", "m/V"})
#: (unit, SI unit) -> factor of the commonest units, for which no library of units needs to be loaded.
COMMON = {
    **{
        (sign + unit, unit): Fraction(10) ** exponent
        for exponent, prefix in _PREFIXES.items()
        for sign in ({"u": ("u", "\u00b5", "\u03bc")}.get(prefix, (prefix,)))
        for unit in _PREFIXABLE
    },
    ("cm", "m"): Fraction(1, 100),
    ("min", "s"): Fraction(60),
    ("g", "kg"): Fraction(1, 1000),
    ("mg", "kg"): Fraction(1, 10**6),
    ("mN/m", "N/m"): Fraction(1, 1000),
}


#: Name of a quantity, or SI unit -> units in use, the most usual first, and the range of SI values that is usual.
_USUAL: dict[str, tuple[tuple[str, ...], float, float]] = {
    "thickness": (("mm", "um", "m"), 2e-5, 1e-2),
    "electrode_thickness": (("um", "nm", "m"), 1e-9, 1e-4),
    "m": (("mm", "m", "cm", "um"), 3e-4, 0.5),
    "m^2": (("mm^2", "m^2"), 1e-9, 1e-2),
    "s": (("s", "ms"), 1e-3, 1e7),
    "Hz": (("Hz", "kHz"), 1e-5, 1e5),
    "V": (("V", "mV"), 0.02, 60.0),
    "A": (("mA", "A"), 1e-6, 2.0),
    "N": (("mN", "N"), 1e-6, 1.0),
    "Pa": (("kPa", "MPa", "Pa"), 1e3, 5e6),
    "kg/m^3": (("kg/m^3", "g/cm^3"), 300.0, 2e4),
    "kg": (("g", "mg", "kg"), 1e-6, 0.1),
    "V/s": (("V/s", "mV/s"), 1e-4, 1e3),
}


def likely(number: str, si_unit: str, what: str = "") -> str:
    """Return a number with the unit that it most likely has: that makes it usual for the quantity ``what``.

    >>> likely("0.35", "m", "geometry.thickness"), likely("35", "m", "--length"), likely("7600", "Pa")
    ('0.35 mm', '35 mm', '7600 Pa')
    """
    word = re.split(r"[.\s]", what)[-1].lstrip("-").replace("-", "_").rstrip("_12")
    units, low, high = _USUAL.get(word) or _USUAL.get(si_unit) or ((), 0.0, 0.0)
    try:
        fitting = [u for u in units if low <= abs(float(number)) * float(scale(u, si_unit)) <= high]
    except (ValueError, InputError):  # not a number, or a name of another dimension here
        fitting = []
    return f"{number} {fitting[0] if fitting else si_unit}"


def _with_point(text: str, what: str) -> str:
    """Return ``text`` with a point for a decimal comma. Raises InputError for one that may divide thousands."""
    match = _COMMA.match(text)
    if match is None:
        return text
    if _THOUSANDS.match(text):
        number = match[0].strip()
        one, other = number.replace(",", "."), number.replace(",", "")
        raise InputError(f"{what}: '{text}' may be {one} or {other}; write out the intended one")
    return f"{match[1] or 0}.{match[2]}{text[match.end() :]}"


@lru_cache(maxsize=1)
def _registry() -> UnitRegistry[Any]:
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Decimal)  # with floats a g/cm^3 would be 999.9999999999999 kg/m^3


@lru_cache(maxsize=512)
def scale(unit: str, si_unit: str) -> Fraction:
    """Return the exact factor that turns a number in ``unit`` into one in ``si_unit``.

    Raises InputError when ``unit`` is unknown, is a unit of something else, or none that an instrument gives. Hertz and
    radians per second are kept apart (pint holds them equal), because the silent factor 2 pi is the classic slip in
    this field.
    """
    if unit == si_unit and unit:  # as in every file that the package writes
        return Fraction(1)
    unit = _POWER.sub(lambda power: f"^{_POWERS.get(power[0], power[0])}", unit)
    return COMMON[unit, si_unit] if (unit, si_unit) in COMMON else scale_by_pint(unit, si_unit)


def scale_by_pint(unit: str, si_unit: str) -> Fraction:
    """Return `scale` of any unit; to load all units takes half a second."""
    import pint

    registry = _registry()
    # pint would drop apparent comments and quotation marks
    if not _UNIT.fullmatch(unit) or re.search(r"\d\d|\*\*.*\*\*|\^.*\^", unit):
        raise InputError(f"unknown unit '{unit[:30]}'; use '{si_unit}' or a multiple of it")
    if si_unit and _NEEDS_SCALE.fullmatch(unit.strip()):
        how = f"give the values in '{si_unit}' or a multiple of it"
        raise InputError(f"unit '{unit}' needs a scale, for pixels so many mm to a pixel; {how}")
    if unit == "%" and not si_unit:
        return Fraction(1, 100)
    try:
        given, wanted = registry.parse_units(unit), registry.parse_units(si_unit)
        factor = Fraction(registry.Quantity(Decimal(1), given).to(wanted).magnitude)
    except pint.DimensionalityError:
        raise InputError(f"unit '{unit}' does not measure this quantity; use '{si_unit}' or a multiple of it") from None
    except Exception:  # pint's parser leaks many exception types (tokenizer, attribute, value errors)
        raise InputError(f"unknown unit '{unit}'; use '{si_unit}' or a multiple of it") from None
    cycles = "hertz" in str(given)
    if cycles != ("hertz" in str(wanted)) and "rad" in f"{si_unit} {given}":
        raise InputError(f"unit '{unit}' is ambiguous by 2 pi here; use '{si_unit}'")
    strange = [name for name in given._units if not _IN_USE.fullmatch(_without_prefix(registry, name))]
    if strange and si_unit:
        raise InputError(
            f"unit '{unit}' ({strange[0].replace('_', ' ')}) is not a unit of an instrument; use '{si_unit}' or a "
            "multiple of it"
        )
    if _COUNTS.search(str(given)) or not si_unit:
        raise InputError(f"unit '{unit}' counts turns, degrees or ratios; use '{si_unit or 'a plain number'}'")
    return factor


def _without_prefix(registry: UnitRegistry[Any], name: str) -> str:
    return next((unit for _, unit, _ in registry.parse_unit_name(name)), name)


def parse(text: str, si_unit: str, what: str = "quantity") -> float:
    """Return the SI value of a text such as ``"30 mm"``; ``si_unit`` names the dimension ("" for a pure number).

    A decimal comma is understood. Raises InputError naming ``what`` when the text has no number, no unit (the likely
    one is named), a unit of another dimension, or a value that is not finite.
    """
    match = _NUMBER.fullmatch(_with_point(text, what)) if len(text) <= 200 else None
    if match is None:
        wanted = f"a number with a unit; write it like '30 {si_unit}'" if si_unit else "a number; write it like '0.3'"
        raise InputError(f"{what}: '{text[:40]}' is not {wanted}")
    number, unit = match.groups()
    if si_unit and not unit:
        raise InputError(f"{what}: '{text}' has no unit; write it like '{likely(number, si_unit, what)}'")
    if not unit:
        value = float(number)
    else:
        try:
            value = float(Fraction(number) * scale(unit, si_unit))
        except InputError as error:
            raise InputError(f"{what}: {error}") from None
        except OverflowError:
            value = math.inf
    if not math.isfinite(value):
        raise InputError(f"{what}: '{text}' is not a finite value")
    if not value and Fraction(number):
        value = 5e-324  # not zero, but smaller than any number
    require_plausible(what, value, si_unit)
    return value


def si(value: str | float, si_unit: str, what: str) -> float:
    """Return the SI value of a text as `parse` reads it, or of a number that is in SI units already."""
    if isinstance(value, str):
        return parse(value, si_unit, what)
    try:
        return float(value)
    except (TypeError, ValueError):
        wanted = f"a number in {si_unit} or a text such as '30 {si_unit}'" if si_unit else "a number"
        raise InputError(f"{what} is {type(value).__name__} {value!r}"[:80] + f"; give {wanted}") from None


def require_plausible(what: str, value: float, unit: str = "") -> None:
    """Raise InputError naming ``what`` for a ``value`` [``unit``], other than zero, of a size that nothing has."""
    name = what.name if isinstance(what, Argument) else unit
    low, high = PLAUSIBLE.get(name, PLAUSIBLE.get(unit, ANY_SIZE))
    if value and not low <= abs(value) <= high:
        raise InputError(f"{what} {value:g} {unit}".strip() + f": give a size from {low:g} to {high:g} {unit}".rstrip())


def require_positive(what: str, value: float, unit: str = "") -> None:
    """Raise InputError naming ``what`` for a ``value`` [``unit``] that is not positive or not finite."""
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"{f'{what} {value:g} {unit}'.strip()} must be more than zero and finite")
    require_plausible(what, value, unit)


def format_quantity(value: float, si_unit: str, digits: int | None = None) -> str:
    """Return an SI value as text with a fitting prefix, exact when ``digits`` is None, else rounded to them."""
    value = float(value)
    if not math.isfinite(value):
        return f"{value} {si_unit}".strip()
    exponent = 0
    if si_unit in _PREFIXABLE and value:
        exponent = 3 * math.floor(math.log10(abs(value)) / 3 + 1e-12)
        exponent = exponent if exponent in _PREFIXES else 0
    scaled = Decimal(repr(value)).scaleb(-exponent)
    text = repr(float(scaled)) if Decimal(repr(float(scaled))) == scaled else format(scaled, "g")
    if digits is not None:
        text = f"{float(scaled):.{digits}g}"
        if "e" in text and 1 <= abs(scaled) < 1e5:
            text = f"{float(text):.0f}"  # 110 reads better than 1.1e+02
    return f"{text.removesuffix('.0')} {_PREFIXES.get(exponent, '')}{si_unit}".strip()


def concise(value: float, error: float, si_unit: str) -> str:
    """Return a value with its standard error in the digits that it concerns, and a fitting prefix.

    The error has two digits where they are 10 to 35, else one.

    >>> concise(332.41, 0.52, "ohm"), concise(4.213e-5, 1.26e-6, "F"), concise(2.4448e-9, 3e-12, "m/(V s)")
    ('332.4(5) ohm', '42.1(13) uF', '2.4448(30)e-09 m/(V s)')
    """
    value, error = float(value), float(error)
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return format_quantity(value, si_unit, 6)
    size = Decimal(repr(value or error))
    exponent = 3 * (size.adjusted() // 3) if si_unit in _PREFIXABLE else 0
    exponent = exponent if exponent in _PREFIXES else 0
    power = size.adjusted() if not -3 <= size.adjusted() - exponent <= 5 else exponent
    spread = Decimal(repr(error))
    last = spread.adjusted() - (spread.scaleb(-spread.adjusted()) < Decimal("3.55"))
    last = max(last, size.adjusted() - 11)  # digits of a double
    shown = Decimal(repr(value)).scaleb(-last).quantize(Decimal(1))
    digits = spread.scaleb(-last).quantize(Decimal(1))
    if last >= power:  # no digits after the point
        text, digits = f"{shown.scaleb(last - power):f}", digits.scaleb(last - power)
    else:
        text = f"{shown.scaleb(last - power):.{power - last}f}"
    tens = f"e{power:+03d}" if power != exponent else ""
    return f"{text}({digits:f}){tens} {_PREFIXES.get(exponent, '') if not tens else ''}{si_unit}".strip()
