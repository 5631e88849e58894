"""A strip that dries: its charge against an ODE, estimates against the truth, an adaptive loop against a fixed one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line
from every_model import strip_of
from scipy.integrate import solve_ivp

import ilg_circuit as ilg
from ilg_circuit.control.drift import changed
from ilg_circuit.control.tune import Tuned
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

#: A strip that bends with its charge, 130 nm/V, and what it becomes as it dries.
STRIP = PAPER.with_(kind="charge", instantaneous="130 nm/V")
DRYING = {"capacitance": -0.5, "dynamic_resistance": 2.0}
HOW: dict[str, Any] = {"beam": "static", "engine": "exact"}


@pytest.fixture(scope="module")
def tuned() -> Tuned:
    return ilg.tune(STRIP, "2 mm", gains="gain=4V/mm,reset_time=8s", beam="static")


class Sine:
    """A voltage over time, whatever the displacement."""

    def __init__(self, period: float) -> None:
        self.period, self.calls = period, 0

    def step(self, reference: float, measured: float) -> float:
        self.calls += 1
        return float(2 * np.sin(0.2 * (self.calls - 1) * self.period))


def test_a_drifting_strip_keeps_its_charge() -> None:
    port = lumped_elements(STRIP).port
    ((r, c),) = port.branches
    off = []
    for period in (0.5, 0.25):
        found = ilg.close_loop(STRIP, Sine(period), "step:1mm", "30 s", period=period, drift=DRYING, samples=31, **HOW)

        def rate(t: float, q: Any, period: float = period) -> Any:
            u = 2 * np.sin(0.2 * np.floor(t / period + 1e-9) * period)
            return (u - q / (c * (1 - 0.5 * t / 30))) / (r * (1 + 2 * t / 30))

        charge, q = [0.0], np.zeros(1)
        for start in np.arange(0, 30, period):
            q = solve_ivp(rate, (start, start + period * (1 - 1e-12)), q, rtol=1e-9, atol=1e-12).y[:, -1]
            charge.append(float(q[0]))
        expected = lumped_elements(STRIP).bending_ratio * 130e-9 * np.array(charge)[:: round(1 / period)] / c
        off.append(np.abs(found.displacement - expected).max() / np.abs(expected).max())
    assert off[0] < 2e-4
    assert off[1] < off[0] / 3  # steps of the second order


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_estimates_find_a_strip_that_is_not_the_fitted_one(beam: str) -> None:
    gains = "gain=4V/mm,reset_time=8s" if beam == "static" else "gain=0.5V/mm,reset_time=4s"
    tuned = ilg.tune(STRIP, "2 mm", gains=gains, beam=beam)
    controller = ilg.adaptive(STRIP, tuned, "0.5 s", beam=beam, noise="1 um")
    truth = {"capacitance": 0.6, "dynamic_resistance": 2.5}
    how = HOW | {"period": "0.5 s", "beam": beam}
    run = ilg.close_loop(changed(STRIP, truth), controller, "sine:1mm,10mHz", "200 s", **how)
    for name, value in truth.items():
        assert run.waves.estimates[name][-1] == pytest.approx(value, rel=1e-3)
    if beam == "dynamic":
        return
    noisy = ilg.close_loop(changed(STRIP, truth), controller, "sine:1mm,10mHz", "400 s", noise="10 um", **how)
    for name, value in truth.items():
        assert noisy.waves.estimates[name][-200:].mean() == pytest.approx(value, rel=0.02)


def test_an_adaptive_loop_follows_a_drying_strip_and_a_fixed_one_falls_behind(tuned: Tuned) -> None:
    asked: dict[str, Any] = HOW | {"period": "0.5 s", "noise": "5 um", "drift": DRYING, "samples": 2001}
    fixed = ilg.close_loop(STRIP, tuned, "sine:1.5mm,10mHz", "1000 s", **asked)
    adaptive = ilg.close_loop(STRIP, tuned, "sine:1.5mm,10mHz", "1000 s", adapt=True, **asked)
    rms = [
        [float(np.std((run.reference - run.displacement)[part])) for part in (slice(0, 400), slice(1600, 2001))]
        for run in (fixed, adaptive)
    ]
    assert rms[0][1] > 1.7 * rms[0][0]
    assert rms[1][1] < 1.1 * rms[1][0]
    assert rms[1][1] < 0.6 * rms[0][1]
    # an estimate is as late as the memory, 50 s, in which the values go by a twentieth of their way
    true = {name: 1 + change * adaptive.waves.sampled / 1000 for name, change in DRYING.items()}
    for name, change in DRYING.items():
        late = adaptive.waves.estimates[name][400:] - true[name][400:]
        assert np.abs(late + 0.05 * change).max() < 0.04 * abs(change)
    assert "adaptive pi" in adaptive.summary()
    assert "estimates" in adaptive.to_dict()


def test_gains_follow_the_strip(tuned: Tuned) -> None:
    controller = ilg.adaptive(STRIP, tuned, "0.5 s", beam="static", noise="1 um")
    strip = changed(STRIP, {"capacitance": 0.5, "dynamic_resistance": 2.0})  # half the gain, as fast
    y, states = 0.0, 0.0
    ((r, c),) = lumped_elements(strip).port.branches
    for k in range(400):
        u = controller.step(1e-3 * np.sin(0.06 * k * 0.5), y)
        states = u + (states - u) * np.exp(-0.5 / (r * c))
        y = lumped_elements(strip).bending_ratio * 65e-9 * states
    assert controller.gains["gain"] == pytest.approx(2 * 4e3, rel=1e-2)
    assert controller.gains["reset_time"] == pytest.approx(8.0, rel=1e-2)


def test_a_gain_that_drifts_is_found_where_the_motion_follows_the_voltage() -> None:
    tuned = ilg.tune("paper", "3 mm", gains="gain=5V/mm,reset_time=15s", beam="static")
    asked: dict[str, Any] = HOW | {"period": "0.5 s", "adapt": True}
    run = ilg.close_loop("paper", tuned, "sine:1mm,10mHz", "400 s", drift="gain=-40%", **asked)
    assert run.waves.estimates["gain"][-1] == pytest.approx(0.65, abs=0.02)
    dull = ilg.close_loop("paper", tuned, "sine:1mm,10mHz", "20 s", drift="capacitance=-40%", **asked)
    assert codes(dull.findings) == {"drift-unseen"}


def test_bad_input_is_told_in_a_line(tuned: Tuned) -> None:
    for wrong, said in (
        ({"drift": "capacity=-40%"}, "capacitance"),
        ({"drift": "capacitance=-100%"}, "becomes 0 of itself"),
        ({"drift": DRYING, "engine": "ngspice"}, "engine='exact'"),
        ({"drift": DRYING, "strip": strip_of("rc2")}, "of model rc"),
        ({"drift": DRYING, "form": "behavioural"}, "form='sampled'"),
        ({"adapt": True, "controller": Sine(0.5)}, "adapts by itself"),
    ):
        asked: dict[str, Any] = {"strip": STRIP, "controller": tuned, "period": "0.5 s", "engine": "exact"} | wrong
        with pytest.raises(InputError, match=said):
            ilg.close_loop(reference="step:1mm", duration="10 s", **asked)
    lqg = ilg.tune("paper", "3 mm", "lqg", gains={"speed": 1.0, "observer": 0.5, "integral": 0.04}, beam="static")
    with pytest.raises(InputError, match="is a PI, not lqg"):
        ilg.adaptive(STRIP, lqg, "0.5 s")
    with pytest.raises(InputError, match="memory is 0 s"):
        ilg.adaptive(STRIP, tuned, "0.5 s", memory=0)


def test_the_command_adapts_and_takes_a_file_that_does(run: Run, tmp_path: Path, tuned: Tuned) -> None:
    STRIP.save(tmp_path / "strip.toml")
    tuned.save(tmp_path / "tuned.json")
    (tmp_path / "own.py").write_text(
        'import ilg_circuit as ilg\ncontroller = ilg.adaptive("strip.toml", "tuned.json", "0.5 s", beam="static")\n'
    )
    asked = ("close", "strip.toml", "--reference", "sine:1mm,10mHz", "--duration", "100s", "--period", "0.5s",
             "--beam", "static", "--drift", "capacitance=-30%,dynamic_resistance=+50%", "--json", "c.json")  # fmt: skip
    found = []
    for how in (("--controller", "tuned.json", "--adapt", "--plot", "c.png"), ("--controller", "own.py")):
        done = run(*asked, *how)
        assert done.code == 0, done.err
        found.append(json.loads((tmp_path / "c.json").read_text())["estimates"]["capacitance"])
    assert found[0] == pytest.approx(found[1])
    assert_one_line(run(*asked, "--controller", "tuned.json", "--engine", "ngspice"), "--engine exact")
