"""The exact flow against general ODE solvers, and its search for switches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.flow import ORDER, Flow, sampled, sign_changes
from ilg_circuit.oscillators.network import Network, chain, default_start, ring, unit


def random_network(seed: int) -> tuple[Network, np.ndarray]:
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 7))
    weights = random.uniform(-0.5, 4, (n, n)) * (random.random((n, n)) < 0.8)
    network = Network(
        weights,
        adaptation=float(random.uniform(0, 5)),
        tonic=tuple(random.uniform(-0.5, 2, n).tolist()),
        rise_time=float(10 ** random.uniform(-2, 0)),
        adaptation_time=float(10 ** random.uniform(-2, 0)),
    )
    return network, random.uniform(-1, 1, 2 * n)


@pytest.mark.parametrize("seed", range(6))
def test_the_flow_is_that_of_the_equations(seed: int) -> None:
    """Against DOP853 on the equations as they are written; its kinks cost it some digits."""
    network, start = random_network(seed)
    n, w = network.size, network.matrix

    def equations(_: float, z: np.ndarray) -> np.ndarray:
        x, v = z[:n], z[n:]
        y = np.maximum(0, x)
        dx = (-x - network.adaptation * v - w @ y + network.tonics) / network.rise_time
        return np.concatenate([dx, (-v + y) / network.adaptation_time])

    end = 10 * (network.rise_time + network.adaptation_time)
    times = np.linspace(0, end, 101)
    short = 0.05 * min(network.rise_time, network.adaptation_time)
    other = solve_ivp(equations, (0, end), start, method="DOP853", t_eval=times, rtol=1e-11, atol=1e-13, max_step=short)
    ours = sampled(Flow(network), start, times)
    assert ours == pytest.approx(other.y.T, abs=2e-8 * np.abs(other.y).max())
    assert Flow(network).rate(start) == pytest.approx(equations(0.0, start), rel=1e-12)


def test_a_piece_is_a_matrix_exponential() -> None:
    """Before the first switch, to rounding."""
    network, start = unit(2.5), np.array([0.5, 0.4, 0.1, 0.1])
    flow = Flow(network)
    first = next(s for s in flow.stretches(start, 1.0) if s.switched >= 0)
    time = 0.9 * first.end
    a = np.zeros((5, 5))
    a[:4, :4] = flow.matrix(np.array([True, True]))
    a[:2, 4] = 1 / 0.12
    expected = (expm(a * time) @ np.append(start, 1.0))[:4]
    assert sampled(flow, start, np.array([time]))[0] == pytest.approx(expected, rel=1e-13, abs=1e-14)


def test_every_switch_is_at_zero_and_between_switches_nothing_changes_sign() -> None:
    flow = Flow(ring(5, 3.0))
    switches = 0
    for stretch in flow.stretches(default_start(flow.network), 5.0):
        x = stretch.states(np.linspace(0, stretch.length, 20))[:, :5]
        assert ((x > 1e-14) <= stretch.active).all()
        assert ((x < -1e-14) <= ~stretch.active).all()
        if stretch.switched >= 0:
            switches += 1
            assert abs(stretch.states(stretch.length)[0, stretch.switched]) < 1e-15
    assert switches > 20


def test_the_propagator_is_the_derivative_of_the_flow() -> None:
    """Across switches too, where nothing is added: by differences of neighbouring motions."""
    flow = Flow(ring(3, 2.5))
    start = default_start(flow.network) + 0.01
    total = np.eye(6)
    for stretch in flow.stretches(start, 1.3):
        total = stretch.propagator() @ total
    step = 1e-6
    for k in range(6):
        ends = [sampled(flow, start + sign * step * np.eye(6)[k], np.array([1.3]))[0] for sign in (1, -1)]
        assert total[:, k] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)


def test_samples_do_not_depend_on_each_other() -> None:
    flow, start = Flow(unit()), default_start(unit())
    many = sampled(flow, start, np.linspace(0, 3, 301))
    few = sampled(flow, start, np.array([0.0, 1.0, 3.0]))
    assert many[[0, 100, 300]] == pytest.approx(few, abs=1e-13)
    assert few[0].tolist() == start.tolist()


def test_a_neuron_at_its_threshold_goes_where_its_slope_goes() -> None:
    """x = 0 with x' = 0 as well: the second derivative decides. Here e = d v at first, and v falls."""
    network = Network(np.zeros((2, 2)), adaptation=2.0, tonic=0.25)
    flow = Flow(network)
    first = next(flow.stretches(np.array([0, -1, 0.125, 0.125]), 1.0))
    assert first.active.tolist() == [True, False]
    rising = sampled(flow, np.array([0, -1, 0.125, 0.125]), np.array([0.01]))[0, 0]
    assert rising > 0


