"""Couplings that relax, as circuits: against the port's rational function, scipy, closed forms, and as libraries."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from relaxing_strips import COUPLINGS, by_scipy, strip
from scipy.special import erfcx
from spice import elements, ngspice, table, with_ngspice

from ilg_circuit.circuit.deck import deck
from ilg_circuit.circuit.library import library, library_netlist
from ilg_circuit.circuit.load import Load
from ilg_circuit.circuit.strip import sensor_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.response import simulate
from ilg_circuit.solve.spectrum import spectrum
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings import ChargeCoupling, VoltageRelaxations
from ilg_circuit.strip.elements import lumped_elements

FREQUENCY = np.geomspace(1e-3, 10, 9)
TIMES = np.linspace(0.0, 60.0, 121)
STEP = PiecewiseLinear.step(1.0)


def of_the_port(actuator: Actuator, beam: str, load: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m/V] and current [A/V] by the two-port: Zp, N and the beam's impedances, EC (17)."""
    lumped, s = lumped_elements(actuator, (1e-4, 100.0)), 2j * np.pi * FREQUENCY
    ion, port = lumped.port.ion_impedance(s), lumped.port
    factor = np.array([lumped.coupling_factor(x) for x in s])
    electrons = 1 / port.dc_resistance
    if beam == "static":
        outer = port.electrode_resistance + 1 / (electrons + 1 / ion)
        inner = 1 / (electrons + 1 / ion) / outer
        return factor * inner / ion / s, 1 / outer
    compliance, inertia = lumped.stiffness / s, (lumped.mass + load) * s + lumped.damping
    mechanical = compliance * inertia / (compliance + inertia)
    ion = ion + factor**2 * mechanical
    outer = port.electrode_resistance + 1 / (electrons + 1 / ion)
    inner = 1 / (electrons + 1 / ion) / outer
    return factor * inner / ion * mechanical / inertia / s, 1 / outer


@pytest.mark.parametrize("which", COUPLINGS)
@pytest.mark.parametrize("model", ["rc3", "warburg"])
def test_the_netlist_is_the_ports_rational_function(which: str, model: str) -> None:
    actuator = strip(which, model)
    # a fractional one is compared with its element, within the stated error of its ladder
    law = COUPLINGS[which]
    ladder = law.ladder((1e-3, 100.0) if model == "warburg" else (1e-4, 100.0))
    allowed = 3 * ladder.error if ladder else 1e-9
    assert allowed < 4e-4
    for beam, load in (("static", None), ("dynamic", None), ("dynamic", Load(mass=1e-4))):
        netlist = strip_netlist(actuator, beam=beam, load=load, band=(1e-4, 100.0))
        found = spectrum(netlist, FREQUENCY, engine="exact")
        moved, current = of_the_port(actuator, beam, load.mass if load else 0.0)
        assert_allclose(found.output("displacement"), moved, rtol=allowed)
        assert_allclose(found.output("current"), current, rtol=allowed)


@pytest.mark.parametrize("which", ["charge", "voltage"])
def test_a_moved_strip_senses_by_the_same_factor(which: str) -> None:
    actuator = strip(which)
    lumped, s = lumped_elements(actuator), 2j * np.pi * FREQUENCY
    factor = np.array([lumped.coupling_factor(x) for x in s])
    found = spectrum(sensor_netlist(actuator, terminals="short"), FREQUENCY, engine="exact").output("current")
    # v1 = N i1, F1 = K (y1 - y), and Zp i1 + N F1 = 0 behind shorted terminals
    want = factor * lumped.stiffness / (lumped.port.ion_impedance(s) + factor**2 * lumped.stiffness / s)
    assert_allclose(np.abs(found), np.abs(want), rtol=1e-9)


def test_a_coupling_in_charge_alone_is_a_passive_transformer() -> None:
    response = simulate(strip("charge alone"), STEP, TIMES, beam="dynamic", engine="exact")
    account = response.account
    assert np.abs(account.mechanical).max() > 0
    assert_allclose(account.converted, account.mechanical, rtol=0, atol=1e-9 * account.mechanical.max())
    assert account.electrical_imbalance < 1e-9
    assert account.mechanical_imbalance < 1e-9
    lumped = lumped_elements(strip("charge alone"))
    # N is real and the same at every frequency, so the port is reciprocal and passive
    assert {lumped.coupling_factor(1j * w) for w in (1e-3, 1.0, 1e3)} == {lumped.coupling_factor(0j)}
    # with a relaxation it is neither asserted nor so: what one side gives the other does not get
    other = simulate(strip("charge"), STEP, TIMES, beam="dynamic", engine="exact").account
    assert np.abs(other.converted - other.mechanical).max() > 0.01 * np.abs(other.mechanical).max()


