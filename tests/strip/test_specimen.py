"""Strips from their sizes alone: their file, what they need for a circuit, and slips in files that are told."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Run

import ilg_circuit as ilg
from ilg_circuit.errors import InputError, nearest, wrong_choice
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import load_actuator, load_strip
from ilg_circuit.strip.specimen import MECHANICAL, Specimen
from ilg_circuit.units import concise, likely, parse

SIZES = {"length": "35 mm", "free_length": "3 cm", "width": "5 mm", "thickness": "0,5 mm"}


def test_its_file_reads_back_with_every_key_in_it(tmp_path: Path) -> None:
    gel = ilg.new_strip(**SIZES, load_position="20 mm", density="1.1 g/cm^3", orientation="hanging", name='gel "7"')
    gel.save(tmp_path / "gel.toml")
    assert load_strip(tmp_path / "gel.toml") == gel
    text = (tmp_path / "gel.toml").read_text(encoding="utf-8")
    assert all(f"\n{key} = " in text for key in (*SIZES, "load_position", "density"))
    assert "\n# youngs_modulus" in text
    whole = "\n".join(line.removeprefix("# ") if " = " in line else line for line in text.splitlines())
    (tmp_path / "whole.toml").write_text(whole, encoding="utf-8")
    given = load_strip(tmp_path / "whole.toml")
    assert isinstance(given, Specimen)
    assert set(dict(given.known)) == set(MECHANICAL[:4])


def test_what_it_stands_for_is_the_paper_strip_of_these_sizes() -> None:
    gel = ilg.new_strip(**SIZES, youngs_modulus="9 kPa")
    assert gel.modulus_known
    assert not ilg.new_strip(**SIZES).modulus_known
    stand_in = gel.stand_in()
    assert stand_in.material.youngs_modulus == 9000.0
    assert stand_in.material.dc_resistivity == PAPER.material.dc_resistivity
    assert stand_in.coupling is None


def test_an_unusual_size_is_warned_of_where_a_strip_is_made_or_loaded(tmp_path: Path, run: Run) -> None:
    with pytest.warns(ilg.IlgWarning, match="length is 35 m; usual strips have 1 mm to 500 mm: check the unit") as told:
        ilg.new_strip(**SIZES | {"length": "35 m"}).save(tmp_path / "long.toml")
    assert Path(told[0].filename) == Path(__file__)
    with pytest.warns(ilg.IlgWarning, match="length is 35 m"):
        load_strip(tmp_path / "long.toml")
    with pytest.warns(ilg.IlgWarning, match="thickness is 500 mm") as told:
        ilg.PAPER.with_(thickness="0.5 m", width="6 mm")
    assert len(told) == 1
    sizes = [f"--{key.replace('_', '-')}={value}" for key, value in SIZES.items()]
    done = run("new", "x.toml", *sizes, "--width=5m")
    assert done.code == 0
    assert done.err.count("width is 5 m") == 1
    assert "UserWarning" not in done.err


def test_what_needs_a_circuit_says_which_command_gives_it(tmp_path: Path) -> None:
    path = tmp_path / "gel.toml"
    ilg.new_strip(**SIZES).save(path)
    for call in (load_actuator, lambda p: ilg.simulate(p, "step:1V", "1 s")):
        with pytest.raises(InputError, match=r"\[material\] is missing dc_resistivity.*ilg-circuit identify DATA.csv"):
            call(path)
    with pytest.raises(InputError, match="has no circuit yet"):
        ilg.simulate(ilg.new_strip(**SIZES), "step:1V", "1 s")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"thickness": "0.35"}, "thickness: '0.35' has no unit; write it like '0.35 mm'"),
        ({"length": "35"}, "write it like '35 mm'"),
        ({"youngs_modulus": "7.6"}, "write it like '7.6 kPa'"),
        ({"density": "1250"}, r"write it like '1250 kg/m\^3'"),
        ({"densty": "1 g/cm^3"}, "unknown key 'densty'; perhaps density"),
        ({"orientation": "hangin"}, "choose one of weightless, hanging, horizontal; perhaps hanging"),
        ({"free_length": "4 cm"}, "longer than geometry.length"),
    ],
)
def test_slips_are_told(wrong: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ilg.new_strip(**SIZES | wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("width = 0,5", """line 5: 'width = 0,5' is not valid TOML.*width = "0.5 mm"$"""),
        ("width = 5 mm # by ruler", """width = "5 mm"$"""),
        ("width = 5,1 mm", """width = "5.1 mm"$"""),
        ('width = "1,250 mm"', "may be 1.250 or 1250"),
        ("width = 5", """width = 5 has no unit; write it in quotes, like "5 mm"$"""),
        ('widht = "5 mm"', "unknown key 'geometry.widht'; perhaps width"),
        ('width = "5 mm"\n[materail]', "unknown section 'materail'; perhaps material"),
        ('width = "5 mm"\n[coupling]', r"section \[coupling\] needs the circuit"),
        ('width = "5 mm"\n[material]\npermittivity = "1 F/m"', "key 'material.dc_resistivity' is missing"),
    ],
)
def test_slips_in_a_file_are_told(tmp_path: Path, line: str, message: str) -> None:
    rest = '[geometry]\nlength = "35 mm"\nfree_length = "30 mm"\nthickness = "0.5 mm"\n'
    (tmp_path / "gel.toml").write_text(f'{rest}{line}\n[mounting]\norientation = "hanging"\n', encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_strip(tmp_path / "gel.toml")


def test_a_decimal_comma_is_understood_where_it_is_one() -> None:
    assert parse("0,5 mm", "m") == parse("0.5 mm", "m")
    assert parse(",5", "") == 0.5
    assert parse("3,1415 V", "V") == 3.1415
    for text in ("1,250 mm", "12,500 mm", "1,000,000 mm"):
        with pytest.raises(InputError):
            parse(text, "m")


@pytest.mark.parametrize(
    ("number", "unit", "what", "expected"),
    [
        ("0.35", "m", "geometry.thickness", "0.35 mm"),
        ("350", "m", "--thickness", "350 um"),
        ("0.0005", "m", "thickness", "0.0005 m"),
        ("0.035", "m", "length", "0.035 m"),
        ("100", "V", "step", "100 mV"),
        ("300", "s", "--duration", "300 s"),
        ("0.5", "Pa", "youngs_modulus", "0.5 MPa"),
        ("3", "ohm m", "dc_resistivity", "3 ohm m"),
        ("1e99", "m", "length", "1e99 m"),
    ],
)
def test_the_likely_unit(number: str, unit: str, what: str, expected: str) -> None:
    assert likely(number, unit, what) == expected


@pytest.mark.parametrize(
    ("value", "error", "unit", "expected"),
    [
        (332.41, 0.52, "ohm", "332.4(5) ohm"),
        (332.41, 12.0, "ohm", "332(12) ohm"),
        (999.96, 0.3, "ohm", "999.96(30) ohm"),
        (3324.0, 960.0, "ohm", "3.3(10) kohm"),
        (0.6212, 0.0004, "", "0.6212(4)"),
        (-20.1, 0.4, "ohm", "-20.1(4) ohm"),
        (3.0, 2500.0, "ohm", "0(2500) ohm"),
        (0.0, 0.02, "V", "0(20) mV"),
        (2.4448e-9, 3e-12, "m/(V s)", "2.4448(30)e-09 m/(V s)"),
        (5.0, 0.0, "V", "5 V"),
        (5.0, float("inf"), "V", "5 V"),
    ],
)
def test_values_with_errors_in_few_digits(value: float, error: float, unit: str, expected: str) -> None:
    assert concise(value, error, unit) == expected


def test_the_nearest_names() -> None:
    assert nearest("exat", ["ngspice", "exact"]) == ["exact"]
    assert nearest("x" * 500, ["exact"]) == []
    assert "perhaps" not in str(wrong_choice("engine", "qqq", ["ngspice", "exact"]))
