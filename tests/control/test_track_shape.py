"""The voltages of segments for a path of the shape: known drives come back, optimality, OSQP, files, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from every_model import strip_of

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.circuit.wiring import wiring
from ilg_circuit.control.programme import EFFORT, SMOOTHING, Answers, Limits, answers, nearest_voltage, trapezoid
from ilg_circuit.control.tracked_shape import TrackedShape
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.cells import layout
from ilg_circuit.strip.uncertainty import Uncertainty

pytest.importorskip("clarabel", reason="an extra of the package")

SHEETS = {"sheet_resistance_1": 5.0, "sheet_resistance_2": 5.0, "segments_1": 3, "gap": 5e-4, "gap_resistance": 200.0,
          "cells": 3}  # fmt: skip
#: Three segments of side 1 over one foil of side 2, which couples them, as the leaks across the gaps do.
CUT = PAPER.with_(electrodes=SHEETS)
NODES, FINE = np.linspace(0.0, 100.0, 41), np.linspace(0.0, 100.0, 81)
KNOWN = {k: np.interp(NODES, NODES[::5], np.random.default_rng(k).uniform(-4.0, 4.0, 9)) for k in (1, 2, 3)}
TARGETS = ("curvature_1", "curvature_2", "curvature_3")


@cache
def known(beam: str = "static") -> ilg.results.Response:
    drives = {k: (NODES, volts) for k, volts in KNOWN.items()}
    return ilg.simulate(CUT, drives, times=FINE, engine="exact", beam=beam)


@pytest.mark.parametrize(
    ("beam", "asked"), [("static", TARGETS), ("dynamic", TARGETS), ("static", ("displacement", "angle", "curvature_2"))]
)
def test_the_shape_of_known_drives_gives_them_back(beam: str, asked: tuple[str, ...]) -> None:
    made = known(beam=beam)
    waves = {**made.segments, "displacement": made.displacement}
    tracked = ilg.track(CUT, {name: (FINE, waves[name]) for name in asked}, nodes=41, beam=beam)
    assert isinstance(tracked, TrackedShape)
    for k, volts in KNOWN.items():
        np.testing.assert_allclose(tracked.voltages[str(k)][::2], volts, atol=1e-4)
    assert tracked.followed
    assert tracked.determined
    assert not tracked.warnings
    # the drive gives the shape that was promised, by itself and as a file
    again = ilg.simulate(CUT, tracked.drive, times=FINE, engine="exact", beam=beam)
    for name, wave in tracked.outputs.items():
        found = {**again.segments, "displacement": again.displacement}[name]
        np.testing.assert_allclose(found, wave, atol=1e-12 * np.abs(wave).max())


def test_the_curvature_of_a_segment_is_the_turn_along_it() -> None:
    made = known()
    shape = made.shape("free", points=31)
    spans = CUT.electrodes.spans(1, CUT.geometry)  # type: ignore[union-attr]
    for k, (start, end) in enumerate(spans):
        turns = [np.array([np.interp(place, shape.s, row) for row in shape.angle]) for place in (start, end)]
        np.testing.assert_allclose(made.segments[f"curvature_{k + 1}"] * (end - start), turns[1] - turns[0], atol=1e-12)
    np.testing.assert_allclose(made.segments["angle"], shape.angle[:, -1], atol=1e-12)


def about_cut() -> Answers:
    """What two segments' curvatures and the angle answer, in parts of 5 1/m and 0.1 rad."""
    cells = layout(CUT, 3)
    net = strip_netlist(CUT, beam="static", wires=wiring(CUT.electrodes, ["1", "2", "3"]), layout=cells)  # type: ignore[arg-type]
    lengths = [cell.length for cell in cells.free]
    rows = [{"curvature_1": 0.2}, {"curvature_3": 0.2},
            {f"curvature_{k + 1}": 10 * length for k, length in enumerate(lengths)}]  # fmt: skip
    return answers(state_space([net]), NODES, rows)


#: Faster than the strip, and a limit of the voltage for each segment.
FAST = np.concatenate([np.sin(2 * np.pi * f * FINE) for f in (0.02, 0.03, 0.025)])
VOLTS = np.repeat([4.0, 3.0, 2.0], 41)