def test_nothing_happens_without_input() -> None:
    assert sampled(Flow(unit(tonic=0.0)), np.zeros(4), np.array([0.0, 5.0])).tolist() == np.zeros((2, 4)).tolist()


def test_growth_without_bound_is_told() -> None:
    network = Network([[0, -6.0], [-6.0, 0]])
    with pytest.raises(InputError, match=r"grow without bound.*make the negative weights smaller"):
        sampled(Flow(network), default_start(network), np.array([1000.0]))


def test_a_run_that_would_never_end_is_refused() -> None:
    with pytest.raises(InputError, match="than the 2000000 that are possible"):
        sampled(Flow(unit(rise_time=1e-9)), default_start(unit()), np.array([10.0]))
    with pytest.raises(InputError, match="possible"):
        sampled(Flow(chain(2)), default_start(chain(2)), np.array([np.inf]))


def test_large_networks_take_another_way_to_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """They keep no stacks of matrix powers, which changes nothing but rounding."""
    network, start = random_network(3)
    end = 5 * network.rise_time

    def motion() -> tuple[np.ndarray, np.ndarray]:
        stretches = list(Flow(network).stretches(start, end))
        derivative = np.eye(2 * network.size)
        for stretch in stretches:
            derivative = stretch.propagator() @ derivative
        return stretches[-1].states(stretches[-1].length)[0], derivative

    small = motion()
    monkeypatch.setattr("ilg_circuit.oscillators.flow._LARGEST_STACK", 0)
    large = motion()
    assert large[0] == pytest.approx(small[0], rel=1e-11, abs=1e-13)
    assert large[1] == pytest.approx(small[1], rel=1e-9, abs=1e-11)


def test_steps_do_not_shrink_with_inhibition_that_only_silences() -> None:
    """A loser's state is far below zero, but nothing there is fast."""
    steps = []
    for a in (5.0, 1e6):
        *_, last = Flow(unit(a)).stretches(np.array([0.25, -1.0, 0.25, 0.0]), 5.0)
        steps.append(last.step)
    assert steps[1] == pytest.approx(steps[0], rel=0.05)


def polynomial(roots: list[float]) -> np.ndarray:
    result = np.zeros(ORDER + 1)
    result[: len(roots) + 1] = np.polynomial.polynomial.polyfromroots(roots)
    return result


@given(
    st.lists(st.integers(1, 999), min_size=1, max_size=5, unique=True), st.lists(st.integers(1100, 3000), max_size=3)
)
def test_every_change_of_sign_is_found(inside: list[int], outside: list[int]) -> None:
    roots = sorted(k / 1000 for k in inside)
    found = list(sign_changes(polynomial([*roots, *(k / 1000 for k in outside)])))
    assert found == pytest.approx(roots, abs=1e-9)


def test_changes_of_sign_within_a_length_and_not_at_its_begin() -> None:
    assert list(sign_changes(polynomial([0.0, 0.3, 0.6]), 0.5)) == pytest.approx([0.3], abs=1e-15)
    assert list(sign_changes(polynomial([0.4, 0.4]))) == []  # touches zero
    assert list(sign_changes(polynomial([-0.1, 1.2]))) == []