def test_short_relaxations_have_the_shape_of_the_charge() -> None:
    now = simulate(strip("charge alone"), STEP, TIMES, beam="static", engine="exact")
    soon = simulate(strip(ChargeCoupling(gain_1=90e-9, time_1=1e-7)), STEP, TIMES, beam="static", engine="exact")
    k = lumped_elements(PAPER).bending_ratio
    assert_allclose(now.displacement, k * 90e-9 * now.charge / 0.35, rtol=1e-12)
    assert_allclose(soon.displacement, now.displacement, rtol=1e-6, atol=1e-7 * now.displacement.max())


def test_under_a_constant_current_the_motion_follows_the_charge() -> None:
    port = lumped_elements(PAPER).port
    dc, ((ion, c),), current = port.dc_resistance, port.branches, 1e-3
    time = np.linspace(0.0, 300.0, 3001)
    decay = np.exp(-time / ((dc + ion) * c))
    # the voltage of the strip under a constant current, as a drive
    drive = PiecewiseLinear(time, current * (dc + (dc * ion / (dc + ion) - dc) * decay))
    run = simulate(strip("charge alone"), drive, time, beam="static", engine="exact")
    assert_allclose(run.current[1:], current, rtol=1e-5)
    expected = lumped_elements(PAPER).bending_ratio * 90e-9 * current * dc * (1 - decay)
    assert_allclose(run.displacement, expected, rtol=0, atol=1e-6 * expected.max())
    # a ramp only for Rdc without end: parts of i t/C
    ramp = lumped_elements(PAPER).bending_ratio * 90e-9 * current * time / c
    assert run.displacement[10] / ramp[10] == pytest.approx(0.97, abs=5e-3)
    assert run.displacement[-1] / ramp[-1] == pytest.approx(0.55, abs=5e-3)


def test_a_fractional_step_is_mittag_lefflers() -> None:
    law = VoltageRelaxations(fractional_gain=40e-9, fractional_time=7.0, fractional_exponent=0.5)
    run = simulate(strip(law), STEP, TIMES, beam="static", engine="exact")
    # E_1/2(-z) = exp(z^2) erfc(z)
    expected = lumped_elements(PAPER).bending_ratio * 40e-9 * (1 - erfcx(np.sqrt(TIMES / 7.0)))
    assert 0 < run.error < 2e-4
    assert_allclose(run.displacement, expected, rtol=0, atol=run.error * expected.max())


def test_mallavarapu_and_leos_strip() -> None:
    # y/u = (12.54 s + 2.26)/(s^2 + 8.34 s + 2.26), as two relaxations
    poles = -np.roots([1.0, 8.34, 2.26])
    gains = [float((2.26 - 12.54 * p) / (q - p) / p) for p, q in (poles, poles[::-1])]
    assert sum(gains) == pytest.approx(1.0)
    law = VoltageRelaxations(
        gain_1=1e-7 * gains[0], time_1=1 / poles[0], gain_2=1e-7 * gains[1], time_2=1 / poles[1]
    )  # fmt: skip
    time = np.linspace(0.0, 20.0, 2001)
    run = simulate(strip(law), STEP, time, beam="static", engine="exact")
    y = run.displacement / (lumped_elements(PAPER).bending_ratio * 1e-7)
    assert y.max() == pytest.approx(1.475, abs=5e-4)
    assert time[np.argmax(y)] == pytest.approx(0.561, abs=6e-3)
    assert time[np.flatnonzero(np.abs(y - 1) > 0.02)[-1]] == pytest.approx(11.98, abs=0.02)


# -- nonlinear, by ngspice ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "model"),
    [
        (ChargeCoupling(gain_1=90e-9, time_1=5.0, gain_2=-30e-9, time_2=40.0, instantaneous=20e-9), "rc growing"),
        (ChargeCoupling(gain_1=90e-9, time_1=5.0, instantaneous=20e-9, odd=-0.1, even=0.05), "rc"),
        (VoltageRelaxations(gain_1=90e-9, time_1=5.0, odd=0.2, even=-0.1), "rc"),
    ],
)
def test_nonlinear_motion_is_scipys(law: ChargeCoupling, model: str) -> None:
    time = np.linspace(0.0, 30.0, 31)
    for voltage in (2.0, -1.0):
        run = simulate(strip(law, model), PiecewiseLinear.step(voltage), time, beam="static", engine="ngspice")
        charge, moved = by_scipy(strip(law, model), voltage, time)
        assert_allclose(run.charge, charge, rtol=0, atol=1e-5 * np.abs(charge).max())
        assert_allclose(run.displacement, moved, rtol=0, atol=1e-5 * np.abs(moved).max())


