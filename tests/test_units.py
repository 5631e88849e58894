"""Quantities at the boundary: lossless, of the right dimension, and never a traceback."""

from __future__ import annotations

import math
import re
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.errors import InputError
from ilg_circuit.units import COMMON, PLAUSIBLE, format_quantity, parse, scale, scale_by_pint

SI_UNITS = ("m", "Pa", "V", "A", "ohm", "F", "N", "s", "C", "J", "W", "Hz")
COMPOUND_UNITS = ("", "ohm m", "F/m", "kg/m^3", "m/(V s)", "1/s", "rad/s", "N/m", "N s/m", "V/s", "m/V", "m/C", "kg")
PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}


@pytest.mark.parametrize("unit", SI_UNITS + COMPOUND_UNITS)
@given(data=st.data())
def test_written_and_read_back_bit_for_bit(unit: str, data: st.DataObject) -> None:
    low, high = PLAUSIBLE.get(unit, (1e-30, 1e30))
    value = data.draw(st.sampled_from([-1.0, 1.0])) * data.draw(st.just(0.0) | st.floats(low, high))
    assert parse(format_quantity(value, unit), unit) == value


#: What `PLAUSIBLE` knows by the name of an argument.
ARGUMENTS = {"duration", "rise_time", "adaptation_time", "slower"}


@pytest.mark.parametrize("unit", [*(u for u in PLAUSIBLE if u not in ARGUMENTS), "m/(V s)"])
def test_a_size_that_nothing_has_is_refused_with_the_sizes_allowed(unit: str) -> None:
    low, high = PLAUSIBLE.get(unit, (1e-30, 1e30))
    for value in (low, high, 0.0):
        assert parse(f"-{value!r} {unit}", unit) == -value
    for text in ("1e-400", "5e-324", repr(low * 0.99), repr(high * 1.01), "-1e300"):
        told = f"quantity {float(text) or 5e-324:g} {unit}".strip() + f": give a size from {low:g} to {high:g}"
        with pytest.raises(InputError, match=re.escape(told)):
            parse(f"{text} {unit}", unit)


@pytest.mark.parametrize("exponent", range(-12, 4))
@given(mantissa=st.floats(1.0, 10.0, exclude_max=True))
def test_every_prefix_is_lossless(exponent: int, mantissa: float) -> None:
    value = mantissa * 10.0**exponent
    text = format_quantity(value, "m")
    assert parse(text, "m") == value
    assert 0.999999999 <= float(text.split()[0]) < 1000


def test_the_commonest_units_are_those_of_the_library() -> None:
    assert {pair: scale_by_pint(*pair) for pair in COMMON} == COMMON


@pytest.mark.parametrize(("prefix", "exponent"), PREFIXES.items())
@pytest.mark.parametrize("unit", SI_UNITS)
def test_prefixes_scale_exactly(unit: str, prefix: str, exponent: int) -> None:
    assert float(scale(f"{prefix}{unit}", unit)) == float(f"1e{exponent}")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("30mm", "m", 0.03),
        (" 30  mm ", "m", 0.03),
        ("+.5 mm", "m", 0.0005),
        ("7.6 kPa", "Pa", 7600.0),
        ("7.6e3Pa", "Pa", 7600.0),
        ("-4V", "V", -4.0),
        ("5 min", "s", 300.0),
        ("1 h", "s", 3600.0),
        ("1 in", "m", 0.0254),
        ("233.333 ohm*m", "ohm m", 233.333),
        ("1.25 g/cm^3", "kg/m^3", 1250.0),
        ("1.25 g/cm3", "kg/m^3", 1250.0),
        ("2.5 mm2", "m^2", 2.5e-6),
        ("2.5 cm\u00b2", "m^2", 2.5e-4),
        ("1 g/cm^3", "kg/m^3", 1000.0),
        ("1 ml", "m^3", 1e-6),
        ("3 \N{MICRO SIGN}m", "m", 3e-6),
        ("3 \N{GREEK SMALL LETTER MU}m", "m", 3e-6),
        ("2 \N{GREEK CAPITAL LETTER OMEGA}", "ohm", 2.0),
        ("50%", "", 0.5),
        ("0.3", "", 0.3),
        ("1uN*s/m", "N*s/m", 1e-6),
        ("0.1mHz", "Hz", 1e-4),
    ],
)
def test_parses(text: str, unit: str, value: float) -> None:
    assert parse(text, unit) == value  # bit for bit


