"""Where networks go in the end: against long motions, and laws that hold for all networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.flow import Flow, sampled
from ilg_circuit.oscillators.network import Network, chain, ring, unit
from ilg_circuit.oscillators.outcome import Rhythm
from ilg_circuit.oscillators.rhythm import rhythm

FEW = settings(max_examples=25)


@st.composite
def networks(draw: st.DrawFn) -> tuple[Network, np.ndarray]:
    """Two to five neurons, any weights of inhibition and some of weak excitation, from anywhere."""
    random = np.random.default_rng(draw(st.integers(0, 10_000)))
    n = int(random.integers(2, 6))
    weights = random.uniform(-0.3, random.uniform(1, 8), (n, n)) * (random.random((n, n)) < 0.8)
    np.fill_diagonal(weights, 0)
    ratio = float(10 ** random.uniform(-1, 0.3))
    network = Network(weights, float(random.uniform(1, 5)), rise_time=0.3 * ratio, adaptation_time=0.3)
    return network, random.uniform(-0.5, 1, 2 * n)


def decided(network: Network, start: np.ndarray) -> Rhythm:
    found = rhythm(network, start)
    assume(found.outcome in ("cycle", "rest"))
    return found


@FEW
@given(networks())
def test_the_end_is_where_a_long_motion_is(case: tuple[Network, np.ndarray]) -> None:
    network, start = case
    found = decided(network, start)
    size = np.abs(network.tonics).max()
    flow = Flow(network)
    if found.rest is not None:
        decay = -next(s for s in found.rest_states.states if np.allclose(s.state, found.rest)).growth
        end = found.settled + 20 / decay
        assume(end < 2000 * min(network.rise_time, network.adaptation_time))
        assert sampled(flow, start, np.array([end]))[0] == pytest.approx(found.rest, abs=1e-6 * size)
        assert found.amplitude == 0
        return
    assert found.cycle is not None
    assert found.period is not None
    wait = np.log(1e-7) / np.log(max(found.cycle.multiplier, 1e-7)) * found.period
    long = found.settled + wait + 2 * found.period
    assume(long < 2000 * min(network.rise_time, network.adaptation_time))
    late = found.settled + wait + np.linspace(0, found.period, 20001)
    states = sampled(flow, start, late)
    assert states[-1] == pytest.approx(states[0], abs=1e-5 * size)  # it repeats after the period
    y = np.maximum(states[:, :2], 0)
    assert np.ptp(y[:, 0] - y[:, 1]) / 2 == pytest.approx(found.amplitude, abs=1e-4 * size)
    half = states[np.abs(states - states[0]).max(axis=1).argmax()]
    assert np.abs(half - states[0]).max() > 1e-3 * size  # and it does move


@FEW
@given(networks(), st.floats(0.1, 10.0))
def test_input_and_start_scale_the_amplitude(case: tuple[Network, np.ndarray], factor: float) -> None:
    network, start = case
    base = decided(network, start)
    found = rhythm(replace(network, tonic=factor), start * factor)
    assert found.outcome == base.outcome
    assert found.amplitude == pytest.approx(factor * base.amplitude, rel=1e-8)
    if base.period is not None:
        assert found.period == pytest.approx(base.period, rel=1e-8)


@FEW
@given(networks(), st.floats(1e-3, 1e3))
def test_both_times_scale_the_period(case: tuple[Network, np.ndarray], factor: float) -> None:
    network, start = case
    base = decided(network, start)
    times = {"rise_time": factor * network.rise_time, "adaptation_time": factor * network.adaptation_time}
    found = rhythm(replace(network, **times), start)
    assert found.outcome == base.outcome
    assert found.amplitude == pytest.approx(base.amplitude, rel=1e-8)
    if base.period is not None:
        assert found.period == pytest.approx(factor * base.period, rel=1e-8)


@FEW
@given(networks(), st.randoms(use_true_random=False))
def test_names_of_neurons_do_not_matter(case: tuple[Network, np.ndarray], random: object) -> None:
    """Neurons in another order, their weights and start with them."""
    network, start = case
    base = decided(network, start)
    n = network.size
    order = np.array(random.sample(range(n), n))  # type: ignore[attr-defined]
    place = np.argsort(order)  # where a neuron has gone
    moved = Network(
        network.matrix[np.ix_(order, order)],
        network.adaptation,
        network.tonic,
        network.rise_time,
        network.adaptation_time,
        units=((int(place[0]), int(place[1])),),
    )
    found = rhythm(moved, np.concatenate([start[:n][order], start[n:][order]]))
    assert found.outcome == base.outcome
    assert found.amplitude == pytest.approx(base.amplitude, rel=1e-7, abs=1e-9)
    if base.period is not None:
        assert found.period == pytest.approx(base.period, rel=1e-8)


@settings(max_examples=12)
@given(networks(), st.floats(0.0, 2.0))
def test_a_cycle_is_the_same_from_each_of_its_points(case: tuple[Network, np.ndarray], part: float) -> None:
    network, start = case
    base = decided(network, start)
    assume(base.cycle is not None)
    assert base.cycle is not None
    assume(base.cycle.multiplier < 0.9)
    on_it = sampled(Flow(network), base.cycle.state, np.array([part * base.cycle.period]))[0]
    found = rhythm(network, on_it)
    assert found.period == pytest.approx(base.period, rel=1e-9)
    assert found.amplitude == pytest.approx(base.amplitude, rel=1e-8, abs=1e-11)


def test_the_multiplier_is_what_is_left_of_a_disturbance() -> None:
    found = rhythm(ring(3, 2.2, one_way=True))
    assert found.cycle is not None
    flow, period = Flow(found.network), found.cycle.period
    later = np.array([0.0, 20 * period, 20.5 * period, 21 * period, 22 * period])
    state = found.cycle.state
    pushed = sampled(flow, state + 1e-3 * np.eye(6)[4], later)
    # the disturbance along the motion stays, so differences of returns show what dies
    first = np.abs(pushed[3] - pushed[1]).max()
    second = np.abs(pushed[4] - pushed[3]).max()
    assert second / first == pytest.approx(found.cycle.multiplier, abs=0.1)
    assert found.cycle.multiplier < 1


@pytest.mark.parametrize(
    ("network", "lags"),
    [
        (ring(3, 3.0, one_way=True), [0, 120, 240]),
        (ring(5, 2.5), [0, 144, 288, 72, 216]),
        (ring(4, 2.5, one_way=True), [0, 180, 0, 180]),
        (ring(5, 3.0, one_way=True), [0, 144, 288, 72, 216]),
    ],
    ids=["one-way 3", "5", "one-way 4", "one-way 5"],
)
def test_phases_of_rings(network: Network, lags: list[float]) -> None:
    """Evenly spread, in one sense or the other."""
    found = np.mod(rhythm(network).phase_lags, 360)
    either = [np.abs(np.mod(found - sense * np.array(lags) + 180, 360) - 180).max() for sense in (1, -1)]
    assert min(either) < 1e-6


def test_a_ring_of_four_has_winners_that_are_not_neighbours() -> None:
    found = rhythm(ring(4, 2.5))
    assert found.outcome == "rest"
    assert found.rest is not None
    assert np.maximum(found.rest[:4], 0) == pytest.approx([0.25, 0, 0.25, 0], abs=1e-12)
    assert found.amplitude == 0
    assert found.period is None
    assert np.isnan(found.phase_lags).all()


def test_a_silent_neuron_has_no_phase() -> None:
    w = np.zeros((3, 3))
    w[0, 1] = w[1, 0] = 2.5
    w[2, :2] = 30.0
    lags = rhythm(Network(w)).phase_lags
    assert lags[:2] == pytest.approx([0, 180], abs=1e-6)
    assert np.isnan(lags[2])


@pytest.mark.parametrize("a", [1.41, 2.0, 3.0, 3.9])
def test_period_and_amplitude_against_a_general_solver(a: float) -> None:
    """DOP853 with the upward passages of y_1 = y_2 as events, nothing of this package in it."""
    d, rise, fatigue = 3.0, 0.12, 0.3

    def equations(_: float, z: np.ndarray) -> list[float]:
        y1, y2 = max(0.0, z[0]), max(0.0, z[1])
        return [
            (-z[0] - d * z[2] - a * y2 + 1) / rise,
            (-z[1] - d * z[3] - a * y1 + 1) / rise,
            (-z[2] + y1) / fatigue,
            (-z[3] + y2) / fatigue,
        ]

    def passage(_: float, z: np.ndarray) -> float:
        return float(z[0] - z[1])

    passage.direction = 1.0  # type: ignore[attr-defined]
    found = rhythm(unit(a))
    assert found.period is not None
    end = found.settled + 12 * found.period
    run = solve_ivp(
        equations, (0, end), [0.12, 0, 0, 0], method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.01, events=passage
    )
    assert np.diff(run.t_events[0])[-1] == pytest.approx(found.period, rel=1e-6)
    late = run.t > end - 2 * found.period
    y = np.maximum(run.y[:2, late], 0)
    assert np.ptp(y[0] - y[1]) / 2 == pytest.approx(found.amplitude, rel=1e-3)


def test_neurons_alike_are_told_when_their_cycle_is_unstable() -> None:
    found = rhythm(ring(3), [0.12, 0, 0, 0, 0, 0])
    assert found.outcome == "cycle"
    assert found.cycle is not None
    assert not found.cycle.stable
    assert "neurons 2 = 3 have equal initial states" in found.warnings[0]
    states = sampled(Flow(ring(3)), found.cycle.state, np.array([found.cycle.period]))
    assert states[0] == pytest.approx(found.cycle.state, abs=1e-9)


def test_just_on_an_edge_it_is_not_decided() -> None:
    for a in (1.4, 4.0):
        found = rhythm(unit(a))
        assert found.outcome == "undecided"
        assert found.oscillates is None
        assert "edge" in found.reason


def test_units_that_do_not_touch_keep_their_phases() -> None:
    """ks = kc = 0: a cycle for each phase between the units; the period is that of one."""
    start = np.zeros(8)
    start[0], start[3] = 0.12, 0.05
    found = rhythm(chain(2, same=0.0, cross=0.0), start)
    assert found.outcome == "cycle"
    assert found.period == pytest.approx(rhythm(unit()).period, rel=1e-9)
    assert "one of a family" in found.warnings[0]


def test_a_motion_without_a_rhythm_is_called_irregular() -> None:
    """Two units of unlike pace that do not touch: quasi-periodic."""
    w = np.zeros((4, 4))
    w[0, 1] = w[1, 0] = 2.5
    w[2, 3] = w[3, 2] = 2.0 * np.sqrt(2)
    found = rhythm(Network(w), [0.12, 0, 0.1, 0, 0, 0, 0, 0])
    assert found.outcome == "irregular"
    assert found.oscillates
    assert found.period is None
    assert found.amplitude == pytest.approx(rhythm(unit()).amplitude, rel=1e-3)
    assert "no stable state of rest" in found.reason


@pytest.mark.parametrize("a", [1e3, 1e8])
def test_strong_inhibition_is_no_obstacle(a: float) -> None:
    """The winner takes e/(1 + d); a one-way ring's period goes on growing, by as much for each factor of ten."""
    winner = rhythm(unit(a))
    assert winner.rest is not None
    assert np.maximum(winner.rest[:2], 0) == pytest.approx([0.25, 0], abs=1e-9)
    periods = [rhythm(ring(3, a * factor, one_way=True)).period for factor in (1, 10, 100)]
    assert None not in periods
    steps = np.diff(np.array(periods, dtype=float))
    assert steps[0] == pytest.approx(steps[1], rel=0.02)