def objective(about: Answers, effort: float, rows: slice) -> tuple[np.ndarray, np.ndarray]:
    """Hessian and linear term of the programme in the voltages alone, in parts of their limits."""
    goal = FAST[rows]
    matrix, scale = about.output[rows] * VOLTS, np.abs(goal).max()
    weight = np.tile(trapezoid(81) / 81, len(goal) // 81)
    change = np.kron(np.eye(3), np.diff(np.eye(41), axis=0))
    hessian = 2 * (matrix.T * weight) @ matrix / scale**2 + 2 * SMOOTHING * change.T @ change
    return hessian + 2 * effort / 41 * np.eye(123), -2 * (matrix.T * weight) @ goal / scale**2


@pytest.mark.parametrize(("count", "effort"), [(3, 0.0), (1, EFFORT)])
def test_conditions_of_the_optimum_and_an_independent_solver(count: int, effort: float) -> None:
    osqp = pytest.importorskip("osqp", reason="a peer")
    from scipy import sparse

    about, rows = about_cut(), slice(0, 81 * count)
    part = Answers(about.output[rows], about.current, about.energy, about.offset[rows], about.flowing)
    limits = [Limits(4.0, slew=0.9), Limits(3.0, slew=1.2), Limits(2.0)]
    found = nearest_voltage(part, FAST[rows], NODES, limits, effort=effort)
    free = nearest_voltage(part, FAST[rows], NODES, [Limits(v) for v in (4.0, 3.0, 2.0)], effort=effort) / VOLTS
    hessian, linear = objective(about, effort, rows)
    gradient, size = hessian @ free + linear, np.abs(linear).max()
    near = 1e-7 if count == 3 else 1e-3  # where multipliers are as small as the effort's weight, slacks are larger
    high, low = free > 1 - near, free < -1 + near
    assert (high | low).mean() > 0.3 / (4 - count)
    assert np.abs(gradient[~(high | low)]).max() <= 1e-6 * size
    assert gradient[high].max(initial=0.0) <= 1e-6 * size
    assert gradient[low].min(initial=0.0) >= -1e-6 * size
    # slew: each voltage of the first two starts from zero
    change = np.kron(np.eye(3), np.eye(41) - np.eye(41, k=-1))[:82]
    most = np.repeat([0.9, 1.2], 41) * 2.5 / VOLTS[:82]
    most[::41] = 0.0
    bound = np.concatenate([np.ones(123), most])
    solver = osqp.OSQP()
    exact = {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 200_000, "polishing": True, "verbose": False}
    solver.setup(sparse.csc_matrix(hessian), linear, sparse.csc_matrix(np.vstack([np.eye(123), change])), -bound,
                 bound, **exact)  # fmt: skip
    other = solver.solve(raise_error=False).x * VOLTS

    def rms(volts: np.ndarray) -> float:
        off = part.output @ volts - FAST[rows]
        return float(np.sqrt(np.average(off**2, weights=np.tile(trapezoid(81), count))))

    assert rms(found) > 0.05
    assert rms(found) == pytest.approx(rms(other), rel=1e-6)


def test_one_segment_is_the_strip_as_a_whole() -> None:
    whole = PAPER.with_(electrodes={"sheet_resistance_1": 5.0, "sheet_resistance_2": 5.0, "cells": 3})
    how: dict[str, Any] = {"nodes": 41, "slew": "1 V/s"}
    one = ilg.track(whole, "sine:3mm,20mHz", "100 s", **how)
    own = ilg.track(whole, "sine:3mm,20mHz", "100 s", quantity="shape", **how)
    np.testing.assert_allclose(own.voltages["1"], one.voltage, atol=4e-9)
    np.testing.assert_allclose(own.outputs["displacement"], one.output, rtol=1e-9, atol=1e-15)
    assert own.at_limit == (one.at_limit,)
    assert own.at_limit[0] > 0.3
    assert own.reach["displacement"] == pytest.approx(one.reach, rel=1e-6)
    assert own.rate["displacement"] == pytest.approx(one.rate, rel=1e-3)
    assert own.bound == pytest.approx(one.bound, rel=1e-3)


def test_a_path_of_the_tip_leaves_the_segments_to_the_least_effort() -> None:
    tracked = ilg.track(CUT, "sine:1mm,5mHz", "100 s", quantity="shape", nodes=41, beam="static")
    alike = ilg.track(CUT, "sine:1mm,5mHz", "100 s", quantity="shape", nodes=41, beam="static", alike=True)
    assert codes(tracked.findings) == {"shape-left-open"}
    assert not codes(alike.findings)
    assert tracked.followed
    assert alike.followed

    def effort(found: TrackedShape) -> float:
        return float(sum(np.square(found.voltages[k if len(found.sources) > 1 else "all"]).mean() for k in "123"))

    assert effort(tracked) < 0.9 * effort(alike)
    # without sheet resistance in proportion to what each does to the tip
    plain = PAPER.with_(electrodes={"sheet_resistance_1": 0, "sheet_resistance_2": 0, "segments_1": 3, "cells": 3})
    free = ilg.track(plain, "sine:1mm,5mHz", "100 s", quantity="shape", nodes=41, beam="static")
    shares = [np.abs(volts).max() for volts in free.voltages.values()]
    arms = [cell.arm(PAPER.geometry.load_distance) for cell in layout(plain, 3).free]
    np.testing.assert_allclose(shares / np.sum(shares), arms / np.sum(arms), atol=1e-6)
    one = ilg.track(CUT, "sine:1mm,5mHz", "100 s", nodes=41, beam="static")
    np.testing.assert_allclose(alike.voltages["all"], one.voltage, atol=1e-8)
    assert "all alike, by one voltage" in one.summary()


def test_every_limit_is_kept_and_a_shape_out_of_reach_is_a_result() -> None:
    path = {1: "sine:6 1/m,20mHz", 2: "sine:-6 1/m,20mHz", 3: "step:20 1/m"}
    asked: dict[str, Any] = {"voltage": "4V,3V,2V", "current": [0.05, 0.06, 0.02], "slew": "1 V/s", "energy": "1 J"}
    tracked = ilg.track(CUT, path, "100 s", nodes=21, beam="static", **asked)
    for most, volts, amps, flowing in zip((4, 3, 2), tracked.voltages.values(), (0.05, 0.06, 0.02),
                                          tracked.currents.values(), strict=True):  # fmt: skip
        assert np.abs(volts).max() <= most * (1 + 1e-6)
        assert np.abs(flowing[::2]).max() <= amps * (1 + 1e-6)
        assert np.abs(np.diff(volts[::2])).max() <= 5 * (1 + 1e-6)
    assert tracked.energy == pytest.approx(1.0, rel=1e-2)
    assert codes(tracked.findings) == {"shape-too-far", "shape-not-followed"}
    assert tracked.bound is None
    # all segments help the third, since they share the foil of side 2
    held, rises = 0.0, np.zeros(400)
    for k, volts in ((1, 4.0), (2, 3.0), (3, 2.0)):
        times = np.append(np.linspace(0.0, 40.0, 401), 2000.0)
        bent = ilg.simulate(CUT, {k: f"step:{volts}V"}, times=times, engine="exact", beam="static").segments[
            "curvature_3"
        ]
        held += abs(bent[-1])
        rises += np.abs(np.diff(bent[:-1])) / 0.1
    assert tracked.reach["curvature_3"] == pytest.approx(held, rel=1e-6)
    assert tracked.rate["curvature_3"] == pytest.approx(rises.max(), rel=1e-3)


def test_a_nonlinear_strip_by_its_own_runs() -> None:
    sheets = {"sheet_resistance_1": 5.0, "sheet_resistance_2": 5.0, "segments_1": 2, "cells": 2}
    strip = strip_of("rc+growing", electrode_resistance=5.0).with_(electrodes=sheets)
    at, fine = np.linspace(0.0, 60.0, 7), np.linspace(0.0, 60.0, 13)
    volts = {1: np.interp(at, [0, 20, 60], [0.5, 2.0, 1.0]), 2: np.interp(at, [0, 40, 60], [0.5, -1.5, 1.0])}
    made = ilg.simulate(strip, {k: (at, v) for k, v in volts.items()}, times=fine, beam="static", engine="ngspice")
    path = {k: (fine, made.segments[f"curvature_{k}"]) for k in (1, 2)}
    tracked = ilg.track(strip, path, beam="static", nodes=7)
    for k, known in volts.items():
        np.testing.assert_allclose(tracked.voltages[str(k)][::2], known, atol=2e-3)


def test_bad_input_is_told_in_a_line() -> None:
    for wrong, said in (
        ({"path": {4: "step:1 1/m"}}, "curvature_4 is of a segment that is not there: side 1 has 3 segments, 1 to 3"),
        ({"path": {"twist": "step:1 1/m"}}, "a shape has no 'twist'"),
        ({"path": {1: "step:1 1/m", "curvature_1": "step:1 1/m"}}, "two paths"),
        ({"path": {1: "step:1mm"}}, "does not measure"),
        ({"path": {}}, "needs a target"),
        ({"strip": "paper"}, "has no \\[electrodes\\]"),
        ({"path": ilg.simulate("paper", "step:1V", "9 s", engine="exact")}, "has no shape of segments"),
        ({"duration": None}, "duration is missing"),
        ({"voltage": "4V,3V"}, "2 limits were given for 3 voltages"),
        ({"voltage": "4V,3V,2V", "slew": [1.0, 2.0]}, "slew has 2 limits"),
        ({"voltage": "4V,3V,2V", "alike": True}, "3 limits were given for 1 voltage"),
        ({"nodes": 2000}, "1334 nodes at most"),
        ({"quantity": "force"}, "that of a shape"),
        ({"quantity": None, "path": "step:1mm", "alike": True}, "alike goes with"),
        ({"quantity": None, "path": "step:1mm", "voltage": "4V,3V"}, "one for all"),
        ({"band": True}, "has no \\[uncertainty\\]"),
    ):
        asked: dict = {"strip": CUT, "path": {1: "step:1 1/m"}, "duration": "100 s", "nodes": 21} | wrong
        with pytest.raises(InputError, match=said):
            ilg.track(**asked)


def test_the_command_takes_columns_of_a_run_and_writes_drives_that_simulate_takes(run: Run, tmp_path: Path) -> None:
    fitted = Uncertainty("rc", ("capacitance", "coupling_gain"), ((1e-4, 0.0), (0.0, 4e-4)), 4.0)
    replace(CUT, uncertainty=fitted).save(tmp_path / "cut.toml")
    known().save(tmp_path / "known.csv")
    done = run("track", "cut.toml", "--quantity", "shape", "--path", "file:known.csv", "--nodes", "41", "--band",
               "--beam", "static", "--out", "drive.csv", "--json", "t.json", "--plot", "t.png")  # fmt: skip
    assert done.code == 0, done.err
    assert "followed      yes" in done.out
    told = json.loads((tmp_path / "t.json").read_text())
    stderr, wave = (np.array(told["waveforms"][name]) for name in ("curvature_1_stderr_1/m", "curvature_1_1/m"))
    assert 0 < stderr.max() == pytest.approx(0.02 * np.abs(wave).max(), rel=0.1)
    written = columns(tmp_path / "drive.csv")
    np.testing.assert_allclose(written["voltage_2_V"], KNOWN[2], atol=1e-4)
    again = run("simulate", "cut.toml", "--drive", "file:drive.csv", "--duration", "100s", "--samples", "81",
                "--beam", "static", "--engine", "exact", "--out", "again.csv")  # fmt: skip
    assert again.code == 0, again.err
    moved = columns(tmp_path / "again.csv")
    for name in ("displacement_m", "angle_rad", "curvature_3_1/m"):
        np.testing.assert_allclose(moved[name], told["waveforms"][name], atol=1e-9 * np.abs(moved[name]).max())
    assert_one_line(run("track", "cut.toml", "--path", "1=step:1 1/m", "--path", "step:1mm"), "say of what each is")
    assert_one_line(run("track", "cut.toml", "--quantity", "shape", "--path", "file:drive.csv"), "no column is that")
    (tmp_path / "path.csv").write_text("time_s,curvature_5_1/m\n0,0\n50,4\n")
    assert_one_line(run("track", "cut.toml", "--quantity", "shape", "--path", "file:path.csv"), "is not there")
    (tmp_path / "path.csv").write_text("curvature_1_1/m\n0\n4\n")
    assert_one_line(run("track", "cut.toml", "--quantity", "shape", "--path", "file:path.csv"), "no column for time")
    assert_one_line(run("track", "cut.toml", "--path", "2=file:known.csv", "--path", "4=file:known.csv"), "no column")
    (tmp_path / "five.csv").write_text("time_s,voltage_1_V,voltage_5_V\n0,0,0\n50,4,1\n")
    assert_one_line(run("simulate", "cut.toml", "--drive", "file:five.csv", "--duration", "9s"), "'5' is not there")


def test_a_file_with_columns_of_segments_drives_them(tmp_path: Path) -> None:
    made = ilg.simulate(CUT, {1: "step:2V", 2: "step:-1V"}, "10 s", samples=5, engine="exact")
    made.save(tmp_path / "run.csv")
    again = ilg.simulate(CUT, f"file:{tmp_path}/run.csv", "10 s", samples=5, engine="exact")
    np.testing.assert_allclose(again.displacement, made.displacement, rtol=1e-12)
    (tmp_path / "own.csv").write_text("time_s,voltage_1_mV,voltage_3_V\n0,1000,0\n5,2000,1\n")
    twice = ilg.simulate(CUT, f"repeat:2,{tmp_path}/own.csv", "10 s", samples=5, engine="exact")
    np.testing.assert_allclose(twice.segments["voltage_1"], [1.0, 1.5, 1.0, 1.5, 2.0], atol=1e-9)
    np.testing.assert_allclose(twice.segments["voltage_2"], 0.0, atol=1e-12)


def test_the_soonest_shape_is_found_where_many_voltages_do_as_well() -> None:
    """The simplex method went round in this programme, whose least error is zero, without end."""
    four = PAPER.with_(electrodes={"sheet_resistance_1": 0.25, "sheet_resistance_2": 5.0, "segments_1": 4,
                                   "segments_2": 2, "cells": 4})  # fmt: skip
    at = np.array([0.0, 5.0, 9.0, 100.0])
    paths = {"curvature_1": (at, np.array([0.0, 2.0, 0.0, 0.0])), "curvature_4": (at, np.array([0.0, -1.0, 1.0, 1.0]))}
    tracked = ilg.track(four, {**paths, "angle": (at, np.array([0.0, 0.02, 0.0, 0.0]))}, nodes=20, slew="1 V/s")
    assert isinstance(tracked, TrackedShape)
    assert tracked.bound == pytest.approx(6.289, rel=1e-3)
