"""Learning over trials: its closed form, the contraction for every sample, independent runs, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line
from every_model import strip_of
from scipy.fft import idct

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.control.learn import Learned
from ilg_circuit.control.plant import plants_of, sampled
from ilg_circuit.control.programme import answers, trapezoid
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import Actuator

DRAWS, TRIALS = 12, 6


@pytest.fixture(scope="module")
def learned(fitted: Actuator) -> Learned:
    return learn(fitted)


def learn(strip: Actuator, **changed: Any) -> Learned:
    asked: dict[str, Any] = {"trials": TRIALS, "nodes": 81, "draws": DRAWS, "beam": "static"} | changed
    return ilg.learn(strip, "sine:2mm,5mHz", "200 s", **asked)


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.average(error**2, weights=trapezoid(len(error)))))


@pytest.mark.parametrize("changed", [{}, {"beam": "dynamic", "gain": 0.6, "bandwidth": "60 mHz"}])
def test_every_trial_falls_by_the_contraction_for_every_sample(fitted: Actuator, changed: dict[str, Any]) -> None:
    found = learn(fitted, **changed)
    assert found.promised.all()
    falls = found.distances[:, 1:] / found.distances[:, :-1]
    above = found.distances[:, 1:] > 1e-9 * found.distances.max()
    assert above[1:, 0].all()
    assert (falls <= found.contraction[:, None] * (1 + 1e-6))[above].all()
    assert (found.errors.max(axis=0) <= found.bounds * (1 + 1e-9)).all()
    assert 0 < found.contraction[1:].max() < 0.5


def test_the_errors_are_those_of_the_closed_form(fitted: Actuator, learned: Learned) -> None:
    at = learned.drive.times
    models = [fitted, sampled(fitted, DRAWS, 0)[learned.worst - 1]]
    nominal, true = (answers(state_space([strip_netlist(s, beam="static")]), at).output for s in models)
    kept = idct(np.eye(81), axis=0, norm="ortho")[:, : 1 + round(2 * 200 * learned.bandwidth)]
    root = np.sqrt(trapezoid(161) / 160)[:, None]
    inverse = np.linalg.lstsq(root * nominal @ kept, np.diag(root[:, 0]), rcond=None)[0]
    keeps = np.eye(161) - true @ kept @ inverse  # e_(k+1) of e_k
    error = learned.path - true @ kept @ inverse @ learned.path
    end = learned.path - true @ kept @ np.linalg.solve(inverse @ true @ kept, inverse @ learned.path)
    assert rms(end) == pytest.approx(learned.limits[learned.worst], rel=1e-6)
    for k in range(TRIALS + 1):
        expected = end + np.linalg.matrix_power(keeps, k) @ (error - end)
        assert rms(expected) == pytest.approx(learned.errors[learned.worst, k], rel=1e-6)
    np.testing.assert_allclose(learned.path - learned.displacements[1], expected, atol=1e-12)


def test_a_true_strip_equal_to_the_fitted_one_falls_by_one_less_the_gain(fitted: Actuator) -> None:
    found = learn(fitted, gain=0.7, draws=0, trials=3)
    assert found.contraction[0] == pytest.approx(0.3, rel=1e-9)
    # the first trial is that of the whole inverse, so that there is nothing left to learn
    np.testing.assert_allclose(found.errors[0], found.limits[0], rtol=1e-9)


def test_a_trial_is_a_run_of_the_true_strip(fitted: Actuator, learned: Learned) -> None:
    strips = [fitted, *sampled(fitted, DRAWS, 0)]
    true, path = strips[learned.worst], (learned.time, learned.path)
    how: dict[str, Any] = {"times": learned.time, "beam": "static", "engine": "exact"}
    first = ilg.simulate(true, learned.drive, **how)
    np.testing.assert_allclose(learned.displacements[0], first.displacement, atol=1e-12)
    nodes, last = learned.drive.times, first
    for k in range(TRIALS):
        assert rms(learned.path - last.displacement) == pytest.approx(learned.errors[learned.worst, k], rel=1e-6)
        trial = (last.time, last.voltage, last.displacement)
        drive = ilg.learn(fitted, path, trial=trial, trials=1, nodes=81, draws=0, beam="static").drive
        last = ilg.simulate(true, (nodes, drive.values), **how)
    np.testing.assert_allclose(learned.displacements[1], last.displacement, atol=1e-10)
    np.testing.assert_allclose(learned.voltages[1], drive.values, atol=1e-6)


def test_the_contraction_is_that_of_the_frequencies_that_are_learnt(fitted: Actuator) -> None:
    found = ilg.learn(fitted, "sine:1mm,5mHz", "1600 s", nodes=201, trials=1, draws=4, beam="static")
    plants = plants_of(fitted, beam="static", draws=4)
    w = 2 * np.pi * np.linspace(0.0, found.bandwidth, 400)
    expected = [np.abs(1 - plant.response(w) / plants[0].response(w)).max() for plant in plants[1:]]
    np.testing.assert_allclose(found.contraction[1:], expected, rtol=0.1)


def test_nothing_is_promised_for_a_strip_that_is_hardly_known_or_at_the_limit(fitted: Actuator) -> None:
    known = fitted.uncertainty
    assert known is not None
    rough = replace(fitted, uncertainty=replace(known, covariance=tuple(np.diag(np.full(7, 0.8**2)).tolist())))
    found = learn(rough, gain=1.5, voltage="1 kV")
    assert "learning-not-promised" in codes(found.findings)
    lost = found.contraction >= 1
    assert 0 < lost.sum() < DRAWS
    assert np.isnan(found.limits[lost]).all()
    assert (np.diff(found.errors[lost & ~found.limited], axis=1) > 0).any()
    weak = learn(fitted, voltage="1.5 V")
    assert {"learning-limited", "path-too-far"} == codes(weak.findings)
    assert not weak.promised.any()
    assert np.isnan(weak.bounds).all()


def test_bad_input_is_told_in_a_line(fitted: Actuator) -> None:
    for wrong, said in (
        ({"gain": 2.0}, "give more than 0 and less than 2"),
        ({"trials": 0}, "give 1 to 1000"),
        ({"bandwidth": "1 Hz"}, "carry up to 0.2 Hz"),
        ({"nodes": 3}, "give 4 to 2001"),
        ({"draws": -1}, "give 0 to 10000"),
        ({"strip": strip_of("rc+growing"), "draws": 0}, "is nonlinear"),
        ({"strip": "paper"}, "has no \\[uncertainty\\]"),
        ({"trial": (1, 2)}, "times, voltages and displacements"),
        ({"trial": ([0, 1], [0, 1], [0])}, "times that do not rise"),
    ):
        asked: dict[str, Any] = {"strip": fitted} | wrong
        with pytest.raises(InputError, match=said):
            learn(asked.pop("strip"), **asked)


def test_the_command_learns_from_a_measured_trial(run: Run, tmp_path: Path, fitted: Actuator) -> None:
    fitted.save(tmp_path / "fitted.toml")
    asked = ("learn", "fitted.toml", "--path", "sine:2mm,5mHz", "--duration", "200s", "--nodes", "81", "--draws", "5")
    done = run(*asked, "--out", "drive.csv", "--json", "l.json", "--plot", "l.png")
    assert done.code == 0, done.err
    assert "the error falls towards its end at every trial in 6 of 6 strips" in done.out
    first = json.loads((tmp_path / "l.json").read_text())
    assert first["promised"] == 6
    errors = []
    for _ in range(2):  # the true strip is the paper's, not the one that was fitted to its noisy record
        made = run("simulate", "paper", "--drive", "file:drive.csv", "--duration", "200s", "--engine", "exact",
                   "--step", "0.5s", "--out", "trial.csv")  # fmt: skip
        assert made.code == 0, made.err
        again = run(*asked, "--trial", "trial.csv", "--out", "drive.csv", "--json", "l.json")
        assert again.code == 0, again.err
        errors.append(json.loads((tmp_path / "l.json").read_text())["trial_error_rms"])
    assert errors[1] < 0.3 * errors[0]
    assert_one_line(run(*asked, "--trial", "none.csv"), "none.csv")
