"""The closed forms against each other, against numerical integration, and against the papers' own numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp
from strategies import log_floats

from ilg_circuit.errors import InputError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

PORTS = [(666.667, 19.4363, 0.35, 0.0), (666.667, 19.4363, 0.35, 5.0), (10.0, 100.0, 2e-3, 1.0), (5e4, 1e-2, 30.0, 0.1)]
DAMPING = [0.05, 0.6212, 0.999, 1.0, 1.001, 1.7, 8.0]
KD, ZD, WN, RATIO = 2.4448e-9, 0.2075, 0.0742, 10800.0
TIMES = np.array([0.0, 1e-3, 0.1, 1.0, 5.0, 20.0, 48.1, 100.0, 300.0])


def coupling_response(damping: float, drive, times: Array) -> Array:
    """Free displacement by integrating d(s)'s differential equation: y'' + 2 z w y' + w^2 y = k Kd (u' + Zd u)."""
    # controllable form: the output k Kd (x1' + Zd x1) needs no derivative of the drive

    def rates(t: float, x: Array) -> list[float]:
        return [x[1], drive(t) - WN**2 * x[0] - 2 * damping * WN * x[1]]

    result = solve_ivp(rates, (0, times[-1]), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-13, max_step=2.0)
    return np.asarray(RATIO * KD * (result.y[1] + ZD * result.y[0]))


# -- current -----------------------------------------------------------------------------------------------------------


@given(
    dc=log_floats(1e-2, 1e6),
    dynamic=log_floats(1e-2, 1e4),
    c=log_floats(1e-6, 1e3),
    part=st.floats(0.0, 0.9),
    voltage=log_floats(1e-3, 10.0),
)
def test_step_constants_and_their_inverse(dc: float, dynamic: float, c: float, part: float, voltage: float) -> None:
    electrode = part * dynamic
    a0, a1, rate = formulas.current_constants(dc, dynamic, c, electrode)
    found = formulas.resistances_from_step(voltage * a0, voltage * a1, rate, voltage, electrode)
    # unlike resistances leave the smaller one in the last digits of a0 or a1
    smallest = min(dc, dynamic)
    tolerance = 1e-14 * (1 + electrode / smallest) * (dc + dynamic) ** 2 / (dc * dynamic)
    assert found == pytest.approx((dc, dynamic, c), rel=tolerance, abs=0)


@pytest.mark.parametrize("port", PORTS)
def test_step_constants_are_the_ports_limits(port: tuple[float, float, float, float]) -> None:
    dc, dynamic, c, electrode = port
    a0, a1, rate = formulas.current_constants(*port)
    assert 1 / a0 == pytest.approx(dc + electrode)  # at rest the capacitor is open
    assert 1 / (a0 + a1) == pytest.approx(electrode + dc * dynamic / (dc + dynamic))  # at once it is a short
    assert 1 / rate == pytest.approx(c * (dynamic + dc * electrode / (dc + electrode)))


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("frequency", [1e-5, 1e-2, 3.0, 1e4])
def test_sine_phasor_is_the_transfer_function(port: tuple[float, float, float, float], frequency: float) -> None:
    """EC (2) at s = 2 pi i f, reached when the transient has gone."""
    dc, dynamic, c, electrode = port
    s = 2j * np.pi * frequency
    d = dc * dynamic + electrode * (dc + dynamic)
    admittance = ((dc + dynamic) * c * s + 1) / (d * c * s + dc + electrode)
    a0, a1, rate = formulas.current_constants(*port)
    assert a0 + a1 * s / (s + rate) == pytest.approx(admittance, rel=1e-12)


@pytest.mark.parametrize("electrode", [-1e-9, 18.886, 20.0, np.nan])
def test_an_impossible_electrode_resistance_is_refused(electrode: float) -> None:
    with pytest.raises(InputError, match=r"from 0 to below 18\.885"):
        formulas.resistances_from_step(0.0060, 0.2058, 0.1470, 4.0, electrode)


def test_two_ports_no_step_can_tell_apart() -> None:
    """Four elements, three observables: another Re with other R, C makes the same current."""
    constants = formulas.current_constants(666.667, 19.4363, 0.35)
    other = formulas.resistances_from_step(*constants, 1.0, electrode_resistance=5.0)
    assert other[1] == pytest.approx(14.0, rel=0.05)
    again = formulas.current_constants(*other, 5.0)
    assert again == pytest.approx(constants, rel=1e-13)


@pytest.mark.parametrize("port", PORTS)
def test_current_ramp_is_the_integral_of_the_step(port: tuple[float, float, float, float]) -> None:
    constants = formulas.current_constants(*port)
    for t in np.array([1e-3, 0.3, 2.0, 9.0]) / constants[2]:
        integral, _ = quad(lambda x: float(formulas.current_step(x, *constants)), 0, t, epsabs=0, epsrel=1e-12)
        assert float(formulas.current_ramp(t, *constants)) == pytest.approx(integral, rel=1e-11)


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("cycles", [0.05, 1.0, 7.0])
def test_current_sine_against_integration(port: tuple[float, float, float, float], cycles: float) -> None:
    dc, dynamic, c, electrode = port
    constants = formulas.current_constants(*port)
    frequency = cycles * constants[2] / 6
    times = np.linspace(0, 6 / constants[2], 40)

    def port_voltage(u: float, v: float) -> float:
        return (u / electrode + v / dynamic) / (1 / electrode + 1 / dc + 1 / dynamic) if electrode else u

    def rate(t: float, v: Array) -> Array:
        return (port_voltage(np.sin(2 * np.pi * frequency * t), v[0]) - v) / (dynamic * c)

    solved = solve_ivp(rate, (0, times[-1]), [0.0], "DOP853", times, rtol=1e-12, atol=1e-14).y[0]
    voltage = np.array([port_voltage(np.sin(2 * np.pi * frequency * t), v) for t, v in zip(times, solved, strict=True)])
    expected = voltage / dc + (voltage - solved) / dynamic
    found = formulas.current_sine(times, *constants, frequency)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_before_the_drive_there_is_nothing() -> None:
    constants = formulas.current_constants(666.667, 19.4363, 0.35)
    past = np.array([-5.0, -1e-9])
    assert not formulas.current_step(past, *constants).any()
    assert not formulas.current_ramp(past, *constants).any()
    assert not formulas.current_sine(past, *constants, 1.0).any()
    assert not formulas.displacement_step(past, KD, ZD, 0.6, WN, RATIO).any()
    assert not formulas.displacement_ramp(past, KD, ZD, 0.6, WN, RATIO).any()
    assert formulas.displacement_sine(past, KD, ZD, 0.6, WN, RATIO, 0.1) == pytest.approx(np.zeros(2), abs=1e-18)


def test_step_current_starts_at_its_right_limit() -> None:
    a0, a1, rate = formulas.current_constants(666.667, 19.4363, 0.35)
    assert float(formulas.current_step(0.0, a0, a1, rate)) == a0 + a1


# -- displacement ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", DAMPING)
def test_step_displacement_against_integration(damping: float) -> None:
    solved = coupling_response(damping, lambda t: 1.0, TIMES)
    found = formulas.displacement_step(TIMES, KD, ZD, damping, WN, RATIO)
    assert found == pytest.approx(solved, abs=1e-10 * np.abs(solved).max())


@pytest.mark.parametrize("damping", DAMPING)
@pytest.mark.parametrize("frequency", [1e-3, 0.0118, 0.2])
def test_sine_displacement_against_integration(damping: float, frequency: float) -> None:
    omega = 2 * np.pi * frequency
    solved = coupling_response(damping, lambda t: np.sin(omega * t), TIMES)
    found = formulas.displacement_sine(TIMES, KD, ZD, damping, WN, RATIO, frequency)
    assert found == pytest.approx(solved, abs=1e-9 * np.abs(solved).max())


@pytest.mark.parametrize("damping", DAMPING)
def test_ramp_displacement_is_the_integral_of_the_step(damping: float) -> None:
    for t in TIMES[1:]:
        integral, _ = quad(
            lambda x: float(formulas.displacement_step(x, KD, ZD, damping, WN, RATIO)),
            0,
            t,
            epsabs=0,
            epsrel=1e-12,
            limit=400,
        )
        assert float(formulas.displacement_ramp(t, KD, ZD, damping, WN, RATIO)) == pytest.approx(integral, rel=1e-9)


@pytest.mark.parametrize("name", ["displacement_step", "displacement_ramp", "displacement_sine"])
def test_nothing_jumps_at_critical_damping(name: str) -> None:
    more = (0.02,) if name.endswith("sine") else ()
    function = getattr(formulas, name)
    at = function(TIMES, KD, ZD, 1.0, WN, RATIO, *more)
    for near in (1 - 1e-9, 1 + 1e-9):
        assert function(TIMES, KD, ZD, near, WN, RATIO, *more) == pytest.approx(at, rel=1e-7, abs=1e-12 * at.max())


@pytest.mark.parametrize("damping", DAMPING)
def test_first_slope_of_the_step_displacement(damping: float) -> None:
    """d(s) has relative degree one: the tip starts with the velocity 3 U L_F^2 Kd/b^2, not with none."""
    t = 1e-6
    slope = formulas.displacement_step([t], KD, ZD, damping, WN, RATIO)[0] / t
    assert slope == pytest.approx(RATIO * KD, rel=1e-6)


@given(damping=log_floats(0.05, 20.0), zero=log_floats(1e-3, 10.0), wn=log_floats(1e-3, 10.0))
def test_step_displacement_ends_at_ec_37(damping: float, zero: float, wn: float) -> None:
    slowest = wn * (damping - np.sqrt(max(damping**2 - 1, 0)))
    end = formulas.displacement_step([60 / slowest], KD, zero, damping, wn, RATIO)[0]
    assert end == pytest.approx(RATIO * KD * zero / wn**2, rel=1e-9)


@pytest.mark.parametrize("damping", [0.3, 0.6212, 0.9])
def test_step_displacement_is_ec_34_as_printed(damping: float) -> None:
    """The paper's own form, its overall sign that of EC (35)."""
    t, root = TIMES, np.sqrt(1 - damping**2)
    bracket = (
        ZD / WN**2
        - ZD / WN**2 * np.exp(-damping * WN * t) * np.cos(WN * root * t)
        - (ZD * damping - WN) / (WN**2 * root) * np.exp(-damping * WN * t) * np.sin(WN * root * t)
    )
    expected = RATIO * KD * bracket
    assert formulas.displacement_step(t, KD, ZD, damping, WN, RATIO) == pytest.approx(expected, abs=1e-14 * 1e-3)


def test_golden_numbers_of_the_papers_strip() -> None:
    k = PAPER.coupling
    assert k is not None
    constants = (k.gain, k.zero, k.damping_ratio, k.natural_frequency, lumped_elements(PAPER).bending_ratio)
    t = np.linspace(0, 300, 300001)
    y = 4 * formulas.displacement_step(t, *constants)
    assert y[-1] == pytest.approx(3.9805e-3, rel=1e-5)
    assert y.max() == pytest.approx(4.339e-3, abs=0.5e-6)
    assert t[y.argmax()] == pytest.approx(48.1, abs=0.05)
    assert formulas.steady_displacement(4, k.static, 30e-3, 0.5e-3) == pytest.approx(3.9805e-3, rel=1e-5)
    assert formulas.steady_force(4, k.static, 7600, 5e-3, 0.5e-3, 30e-3) == pytest.approx(0.1751e-6, abs=0.5e-10)


def test_steady_force_is_displacement_times_stiffness() -> None:
    lumped = lumped_elements(PAPER)
    y = formulas.steady_displacement(1.0, 2e-7, 20e-3, 0.3e-3)
    stiffness = 5000.0 * 4e-3 * 0.3e-3**3 / (4 * 20e-3**3)
    assert formulas.steady_force(1.0, 2e-7, 5000.0, 4e-3, 0.3e-3, 20e-3) == pytest.approx(y * stiffness)
    assert lumped.stiffness > 0


def test_coefficients_of_ec_35() -> None:
    """y(t) = 3.9805 - 3.9805 e^(-0.0461 t) cos 0.0581 t - 1.3392 e^(-0.0461 t) sin 0.0581 t [mm]."""
    k = PAPER.coupling
    assert k is not None
    sigma = k.damping_ratio * k.natural_frequency
    wd = k.natural_frequency * np.sqrt(1 - k.damping_ratio**2)
    assert sigma == pytest.approx(0.0461, abs=0.5e-4)
    assert wd == pytest.approx(0.0581, abs=1e-4)  # 0.05816 to five digits
    # quarter periods single out cosine and sine
    scale = 4e3 * 10800.0
    static = scale * k.static
    sine = (
        scale
        * k.gain
        * (k.zero * k.damping_ratio - k.natural_frequency)
        / (k.natural_frequency**2 * np.sqrt(1 - k.damping_ratio**2))
    )
    assert static == pytest.approx(3.9805, abs=0.5e-4)
    assert sine == pytest.approx(1.3392, abs=3e-4)  # 1.3390 from the rounded values of Table 3
    t = np.pi / 2 / wd
    y = 4e3 * formulas.displacement_step([t, 2 * t], *(k.gain, k.zero, k.damping_ratio, k.natural_frequency, 10800.0))
    assert y[0] == pytest.approx(static - sine * np.exp(-sigma * t), rel=1e-12)
    assert y[1] == pytest.approx(static + static * np.exp(-2 * sigma * t), rel=1e-12)
