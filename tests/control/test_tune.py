"""Controllers that are tuned: robust over a fit's covariance, near the bound; refusals; the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns

import ilg_circuit as ilg
from ilg_circuit.control import search
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.findings import codes
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.strip.file import save_actuator


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search with fewer laws: enough here."""
    monkeypatch.setattr(search, "FIRST", 32)
    monkeypatch.setattr(search, "ROUND", 12)


def test_static_beam_with_a_camera_settles_at_the_bound_at_every_sample(fitted: Actuator) -> None:
    tuned = ilg.tune(fitted, "3 mm", beam="static", delay="40 ms")
    assert tuned.met
    assert len(tuned.margins.sensitivity) == 201
    assert tuned.margins.sensitivity.max() <= 1.6
    assert tuned.settling <= 1.05 * tuned.wish.bound
    assert tuned.delay >= 0.04
    assert "static-beam-tuned" in codes(tuned.findings)
    worst, five, nominal = (tuned.margins.of(what) for what in ("worst", "5 %", "nominal"))
    assert worst["gain"] <= five["gain"] <= nominal["gain"]
    assert worst["sensitivity"] >= five["sensitivity"] >= nominal["sensitivity"]


def test_dynamic_beam_refuses_the_pi_of_the_static_one_and_does_better(fitted: Actuator) -> None:
    refused = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s")
    assert f"{refused.margins.sensitivity[0]:.2f}" == "3.55"
    assert {"loop-too-sensitive", "overshoot-missed"} <= codes(refused.findings)
    assert not refused.met
    tuned = ilg.tune(fitted, "3 mm", "lqg", beam="dynamic")
    assert tuned.margins.sensitivity.max() <= 1.6
    assert tuned.settling < 35.0
    assert tuned.overshoot <= 0.06


def test_goals_are_met() -> None:
    slow = ilg.tune("paper", "3 mm", "adrc", to="settling=40s", beam="static")
    assert slow.met
    assert slow.settling <= 40.0
    wide = ilg.tune("paper", "3 mm", "pid", to="bandwidth=50mHz", beam="static")
    assert wide.margins.bandwidth[0] >= 0.05


def test_what_cannot_be_is_told_in_a_line() -> None:
    with pytest.raises(SolveError, match=r"settling in 10 s is impossible: .* sooner than 20\.63 s"):
        ilg.tune("paper", "3 mm", to="settling=10s", beam="static")
    with pytest.raises(SolveError, match="is unstable"):
        ilg.tune("paper", "3 mm", gains="gain=2000V/mm,reset_time=10s")
    with pytest.raises(InputError, match="no pi controller"):
        ilg.tune("paper", "3 mm", delay="1000 s", sensitivity=1.001)
    for wrong, said in (
        ({"gains": "gian=2V/mm,reset_time=3s"}, "perhaps gain"),
        ({"gains": "gain=2V/mm"}, "pi needs reset_time too"),
        ({"to": "seting=3s"}, "perhaps settling"),
        ({"kind": "pip"}, "choose one of"),
        ({"draws": 5}, "has no \\[uncertainty\\]"),
        ({"kind": "lqg", "anti_windup": "clamping"}, "is for pi and pid"),
        ({"sensitivity": 0.9}, "more than 1"),
        ({"voltage": "0 V"}, "more than zero"),
    ):
        with pytest.raises(InputError, match=said):
            ilg.tune("paper", "3 mm", **wrong)  # type: ignore[arg-type]


def test_the_command(run: Run, tmp_path: Path, fitted: Actuator) -> None:
    save_actuator(fitted, tmp_path / "fitted.toml")
    asked = ("--step", "3mm", "--gains", "gain=20V/mm,reset_time=10s", "--draws", "20")
    done = run("tune", "fitted.toml", *asked, "--json", "t.json", "--out", "t.csv", "--plot", "t.png")
    assert done.code == 0, done.err
    assert "gain 20 V/mm, reset_time 10 s" in done.out
    found = json.loads((tmp_path / "t.json").read_text())
    assert found["controller"]["gains"] == {"gain": 2e4, "reset_time": 10.0, "weight": 1.0}
    assert found["samples"] == 20
    assert columns(tmp_path / "t.csv")["displacement_m"][-1] == pytest.approx(3e-3, rel=1e-3)
    assert np.abs(columns(tmp_path / "t.csv")["voltage_V"]).max() <= 4.0
    refused = run("tune", "fitted.toml", *asked, "--beam", "dynamic")
    assert refused.code == 1
    assert "too sensitive" in refused.err
    assert refused.err.splitlines()[-1].startswith("ilg-circuit: ")
    assert_one_line(run("tune", "paper", "--step", "9mm"), "out of reach")
