"""Drives by current: against closed forms, between engines, with a limit of the source, in files, decks and studies."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run

import ilg_circuit as ilg
from ilg_circuit.drive import PiecewiseLinear, Sine, by_current, voltage_limit
from ilg_circuit.errors import InputError
from ilg_circuit.report.check import summary
from ilg_circuit.simulation.check import check
from ilg_circuit.simulation.drives import CURRENT, parse_drive
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings import ChargeCoupling, VoltageRelaxations
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.material import IonBranch
from ilg_circuit.strip.validity import largest_voltage

T = np.linspace(0, 300, 61)
LUMPED = lumped_elements(PAPER)
RDC = LUMPED.port.dc_resistance
((RD, C),) = LUMPED.port.branches


def _run(drive: str, strip: Actuator = PAPER, engine: str = "exact", **how: str) -> Response:
    return simulate(strip, parse_drive(drive, float(T[-1])), T, engine=engine, **how)  # type: ignore[arg-type]


def test_step_of_current_reaches_the_voltage_of_the_formula() -> None:
    """u = I [Rdc + (Rdc || Rd - Rdc) exp(-t/((Rdc + Rd) C))]: 4.809428 V at 300 s for 10 mA."""
    run = _run("current:10mA")
    formula = 0.01 * (RDC + (RDC * RD / (RDC + RD) - RDC) * np.exp(-T / ((RDC + RD) * C)))
    assert run.voltage == pytest.approx(formula, rel=1e-11)
    assert run.voltage[-1] == pytest.approx(4.809428, abs=5e-7)
    # the charge is no ramp: q/(I t) is 0.97 at 1 s, 0.55 at 300 s
    charge = 0.01 * C * RDC * -np.expm1(-T / ((RDC + RD) * C))
    assert run.charge == pytest.approx(charge, rel=1e-9, abs=1e-15)
    assert run.charge[-1] / 3 == pytest.approx(0.55, abs=0.005)
    assert (run.current == 0.01).all()


def test_motion_that_follows_the_charge_is_no_ramp_and_no_voltage() -> None:
    """y = k g q/C of q = I C Rdc (1 - exp(-t/((Rdc + Rd) C))); a law of the voltage has its jump's answer instead."""
    gain = 50e-9
    by_charge = replace(PAPER, coupling=ChargeCoupling(instantaneous=gain))
    by_voltage = replace(PAPER, coupling=VoltageRelaxations(instantaneous=gain))
    stored = 0.01 * RDC * -np.expm1(-T / ((RDC + RD) * C))
    for engine, bound in (("exact", 1e-9), ("ngspice", 1e-6)):
        run = _run("current:10mA", by_charge, engine, beam="static")
        formula = LUMPED.bending_ratio * gain * stored
        assert np.abs(run.displacement - formula).max() <= bound * formula[-1]
    other = _run("current:10mA", by_voltage, beam="static")
    assert other.displacement == pytest.approx(LUMPED.bending_ratio * gain * other.voltage, rel=1e-9)
    assert other.displacement[0] > 0
    assert run.displacement[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("drive", ["current:10mA", "square:-10mA..10mA,70s", "current:sine:5mA,0.02Hz", "ramp:20uA/s"])
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_three_answers_to_a_current_agree(drive: str, beam: str) -> None:
    differences = check(run := _run(drive, engine="ngspice", beam=beam), tip="free", beam=beam)
    assert all(d.value <= 1e-9 for d in differences), summary(differences)
    forms = {d.quantity for d in differences if d.reference == "closed form"}
    assert forms == ({"voltage"} | ({"displacement"} if "sine" not in drive else set()) if beam == "static" else set())
    assert run.account.electrical_imbalance < 1e-9


def test_motion_over_current_in_the_frequency_domain() -> None:
    """y/i = -(N/s) Rdc/(Rdc + Zp): amplitude and phase of a settled sine; towards the anode, so without the sign."""
    frequency, period = 0.02, 50.0
    drive = Sine(1e-3, frequency, "A")
    t = 40 * period + np.linspace(0, period, 65)[:-1]  # after 2000 s, 8 time constants of (Rdc + Rd) C
    run = simulate(PAPER, drive, t, engine="exact", beam="static")
    s = 2j * math.pi * frequency
    expected = LUMPED.coupling_factor(s) / s * RDC / (RDC + LUMPED.ion_impedance(s))
    found = 2j * np.mean(run.displacement * np.exp(-s * t)) / 1e-3
    assert found == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("part", ["electrode_resistivity", "rc2", "warburg", "hanging"])
def test_every_kind_of_strip_by_two_engines(part: str) -> None:
    strip = {
        "electrode_resistivity": PAPER.with_(electrode_resistivity_1=2e3, electrode_thickness_1=1e-6),
        "rc2": replace(
            PAPER, material=replace(PAPER.material, further_branches=(IonBranch(50.0, 0.2),)), name="two branches"
        ),
        "warburg": PAPER.with_(diffusion_time=20.0, ladder_sections=8),
        "hanging": PAPER.with_(bending_stiffness=1e-6, orientation="hanging"),
    }[part]
    differences = check(run := _run("current:8mA", strip, "ngspice"), tip="free")
    assert all(d.value <= 1e-9 for d in differences), summary(differences)
    assert run.voltage[0] == pytest.approx(
        8e-3 * lumped_elements(strip, (1e-4, 1e4)).port.high_frequency_resistance, 0.2
    )
    assert run.voltage[-1] <= largest_voltage(strip, run.drive)


def test_nonlinear_strip_against_its_equations() -> None:
    strip = PAPER.with_(emission_voltage="0.2 V", capacitance_slope=0.4)
    run = simulate(strip, parse_drive("current:square:-5mA..5mA,20s", 25.0), np.linspace(0, 25, 11))
    differences = check(run, tip="free")
    assert all(d.value <= 1e-6 for d in differences), summary(differences)
    assert np.abs(run.voltage).max() <= largest_voltage(strip, run.drive)


# -- a limit of the source ---------------------------------------------------------------------------------------------


def test_source_gives_way_at_its_limit_when_the_formula_says() -> None:
    """Constant current until u = 4 V, then constant voltage: the current relaxes to U/Rdc with the time Rd C."""
    limit, slow, fast = 4.0, (RDC + RD) * C, RD * C
    parallel = RDC * RD / (RDC + RD)
    event = -slow * math.log((limit / 0.01 - RDC) / (parallel - RDC))
    t = np.append(T, event + np.array([-1e-6, 1e-6, 1.0]))
    t.sort()
    run = simulate(PAPER, parse_drive("current:10mA,limit=4V", 300.0), t, engine="exact")
    before = t < event
    formula = 0.01 * (RDC + (parallel - RDC) * np.exp(-t / slow))
    assert run.voltage[before] == pytest.approx(formula[before], rel=1e-11)
    assert run.voltage[~before] == pytest.approx(limit, rel=1e-11)
    assert (run.current[before] == 0.01).all()
    taken = limit / RDC + (0.01 - limit / RDC) * np.exp(-(t - event) / fast)
    assert run.current[~before] == pytest.approx(taken[~before], rel=1e-9)
    assert run.account.electrical_imbalance < 1e-11
    assert run.error < 1e-9
    assert "reaches its limit of 4 V first at 213" in run.warnings[0]


@pytest.mark.parametrize("drive", ["square:-20mA..20mA,100s", "sine:30mA,0.01Hz", "ramp:0.1mA/s"])
def test_limited_runs(drive: str) -> None:
    """The source never exceeds its limit or its drive, the energies balance, and the port's equations agree."""
    run = simulate(PAPER, parse_drive(f"current:{drive},limit=0.9V", 200.0), np.linspace(0, 200, 41), engine="exact")
    assert np.abs(run.voltage).max() == pytest.approx(0.9, rel=1e-10)
    assert (np.abs(run.current) <= np.abs(run.drive.value(run.time)) * (1 + 1e-9) + 1e-15).all()
    assert run.account.electrical_imbalance < 1e-11
    if "ramp" in drive:
        differences = check(run, tip="free")
        assert {d.quantity for d in differences} == {"voltage", "charge"}
        assert all(d.value <= 1e-10 for d in differences), summary(differences)


def test_limit_that_is_not_reached_changes_nothing() -> None:
    plain, limited = (_run(f"current:2mA{limit}") for limit in ("", ",limit=4V"))
    for name, values in plain.waveforms.items():
        assert limited.waveforms[name] == pytest.approx(values, rel=1e-11, abs=1e-13), name
    assert not limited.warnings


@pytest.mark.parametrize(
    ("strip", "drive", "error"),
    [
        (PAPER, "current:10mA,limit=0V", "current, limit 0 V must be more than zero"),
        (PAPER, "current:10mA,limit=4", "current, limit: '4' has no unit"),
        (PAPER, "current:10V", "unit 'V' does not measure this quantity; use 'A'"),
        (PAPER, "current:absent.csv", "cannot read 'absent.csv'"),
        (PAPER.with_(emission_voltage=1.0), "current:10mA,limit=4V", "one linear strip from rest"),
        (PAPER.with_(inductance=1.0), "current:10mA", "through leads with an inductance"),
    ],
)
def test_impossible_currents(strip: Actuator, drive: str, error: str) -> None:
    with pytest.raises(InputError, match=error):
        ilg.simulate(strip, drive, "60 s")


def test_what_takes_no_current_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="exact engine only"):
        ilg.simulate("paper", "current:10mA,limit=4V", "60 s", engine="ngspice")
    with pytest.raises(InputError, match="a kit takes a voltage"):
        ilg.kit("paper", tmp_path / "kit", "current:10mA", "60 s")
    with pytest.raises(InputError, match="a deck has no limit"):
        ilg.netlist("paper", "current:10mA,limit=4V", "60 s")
    with pytest.raises(InputError, match="a study has no limit"):
        ilg.sweep("paper", "current:10mA,limit=4V", "60 s", "width=5mm", jobs=1)


