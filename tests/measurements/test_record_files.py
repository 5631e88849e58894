"""Records over time from files: all formats give the same step, notes name what was dropped, bad files are one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from record_texts import FORMATS, I, T, U, Y, csv, ec_lab, gamry

from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read_columns, read_record, read_waveform


def notes(path: Path) -> list[str]:
    return [str(note) for note in read_columns(path, RECORD).notes]


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_step(name: str, tmp_path: Path) -> None:
    path = tmp_path / "step.txt"
    path.write_text(FORMATS[name](), encoding="utf-8", newline="")
    table = read_columns(path, RECORD)
    assert table.time == pytest.approx(T, abs=1e-9)
    assert table.columns["voltage"] == pytest.approx(U, abs=1e-9)
    assert table.columns["current"] == pytest.approx(I, abs=1e-9)
    if "displacement" in table.columns:
        assert table.columns["displacement"] == pytest.approx(Y, abs=1e-12)
    m = read_record(path)
    assert m.step == pytest.approx(1.5)
    assert m.onset == pytest.approx((1.95 + 2.0) / 2)
    assert read_record(path, "first-level").onset == pytest.approx(2.0)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
@pytest.mark.parametrize("text", [csv, ec_lab])
def test_encodings(encoding: str, text: type[str], tmp_path: Path) -> None:
    path = tmp_path / "step.csv"
    path.write_bytes(text().encode(encoding))
    assert len(read_columns(path, RECORD).time) == len(T)


def test_the_voltage_that_is_taken_is_told(tmp_path: Path) -> None:
    path = tmp_path / "step.mpt"
    path.write_text(ec_lab(), encoding="utf-8")
    assert notes(path) == ["voltage is the column Ewe/V, not control/V"]
    path.write_text(ec_lab(voltage="Ewe-Ece/V"), encoding="utf-8")
    assert notes(path) == ["voltage is the column Ewe-Ece/V, not control/V"]
    path.write_text(ec_lab(voltage="Temperature/C"), encoding="utf-8")
    found = read_columns(path, RECORD)
    assert notes(path) == ["voltage is the column control/V"]
    assert found.columns["voltage"] == pytest.approx(U + 0.01, abs=1e-6)


def test_two_readings_at_one_time_leave_the_later(tmp_path: Path) -> None:
    lines = ec_lab(preamble=False).splitlines()
    k = 1 + int(np.argmax(U > 0))
    before = lines[k].split("\t")
    before[9], before[10] = "0.0", "0.0"
    path = tmp_path / "step.mpt"
    path.write_text("\n".join([*lines[:k], "\t".join(before), *lines[k:]]), encoding="utf-8")
    found = read_columns(path, RECORD)
    assert "1 reading at the same time as the next one: left out" in notes(path)
    assert found.columns["voltage"] == pytest.approx(U, abs=1e-9)


def test_overloaded_readings_have_no_current(tmp_path: Path) -> None:
    path = tmp_path / "step.DTA"
    path.write_text(gamry(range(40, 44)), encoding="utf-8")
    found = read_columns(path, RECORD)
    assert np.flatnonzero(np.isnan(found.columns["current"])).tolist() == [40, 41, 42, 43]
    (note,) = read_record(path).notes
    assert (note.code, note.values) == ("overloaded", {"count": 4})


def test_they_are_drives_too(tmp_path: Path, run: Run) -> None:
    Path("step.DTA").write_text(gamry(), encoding="utf-8")
    times, values, _ = read_waveform(Path("step.DTA"), "voltage")
    assert values == pytest.approx(U)
    assert times == pytest.approx(T)
    outcome = run("simulate", "paper", "--drive", "file:step.DTA", "--duration", "12s", "--engine", "exact")
    assert outcome.code == 0, outcome.err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ec_lab().replace("<I>", "Q"), "line 9: no column for current; not understood: 'mode'"),
        (ec_lab(preamble=False).replace("time/s", "cycle"), "no column for time; not understood: "),
        (ec_lab().replace("/mA\t", "/flurb\t"), "unit 'flurb'"),
        (ec_lab().replace("1.500000000E+00", "abc"), "line 50, column 'Ewe/V': 'abc' is not a number"),
        (gamry().replace("\tIm\t", "\tXx\t"), "no column for current"),
        (gamry().replace("CURVE\tTABLE", "CURVE\tTABEL"), "without a ZCURVE table"),
        ("EC-Lab ASCII FILE\nNb header lines : 2\n\n", "no column for time"),
    ],
)
def test_bad_files_are_one_line(text: str, said: str, run: Run) -> None:
    Path("s.txt").write_text(text, encoding="utf-8")
    assert_one_line(run("identify", "s.txt", "--model", "rc"), said, "s.txt: ")