@pytest.mark.parametrize(
    ("text", "unit", "hint"),
    [
        ("30", "m", "has no unit"),
        ("30 V", "m", "does not measure"),
        ("30 mm^2", "m", "does not measure"),
        ("30 M", "m", "does not measure"),  # molar, not metre
        ("30 furlong_s", "m", "unknown unit"),
        ("30 K", "s", "does not measure"),
        ("30 S", "s", "does not measure"),  # siemens, not seconds
        ("mm", "m", "not a number"),
        ("", "m", "not a number"),
        ("nan m", "m", "not a number"),
        ("inf m", "m", "not a number"),
        ("-inf m", "m", "not a number"),
        ("1e999 m", "m", "not a finite value"),
        ("1e308 km", "m", "not a finite value"),
        ("1e999", "", "not a finite value"),
        ("3,500 m", "m", "may be 3.500 or 3500"),
        ("3,5,5 mm", "m", "unknown unit"),
        ("1 m m", "m", "does not measure"),
        ("0.3 V", "", "does not measure"),
        ("5 degC", "m", "does not measure"),
        ("1 2 mm", "m", "unknown unit"),
    ],
)
def test_refuses(text: str, unit: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint) as caught:
        parse(text, unit, "key")
    assert str(caught.value).startswith("key: ")


def test_a_missing_unit_is_shown_how_to_write() -> None:
    with pytest.raises(InputError, match="write it like '30 mm'"):
        parse("30", "m", "length")


@pytest.mark.parametrize(
    ("unit", "si_unit"),
    [
        ("Hz", "rad/s"),
        ("kHz", "rad/s"),
        ("hertz", "rad/s"),
        ("rad/s", "Hz"),
        ("mrad/s", "Hz"),
        ("rad*Hz", "rad/s"),
    ],
)
def test_hertz_and_radians_per_second_are_kept_apart(unit: str, si_unit: str) -> None:
    with pytest.raises(InputError, match="2 pi"):
        scale(unit, si_unit)


@pytest.mark.parametrize("unit", ["rpm", "rps", "cycle/s", "turn/s", "revolution/second", "degree/s"])
def test_no_unit_of_rotation_is_taken_for_hertz_times_2_pi(unit: str) -> None:
    """One turn a second is 1 Hz; a unit library that counts angles in radians says 6.28."""
    right = {"rpm": 1 / 60, "degree/s": 1 / 360}.get(unit, 1.0)
    try:
        factor = float(scale(unit, "Hz"))
    except InputError:
        return  # refusing is as good
    assert factor == pytest.approx(right)


@pytest.mark.parametrize(
    "unit", ["px", "pixel", "dot", "pt", "pica", "point", "didot", "count", "a.u.", "au", "arb. u.", "steps"]
)
@pytest.mark.parametrize("si_unit", ["m", "V", "A", "s"])
def test_what_has_no_scale_is_no_unit(unit: str, si_unit: str) -> None:
    """A unit library takes a pixel for 1/96 inch and au for the astronomical unit."""
    with pytest.raises(InputError, match=f"unit '{unit}' needs a scale, for pixels so many mm to a pixel"):
        scale(unit, si_unit)


