"""Actuators as TOML files: lossless, and every mistake answered with file, key and remedy."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import wild_actuators

from ilg_circuit.errors import InputError, visible
from ilg_circuit.strip.actuator import PAPER, Actuator, IonBranch
from ilg_circuit.strip.file import dumps, load_actuator, loads, save_actuator

GOOD = """\
name = "gel 7"

[geometry]
length = "35 mm"
free_length = "3 cm"
width = "5 mm"
thickness = "500 um"

[material]
dc_resistivity = "233.333 ohm m"
dynamic_resistivity = "6.80272 ohm*m"
permittivity = "1 F/m"
youngs_modulus = "7.6 kPa"
beam_damping_ratio = 0.25

[[material.further_branches]]
dynamic_resistivity = "60 ohm m"
permittivity = "0.4 F/m"

[coupling]
gain = "2.4448 nm/V/s"
zero = "0.2075 1/s"
damping_ratio = 0.6212
natural_frequency = "0.0742 rad/s"

[mounting]
orientation = "hanging"
"""


@given(wild_actuators())
def test_written_and_read_back_exactly(actuator: Actuator) -> None:
    assert loads(dumps(actuator)) == actuator


@given(st.text(max_size=60))
def test_any_comment_is_harmless(comment: str) -> None:
    assert loads(dumps(PAPER, comment)) == PAPER


@pytest.mark.parametrize(
    "name", ['"', "\\", "a\nb", "\t", "\x7f", "'''", "# no", "[x]", "gel \N{GREEK SMALL LETTER MU}", ""]
)
def test_odd_names(name: str) -> None:
    assert loads(dumps(replace(PAPER, name=name))).name == visible(name)


def test_saved_and_loaded(tmp_path: Path, strips: dict[str, Actuator]) -> None:
    for strip in strips.values():
        save_actuator(strip, tmp_path / "strip.toml", comment="fitted\nto nothing")
        assert load_actuator(tmp_path / "strip.toml") == strip
    text = (tmp_path / "strip.toml").read_text(encoding="utf-8")
    assert text.startswith("# fitted\n# to nothing\nname = ")


def test_a_file_as_a_user_writes_it() -> None:
    strip = loads(GOOD)
    assert strip.name == "gel 7"
    assert strip.geometry.free_length == 0.03
    assert strip.geometry.load_position is None
    assert strip.material.further_branches == (IonBranch(60.0, 0.4),)
    assert strip.material.density == 1250.0  # assumed where nothing is said
    assert strip.coupling is not None
    assert strip.coupling.gain == pytest.approx(2.4448e-9, rel=1e-15)
    assert strip.mounting.orientation == "hanging"


def test_coupling_mounting_and_name_may_be_absent() -> None:
    text = GOOD.partition("[coupling]")[0].replace('name = "gel 7"', "")
    strip = loads(text)
    assert strip.coupling is None
    assert strip.mounting.orientation == "weightless"
    assert strip.name == "strip"


def test_presets() -> None:
    assert load_actuator("paper") is PAPER


CHANGES = {
    "unknown key": ('width = "5 mm"', 'width = "5 mm"\ncolour = "red"', "unknown key 'geometry.colour'"),
    "unknown section": ("[mounting]", "[mountings]", "unknown section 'mountings'"),
    "unknown key of a branch": ('permittivity = "0.4 F/m"', "x = 1", "unknown key 'material.further_branches.x'"),
    "missing key": ('width = "5 mm"\n', "", "key 'geometry.width' is missing"),
    "missing key of a branch": ('permittivity = "0.4 F/m"\n', "", "material.further_branches.permittivity"),
    "missing unit": ('"5 mm"', '"5"', "geometry.width: '5' has no unit"),
    "bare number": ('"5 mm"', "0.005", "geometry.width = 0.005 has no unit"),
    "wrong unit": ('"5 mm"', '"5 V"', "geometry.width: unit 'V' does not measure"),
    "unknown unit": ('"5 mm"', '"5 mmm"', "geometry.width: unknown unit 'mmm'"),
    "hertz for radians": (
        '"0.0742 rad/s"',
        '"0.0742 Hz"',
        "coupling.natural_frequency: unit 'Hz' is ambiguous by 2 pi",
    ),
    "negative": ('"5 mm"', '"-5 mm"', "geometry.width is -0.005; it must be more than zero"),
    "zero": ('"5 mm"', '"0 mm"', "geometry.width is 0; it must be more than zero"),
    "NaN quantity": ('"5 mm"', '"nan mm"', "geometry.width: 'nan mm' is not a number"),
    "NaN number": ("0.25", "nan", "material.beam_damping_ratio is nan"),
    "infinite": ("0.25", "inf", "material.beam_damping_ratio is inf"),
    "negative number": ("0.25", "-0.25", "material.beam_damping_ratio is -0.25; it must be zero or more"),
    "huge integer": ("0.25", "9" * 400, "material.beam_damping_ratio"),
    "huger integer": ("0.25", "9" * 5000, ""),
    "free longer than whole": ('"3 cm"', '"36 mm"', "geometry.free_length 0.036 m is longer than geometry.length"),
    "true": ('"5 mm"', "true", "geometry.width is True"),
    "date": ('"5 mm"', "2020-01-01", "geometry.width is"),
    "list": ('"5 mm"', '["5 mm"]', "geometry.width is"),
    "name is no text": ('"gel 7"', "7", "name is 7"),
    "orientation is no text": ('"hanging"', "7", "mounting.orientation is 7"),
    "orientation unknown": ('"hanging"', '"sideways"', "choose one of weightless, hanging, horizontal"),
    "branches are no sections": ("[[material.further_branches]]", "[material.further_branches]", "must be written as"),
    "section twice": ("[mounting]", "[geometry]", "not valid TOML"),
    "sections as list": ("[mounting]", "[[mounting]]", "'mounting' must be a section"),
    "section missing": ('[material]\ndc_resistivity = "233.333 ohm m"', '[coupling]\ngain = "1 m/V/s"', ""),
    "no TOML": ("[geometry]", "[geometry", "not valid TOML"),
    "nested without end": ("0.25", "[" * 50000, ""),
}


@pytest.mark.parametrize(("old", "new", "hint"), CHANGES.values(), ids=CHANGES)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, hint: str) -> None:
    assert old in GOOD
    path = tmp_path / "strip.toml"
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_actuator(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert hint in str(caught.value)


@pytest.mark.parametrize("section", ["geometry", "material"])
def test_a_missing_section_is_named(section: str) -> None:
    whole = GOOD.partition("[[")[0].split("\n\n")
    text = "\n\n".join(part for part in whole if f"[{section}]" not in part)
    with pytest.raises(InputError, match=rf"section \[{section}\] is missing"):
        loads(text)


def test_a_missing_file_is_told_with_the_presets(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"give a TOML file that exists or a preset \(paper\)"):
        load_actuator(tmp_path / "none.toml")


def test_a_folder_is_no_actuator(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read"):
        load_actuator(tmp_path)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", "name = 'é'".encode("latin-1")])
def test_a_file_that_is_not_utf8(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "strip.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a text file"):
        load_actuator(path)


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("start", ["", "\N{ZERO WIDTH NO-BREAK SPACE}"])
def test_files_of_a_windows_editor_are_read(tmp_path: Path, ends: str, start: str) -> None:
    path = tmp_path / "strip.toml"
    path.write_bytes((start + GOOD.replace("\n", ends)).encode())
    assert load_actuator(path) == loads(GOOD)


@given(st.text(max_size=200))
def test_garbage_is_refused_as_input(text: str) -> None:
    with pytest.raises(InputError):
        loads(text)


@given(st.integers(0, len(GOOD) - 1), st.integers(0, 20), st.text(max_size=8))
def test_a_damaged_file_is_refused_as_input_or_still_an_actuator(start: int, length: int, insert: str) -> None:
    with suppress(InputError):
        loads(GOOD[:start] + insert + GOOD[start + length :])
