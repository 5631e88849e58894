"""Closed loops: sampled against the discrete closed form, both engines, the circuit against the exact loop, exports."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from scipy.linalg import expm

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.control.export import c_text
from ilg_circuit.control.laws import lqg, pi
from ilg_circuit.control.loop import Loop
from ilg_circuit.control.plant import plants_of
from ilg_circuit.control.sampled import SampledLaw
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER

STATIC = plants_of(PAPER, beam="static")[0]
DYNAMIC = plants_of(PAPER, beam="dynamic")[0]


class Integral:
    """An integrator without limits."""

    def __init__(self) -> None:
        self.total = 0.0

    def step(self, reference: float, measured: float) -> float:
        self.total += 40.0 * (reference - measured)
        return self.total + 900.0 * (reference - measured)


def closed(controller: Any = None, **changed: Any) -> Any:
    asked: dict[str, Any] = {"period": "0.5 s", "samples": 41, "engine": "exact", "beam": "dynamic"} | changed
    return ilg.close_loop("paper", controller or Integral(), "step:1mm", "20 s", **asked)


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_the_exact_engine_is_the_discrete_closed_form(delay: float) -> None:
    found = closed(delay=delay)
    system = state_space([strip_netlist(PAPER, beam="dynamic")])
    row = system.output_names.index("displacement")
    a, b, c = system.a[0], system.b[0, :, 0], system.c[0, row]
    n, late = len(b), round(delay / 0.5)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = a, b
    moved = expm(whole * 0.5)
    # states of strip, sum of errors, displacements of the last samples: z' = M z + r m
    size = n + 1 + late
    matrix, into = np.zeros((size, size)), np.zeros(size)
    seen = np.zeros(size)
    if late:
        seen[n + late] = 1.0
    else:
        seen[:n] = c
    volts = -(40.0 + 900.0) * seen
    volts[n] += 1.0
    matrix[:n, :n] = moved[:n, :n]
    matrix[:n] += np.outer(moved[:n, n], volts)
    into[:n] = moved[:n, n] * 940.0
    matrix[n] = -40.0 * seen
    matrix[n, n] += 1.0
    into[n] = 40.0
    for k in range(late):
        matrix[n + 1 + k, :n] = c if k == 0 else 0.0
        if k:
            matrix[n + 1 + k, n + k] = 1.0
    z, expected = np.zeros(size), []
    for _ in range(41):
        expected.append(c @ z[:n])
        z = matrix @ z + into * 1e-3
    np.testing.assert_allclose(found.displacement, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    "sensor", [{}, {"delay": "0.13 s", "noise": "5 um", "computation": "50 ms", "seed": 3}, {"quantum": "10 um"}]
)
def test_ngspice_calls_the_controller_as_the_exact_engine_does(sensor: dict[str, Any]) -> None:
    exact, spice = closed(**sensor), closed(engine="ngspice", **sensor)
    largest = np.abs(exact.displacement).max()
    np.testing.assert_allclose(spice.displacement, exact.displacement, atol=1e-6 * largest)
    np.testing.assert_allclose(spice.waves.measured, exact.waves.measured, atol=1e-6 * largest)
    assert spice.error <= 1e-6
    if "quantum" in sensor:
        np.testing.assert_allclose(exact.waves.measured / 1e-5, np.round(exact.waves.measured / 1e-5), atol=1e-9)
    if "noise" in sensor:
        again = closed(**sensor)
        np.testing.assert_array_equal(again.waves.measured, exact.waves.measured)
        assert np.any(closed(**(sensor | {"seed": 4})).waves.measured != exact.waves.measured)


@pytest.mark.parametrize(
    ("beam", "law"), [("static", pi(STATIC, 2e4, 10.0)), ("dynamic", lqg(DYNAMIC, 1.4, 0.5, 0.04))], ids=["pi", "lqg"]
)
def test_a_law_in_the_circuit_is_the_exact_loop(beam: str, law: Any) -> None:
    found = ilg.close_loop("paper", (law, 4.0), "step:3mm", "40 s", form="behavioural", beam=beam, samples=41)
    plant = STATIC if beam == "static" else DYNAMIC
    exact = Loop(plant, law, 4.0).run(np.zeros(1), np.array([3e-3]), 40.0, 2000)
    expected = np.interp(found.time, exact.time, exact.displacement)
    np.testing.assert_allclose(found.displacement, expected, atol=1e-6 * 3e-3)
    np.testing.assert_allclose(found.voltage[1:-1], np.interp(found.time, exact.time, exact.voltage)[1:-1], atol=2e-3)
    assert np.abs(found.voltage).max() <= 4.0 + 1e-9
    assert "Bdrive drive 0 V=max(min(v(asked),4.0),-4.0)" in found.netlist


def test_a_fast_sampled_law_tends_to_the_continuous_one() -> None:
    law = lqg(DYNAMIC, 1.4, 0.5, 0.04)
    exact = Loop(DYNAMIC, law, 4.0).run(np.zeros(1), np.array([3e-3]), 40.0, 2000)
    away = []
    for period in ("0.2 s", "0.1 s"):
        found = ilg.close_loop("paper", (law, 4.0), "step:3mm", "40 s", period=period, samples=101, engine="exact")
        away.append(np.abs(found.displacement - np.interp(found.time, exact.time, exact.displacement)).max())
    assert away[1] < 0.6 * away[0] < 6e-5


def test_the_static_beams_controller_overshoots_on_the_dynamic_one_and_its_margins_had_said_so() -> None:
    tuned = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s", beam="static")
    judged = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s", beam="dynamic")
    runs = {
        beam: ilg.close_loop("paper", tuned, "step:3mm", "60 s", period="0.1 s", beam=beam, engine="exact").run
        for beam in ("static", "dynamic")
    }
    assert runs["dynamic"].overshoot > 1.3 * runs["static"].overshoot
    assert judged.margins.sensitivity[0] > 3 > 1.6 > tuned.margins.sensitivity[0]


def test_python_control_gets_the_strip_with_names() -> None:
    pytest.importorskip("control", reason="an extra of the package")
    system = ilg.to_control("paper")
    assert (system.input_labels, system.output_labels) == (["u"], ["y", "i", "F"])
    w = np.array([0.05, 0.5, 3.0])
    got = system(1j * w)[0, 0] if system(1j * w).ndim == 3 else system(1j * w)[0]
    np.testing.assert_allclose(got, DYNAMIC.response(w), rtol=1e-6)


@pytest.mark.skipif(shutil.which("cc") is None, reason="a C compiler")
@pytest.mark.parametrize("clamps", [False, True])
def test_the_text_in_c_is_the_sampled_law(tmp_path: Path, clamps: bool) -> None:
    law = pi(STATIC, 2e4, 10.0).guarded("clamping") if clamps else lqg(DYNAMIC, 1.4, 0.5, 0.04)
    main = """
