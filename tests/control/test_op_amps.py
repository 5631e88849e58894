"""A PI of operational amplifiers against the exact loop of the same law: speed, limit, parts, deck."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

from ilg_circuit.control.close import Closed, close_loop
from ilg_circuit.control.laws import Law, pi, pid
from ilg_circuit.control.loop import Loop
from ilg_circuit.control.loop import Run as Exact
from ilg_circuit.control.op_amps import Controller, OpAmps, op_amp_controller
from ilg_circuit.control.plant import plants_of
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.strip.actuator import PAPER

STATIC = plants_of(PAPER, beam="static")[0]
IDEAL = OpAmps(open_loop_gain=1e9)
#: Two digits of IEC 60063.
TENS = ["10", "11", "12", "13", "15", "16", "18", "20", "22", "24", "27", "30"]
TENS += ["33", "36", "39", "43", "47", "51", "56", "62", "68", "75", "82", "91"]


def law(gain: float = 2e4, weight: float = 1.0) -> Law:
    return pi(STATIC, gain, 10.0, weight)


def closed(step: float, duration: float, made: OpAmps, asked: Law) -> Closed:
    how = {"form": "op-amps", "beam": "static", "samples": 41}
    return close_loop(PAPER, (asked, 4.0), PiecewiseLinear.step(step), duration, op_amps=made, **how)  # type: ignore[arg-type]


def circuit_of(found: Closed) -> Controller:
    assert found.circuit is not None
    return found.circuit


def exact(found: Closed, anti_windup: str = "back-calculation") -> Exact:
    """Return the exact loop of the law that the parts make, limited where they limit."""
    made = circuit_of(found)
    parts = law(made.gain, made.weight)
    rate = made.gain / made.reset_time
    parts = replace(
        parts,
        into_reference=np.array([rate]),
        into_measured=np.array([-rate]),
        into_excess=np.array([1 / made.reset_time]),
    ).guarded(anti_windup)
    duration = float(found.time[-1])
    return Loop(STATIC, parts, made.limit).run(np.zeros(1), np.array([found.reference[-1]]), duration, 1200)


def away(found: Closed) -> float:
    run = exact(found)
    difference = found.displacement - np.interp(found.time, run.time, run.displacement)
    return float(np.abs(difference).max() / found.reference[-1])


def test_the_loop_tends_to_the_exact_one_as_amplifiers_become_fast() -> None:
    slow, middle, fast = (away(closed(1e-4, 10.0, replace(IDEAL, gain_bandwidth=f), law())) for f in (1e4, 1e5, 1e6))
    assert middle == pytest.approx(slow / 10, rel=0.15)
    assert fast < middle / 4  # near the accuracy of both solutions
    assert fast < 4e-6


@pytest.mark.parametrize("weight", [0.5, 0.0])
def test_an_unlimited_step_is_within_what_the_docs_state(weight: float) -> None:
    assert away(closed(1e-4, 10.0, OpAmps(), law(weight=weight))) < 2e-4


@pytest.mark.parametrize(("form", "bound"), [("op-amps", 2e-4), ("behavioural", 3e-6)])
def test_a_reference_that_jumps_within_the_run_is_followed_as_exactly(form: str, bound: float) -> None:
    asked = pi(STATIC, 1e4, 15.0)  # which parts make without a deviation
    reference = parse_drive("square:0.1mm,7s", 10.0, "m")
    found = close_loop(PAPER, (asked, 4.0), reference, 10.0, form=form, beam="static", samples=21)
    step = Loop(STATIC, asked, 4.0).run(np.zeros(1), np.array([1e-4]), 10.0, 20).displacement
    expected = step.copy()
    expected[7:] -= step[:-7]  # 3.5 s later the reference falls to 0, and rises again at 7 s
    expected[14:] += step[:-14]
    difference = found.displacement - expected
    assert np.abs(difference).max() < bound * 1e-4


def test_at_the_limit_the_diodes_keep_the_output_and_the_integral() -> None:
    found = closed(3e-3, 60.0, OpAmps(), law())
    made, ideal, wound = circuit_of(found), exact(found), exact(found, "none")
    assert made.limit <= 4.0
    largest = np.abs(found.voltage).max()
    assert 0.97 * made.limit < largest <= made.limit + 1e-3
    assert found.run.overshoot == pytest.approx(ideal.overshoot, abs=0.005)
    assert wound.overshoot > 1.5 * ideal.overshoot
    assert found.run.settled() == pytest.approx(ideal.settled(), rel=0.05)
    down = closed(-3e-3, 60.0, OpAmps(), law())
    np.testing.assert_allclose(down.voltage, -found.voltage, atol=2e-3)


def test_a_jump_that_meets_the_diodes_is_gone_through() -> None:
    reference = parse_drive("square:-2mm..2mm,8s", 10.0, "m")
    asked = law()
    found = close_loop(PAPER, (asked, 4.0), reference, 10.0, form="op-amps", beam="static", samples=21)
    times, values = np.array([0.0, 4.0, 4.0, 8.0, 8.0]), 1e-3 * np.array([2.0, 2.0, -2.0, -2.0, 2.0])
    ideal = Loop(STATIC, asked, circuit_of(found).limit).run(times, values, 10.0, 200)
    expected = np.interp(found.time, ideal.time, ideal.displacement)
    assert np.abs(found.voltage).max() > 0.97 * circuit_of(found).limit
    assert np.abs(found.displacement - expected).max() < 0.04 * np.abs(expected).max()  # diodes are soft


@pytest.mark.parametrize(("gain", "reset", "sensor"), [(2e4, 10.0, 1e3), (1234.5, 17.3, 1e3), (7.7e4, 3.21, 2e3)])
def test_the_parts_are_the_nearest_of_the_series(gain: float, reset: float, sensor: float) -> None:
    made = op_amp_controller(pi(STATIC, gain, reset), 4.0, 1e-3, OpAmps(sensor_gain=sensor))
    resistors = np.array([float(f"{v}e{d}") for v in TENS for d in range(2, 6)])
    capacitors = np.array([*(float(f"{v}e{d}") for v in TENS[::2] for d in range(-10, -6)), 10e-6])
    least = min(
        float(((r6 / resistors[:, None] * sensor / gain - 1) ** 2 + (r6 * capacitors / reset - 1) ** 2).min())
        for r6 in resistors
    )
    assert sum(made.deviations[name] ** 2 for name in ("gain", "reset_time")) == pytest.approx(least, abs=1e-9)
    value = {part.designator: part.value for part in made.parts}
    r5, r6, c1 = (value[name] or 0.0 for name in ("R5", "R6", "C1"))
    assert (made.gain, made.reset_time) == pytest.approx((sensor * r6 / r5, r6 * c1))
    for name, number in value.items():
        if name[0] in "RC":
            mantissa = f"{number:.1e}"[:3].replace(".", "")
            assert mantissa in (TENS if name[0] == "R" else TENS[::2]), name


@pytest.mark.skipif(shutil.which("ngspice") is None, reason="the program ngspice")
def test_an_amplifier_has_one_pole_and_rails(tmp_path: Path) -> None:
    lines = op_amp_controller(law(), 4.0, 1e-3, OpAmps(gain_bandwidth=1e5)).lines("drive")
    macro = lines[lines.index(".subckt op_amp positive negative out") :]
    deck = [
        "* an open loop driven to both rails, and a follower",
        "Vin in 0 PWL(0 0 1n 1 0.5m 1 0.500001m -1)",
        "Xopen in 0 open op_amp",
        "Xfollower in out out op_amp",
        *macro,
        ".options reltol=1e-6 method=gear",
        ".meas tran high max v(open)",
        ".meas tran low min v(open)",
        f".meas tran after find v(out) at={1 / (2 * np.pi * 1e5)!r}",
        ".tran 1u 1m 0 0.1u uic",
        ".end",
    ]
    (tmp_path / "amplifier.cir").write_text("\n".join(deck) + "\n")
    done = subprocess.run(["ngspice", "-b", "amplifier.cir"], cwd=tmp_path, capture_output=True, text=True, check=False)
    found = dict(re.findall(r"^(high|low|after)\s*=\s*(\S+)", done.stdout, re.MULTILINE))
    assert float(found["high"]) == pytest.approx(13.5, abs=0.05)
    assert float(found["low"]) == pytest.approx(-13.5, abs=0.05)
    assert float(found["after"]) == pytest.approx(1 - np.exp(-1), rel=1e-3)


def test_what_such_a_circuit_is_not_is_told_in_a_line() -> None:
    for asked, limit, jump, made, said in (
        (pid(STATIC, 2e4, 10.0, 1.0), 4.0, 1e-3, OpAmps(), "kind pi, not pid"),
        (law().guarded("clamping"), 4.0, 1e-3, OpAmps(), "back-calculation"),
        (law().guarded("back-calculation", 1.0), 4.0, 1e-3, OpAmps(), "back-calculation"),
        (law(weight=1.5), 4.0, 1e-3, OpAmps(), "0 to 1, not 1.5"),
        (law(), 4.0, 1e-3, OpAmps(supply=5.0), "an amplifier gives 3.5 V at most"),
        (law(), 4.0, 2e-2, OpAmps(), "the range of the reference"),
        (law(), 0.3, 1e-3, OpAmps(), "the diodes cannot limit"),
        (law(2e8), 4.0, 1e-6, OpAmps(), "no resistors"),
        (law(5e-324), 4.0, 1e-6, OpAmps(), "more than zero"),
        (law(weight=1e-300), 4.0, 1e-6, OpAmps(), "no resistors"),
        (pi(STATIC, 2e4, 1e4), 4.0, 1e-3, OpAmps(), "no resistors"),
        (law(), 4.0, 1e-3, OpAmps(gain_bandwidth=0.0), "gain_bandwidth is 0 Hz"),
    ):
        with pytest.raises(InputError, match=said):
            op_amp_controller(asked, limit, jump, made)
    with pytest.raises(InputError, match=r"are of form='op-amps'"):
        close_loop(PAPER, (law(), 4.0), PiecewiseLinear.step(1e-3), 9.0, period=1.0, op_amps=OpAmps())


def test_the_command_writes_a_deck_and_all_of_its_parts(run: Run, tmp_path: Path) -> None:
    gains = ("--gains", "gain=5V/mm,reset_time=15s,weight=0.6", "--overshoot", "20%")
    assert run("tune", "paper", "--step", "3mm", *gains, "--json", "tuned.json", "--beam", "static").code == 0
    asked = (
        "close",
        "paper",
        "--reference",
        "step:3mm",
        "--duration",
        "20s",
        "--controller",
        "tuned.json",
        "--beam",
        "static",
    )
    built = run(*asked, "--form", "op-amps", "--samples", "21", "--netlist", "l.cir", "--parts", "p.csv", "--json", "-")
    assert built.code == 0, built.err
    assert "op-amps 4, resistors 12, capacitors 2, diodes 2" in built.err
    inside = (tmp_path / "l.cir").read_text().partition(".subckt controller")[2].partition(".ends")[0].splitlines()[1:]
    with (tmp_path / "p.csv").open() as file:
        listed = [row["designator"] for row in csv.DictReader(file)]
    assert sorted(listed) == sorted(line.split()[0].removeprefix("X") for line in inside)
    assert len(set(listed)) == len(listed)
    if shutil.which("ngspice"):
        done = subprocess.run(["ngspice", "-b", "l.cir"], cwd=tmp_path, capture_output=True, text=True, check=False)
        rows = [r.split() for r in done.stdout.splitlines() if re.match(r"\d+\t", r)]
        sensed = float(rows[-1][3]) * 1e-3
        final = float(re.findall(r'"displacement_m": \[([^\]]*)\]', built.out)[0].split(",")[-1])
        assert sensed == pytest.approx(final, rel=1e-4)
    assert_one_line(run(*asked, "--period", "1s", "--parts", "p.csv"), "give --form op-amps")
    assert_one_line(run(*asked, "--form", "op-amps", "--sensor-gain", "1kV/mm"), "--supply 15 V")