# -- texts, files, front doors -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("current:10mA", None),
        ("step:10mA", None),
        ("current: 10 mA, limit = 4 V", 4.0),
        ("current:file:drive.csv", None),
        ("current:drive.csv,limit=4V", 4.0),
        ("current:repeat:2,drive.csv", None),
        ("current:cv:-1mA..1mA,0.1mA/s", None),
        ("multisine:1mA,0.1Hz..1Hz", None),
    ],
)
def test_texts_of_currents(text: str, limit: float | None, run: Run) -> None:
    Path("drive.csv").write_text("time_s,current_mA,voltage_V\n0,10,1\n60,10,2\n")
    drive = parse_drive(text, 60.0)
    assert by_current(drive)
    assert voltage_limit(drive) == limit
    assert drive.largest() == pytest.approx(10e-3 if "10" in text or "drive" in text else 1e-3, rel=0.2)
    assert not by_current(parse_drive("file:drive.csv", 60.0))


def test_help_and_errors_name_the_current(run: Run) -> None:
    assert CURRENT.meaning in " ".join(run("simulate", "--help").out.split())
    with pytest.raises(InputError, match=r"current:10mA\[,limit=4V\]"):
        parse_drive("sawtooth:1V", 60.0)


def test_from_the_command_line(run: Run) -> None:
    Path("drive.csv").write_text("time_s,current_mA\n0,10\n100,10\n100,-5\n")
    done = run(
        "simulate",
        "paper",
        *["--drive", "current:drive.csv", "--duration", "200s", "--engine", "exact"],
        "--out",
        "run.csv",
    )
    assert done.code == 0
    table = np.genfromtxt("run.csv", delimiter=",", names=True)
    assert table["current_A"][[0, -1]].tolist() == [0.01, -0.005]
    expected = 0.01 * RDC * -np.expm1(-100 / ((RDC + RD) * C)) * C  # charge at 100 s
    assert table["charge_C"][300] == pytest.approx(expected, rel=1e-9)