def test_a_strip_at_rest_under_a_bias_stays() -> None:
    law = ChargeCoupling(gain_1=90e-9, time_1=5.0, instantaneous=20e-9, odd=-0.1, even=0.05)
    actuator = strip(law, "rc growing")
    expected = lumped_elements(actuator).steady(1.5)
    netlist = strip_netlist(actuator, beam="static", rest=1.5)
    starts = {f"v({e.nodes[0]})": e.start for e in netlist.elements if e.kind == "C"}
    x = starts["v(q1)"] / 0.35
    starts["v(wd)"] = x - 0.1 * x * abs(x) + 0.05 * x * x
    terms = dict(next(o for o in netlist.outputs if o.name == "displacement").terms)
    assert sum(c * starts[q] for q, c in terms.items()) == pytest.approx(expected, rel=1e-12)
    # the small signal about it moves by the law's slope there
    slow = spectrum(netlist, [1e-5], bias=1.5, inner_bias=1.5, engine="exact").output("displacement")[0]
    rise = lumped_elements(actuator).steady(1.5 + 1e-4) - lumped_elements(actuator).steady(1.5 - 1e-4)
    assert slow.real == pytest.approx(rise / 2e-4, rel=1e-5)


# -- what is handed out ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", COUPLINGS)
@pytest.mark.parametrize("model", ["rc2", "warburg", "rc2 growing sinh"])
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_expressions_are_the_elements(which: str, model: str, beam: str) -> None:
    actuator = strip(which, model)
    found = elements(library(actuator, beam=beam))
    for element in library_netlist(actuator, beam).elements:
        if element.name == "Vdrive" or element.law:
            continue
        *_, value = [word for word in found[element.name] if not word.startswith("ic=")]
        assert float(value) == pytest.approx(element.value, rel=1e-12), element.name


@with_ngspice
@pytest.mark.parametrize(("which", "model"), [("charge", "rc2"), ("voltage", "rc"), ("odd and even", "rc growing")])
def test_the_library_and_the_deck_run_in_ngspice(which: str, model: str, tmp_path: Path) -> None:
    bent = ChargeCoupling(gain_1=90e-9, time_1=5.0, odd=-0.1, even=0.05)
    actuator = strip(bent if which == "odd and even" else which, model)
    text = deck(strip_netlist(actuator, beam="dynamic"), STEP, 30.0, actuator, samples=31)
    recorder = [".control", "run", "set numdgt=15 wr_singlescale wr_vecnames",
                "wrdata out.txt v(out_displacement)", "op", "print v(x1.way)", "quit 0", ".endc"]  # fmt: skip
    body = re.sub(r"\.print.*\n", "", text).removesuffix(".end\n")
    pins = ["X1 drive 0 tip ilg_strip", "Vtip tip 0 0"]
    (tmp_path / "deck.cir").write_text("\n".join([body, library(actuator), *pins, *recorder, ".end", ""]))
    said = ngspice(tmp_path, "deck.cir")
    found = table(tmp_path / "out.txt")
    engine = "exact" if actuator.linear else "ngspice"
    at = np.unique(np.linspace(0, len(found["time"]) - 1, 60).astype(int))
    run = simulate(actuator, STEP, np.minimum(found["time"][at], 30.0), beam="dynamic", engine=engine)
    assert_allclose(found["v(out_displacement)"][at], run.displacement, rtol=0, atol=2e-6 * run.displacement.max())
    way = float(re.findall(r"v\(x1\.way\) = (\S+)", said)[-1])
    assert way == pytest.approx(1e3 * lumped_elements(actuator).steady(1.0), rel=1e-6)


def test_what_cannot_be_says_so() -> None:
    law = VoltageRelaxations(instantaneous=1e-8, gain_1=1e-8, time_1=1.0)
    with pytest.raises(InputError, match="needs the rate of the voltage on a dynamic beam"):
        strip_netlist(strip(law), beam="dynamic")
    assert simulate(strip(law), STEP, TIMES, beam="static", engine="exact").displacement[1] > 0
    with pytest.raises(InputError, match="rate of a product"):
        strip_netlist(strip(ChargeCoupling(instantaneous=1e-8, odd=0.1)), beam="dynamic")
    with pytest.raises(InputError, match="short time_1"):
        library(replace(strip(law), name="x"), beam="static")
