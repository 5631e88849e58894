"""Neurons that feel the strip they drive, against equations written out, averaging, ngspice and closed forms."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import ilg_circuit as ilg
from ilg_circuit.arrays import Array
from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.entrainment import drifting, entrainment
from ilg_circuit.oscillators.flow import Flow, sampled
from ilg_circuit.oscillators.loop_rhythm import LoopRhythm, loop_rhythm
from ilg_circuit.oscillators.loop_run import run_loop
from ilg_circuit.oscillators.network import Network, default_start, unit
from ilg_circuit.oscillators.orbits import propagated
from ilg_circuit.oscillators.reflex import LoopFlow, looped
from ilg_circuit.oscillators.rhythm import rhythm
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.couplings import VoltageRelaxations

#: Neurons that toggle: their inhibition exceeds 1 + d, so that only a reflex makes them a rhythm.
TOGGLING = unit(4.5)
#: Curvature times length over d(s) of the paper's strip [rad V/m].
BENT = PAPER.geometry.free_length * 6 / PAPER.geometry.thickness**2


@cache
def felt(network: Network, gain: float) -> LoopRhythm:
    return loop_rhythm(looped(network, PAPER, gain))


def d_of(s: Array) -> Array:
    """Return d(s) of EC (31)."""
    c: Any = PAPER.coupling
    return np.asarray(
        c.gain * (s + c.zero) / (s**2 + 2 * c.damping_ratio * c.natural_frequency * s + c.natural_frequency**2)
    )


def test_without_gain_the_neurons_run_free_and_the_strip_follows() -> None:
    run = ilg.reflex("1.5 s", "paper", 0, step="0.2 ms")
    free = ilg.cpg("1.5 s", step="0.2 ms")
    assert run.outputs == pytest.approx(free.outputs, abs=1e-12)
    assert run.period == pytest.approx(free.period, rel=1e-10)
    drive, late = (run.time, run.voltages[:, 0]), run.time[::150]  # straight between the times
    driven = ilg.simulate("paper", drive, times=late, beam="static", engine="exact")
    angle = driven.displacement * 2 / PAPER.geometry.free_length
    assert run.angles[::150, 0] == pytest.approx(angle, abs=1e-6 * np.abs(angle).max())


@pytest.mark.parametrize(("inhibition", "gain", "rest"), [(2.5, 100.0, 0.0), (4.5, 30.0, 1e-3)])
def test_the_flow_solves_the_equations_as_they_are_written(inhibition: float, gain: float, rest: float) -> None:
    loop = looped(unit(inhibition), PAPER, gain, rest_angle=rest)
    c: Any = PAPER.coupling

    def rate(_: float, z: Array) -> list[float]:
        x, v, (p, q) = z[:2], z[2:4], z[4:]
        y = np.maximum(x, 0)
        u = 4 * np.clip((y[0] - y[1]) / loop.reference, -1, 1)
        angle = BENT * c.gain * (q + c.zero * p)  # d(s) u = gain (s + zero) p, with p'' + .. p' + .. p = u
        s = gain * (angle - rest) * np.array([-1, 1])
        dx = (-x - 3 * v - inhibition * y[::-1] + 1 + s) / 0.12
        return [
            *dx,
            *((y - v) / 0.3),
            q,
            u - 2 * c.damping_ratio * c.natural_frequency * q - c.natural_frequency**2 * p,
        ]

    times = np.linspace(0, 6, 61)
    solved = solve_ivp(rate, (0, 6), [0.12, 0, 0, 0, 0, 0], t_eval=times, rtol=1e-9, atol=1e-11, max_step=0.02).y
    run = run_loop(loop, times)
    assert run.inner == pytest.approx(solved[:2].T, abs=2e-6)
    assert run.angles[:, 0] == pytest.approx(BENT * c.gain * (solved[5] + c.zero * solved[4]), abs=1e-8)


_AT_ONCE = replace(PAPER, coupling=VoltageRelaxations(instantaneous=2e-9, gain_1=90e-9, time_1=10.0), name="at once")


@pytest.mark.parametrize(
    ("strip", "gain", "end"), [(PAPER, 100.0, 0.65), (_AT_ONCE, 1.0, 0.12)], ids=["paper", "at once"]
)
def test_one_netlist_of_all_agrees_within_a_millionth(strip: Any, gain: float, end: float) -> None:
    loop = looped(TOGGLING, strip, gain)
    times = np.linspace(0, end, 81)
    ours, spice = run_loop(loop, times), run_loop(loop, times, engine="ngspice")
    assert ours.angles[-1, 0] < 0.9 * ours.angles.max() or strip is _AT_ONCE  # the neurons have switched
    for name in ("inner", "angles"):
        mine, other = getattr(ours, name), getattr(spice, name)
        assert other == pytest.approx(mine, abs=1e-6 * np.abs(mine).max())


@pytest.mark.parametrize(("inhibition", "gain"), [(2.5, 414.0), (3.4, -29.0), (4.4, -75.0)])
def test_the_error_of_one_netlist_is_told(inhibition: float, gain: float) -> None:
    times = np.linspace(0, 0.8, 301)
    loop = looped(unit(inhibition), PAPER, gain)
    ours, spice = run_loop(loop, times), run_loop(loop, times, engine="ngspice")
    pairs = [(ours.inner, spice.inner), (ours.angles, spice.angles)]
    true = max(float(np.abs(a - b).max() / np.abs(a).max()) for a, b in pairs)
    assert true <= spice.error <= 1e-6
    assert spice.error < 4 * true


@cache
def response_of_phase() -> tuple[float, Array, Array]:
    """Return period of the free unit, times (n,) on its cycle, and the advance of its phase (n,) by an input s."""
    free = rhythm(unit()).cycle
    assert free is not None
    flow, times = Flow(unit()), np.arange(200) / 200 * free.period
    found = []
    for state in sampled(flow, free.state, times):
        values, left = np.linalg.eig(propagated(flow, state, free.period)[0].T)
        w = left[:, np.argmin(np.abs(values - 1))].real
        w = w / (w @ flow.rate(state))
        found.append((w[0] - w[1]) / 0.12)
    return free.period, times, np.array(found)


def test_a_weak_reflex_shifts_the_period_as_averaging_says() -> None:
    period, times, advance = response_of_phase()
    free = rhythm(unit()).cycle
    assert free is not None
    y = np.maximum(sampled(Flow(unit()), free.state, times)[:, :2], 0)
    u = np.fft.rfft(4 * np.clip((y[:, 0] - y[:, 1]) / rhythm(unit()).amplitude, -1, 1))
    angle = np.fft.irfft(u * BENT * d_of(2j * np.pi * np.arange(len(u)) / period), len(times))
    slope = period * float(np.mean(advance * angle))  # T(h) = T + h slope: s = - h angle delays
    for gain in (0.3, -0.3):
        found = felt(unit(), gain).period
        assert found is not None
        assert (found - period) / gain == pytest.approx(slope, rel=5e-3)


def test_a_weak_input_entrains_as_averaging_says() -> None:
    period, times, advance = response_of_phase()
    reach = abs(np.mean(advance * np.exp(-2j * np.pi * times / period)))
    found = entrainment(felt(unit(), 0.0), 0.01, [1 / period])
    assert found.high * period - 1 == pytest.approx(0.01 * reach, rel=0.03)
    assert 1 - found.low * period == pytest.approx(0.01 * reach, rel=0.03)


def test_the_range_of_entrainment_is_that_of_the_motion_itself() -> None:
    own, force = felt(TOGGLING, 100.0), 0.05
    found = entrainment(own, force, [1.0])
    assert own.state is not None
    assert not found.findings
    for edge, way in ((found.low, 1), (found.high, -1)):
        inside, outside = (
            drifting(own.loop.forced(force, edge * (1 + way * off)), own.state, wait=25, watched=20)[0]
            for off in (0.01, -0.01)
        )
        assert abs(inside) < 1e-4
        assert way * outside > 1e-3  # below the range the rhythm gains on the input, above it loses


@pytest.mark.parametrize(("part", "outcome"), [(0.5, "rest"), (1.5, "cycle")])
def test_toggling_neurons_become_a_rhythm_where_the_bent_strip_switches_them(part: float, outcome: str) -> None:
    # the silent neuron wakes where e + h theta > a (e - h theta)/(1 + d), at the angle of the largest voltage
    angle = 4 * BENT * d_of(np.zeros(1))[0]
    threshold = (4.5 - 4) / (4.5 + 4) / angle
    found = felt(TOGGLING, part * threshold)
    assert found.outcome == outcome
    if outcome == "rest":
        assert found.rest_angles is not None
        y = 1 - found.loop.gain * found.rest_angles[0]
        assert y / 4 < 0.25  # the active neuron's output, below that which gives all of the voltage
    else:
        free = felt(unit(), 0.0)
        assert found.period is not None
        assert free.period is not None
        assert found.period > 50 * free.period
        assert found.angle_amplitudes[0] > 140 * free.angle_amplitudes[0]


@settings(max_examples=4, deadline=None)
@given(scale=st.floats(0.2, 5), gain=st.floats(20, 300))
def test_all_inputs_and_outputs_may_be_scaled_together(scale: float, gain: float) -> None:
    base = loop_rhythm(looped(unit(), PAPER, gain))
    scaled = looped(unit(tonic=scale), PAPER, scale * gain)
    found = loop_rhythm(scaled, scale * default_start(unit()))
    assert found.period == pytest.approx(base.period, rel=1e-9)
    assert found.amplitudes == pytest.approx(scale * base.amplitudes, rel=1e-6)
    assert found.angle_amplitudes == pytest.approx(base.angle_amplitudes, rel=1e-6)


def test_lag_and_mean_of_the_angle_are_those_of_the_strip() -> None:
    found = felt(unit(), 100.0)
    assert found.period is not None
    outputs, angles = found.fundamentals
    own = d_of(np.array([2j * np.pi / found.period]))[0]
    assert abs(angles[0]) < 4.6 / found.loop.reference * abs(outputs[0]) * BENT * abs(own)  # clipped at times
    assert found.lags[0] == pytest.approx(-np.degrees(np.angle(own)), abs=1.0)


def test_a_motion_from_the_cycle_returns_to_it() -> None:
    found = felt(TOGGLING, 100.0)
    assert found.state is not None
    assert found.period is not None
    again = sampled(LoopFlow(found.loop), found.state, np.array([3 * found.period]))[0]
    assert again == pytest.approx(found.state, abs=1e-9)


def test_a_sweep_goes_on_from_rhythm_to_rhythm() -> None:
    found = ilg.reflex(strip="paper", sweep="reflex=1000:100:2", inhibition=4.5)
    assert found.outcomes == ("cycle", "cycle")
    assert found.period[1] == pytest.approx(felt(TOGGLING, 100.0).period, rel=1e-9)
    assert found.lag[1] == pytest.approx(felt(TOGGLING, 100.0).lags[0], abs=1e-4)


_STILL = replace(PAPER, coupling=None, name="still")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"strip": _STILL, "duration": 1}, "no \\[coupling\\]"),
        ({"gain": float("nan"), "duration": 1}, "finite gain"),
        ({"rest_angle": float("inf"), "duration": 1}, "rest angle"),
        ({"reference": 0.0, "duration": 1}, "reference 0"),
        ({"voltage": "0V", "duration": 1}, "voltage"),
        ({}, "duration is missing"),
        ({"duration": 1, "sweep": "reflex=0:1:2"}, "leave out duration"),
        ({"sweep": "tonic=0:1:2"}, "reflex=0:10:21"),
        ({"entrain": -1.0}, "amplitude"),
        ({"entrain": 0.1, "inhibition": 1.2}, "no rhythm to entrain"),
        ({"entrain": 0.1, "engine": "ngspice"}, "engine='ode'"),
        ({"entrain": 0.1, "frequencies": [1e9], "gain": 100}, "frequencies"),
        ({"duration": 1, "engine": "x"}, "engine"),
        ({"duration": 1, "frequencies": [1.0]}, "entrain"),
    ],
)
def test_bad_input_is_told_in_one_line(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        ilg.reflex(**given)
    assert "\n" not in str(error.value)
