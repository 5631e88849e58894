"""Displacements in files of their own: tracks of cameras' programs, their axis, scale and frames, beside a record."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from format_texts import TEXTS
from track_texts import ANGLE, PIXEL, TRACKS, X_PX, Y_PX, T, Y, deeplabcut, table

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.said import pixel
from ilg_circuit.measurements.track import beginning


def read(tmp_path: Path, text: str, **how: Any) -> Record:
    (tmp_path / "current.csv").write_text(TEXTS["record"]["CSV"]())
    (tmp_path / "tip.csv").write_text(text)
    current = np.loadtxt(tmp_path / "current.csv", delimiter=",", skiprows=1)
    columns = {"time_ms": current[:, 0], "voltage_mV": current[:, 1], "current_uA": current[:, 2]}
    found = ilg.read(columns, displacement=tmp_path / "tip.csv", **how)
    assert isinstance(found, Record)
    return found


@pytest.mark.parametrize("name", TRACKS)
def test_every_track_is_one_displacement(name: str, tmp_path: Path) -> None:
    text, how = TRACKS[name]
    found = read(tmp_path, text(), **how)
    moved = found.displacement
    assert found.own_clock
    assert moved is not None
    np.testing.assert_allclose(moved.time + moved.zero, T, atol=1e-9)
    np.testing.assert_allclose(moved.values, Y, atol=2e-9)
    assert 1.9 < moved.zero < 2.1
    assert ("track-axis" in codes(found.notes)) == ("axis" not in how and "displacement" not in text().split("\n")[0])


def test_the_direction_is_said_and_another_is_taken(tmp_path: Path) -> None:
    text = "time_s,x_px,y_px\n" + table(T, 600 - X_PX, Y_PX)
    found = read(tmp_path, text, scale=PIXEL)
    (said,) = (f for f in found.notes if f.code == "track-axis")
    assert said.values["angle"] == pytest.approx(160, abs=0.1)
    assert found.displacement is not None
    assert found.displacement.values[-1] == pytest.approx(Y[-1], rel=1e-6)
    for axis, size in (("x", -np.cos(ANGLE)), ("-x", np.cos(ANGLE)), ("y", np.sin(ANGLE)), ("90", np.sin(ANGLE))):
        turned = read(tmp_path, text, scale=PIXEL, axis=axis).displacement
        assert turned is not None
        assert turned.values[-1] == pytest.approx(size * Y[-1], rel=1e-6)


def test_an_unlikely_position_is_a_drop_out(tmp_path: Path) -> None:
    found = read(tmp_path, deeplabcut(unsure=(7, 120)), part="tip", fps=25, scale=PIXEL)
    (said,) = (f for f in found.notes if f.code == "track-uncertain")
    assert said.values["count"] == 2
    assert found.displacement is not None
    assert len(found.displacement.time) == len(T) - 2
    assert found.displacement.values.max() == pytest.approx(Y.max(), rel=1e-6)


PLAIN = "time_s,x_px,y_px\n" + table(T, X_PX, Y_PX)
REFUSED: dict[str, tuple[str, Mapping[str, Any], str]] = {
    "pixels without a scale": (PLAIN, {}, "column 'x_px' is in pixels; say the size of one: scale='0.042mm/px'"),
    "a scale without pixels": (
        "time_s,displacement_mm\n" + table(T, Y),
        {"scale": PIXEL},
        r"no column is in pixels \('time_s' is in s, 'displacement_mm' is in mm\); leave it out",
    ),
    "a scale that is none": (PLAIN, {"scale": "0.042mm"}, "write the size of a pixel, such as 0.042mm/px"),
    "a scale of nothing": (PLAIN, {"scale": "0mm/px"}, "scale 0 must be more than zero"),
    "frames without a rate": (deeplabcut(), {"part": "tip", "scale": PIXEL}, "give the camera's rate: fps=25"),
    "a rate beside times": (PLAIN, {"scale": PIXEL, "fps": 25}, "the file has times; leave out fps"),
    "several points": (deeplabcut(), {"scale": PIXEL}, "tracks 2 points: base, tip; choose one with part='tip'"),
    "no such point": (deeplabcut(), {"part": "top"}, "no point 'top'; it tracks base, tip"),
    "a point of a plain file": (PLAIN, {"part": "tip", "scale": PIXEL}, "part='tip': no points have names in it"),
    "no such axis": (PLAIN, {"scale": PIXEL, "axis": "z"}, "write x, y, -x, -y or an angle"),
    "an axis of a displacement": (
        "time_s,displacement_mm\n" + table(T, Y),
        {"axis": "x"},
        "the file has a displacement",
    ),
    "an axis that is not there": ("time_s,x_mm\n" + table(T, Y), {"axis": "y"}, "the file has no column y"),
    "lengths without a unit": (
        "t_s,x,y\n" + table(T, X_PX, Y_PX),
        {},
        "if so: units={'displacement': 'mm'}$",
    ),
    "times without a unit": ("t,x_mm,y_mm\n" + table(T, X_PX, Y_PX), {}, "if so: units={'displacement.time': 's'}$"),
    "no column": ("time_s,temperature_K\n" + table(T, Y), {}, "no column for displacement"),
    "too short": ("time_s,displacement_mm\n" + table(T[:9], Y[:9]), {}, "9 readings of the displacement; 20 are"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    text, how, said = REFUSED[name]
    with pytest.raises(InputError, match=said) as caught:
        read(tmp_path, text, **how)
    assert "\n" not in str(caught.value)


def test_what_is_said_of_the_times_of_the_track_is_not_said_of_the_record(tmp_path: Path) -> None:
    text = "t,x,y\n" + table(1e3 * T, 1e3 * PIXEL * X_PX, 1e3 * PIXEL * Y_PX)
    found = read(tmp_path, text, units={"displacement.time": "ms", "displacement": "mm"})
    assert found.displacement is not None
    np.testing.assert_allclose(found.displacement.time + found.displacement.zero, T, atol=1e-9)
    assert found.onset == pytest.approx(1.975)


def test_a_displacement_is_arrays_a_frame_or_one_of_the_arrays() -> None:
    t = np.arange(-5.0, 60.0, 0.25)
    arrays = {"time": t, "voltage": 4.0 * (t >= 0), "current": (t >= 0) * (4 / 600 + 0.2 * np.exp(-t / 7))}
    own = ilg.read(**arrays, displacement=(T, Y))
    assert own.own_clock
    np.testing.assert_allclose(own.displacement.values, Y)
    mapped = ilg.read(**arrays, displacement={"time_s": T, "displacement_mm": 1e3 * Y})
    np.testing.assert_allclose(mapped.displacement.time, own.displacement.time)
    same = ilg.read(**arrays, displacement=np.interp(t, T, Y))
    assert not same.own_clock
    with pytest.raises(InputError, match="already has a displacement"):
        ilg.read(same, displacement=(T, Y))
    with pytest.raises(InputError, match="1 records and 2 displacements were given; give one displacement for each"):
        ilg.read(own, displacement=[(T, Y), (T, Y)])


@pytest.mark.parametrize(("text", "size"), [("0.042mm/px", 42e-6), ("42 um/pixel", 42e-6), ("25px/mm", 4e-5)])
def test_the_size_of_a_pixel(text: str, size: float) -> None:
    assert pixel(text) == pytest.approx(size, rel=1e-12)


def test_where_a_tip_begins_to_move_is_found_between_its_noise() -> None:
    noisy = Y + 2e-5 * np.random.default_rng(3).standard_normal(len(Y))
    zero, rests = beginning(T, noisy)
    assert rests
    assert zero == pytest.approx(2.0, abs=0.15)
    zero, rests = beginning(T[60:], noisy[60:])
    assert (zero, rests) == (T[60], False)