#include <stdio.h>
int main(void)
{
    ilg_reset();
    for (int k = 0; k < 40; k++) printf("%.17g\\n", ilg_step(1e-4, 1e-5 * k));
    return 0;
}
"""
    (tmp_path / "law.c").write_text(c_text(law, 0.1, 4.0) + main)
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "law.c", "-o", "law"], cwd=tmp_path, check=True)
    done = subprocess.run([str(tmp_path / "law")], capture_output=True, text=True, check=True)
    sampled = SampledLaw(law, 0.1, 4.0)
    expected = [sampled.step(1e-4, 1e-5 * k) for k in range(40)]
    np.testing.assert_allclose([float(line) for line in done.stdout.split()], expected, rtol=1e-12)
    assert min(expected) < 4.0


def test_what_makes_no_loop_is_told_in_a_line() -> None:
    class Failing:
        def step(self, reference: float, measured: float) -> float:
            raise ValueError("out of range\nand more")

    class Endless(Failing):
        def step(self, reference: float, measured: float) -> float:
            return float("nan")

    for engine in ("exact", "ngspice"):
        with pytest.raises(SolveError, match=r"step raised ValueError at 0 s: out of range$"):
            closed(Failing(), engine=engine)
    with pytest.raises(SolveError, match="returned nan at 0 s"):
        closed(Endless())

    class Late(Integral):
        def step(self, reference: float, measured: float) -> float:
            return 1 / (1e-5 - measured) if measured > 1e-5 else 1 / 0 if self.total > 0.5 else super().step(1e-3, 0.0)

    with pytest.raises(SolveError, match=r"step raised ZeroDivisionError at \d"):
        closed(Late(), engine="ngspice", delay="30 s")
    assert closed(engine="ngspice").error <= 1e-6  # ngspice goes on after a failure
    tuned = (pi(STATIC, 2e4, 10.0).guarded("clamping"), 4.0)
    for wrong, said in (
        ({"period": "30 s"}, "at most the run's 20 s"),
        ({"period": None}, "period is missing"),
        ({"computation": "0.5 s"}, "shorter than the period"),
        ({"noise": "-1 um"}, "zero or more"),
        ({"form": "sample"}, "perhaps sampled"),
        ({"form": "behavioural", "period": None}, "only a tuned law can be a circuit"),
        ({"controller": tuned, "form": "behavioural", "period": None}, "clamping"),
        ({"controller": 3}, "step\\(reference, measured\\)"),
        ({"controller": "none.json"}, "cannot read the controller"),
    ):
        with pytest.raises(InputError, match=said):
            closed(**wrong)


def test_the_command(run: Run, tmp_path: Path) -> None:
    gains = ("--gains", "gain=5V/mm,reset_time=15s", "--overshoot", "20%")
    assert run("tune", "paper", "--step", "3mm", *gains, "--json", "tuned.json").code == 0
    asked = ("close", "paper", "--reference", "step:3mm", "--duration", "60s", "--samples", "61")
    done = run(*asked, "--controller", "tuned.json", "--period", "0.5s", "--delay", "40ms", "--out", "c.csv",
               "--json", "c.json", "--plot", "c.png", "--c-code", "law.c")  # fmt: skip
    assert done.code == 0, done.err
    assert "121 calls of the controller" in done.out
    assert columns(tmp_path / "c.csv")["displacement_m"][-1] == pytest.approx(3e-3, rel=0.02)
    assert len(json.loads((tmp_path / "c.json").read_text())["measured"]) == 121
    assert "double ilg_step(" in (tmp_path / "law.c").read_text()
    (tmp_path / "own.py").write_text("def step(reference, measured):\n    return 1000 * reference\n")
    own = run(*asked, "--controller", "own.py", "--period", "1s", "--engine", "exact")
    assert own.code == 0, own.err
    (tmp_path / "bad.py").write_text("def step(reference, measured):\n    return 1 / 0\n")
    assert_one_line(run(*asked, "--controller", "bad.py", "--period", "1s"), "raised ZeroDivisionError", code=1)
    (tmp_path / "none.py").write_text("x = 1\n")
    assert_one_line(run(*asked, "--controller", "none.py", "--period", "1s"), "nor a function step")
    assert_one_line(run(*asked, "--controller", "tuned.json", "--period", "100s"), "at most the run's 60 s")
    circuit = run(*asked, "--controller", "tuned.json", "--form", "behavioural", "--netlist", "loop.cir")
    assert circuit.code == 0, circuit.err
    assert "Bdrive drive 0" in (tmp_path / "loop.cir").read_text()
