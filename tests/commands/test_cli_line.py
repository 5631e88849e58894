"""Commands on a strip with segments: drives of each, files, one-line refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import Run, assert_one_line

from ilg_circuit.strip.actuator import PAPER

SHEETS = {"sheet_resistance_1": 0.25, "sheet_resistance_2": 5.0, "segments_1": 4, "segments_2": 4, "cells": 4}
RUN = ("--duration", "10s", "--samples", "5", "--engine", "exact")


@pytest.fixture
def four(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    PAPER.with_(electrodes=SHEETS).save("four.toml")
    return "four.toml"


def test_simulate_segments(four: str, run: Run) -> None:
    drives = ("--drive", "1=step:4V", "--drive", "-2=sine:1V,0.1Hz", "--drive", "3=open")
    done = run("simulate", four, *drives, *RUN, "--out", "run.csv", "--json", "run.json")
    assert done.code == 0, done.err
    assert "4 cells of the free length" in done.out
    head = Path("run.csv").read_text().splitlines()[0].split(",")
    assert head[6:10] == ["voltage_1_V", "current_1_A", "voltage_2_V", "current_2_A"]
    told = json.loads(Path("run.json").read_text())
    assert told["drive"] == "1 = step 4 V; -2 = sine 1 V, 100 mHz"
    assert len(told["curvatures"]["lengths_m"]) == 4


def test_other_commands_on_segments(four: str, run: Run) -> None:
    assert "line_number_low" in run("show", four).out
    done = run("impedance", four, "--segment", "2", "--points", "2", "--engine", "exact", "--json", "-")
    assert json.loads(done.out)["segment"] == 2
    assert run("netlist", four, "--drive", "2=step:1V", "--drive", "1=step:2V", "--out", "four.cir").code == 0
    assert "Vdrive_1 drive_1 0 PWL(0.0 2.0" in Path("four.cir").read_text()
    assert run("netlist", four, "--out", "four.lib").code == 0
    assert ".subckt ilg_strip_4 p1 m1 p2 m2 p3 m3 p4 m4" in Path("four.lib").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("simulate", "four.toml", "--drive", "5=step:4V", *RUN), "segment '5' is not there"),
        (("simulate", "four.toml", "--drive", "1=step:4V", "--drive", "step:4V", *RUN), "say of which segment"),
        (("simulate", "four.toml", "--drive", "1=open", *RUN), "no segment is driven"),
        (("simulate", "paper", "--drive", "1=step:4V", *RUN), "has no [electrodes]"),
        (("impedance", "paper", "--segment", "1"), "no segments"),
        (("netlist", "four.toml", "--drive", "1=step:4V", "--kit", "kit"), "one drive for the whole strip"),
        (("netlist", "four.toml", "--kit", "kit"), "a kit is for a strip that is one lump"),
        (("sense", "four.toml", "--motion", "sine:1mm,1Hz", "--duration", "1s"), "one lump"),
        (("netlist", "four.toml", "--beam", "dynamic", "--out", "four.lib"), "without the beam's mass"),
    ],
)
def test_refusals(four: str, run: Run, words: tuple[str, ...], told: str) -> None:
    assert_one_line(run(*words), told)


def test_segments_longer_than_the_strip(four: str, run: Run) -> None:
    text = Path(four).read_text().replace("segments_1 = 4", 'lengths_1 = ["20 mm", "11 mm"]')
    Path(four).write_text(text)
    assert_one_line(run("show", four), "segments must not be longer than the strip")
