"""Named waveforms: their values by hand, and the same answer of both engines under each of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER


@pytest.mark.parametrize(
    ("text", "times", "values"),
    [
        ("triangle:4V,20s", [0, 5, 10, 15, 20, 25], [0, 2, 4, 2, 0, 2]),
        ("triangle:-2V..2V,20s", [0, 5, 10, 15, 20, 25], [0, 2, 0, -2, 0, 2]),
        ("triangle:1V..3V,20s", [0, 5, 10, 15, 20], [1, 2, 3, 2, 1]),
        ("triangle:-3V..-1V,20s", [0, 10, 20], [-1, -3, -1]),
        ("cv:-1V..1V,200mV/s", [0, 5, 10, 15, 20, 25], [0, 1, 0, -1, 0, 1]),
        ("cv:-1V..1V,200mV/s,1", [0, 5, 10, 15, 20, 25], [0, 1, 0, -1, 0, 0]),
        ("pulse:4V,1s,10s", [0, 0.5, 1, 9.9, 10, 10.5, 11.5], [4, 4, 0, 0, 4, 4, 0]),
        ("pulse:-1V,2s,10s,2", [1, 5, 11, 15, 21], [-1, 0, -1, 0, 0]),
    ],
)
def test_values_by_hand(text: str, times: list[float], values: list[float]) -> None:
    assert_allclose(parse_drive(text, 30.0).value(times), values, atol=1e-12)


def test_a_chirp_goes_through_its_frequencies() -> None:
    drive, t = parse_drive("chirp:2V,0.05Hz..2Hz", 40.0), np.linspace(0, 40, 20001)
    rate = np.log(40) / 40
    assert_allclose(drive.value(t), 2 * np.sin(2 * np.pi * 0.05 / rate * np.expm1(rate * t)), atol=2 * 8e-5)


def test_a_multisine_has_its_tones_and_its_peak() -> None:
    drive, t = parse_drive("multisine:3V,0.1Hz..2Hz,6", 10.0), np.linspace(0, 10, 20481)[:-1]
    values = drive.value(t)
    assert np.abs(values).max() == pytest.approx(3.0, rel=1e-3)
    power = np.abs(np.fft.rfft(values)) / len(t) * 2
    tones = np.flatnonzero(power > 0.02)
    assert tones.tolist() == [1, 2, 3, 6, 11, 20]
    assert_allclose(power[tones], power[1], rtol=1e-3)
    # the crest factor of one sine is 1.41, that of six in phase 3.46
    assert np.abs(values).max() / values.std() < 2.2


def test_a_file_is_repeated(tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.csv").write_text("time_s,voltage_V\n0,1\n2,1\n2,3\n4,0\n")
    drive = parse_drive("repeat:3,drive.csv", 14.0)
    assert drive.value([1, 3, 5, 7, 9, 11, 13]).tolist() == [1.0, 1.5, 1.0, 1.5, 1.0, 1.5, 0.0]
    assert drive.jumps(14.0).tolist() == [2.0, 4.0, 6.0, 8.0, 10.0]


@pytest.mark.parametrize(
    "text",
    [
        "triangle:-1V..2V,7s",
        "cv:-1V..1V,500mV/s,2",
        "pulse:2V,1s,4s",
        "chirp:1V,0.05Hz..0.5Hz",
        "multisine:1V,0.1Hz..0.5Hz,4",
        "step:1V",
        "square:-1V..2V,4s,0.3",
        "sine:1V,0.2Hz",
        "ramp:0.2V/s",
        "file:drive.csv",
        "repeat:2,drive.csv",
    ],
)
def test_both_engines_agree(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drive.csv").write_text("time_s,voltage_V\n0,1\n2,1\n2,3\n4,0.5\n")
    t = np.linspace(0, 10, 41)
    ngspice, exact = (simulate(PAPER, parse_drive(text, 10.0), t, engine=engine) for engine in ("ngspice", "exact"))
    for name in ("current", "displacement"):
        a, b = getattr(ngspice, name), getattr(exact, name)
        assert np.abs(a - b).max() < 1e-6 * np.abs(b).max()


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("triangle:2V..1V,3s", "give the lower level first"),
        ("triangle:1V,0s", "must be more than zero"),
        ("cv:-1V..1V,0V/s", "must be more than zero"),
        ("cv:-1V..1V,1V/s,1.5", "not a whole number"),
        ("pulse:1V,3s,2s", "the width must lie between 0 and the period"),
        ("chirp:1V,1Hz..0.1Hz", "the lower first"),
        ("chirp:1V,1Hz..1MHz", "takes more than 1000000 lines"),
        ("multisine:1V,0.1Hz..1Hz,1", "give 2 to 1000"),
        ("triangle:1V,1us", "too many"),
        ("repeat:0,drive.csv", ""),
    ],
)
def test_what_cannot_be(text: str, hint: str) -> None:
    with pytest.raises(InputError) as raised:
        parse_drive(text, 60.0)
    assert hint in str(raised.value)