def test_band_of_a_fit_under_a_current() -> None:
    """The standard error of the voltage is that of the formula in one parameter."""
    from ilg_circuit.strip.uncertainty import Uncertainty

    names = ("dc_resistance", "dynamic_resistance", "capacitance")
    covariance = tuple(tuple(1e-4 * (j == k == 0) for j in range(3)) for k in range(3))
    strip = replace(PAPER, uncertainty=Uncertainty("rc", names, covariance))
    run = ilg.simulate(strip, "current:10mA", "300 s", samples=3, engine="exact", band=True)

    def final(rdc: float) -> float:
        return 0.01 * (rdc + (rdc * RD / (rdc + RD) - rdc) * math.exp(-300 / ((rdc + RD) * C)))

    slope = (final(RDC * 1.001) - final(RDC * 0.999)) / 0.002
    assert run.stderr["voltage"][-1] == pytest.approx(0.01 * slope, rel=1e-5)


def test_studies_under_a_current() -> None:
    outputs = "voltage_final,energy,displacement_final"
    found = ilg.sweep("paper", "current:10mA", "300 s", "current=5mA,10mA", engine="exact", jobs=1, outputs=outputs)
    data = found.to_xarray()
    run = _run("current:10mA")
    assert data.voltage_final.values[1] == pytest.approx(run.voltage[-1], rel=1e-9)
    assert data.energy.values == pytest.approx(run.energy[-1] * np.array([0.25, 1.0]), rel=1e-9)
    assert data.displacement_final.values[1] == pytest.approx(run.displacement[-1], rel=1e-7)
    with pytest.raises(InputError, match="voltage is not part of the drive"):
        ilg.design("paper", "current:10mA", "60 s", "voltage=1V:2V", maximise="displacement_final")


def test_response_shows_the_voltage_as_the_answer() -> None:
    run = ilg.simulate("paper", "current:square:-20mA..20mA,100s,limit=2V", "200 s", samples=21)
    assert "square -0.02 A..0.02 A" in repr(run)
    assert [axes.get_ylabel().split()[0] for axes in run.figure().axes] == [
        *("voltage", "current", "charge", "displacement", "energy", "current")
    ]
    moved = PiecewiseLinear(T, 0 * T + 1e-3, "mine", unit="A")
    assert ilg.simulate("paper", moved, engine="exact").voltage[-1] == pytest.approx(0.4809428, rel=1e-6)
