"""The voltage for a path: known drives come back, optimality conditions, an independent solver, limits, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from every_model import strip_of, strongly_coupled

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.control.programme import SMOOTHING, Answers, Limits, answers, nearest_voltage, trapezoid
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings.relaxing import ChargeCoupling
from ilg_circuit.strip.electrodes import Electrodes

pytest.importorskip("clarabel", reason="an extra of the package")

NODES = np.linspace(0.0, 100.0, 81)
FINE = np.linspace(0.0, 100.0, 161)
#: Faster than the strip.
FAST = 3e-3 * np.sin(2 * np.pi * 0.02 * FINE)


def answer(beam: str) -> Answers:
    return answers(state_space([strip_netlist(PAPER, beam=beam)]), NODES)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
@pytest.mark.parametrize("strip", ["paper", "strongly coupled", "line of cells"])
def test_the_force_of_a_known_drive_gives_it_back(strip: str, beam: str) -> None:
    sheets = Electrodes(sheet_resistance_1=20.0, sheet_resistance_2=20.0, segments_1=2.0, cells=4.0)
    strips = {"paper": PAPER, "strongly coupled": strongly_coupled(PAPER)}
    chosen = strips.get(strip, replace(PAPER, electrodes=sheets))
    volts = np.interp(NODES, NODES[::8], np.random.default_rng(2).uniform(-4.0, 4.0, 11))
    made = ilg.simulate(chosen, (NODES, volts), times=FINE, engine="exact", beam=beam, tip="clamped")
    tracked = ilg.track(chosen, (FINE, made.force), quantity="force", beam=beam, nodes=81)
    np.testing.assert_allclose(tracked.voltage[::2], volts, atol=1e-4)
    np.testing.assert_allclose(tracked.force, made.force, atol=1e-6 * np.abs(made.force).max())
    assert tracked.followed
    assert not tracked.displacement.any()


def test_a_force_out_of_reach_is_a_result_in_newtons() -> None:
    tracked = ilg.track(PAPER, "step:300nN", "100 s", quantity="force", nodes=41, beam="static")
    step = ilg.simulate(
        PAPER, "step:4V", times=np.linspace(0, 300, 30001), engine="exact", beam="static", tip="clamped"
    )
    assert tracked.reach == pytest.approx(step.force[-1], rel=1e-6)
    assert tracked.rate == pytest.approx(np.diff(step.force).max() / 0.01, rel=1e-3)
    assert tracked.at_limit > 0.5
    assert tracked.bound is None
    far = ilg.track(PAPER, "step:1N", "100 s", quantity="force", nodes=41, beam="static")
    np.testing.assert_allclose(far.voltage, 4.0, rtol=1e-6)
    assert far.at_limit == 1.0
    found = tracked.to_dict()
    assert (found["quantity"], found["unit"]) == ("force", "N")
    assert list(found["waveforms"]) == ["time_s", "path_N", "force_N", "voltage_V", "current_A"]
    assert {"path-not-followed", "path-too-far"} == codes(tracked.findings)
    said = "\n".join([tracked.summary(), *tracked.warnings])
    assert "goes to 300 nN, and 4 V hold at most 175 nN" in said
    assert "mm" not in said
    assert "displacement" not in said
    assert [panel.get_ylabel() for panel in tracked.plot()] == ["force [nN]", "error [nN]", "voltage [V]"]


def test_the_largest_rate_of_a_strip_with_slow_relaxations_is_that_of_its_step() -> None:
    law = ChargeCoupling(fractional_gain=1e-7, fractional_time=10.0, fractional_exponent=0.5)
    strip = replace(PAPER, coupling=law)
    tracked = ilg.track(strip, "step:9mm", "100 s", beam="static", nodes=11)  # out of reach
    step = ilg.simulate(strip, "step:4V", times=np.linspace(0, 20, 2001), engine="exact", beam="static").displacement
    assert tracked.rate == pytest.approx(np.diff(step).max() / 0.01, rel=1e-2)


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
    pressed = ilg.simulate(strip, (at, volts), times=fine, beam="static", engine="ngspice", tip="clamped").force
    tracked = ilg.track(strip, (fine, pressed), quantity="force", beam="static", nodes=13)
    np.testing.assert_allclose(tracked.drive.values, volts, atol=1e-4)


def test_bad_input_is_told_in_a_line() -> None:
    for wrong, said in (
        ({"voltage": "0 V"}, "more than zero"),
        ({"slew": "-1 V/s"}, "more than zero"),
        ({"nodes": 2}, "give 4 to 2001"),
        ({"path": "sine:1mm"}, "not understood"),
        ({"duration": None}, "duration is missing"),
        ({"strip": Actuator(PAPER.geometry, PAPER.material)}, "has no \\[coupling\\]"),
        ({"band": True}, "has no \\[uncertainty\\]"),
        ({"quantity": "torque"}, "choose displacement or force"),
        ({"quantity": "force"}, "unit 'mm' does not measure"),
        ({"quantity": "force", "path": "sine:9nN"}, "write one of step:1nN"),
        ({"quantity": "force", "path": "step:9nN", "load": "mass=1g"}, "moves no load"),
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
    pressed = run("track", "fitted.toml", "--quantity", "force", "--path", "sine:50nN,5mHz", *asked[2:],
                  "--json", "f.json", "--out", "force.csv", "--report", "f.html")  # fmt: skip
    assert pressed.code == 0, pressed.err
    found = json.loads((tmp_path / "f.json").read_text())
    assert 0 < max(found["waveforms"]["force_stderr_N"]) < 50e-9
    again = run("simulate", "fitted.toml", "--tip", "clamped", "--drive", "file:force.csv", "--duration", "200s",
                "--engine", "exact", "--step", "2s", "--out", "run.csv")  # fmt: skip
    assert again.code == 0, again.err
    force = columns(tmp_path / "run.csv")["force_N"]
    np.testing.assert_allclose(force, found["waveforms"]["force_N"], atol=1e-14)
    (tmp_path / "path.csv").write_text("time_s,force_nN\n0,0\n50,40\n100,0\n")
    of_file = run("track", "paper", "--quantity", "force", "--path", "file:path.csv", "--nodes", "51")
    assert "path 40 nN" in of_file.out
    assert_one_line(run("track", "paper", "--quantity", "force", "--path", "step:1mm", "--duration", "9s"), "mm")
    fast = run("track", "paper", "--path", "sine:3mm,20mHz", "--duration", "100s", "--nodes", "51")
    assert fast.code == 0
    assert "cannot follow this path" in fast.err
    assert_one_line(run("track", "paper", "--path", "file:none.csv"), "none.csv")
