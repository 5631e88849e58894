"""States of rest and their eigenvalues, against the matrices and motions themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.oscillators.flow import Flow, sampled
from ilg_circuit.oscillators.network import Network, chain, one_way_ring_weights, ring, unit
from ilg_circuit.oscillators.rest import block_eigenvalues, growth, rest_of_piece, rest_states, strong_components


def random_network(seed: int, most: int = 6) -> Network:
    random = np.random.default_rng(seed)
    n = int(random.integers(2, most + 1))
    weights = random.uniform(-0.5, 5, (n, n)) * (random.random((n, n)) < 0.7)
    times = (float(t) for t in 10 ** random.uniform(-2, 0, 2))
    return Network(weights, float(random.uniform(0, 4)), tuple(random.uniform(-0.3, 2, n).tolist()), *times)


@given(st.integers(0, 10_000))
def test_states_of_rest_are_at_rest(seed: int) -> None:
    network = random_network(seed)
    flow = Flow(network)
    for rest in rest_states(network).states:
        assert np.abs(flow.rate(rest.state)).max() * network.rise_time <= 1e-9 * np.abs(rest.state).max()


@given(st.integers(0, 10_000))
def test_growth_is_that_of_the_matrix(seed: int) -> None:
    network = random_network(seed)
    active = np.random.default_rng(seed).random(network.size) < 0.6
    expected = np.linalg.eigvals(Flow(network).matrix(active)).real.max()
    scale = np.abs(Flow(network).matrix(active)).max()
    # a double eigenvalue of the matrix is known to half the digits only
    assert growth(network, active) == pytest.approx(expected, abs=1e-6 * scale)


@given(st.integers(0, 10_000))
def test_stability_is_what_a_small_disturbance_sees(seed: int) -> None:
    network = random_network(seed)
    for rest in rest_states(network).states:
        away = np.abs(rest.x).min()
        rate = abs(rest.growth)
        slow = 1 / (network.rise_time + network.adaptation_time)
        if rest.edge or away < 1e-3 or rate < 0.05 * slow:
            continue
        push = 1e-7 * away * np.random.default_rng(seed).normal(size=2 * network.size)
        end = sampled(Flow(network), rest.state + push, np.array([8 / rate]))[0]
        grown = np.abs(end - rest.state).max() / np.abs(push).max()
        assert (grown < 1) == rest.stable


def test_every_active_set_of_a_ring_is_counted() -> None:
    """Above the window of three neurons all seven sets have a rest, and the winners alone are stable."""
    found = rest_states(ring(3, 4.5))
    assert found.complete
    assert sorted(s.active for s in found.states) == [(1,), (1, 2), (1, 2, 3), (1, 3), (2,), (2, 3), (3,)]
    assert sorted(s.active for s in found.stable) == [(1,), (2,), (3,)]


@pytest.mark.parametrize("a", [0.5, 2.1, 2.1664, 5.0])
def test_the_one_way_ring_by_hand(a: float) -> None:
    """W has the eigenvalues a times the cube roots of one; the piece's are roots of s^2 Tr Ta + ...; CPG §6.3."""
    rise, fatigue, d = 0.12, 0.3, 3.0
    roots = [
        np.roots([rise * fatigue, rise + fatigue * (1 + a * z), 1 + a * z + d])
        for z in np.exp(2j * np.pi * np.arange(3) / 3)
    ]
    expected = max(r.real.max() for r in roots)
    (rest,) = rest_states(ring(3, a, one_way=True)).states
    assert rest.growth == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert rest.stable == (expected < 0)


def test_a_chain_is_decided_unit_by_unit() -> None:
    """Its 2^30 active sets need not be tried, and equal eigenvalues of fifteen units are not smeared out."""
    found = rest_states(chain(15))
    assert found.complete
    assert not found.stable
    alone = rest_states(unit()).states[0].growth
    (rest,) = rest_states(chain(15, same=0.0, cross=0.1)).states
    assert rest.growth == pytest.approx(alone, rel=1e-9)


def test_equal_eigenvalues_of_a_chain_come_out_equal() -> None:
    w = chain(15, 2.5).matrix
    assert np.sort(block_eigenvalues(w).real) == pytest.approx(np.repeat([-2.5, 2.5], 15), abs=1e-12)
    assert np.ptp(np.linalg.eigvals(w).real) > 5.01  # what they would be otherwise


def test_components_come_after_what_acts_on_them() -> None:
    w = np.zeros((5, 5))
    w[0, 1] = w[1, 0] = 1.0  # 0 and 1 act on each other
    w[0, 4] = 1.0  # 4 acts on 0
    w[3, 1] = 1.0  # 1 acts on 3
    order = strong_components(w)
    assert sorted(map(sorted, order)) == [[0, 1], [2], [3], [4]]
    assert order.index([4]) < order.index([0, 1]) < order.index([3])


def test_what_is_too_large_to_enumerate_is_searched_and_says_so() -> None:
    network = ring(15, 5.0)
    found = rest_states(network)
    assert not found.complete
    assert "search" in found.how
    assert found.stable
    for rest in found.states:
        assert np.abs(Flow(network).rate(rest.state)).max() <= 1e-10
    again = rest_states(network)
    assert [s.active for s in again.states] == [s.active for s in found.states]


def test_the_search_finds_what_enumeration_finds() -> None:
    """A one-way ring has one rest, whatever its length."""
    network = Network(one_way_ring_weights(20, 1.5))
    (rest,) = rest_states(network).states
    assert rest.x == pytest.approx(np.full(20, 1 / 5.5), rel=1e-12)


def test_edges_and_lines_of_states_are_told() -> None:
    found = rest_states(unit(4.0))  # a = 1 + d: the loser at its threshold, and a line of states between the winners
    assert not found.complete
    assert "a line of them" in found.how
    assert all(s.edge and not s.stable for s in found.states)
    (rest,) = rest_states(unit(1.4)).states  # a = 1 + Tr/Ta: neither growth nor decay
    assert rest.marginal
    assert not rest.stable


def test_a_silent_network() -> None:
    (rest,) = rest_states(unit(tonic=-1.0)).states
    assert rest.active == ()
    assert rest.growth == pytest.approx(-1 / 0.3)
    assert rest.x.tolist() == [-1, -1]
    assert rest_of_piece(unit(tonic=-1.0), np.array([True, False])) is None