@pytest.mark.parametrize(
    ("unit", "si_unit"),
    [
        *[
            (unit, "m")
            for unit in ("css_pixel", "mpx", "parsec", "light_year", "furlong", "bohr", "scaled_point", "fathom")
        ],
        *[("a", "s"), ("century", "s"), ("fortnight", "s"), ("Bq", "Hz"), ("biot", "A"), ("abA", "A"), ("e", "C")],
    ],
)
def test_units_that_no_instrument_gives_are_refused(unit: str, si_unit: str) -> None:
    with pytest.raises(InputError, match=f"unit '{unit}' .*is not a unit of an instrument; use '{si_unit}'"):
        scale(unit, si_unit)


@pytest.mark.parametrize(
    ("unit", "si_unit", "factor"),
    [
        *[
            ("inch", "m", 0.0254),
            ("thou", "m", 2.54e-5),
            ("micron", "m", 1e-6),
            ("angstrom", "m", 1e-10),
            ("h", "s", 3600),
        ],
        *[
            ("mAh", "C", 3.6),
            ("kgf", "N", 9.80665),
            ("psi", "Pa", 6894.757293168362),
            ("bar", "Pa", 1e5),
            ("mN/m", "N/m", 1e-3),
        ],
        *[
            ("MA", "A", 1e6),
            ("kohm", "ohm", 1e3),
            ("mS", "1/ohm", 1e-3),
            ("g/cm^3", "kg/m^3", 1e3),
            ("day", "s", 86400),
        ],
    ],
)
def test_units_in_use_stay(unit: str, si_unit: str, factor: float) -> None:
    assert float(scale(unit, si_unit)) == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize("text", ["3 dB", "3 Np", "1 decade", "1 octave", "30 deg", "1 turn", "1 bit"])
def test_a_pure_number_has_no_logarithmic_or_angular_unit(text: str) -> None:
    with pytest.raises(InputError):
        parse(text, "", "damping ratio")


@pytest.mark.parametrize("unit", ["mm # a note", "'mm", '"mm', "mm;", "mm\x00", "mm,"])
def test_stray_characters_are_not_dropped_without_a_word(unit: str) -> None:
    with pytest.raises(InputError):
        parse(f"30 {unit}", "m")


@pytest.mark.parametrize("unit", ["m", "rad/s", ""])
@given(text=st.text(max_size=40))
def test_garbage_is_refused_as_input(unit: str, text: str) -> None:
    with suppress(InputError):
        assert math.isfinite(parse(text, unit))


@given(number=st.from_regex(r"[+-]?\d{1,8}(\.\d{0,8})?([eE][+-]?\d{1,4})?", fullmatch=True), unit=st.text(max_size=12))
def test_garbage_after_a_number_is_refused_as_input(number: str, unit: str) -> None:
    with suppress(InputError):
        assert math.isfinite(parse(f"{number} {unit}", "s"))


@pytest.mark.parametrize(
    "text", ["1" * 5000 + " m", "1 " + "(" * 3000, "1 m^" + "9" * 400, "1 m**9**9", "1 1/0", "1 m/0", "1 \ud800"]
)
def test_hostile_texts_are_refused_as_input(text: str) -> None:
    with pytest.raises(InputError):
        parse(text, "m")


def test_formatted_for_people() -> None:
    assert format_quantity(0.0005, "m") == "500 um"
    assert format_quantity(4.398e-5, "N/m") == "4.398e-05 N/m"
    assert format_quantity(2 / 3, "V", 3) == "667 mV"
    assert format_quantity(1.1e-4, "F", 2) == "110 uF"
    assert format_quantity(1234.0, "kg/m^3", 2) == "1200 kg/m^3"
    assert format_quantity(0.0, "A") == "0 A"
    assert format_quantity(-0.25, "V") == "-250 mV"
    assert format_quantity(0.3, "") == "0.3"
    assert format_quantity(math.nan, "V") == "nan V"
    assert format_quantity(math.inf, "V") == "inf V"
    assert format_quantity(1e30, "m") == "1e+30 m"
