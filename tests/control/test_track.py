"""The voltage for a path: known drives come back, optimality conditions, an independent solver, limits, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from every_model import strip_of

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.control.programme import SMOOTHING, Answers, Limits, answers, nearest_voltage, trapezoid
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER, Actuator

pytest.importorskip("clarabel", reason="an extra of the package")

NODES = np.linspace(0.0, 100.0, 81)
FINE = np.linspace(0.0, 100.0, 161)
#: Faster than the strip.
FAST = 3e-3 * np.sin(2 * np.pi * 0.02 * FINE)


def answer(beam: str) -> Answers:
    return answers(state_space([strip_netlist(PAPER, beam=beam)]), NODES)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_the_path_of_a_known_drive_gives_it_back(beam: str) -> None:
    volts = np.interp(NODES, NODES[::8], np.random.default_rng(1).uniform(-4.0, 4.0, 11))
    made = ilg.simulate(PAPER, (NODES, volts), times=FINE, engine="exact", beam=beam)
    tracked = ilg.track(PAPER, (FINE, made.displacement), beam=beam, nodes=81)
    np.testing.assert_allclose(tracked.voltage[::2], volts, atol=4e-4)
    assert tracked.followed
    step = ilg.simulate(PAPER, "step:4V", times=FINE, engine="exact", beam=beam)
    own = ilg.track(PAPER, (FINE, step.displacement), beam=beam, nodes=81)
    np.testing.assert_allclose(own.voltage, 4.0, atol=4e-4)
    less = ilg.track(PAPER, (FINE, step.displacement), beam=beam, nodes=81, voltage="3.9 V")
    assert not less.followed
    assert less.at_limit > 0.1


def objective(about: Answers) -> tuple[np.ndarray, np.ndarray]:
    """Hessian and linear term of the programme in the voltage alone, in parts of 4 V and 3 mm."""
    scale = np.abs(FAST).max()
    matrix = about.output * 4.0 / scale
    weight = trapezoid(161) / 161
    change = np.diff(np.eye(81), axis=0)
    return 2 * (matrix.T * weight) @ matrix + 2 * SMOOTHING * change.T @ change, -2 * (matrix.T * weight) @ (
        FAST / scale
    )


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_conditions_of_the_optimum_hold(beam: str) -> None:
    about = answer(beam)
    part = nearest_voltage(about, FAST, NODES, Limits(4.0)) / 4.0
    hessian, linear = objective(about)
    gradient = hessian @ part + linear
    size = np.abs(linear).max()
    high, low = part > 1 - 1e-7, part < -1 + 1e-7
    assert (high | low).mean() > 0.3
    assert np.abs(gradient[~(high | low)]).max() <= 1e-6 * size
    assert gradient[high].max() <= 1e-6 * size
    assert gradient[low].min() >= -1e-6 * size


def test_an_independent_solver_finds_the_same_error() -> None:
    osqp = pytest.importorskip("osqp", reason="a peer")
    from scipy import sparse

    about = answer("static")
    most = 0.5 * (NODES[1] - NODES[0]) / 4.0
    found = nearest_voltage(about, FAST, NODES, Limits(4.0, slew=0.5))
    hessian, linear = objective(about)
    change = np.vstack([np.eye(81)[:1], np.diff(np.eye(81), axis=0)])
    rows = sparse.csc_matrix(np.vstack([np.eye(81), change]))
    bound = np.concatenate([np.ones(81), [0.0], np.full(80, most)])
    solver = osqp.OSQP()
    exact = {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 200_000, "polishing": True, "verbose": False}
    solver.setup(sparse.csc_matrix(hessian), linear, rows, -bound, bound, **exact)
    other = solver.solve(raise_error=False).x * 4.0

    def rms(volts: np.ndarray) -> float:
        return float(np.sqrt(np.average((about.output @ volts - FAST) ** 2, weights=trapezoid(161))))

    assert rms(found) == pytest.approx(rms(other), rel=1e-6)
    assert np.abs(np.diff(found)).max() <= 0.5 * (NODES[1] - NODES[0]) * (1 + 1e-8)


def test_every_limit_is_kept_and_said() -> None:
    asked = {"current": "50 mA", "slew": "1 V/s", "energy": "2 J", "nodes": 41}
    tracked = ilg.track(PAPER, "triangle:3mm,60s", "100 s", **asked)  # type: ignore[arg-type]
    assert np.abs(tracked.current[::2]).max() <= 0.05 * (1 + 1e-6)
    assert np.abs(np.diff(tracked.drive.values) / np.diff(tracked.drive.times)).max() <= 1 + 1e-6
    assert tracked.energy == pytest.approx(2.0, rel=1e-3)
    assert tracked.drive.values[0] == pytest.approx(0.0, abs=1e-8)
    assert "path-not-followed" in codes(tracked.findings)


def test_a_path_faster_than_the_strip_is_a_result_with_its_numbers() -> None:
    tracked = ilg.track(PAPER, "sine:5mm,20mHz", "100 s", beam="static", nodes=81)
    assert {"path-not-followed", "path-too-far"} == codes(tracked.findings)
    # the step of 4 V: k Kd V at first, more later, since d(s) overshoots
    step = ilg.simulate(PAPER, "step:4V", times=np.linspace(0, 40, 4001), engine="exact", beam="static").displacement
    assert tracked.rate == pytest.approx(np.diff(step).max() / 0.01, rel=1e-3)
    assert step[1] / 0.01 == pytest.approx(0.1056e-3, rel=1e-3)
    assert f"{1e3 * tracked.reach:.2f}" == "3.98"
    assert tracked.bound is None


def test_a_nonlinear_strip_by_its_own_runs() -> None:
    strip = strip_of("rc+growing", electrode_resistance=5.0)
    at, fine = np.linspace(0.0, 60.0, 13), np.linspace(0.0, 60.0, 25)
    volts = np.interp(at, [0, 20, 40, 60], [0.5, 2.0, -1.0, 1.0])
    made = ilg.simulate(strip, (at, volts), times=fine, beam="static", engine="ngspice")
    tracked = ilg.track(strip, (fine, made.displacement), beam="static", nodes=13)
    np.testing.assert_allclose(tracked.drive.values, volts, atol=2e-3)
    linear = ilg.track(strip_of("rc", electrode_resistance=5.0), (fine, made.displacement), beam="static", nodes=13)
    assert np.abs(linear.drive.values - volts).max() > 0.02  # it does matter


def test_bad_input_is_told_in_a_line() -> None:
    for wrong, said in (
        ({"voltage": "0 V"}, "more than zero"),
        ({"slew": "-1 V/s"}, "more than zero"),
        ({"nodes": 2}, "give 4 to 2001"),
        ({"path": "sine:1mm"}, "not understood"),
        ({"duration": None}, "duration is missing"),
        ({"strip": Actuator(PAPER.geometry, PAPER.material)}, "has no \\[coupling\\]"),
        ({"band": True}, "has no \\[uncertainty\\]"),
    ):
        asked: dict = {"strip": "paper", "path": "sine:1mm,5mHz", "duration": "100 s", "nodes": 21} | wrong
        with pytest.raises(InputError, match=said):
            ilg.track(**asked)


def test_the_command_writes_a_drive_that_simulate_takes(run: Run, tmp_path: Path, fitted: Actuator) -> None:
    fitted.save(tmp_path / "fitted.toml")
    asked = ("--path", "sine:3mm,5mHz", "--duration", "200s", "--nodes", "51", "--band")
    done = run("track", "fitted.toml", *asked, "--out", "drive.csv", "--json", "t.json", "--plot", "t.png")
    assert done.code == 0, done.err
    assert "yes, within 1 %" in done.out
    found = json.loads((tmp_path / "t.json").read_text())
    assert max(found["waveforms"]["displacement_stderr_m"]) > 0
    again = run("simulate", "fitted.toml", "--drive", "file:drive.csv", "--duration", "200s", "--engine", "exact",
                "--step", "2s", "--out", "run.csv")  # fmt: skip
    assert again.code == 0, again.err
    moved = columns(tmp_path / "run.csv")["displacement_m"]
    np.testing.assert_allclose(moved, found["waveforms"]["displacement_m"], atol=1e-9)
    fast = run("track", "paper", "--path", "sine:3mm,20mHz", "--duration", "100s", "--nodes", "51")
    assert fast.code == 0
    assert "cannot follow this path" in fast.err
    assert_one_line(run("track", "paper", "--path", "file:none.csv"), "none.csv")
