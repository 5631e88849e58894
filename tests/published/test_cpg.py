"""Golden numbers and exact laws of the central pattern generator with the constants of CPG §6.3 (a = 2.5 assumed)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.closed_forms import describing_frequency, window
from ilg_circuit.oscillators.network import Network, chain, ring, unit
from ilg_circuit.oscillators.rhythm import rhythm


def test_the_papers_unit() -> None:
    found = rhythm(unit())
    assert found.outcome == "cycle"
    assert found.period == pytest.approx(1.035463, abs=5e-7)
    assert found.amplitude == pytest.approx(0.462008, abs=5e-7)
    assert found.phase_lags == pytest.approx([0, 180], abs=1e-6)


def test_the_window() -> None:
    low, high = window(3.0, 0.12, 0.3)
    assert (low, high) == pytest.approx((1.4, 4.0), rel=1e-15)


@pytest.mark.parametrize(
    ("build", "away"),
    [(unit, 1e-5), (unit, 1e-3), (unit, 0.05), (lambda a: ring(3, a), 1e-3), (lambda a: ring(3, a), 0.05)],
)
def test_it_oscillates_just_within_the_window(build: Callable[[float], Network], away: float) -> None:
    low, high = window(3.0, 0.12, 0.3)
    assert rhythm(build(low + away)).outcome == "cycle"
    assert rhythm(build(low - away)).outcome == "rest"
    assert rhythm(build(high - away)).outcome == "cycle"


@pytest.mark.parametrize("away", [1e-4, 1e-3, 0.05, 10.0])
def test_above_the_window_one_neuron_wins(away: float) -> None:
    found = rhythm(unit(4.0 + away))
    assert found.outcome == "rest"
    assert found.rest is not None
    winner, loser = sorted(np.maximum(found.rest[:2], 0))[::-1]
    assert (winner, loser) == pytest.approx((0.25, 0.0), abs=1e-12)  # e/(1 + d)


def test_below_the_window_both_rest_alike() -> None:
    found = rhythm(unit(1.0))
    assert found.rest == pytest.approx(np.full(4, 1 / (1 + 3 + 1.0)), rel=1e-12)


def test_the_bidirectional_ring_is_bistable_above_its_window() -> None:
    moving = rhythm(ring(3, 4.10))
    assert moving.outcome == "cycle"
    assert len(moving.rest_states.stable) == 3
    assert rhythm(ring(3, 4.12)).outcome == "rest"
    assert rhythm(ring(3, 4.10), [1, 0, 0, 0, 0.25, 0]).outcome == "rest"


def test_the_one_way_ring_starts_at_its_onset_and_never_stops() -> None:
    assert rhythm(ring(3, 2.1663, one_way=True)).outcome == "rest"
    onset = rhythm(ring(3, 2.1664, one_way=True))
    assert onset.outcome == "cycle"
    assert onset.period == pytest.approx(0.3183, abs=5e-5)
    for a in (3.0, 30.0, 300.0):
        far = rhythm(ring(3, a, one_way=True))
        assert far.outcome == "cycle"
        assert sorted(far.phase_lags) == pytest.approx([-120, 0, 120], abs=1e-6)


def test_the_chain_locks_at_its_angle() -> None:
    found = rhythm(chain(15, same=0.1, cross=0.1))
    assert found.unit_lags[3:] == pytest.approx(np.full(12, 24.1), abs=0.05)
    assert found.unit_lags[1:].sum() == pytest.approx(360, abs=30)  # about one body length
    assert found.period == pytest.approx(rhythm(unit()).period, rel=1e-10)  # the tail sets the pace


def equal(size: int) -> list[float]:
    return [0.12] * size + [0.0] * size


@pytest.mark.parametrize("size", [2, 3, 4, 5, 8])
@pytest.mark.parametrize("one_way", [False, True])
def test_equal_starts_never_oscillate(size: int, one_way: bool) -> None:
    network = ring(size, 2.5, one_way=one_way)
    found = rhythm(network, equal(size))
    assert found.outcome == "rest"
    assert found.rest is not None
    received = network.matrix[0].sum()
    assert found.rest == pytest.approx(np.full(2 * size, 1 / (4 + received)), rel=1e-9)
    assert any("give them different initial states" in line for line in found.warnings)


@pytest.mark.parametrize("factor", [1e-6, 0.3, 7.0, 1e6])
def test_tonic_input_scales_the_amplitude_and_leaves_the_period(factor: float) -> None:
    base = rhythm(unit())
    found = rhythm(unit(tonic=factor), base.start * factor)
    assert found.period == pytest.approx(base.period, rel=1e-9)
    assert found.amplitude == pytest.approx(factor * base.amplitude, rel=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 0.3, 7.0, 1e6])
def test_time_constants_scale_the_period_and_leave_the_amplitude(factor: float) -> None:
    base = rhythm(unit())
    found = rhythm(unit(rise_time=0.12 * factor, adaptation_time=0.3 * factor))
    assert found.period == pytest.approx(factor * base.period, rel=1e-9)
    assert found.amplitude == pytest.approx(base.amplitude, rel=1e-9)


def test_a_slower_rise_ends_the_cycle() -> None:
    """CPG §6.4.2: "a smaller frequency destroys the limit cycle", at Tr = Ta (a - 1)."""
    edge = 0.3 * (2.5 - 1)
    assert rhythm(unit(rise_time=edge * 0.999)).outcome == "cycle"
    assert rhythm(unit(rise_time=edge * 1.001)).outcome == "rest"


@pytest.mark.parametrize("a", np.linspace(1.5, 3.0, 7))
def test_the_describing_function_is_near(a: float) -> None:
    found = rhythm(unit(a))
    assert found.period is not None
    assert 2 * math.pi / found.period == pytest.approx(describing_frequency(a, 3.0, 0.12, 0.3), rel=0.02)


def test_the_describing_function_refuses_what_it_cannot() -> None:
    with pytest.raises(InputError, match="has no frequency"):
        describing_frequency(50.0, 3.0, 0.12, 0.3)
