"""The command `identify`: what it writes, prints and warns of for every kind of data, and how it refuses."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from kinds import KINDS, write
from spectrum_texts import FORMATS
from synthetic import Synthetic, record, step, two_branches

from ilg_circuit.front.fits import identify
from ilg_circuit.simulation.impedance import frequencies, impedance
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator, save_actuator

pytestmark = pytest.mark.usefixtures("drafts")
EXACT = ("--model", "rc", "--engine", "exact", "--json", "fit.json")


# -- what it writes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_it_writes_what_it_is_asked_for(run: Run, tmp_path: Path, kind: str) -> None:
    files = write(kind, tmp_path)
    save_actuator(replace(PAPER, name="mine"), tmp_path / "mine.toml")
    outputs = {"--out": "fitted.toml", "--json": "fit.json", "--plot": "fit.png", "--report": "fit.html"}
    engine = {"step": "ngspice", "spectrum": "closed form"}.get(kind, "exact")
    given = ("--actuator", "mine.toml", "--electrode-resistance", "1ohm", "--model", "rc")
    given += ("--engine", "exact") if engine == "exact" else ()
    result = run("identify", *files, *given, *(word for pair in outputs.items() for word in pair))
    assert result.code == 0, result.err
    content = json.loads(Path("fit.json").read_text())
    strip = load_actuator("fitted.toml")
    names = [Path(file).name for file in files]
    assert strip.name == "mine"
    assert strip.uncertainty is not None
    assert ", ".join(names) in Path("fitted.toml").read_text()
    assert lumped_elements(strip).port.dc_resistance == pytest.approx(content["parameters"]["dc_resistance"]["value"])
    assert content["parameters"]["electrode_resistance"]["value"] == 1.0
    assert content["engine"] == engine
    assert list(dict.fromkeys(r["source"] for r in content["records"])) == names
    assert "dc_resistance" in result.out
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    assert "To repeat this" in Path("fit.html").read_text(encoding="utf-8")
    said = [line for line in result.err.splitlines() if not line.startswith("fitting: ")]  # a slow machine's progress
    assert said == [f"warning: {line}" for line in content["warnings"]]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*names, "mine.toml", *outputs.values()])


def test_units_of_the_columns(run: Run, step_record: Synthetic, tmp_path: Path) -> None:
    units = {"time": ("ms", 1e3), "current": ("mA", 1e3), "displacement": ("mm", 1e3)}
    texts = []
    for name, how in (("plain", None), ("scaled", units)):
        step_record.write(tmp_path / f"{name}.csv", how)
        texts.append(run("identify", f"{name}.csv", *EXACT).out.replace(name, "data"))
    assert texts[0] == texts[1]


def test_warnings_are_on_stderr(run: Run, tmp_path: Path) -> None:
    record(step(), 300.0, 201, strip=two_branches(), noise=1e-3).write(tmp_path / "data.csv")
    result = run("identify", "data.csv", *EXACT)
    assert result.code == 0
    lines = result.err.splitlines()
    assert lines
    assert all(line.startswith("warning: ") for line in lines)
    assert "exact in the loop" in result.out


@pytest.mark.parametrize("name", ["CSV", "Gamry"])
def test_a_spectrum_of_any_format(name: str, run: Run) -> None:
    Path("strip.txt").write_text(FORMATS[name](), encoding="utf-8")
    how = ("--electrode-resistance", "2ohm", "--model", "rc2", "--out", "f.toml", "--json", "f.json")
    said = run("identify", "strip.txt", *how)
    assert said.code == 0, said.err
    assert "strip.txt: spectrum of 36 points, 10 mHz to 100 kHz; model rc2" in said.out
    assert json.loads(Path("f.json").read_text())["parameters"]["resistance_2"]["value"] == pytest.approx(100, rel=1e-4)
    assert lumped_elements(load_actuator("f.toml")).port.branches[1] == pytest.approx((100.0, 0.02), rel=1e-4)
    assert "held" in Path("f.toml").read_text()


def test_what_impedance_writes_identify_reads(tmp_path: Path) -> None:
    path = tmp_path / "z.csv"
    impedance(replace(PAPER, coupling=None), frequencies(1e-4, 1e3, 50), engine="exact").write_csv(path)
    found = identify(path)
    assert found.model == "rc"
    port = lumped_elements(PAPER).port
    assert found.parameters["capacitance"].value == pytest.approx(port.capacitance, rel=1e-6)
    assert found.parameters["dc_resistance"].value == pytest.approx(port.dc_resistance, rel=1e-6)


# -- what it refuses ---------------------------------------------------------------------------------------------------


GOOD = ["time_s,voltage_V,current_A", *(f"{k},{4 * (k > 3)},{(k > 3) * 0.2 * math.exp(-k / 9)}" for k in range(40))]


def broken(**lines: str) -> str:
    """GOOD with some lines replaced, by their number."""
    text = list(GOOD)
    for number, line in lines.items():
        text[int(number[1:])] = line
    return "\n".join(text)


BAD = {
    "empty": ("", "the file is empty"),
    "blank lines": ("\n \n\n", "the file is empty"),
    "header only": (GOOD[0], "no row of numbers"),
    "one row": ("\n".join(GOOD[:2]), "fewer than two numbers"),
    "two rows": ("\n".join(GOOD[:3]), "zero throughout"),
    "no header": ("\n".join(GOOD[1:]), "no column for"),
    "no units": (broken(L0="time,voltage,current"), "has no unit"),
    "wrong unit": (broken(L0="time_s,voltage_m,current_A"), "does not measure this quantity"),
    "unknown unit": (broken(L0="time_s,voltage_V,current_foo"), "unknown unit 'foo'"),
    "no voltage": (broken(L0="time_s,torque_Nm,current_A"), "no column for voltage; not understood: 'torque_Nm'"),
    "no current": (broken(L0="time_s,voltage_V,Prad_A"), "no column for current; not understood: 'Prad_A'"),
    "two currents": (broken(L0="time_s,current_mA,current_A"), "both give the current"),
    "text": (broken(L10="9,4,high"), "line 11, column 'current_A': 'high' is not a number"),
    "pixels": (broken(L0="time_s,voltage_V,current_px"), "column 'current_px': unit 'px' needs a scale"),
    "repeated time": (broken(L10="8,4,0.1"), "line 11: time 8 s repeats 8 s"),
    "time goes back": (broken(L10="2,4,0.1"), "goes back from"),
    "no time": (broken(L10=",4,0.1"), "line 11 has no time"),
    "too many cells": (broken(L10="9,4,0.1,7"), "has 4 cells, the header 3"),
    "decimal commas": (broken(L10='9,4,"0,1"'), "'0,1' is not a number"),
    "row of units among numbers": (broken(L2="s,V,A"), "line 3, column 'time_s': 's' is not a number"),
    "binary": ("time_s,voltage_V,current_A\n\0\0\0,1,2", "not a text file"),
    "all current blank": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},NaN" for k in range(40))]), "has no number"),
    "zero volts": ("\n".join([GOOD[0], *(f"{k},0,{k}" for k in range(40))]), "zero throughout"),
    "constant": ("\n".join([GOOD[0], *(f"{k},4,0.01" for k in range(40))]), "no step in the record"),
    "resistor": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},{0.01 * (k > 3)}" for k in range(40))]), "no step"),
    "no current at all": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},0" for k in range(40))]), "no step"),
    "wires swapped": (
        "\n".join([GOOD[0], *(f"{k},{-4 * (k > 3)},{(k > 3) * math.exp(-k / 9)}" for k in range(40))]),
        "the sign of the current (column 'current_A') is reversed",
    ),
    "current rises": (
        "\n".join(
            [GOOD[0], *(f"{k},{4 * (k > 3)},{(k > 3) * 0.01 * (1 - 0.9 * math.exp(-k / 9))}" for k in range(40))]
        ),
        "data.csv: the current does not follow the voltage as a resistive and capacitive strip's does, from 3.5 s on",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_end_in_one_line_and_nothing_is_written(run: Run, tmp_path: Path, name: str) -> None:
    text, reason = BAD[name]
    Path("data.csv").write_text(text)
    assert_one_line(run("identify", "data.csv", "--out", "a.toml", "--json", "a.json", "--plot", "a.png"), reason)
    assert [p.name for p in tmp_path.iterdir()] == ["data.csv"]


@pytest.mark.parametrize("several", [False, True], ids=["one file", "several"])
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--electrode-resistance", "2"], "has no unit"),
        (["--electrode-resistance", "500ohm"], "is too large"),
        (["--electrode-resistance", "-1ohm"], "must be zero or more"),
        (["--electrode-resistance", "fit", "--model", "rc"], "for every Re below"),
        (["--electrode-resistance", "fit"], "not with auto"),
        (["--model", "rc9"], "model is 'rc9'; choose one of"),
        (["--engine", "gnucap"], "'gnucap' is not one of"),
        (["--intervals", "guess"], "--intervals"),
        (["--actuator", "nowhere.toml"], "no actuator 'nowhere.toml'"),
        (["--own", "stiffness", "--model", "rc"], "model rc has no stiffness"),
        (["--bias", "1V"], "it is for the spectra among the files, and there is none"),
        (["--bias", "q.csv=1V"], "'q.csv' is not one of them"),
        (["--out", "nowhere/x.toml"], "does not exist"),
        (["--json", "."], "is a folder"),
        (["--plot", "x.txt"], "end its name in"),
        (["--out", "0.csv"], "name the same file"),
        (["--out", "x", "--json", "x"], "name the same file"),
    ],
)
def test_bad_options_end_in_one_line(run: Run, tmp_path: Path, options: list[str], reason: str, several: bool) -> None:
    files = [f"{k}.csv" for k in range(1 + several)]
    for k, name in enumerate(files):
        Path(name).write_text(broken(L30=f"29,4,{0.008 + 1e-5 * k}"))
    assert_one_line(run("identify", *files, "--engine", "exact", *options), reason)
    assert sorted(p.name for p in tmp_path.iterdir()) == files


def test_a_spectrum_takes_a_bias(run: Run, tmp_path: Path) -> None:
    (file,) = write("spectrum", tmp_path)
    for bias in ("0.5V", "z.csv=0.5V"):
        done = run("identify", file, "--model", "rc", "--bias", bias, "--json", "fit.json")
        assert done.code == 0, done.err
        assert json.loads(Path("fit.json").read_text())["records"][0]["voltage"] == 0.5


def test_a_bad_spectrum_is_refused_in_one_line(run: Run) -> None:
    Path("bad.csv").write_text("frequency_Hz,re_ohm,im_ohm\n1,2,-3\n")
    said = run("identify", "bad.csv")
    assert (said.code, said.out) == (2, "")
    assert said.err == "ilg-circuit: bad.csv: 1 point left, 6 are needed\n"


def test_a_record_without_any_transient_is_refused_by_name(run: Run, tmp_path: Path) -> None:
    good = record(step(3.0), 120.0, 241, rest=20, noise=2e-3)
    good.write(tmp_path / "good.csv")
    good.changed(current=np.zeros(261)).write(tmp_path / "dead.csv")
    done = run("identify", "good.csv", "dead.csv", "--model", "rc")
    assert_one_line(done, "dead.csv", "the current is zero throughout")


@pytest.mark.parametrize("name", ["nowhere.csv", "."])
def test_no_file(run: Run, tmp_path: Path, name: str) -> None:
    assert_one_line(run("identify", str(tmp_path / name)), "cannot read")


@pytest.mark.parametrize(
    "style",
    ["semicolons", "decimal commas", "tabs", "windows", "byte order mark", "comments", "quotes", "brackets"],
)
def test_every_style_of_csv_gives_the_same(run: Run, tmp_path: Path, style: str) -> None:
    text = record(step(), 300.0, 61, rest=3, noise=1e-3).write(tmp_path / "plain.csv").read_text()
    styles = {
        "semicolons": text.replace(",", ";"),
        "decimal commas": text.replace(",", ";").replace(".", ","),
        "tabs": text.replace(",", "\t"),
        "windows": text.replace("\n", "\r\n"),
        "byte order mark": "\ufeff" + text,
        "comments": "# potentiostat 7\n# 2026-11-22\n" + text,
        "quotes": "\n".join('"' + line.replace(",", '","') + '"' for line in text.splitlines()),
        "brackets": text.replace("time_s,voltage_V,current_A", "Time [s],U/V,Current (A)"),
    }
    (tmp_path / "styled.csv").write_bytes(styles[style].encode())
    outcomes = [run("identify", f"{name}.csv", *EXACT) for name in ("plain", "styled")]
    assert [o.code for o in outcomes] == [0, 0]
    assert outcomes[0].out.replace("plain", "styled") == outcomes[1].out
