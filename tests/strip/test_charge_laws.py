"""Laws of charge: their inverses, slopes and energies by integration, and strips whose motion follows them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.charge_laws import CHARGE_LAWS, THERMAL, ChargeLaw, GrowingLaw, SaturatingLaw, StericLaw
from ilg_circuit.strip.couplings import ChargeCoupling
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.models import electrical_model

LAWS = [GrowingLaw(0.4), GrowingLaw(-0.2), SaturatingLaw(1.5), StericLaw(1e-3), StericLaw(0.4)]
VOLTAGES = np.array([0.0, 1e-9, 1e-4, 0.01, 0.05, 0.3, 1.0, 2.0, -4.0])


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_inverse_slope_and_energy(law: ChargeLaw) -> None:
    assert_allclose(law.voltage(law.charge(VOLTAGES)), VOLTAGES, rtol=1e-10, atol=1e-20)
    assert law.slope(0.0) == 1.0
    for v in VOLTAGES[2:]:
        h = 1e-4 * abs(v)
        rise = (law.charge(v + h) - law.charge(v - h)) / (2 * h)
        assert rise == pytest.approx(float(law.slope(v)), rel=1e-5)
        assert float(law.inverse(law.charge(v))[1] * law.slope(v)) == pytest.approx(1.0, rel=1e-9)
    for v in (0.05, 1.0):
        expected = quad(lambda u: u * float(law.slope(u)), 0.0, v, epsabs=1e-14, epsrel=1e-12)[0]
        assert float(law.energy(v)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_what_a_netlist_writes_is_the_law(law: ChargeLaw) -> None:
    # ngspice's functions by their names
    functions = {"atanh": np.arctanh, "asinh": np.arcsinh, "sqrt": np.sqrt, "exp": np.exp, "abs": abs}
    for v in VOLTAGES:
        text = law.expression("q", "0.35", repr(law.constant))
        found = eval(text, functions | {"q": 0.35 * float(law.charge(v)), "min": min, "max": max})
        assert found == pytest.approx(v, rel=1e-9, abs=1e-7)


def test_a_steric_capacitance_falls_as_the_root_of_the_voltage() -> None:
    law = StericLaw(0.3)
    assert float(law.slope(8.0) / law.slope(2.0)) == pytest.approx(0.5, rel=0.02)
    assert float(law.charge(8.0) / law.charge(2.0)) == pytest.approx(2.0, rel=0.02)
    # one double layer has half of the voltage: q0 sqrt((2/nu) ln(1 + 2 nu sinh^2(v1/(2 VT)))), C = q0/(2 VT)
    one = np.sqrt(2 / 0.3 * np.log(1 + 0.6 * np.sinh(0.2 / (2 * THERMAL)) ** 2))
    assert float(law.charge(0.4)) == pytest.approx(2 * THERMAL * one, rel=1e-12)


def strip(law: ChargeLaw) -> Actuator:
    known = {"capacitance_slope": law.constant} if isinstance(law, GrowingLaw) else {}
    constants = {} if known else {law.field: law.constant}
    made = replace(PAPER.material, constants=constants, **known)
    return replace(PAPER, material=made, coupling=ChargeCoupling(instantaneous=90e-9))


@pytest.mark.parametrize("law", [GrowingLaw(-0.2), SaturatingLaw(1.5), StericLaw(0.3)], ids=repr)
def test_the_motion_follows_the_charge_of_the_law(law: ChargeLaw) -> None:
    actuator = strip(law)
    lumped, time = lumped_elements(actuator), np.linspace(0.0, 20.0, 21)
    resistance, capacitance = lumped.port.branches[0]
    run = simulate(actuator, PiecewiseLinear.step(2.0), time, beam="static")

    def rate(_: float, v: np.ndarray) -> np.ndarray:
        return (2.0 - v) / (resistance * capacitance * law.slope(v))

    found = solve_ivp(rate, (0.0, 20.0), [0.0], method="Radau", t_eval=time, rtol=1e-10, atol=1e-12)
    charge = capacitance * law.charge(found.y[0])
    assert_allclose(run.charge, charge, rtol=0, atol=1e-5 * charge.max())
    assert_allclose(run.displacement, lumped.bending_ratio * 90e-9 * charge / capacitance, rtol=0, atol=1e-5 * 2e-3)
    assert run.account.electrical_imbalance < 1e-6


def test_the_ratio_of_two_amplitudes_is_the_charges() -> None:
    # at rest, closed forms: 1 + k/2 against 2 + 2 k, and tanh
    for law, expected in (
        (GrowingLaw(0.5), 2.4),
        (GrowingLaw(-0.2), 1.6 / 0.9),
        (SaturatingLaw(1.5), np.tanh(2 / 1.5) / np.tanh(1 / 1.5)),
    ):
        lumped = lumped_elements(strip(law))
        assert lumped.steady(2.0) / lumped.steady(1.0) == pytest.approx(expected, rel=1e-12)
    # and d(s), which does not know the charge, gives 2
    lumped = lumped_elements(replace(strip(LAWS[0]), coupling=PAPER.coupling))
    assert lumped.steady(2.0) / lumped.steady(1.0) == pytest.approx(2.0, rel=1e-12)


def test_a_law_must_rise_over_the_voltages_used() -> None:
    falling = strip(GrowingLaw(-0.3))
    said = r"capacitance_slope is -0.3: 4 V are reached, and the charge rises only up to 3.333 V; lower the voltage"
    with pytest.raises(InputError, match=said):
        simulate(falling, PiecewiseLinear.step(-4.0), [0.0, 1.0])
    with pytest.raises(InputError, match=said):
        impedance(falling, [0.1], bias=4.0, engine="exact")
    with pytest.raises(InputError, match=r"saturation_voltage is 0\.3: 4 V are reached"):
        simulate(strip(SaturatingLaw(0.3)), PiecewiseLinear.step(4.0), [0.0, 1.0])
    with pytest.raises(InputError, match="capacitance_slope is 0, a linear capacitance; leave it out"):
        PAPER.with_(capacitance_slope=0.0)
    with pytest.raises(InputError, match="growing and steric, two laws of one charge"):
        electrical_model("rc+growing+steric")
    with pytest.raises(InputError, match="packing_fraction is 1; it must be less than 1"):
        strip(StericLaw(1.0))
    assert set(CHARGE_LAWS) == {"charge", "saturating", "steric"}