def test_time_constants_far_apart() -> None:
    """Tr << Ta: a relaxation oscillation, the period of which no longer depends on Tr."""
    slow, slower = (rhythm(unit(rise_time=tr, adaptation_time=1.0)).period for tr in (2e-3, 1e-3))
    assert slow == pytest.approx(slower, rel=0.01)


def test_time_constants_too_far_apart_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ilg_circuit.oscillators.rhythm.MOST_STEPS", 1000)
    monkeypatch.setattr("ilg_circuit.oscillators.rhythm._MOST_STIFF_STEPS", 1000)
    found = rhythm(unit(rise_time=1e-4, adaptation_time=1.0))
    assert found.outcome == "undecided"
    assert "too far apart" in found.reason


def test_near_an_edge_the_period_is_the_least() -> None:
    """The modes of the symmetric ring sort themselves out so slowly that a multiple of the cycle is found first."""
    found = rhythm(ring(3, 1.4001))
    assert found.period == pytest.approx(rhythm(unit(1.4001)).period, rel=1e-4)
    assert sorted(found.phase_lags) == pytest.approx([-120, 0, 120], abs=1e-5)


def test_no_input_no_motion() -> None:
    found = rhythm(unit(tonic=0.0))
    assert found.outcome == "rest"
    assert found.rest == pytest.approx(np.zeros(4))
    silent = rhythm(unit(tonic=-1.0))
    assert silent.outcome == "rest"
    assert silent.rest == pytest.approx([-1, -1, 0, 0])


def test_the_reason_names_the_neurons_of_the_whole_network() -> None:
    assert "active neurons: 1, 2, 3 (decay" in rhythm(ring(3), [0.1] * 3 + [0.0] * 3).reason
    assert "active neurons: none" in rhythm(ring(3, tonic=-1.0)).reason


def test_a_start_that_is_none() -> None:
    with pytest.raises(InputError, match="need 4"):
        rhythm(unit(), [1.0])
