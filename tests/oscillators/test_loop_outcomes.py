"""What becomes of neurons with a reflex: rests whose modes are no basis, and neurons that feel nothing."""

from __future__ import annotations

import every_model
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import ilg_circuit as ilg
from ilg_circuit.oscillators.flow import Flow
from ilg_circuit.oscillators.loop_rhythm import _Follower, loop_rhythm
from ilg_circuit.oscillators.network import Network, chain, default_start, ring, unit
from ilg_circuit.oscillators.reflex import LoopFlow, looped
from ilg_circuit.oscillators.rest import Ellipsoid
from ilg_circuit.oscillators.rhythm import rhythm
from ilg_circuit.strip.actuator import PAPER


def test_a_rest_whose_modes_are_no_basis_is_a_rest() -> None:
    """Silent neurons share one rate, so that the piece has too few eigenvectors; it was said to be undecided."""
    strip = every_model.strip_of("rc2")
    run = ilg.reflex("1 s", strip, -2, weights=[[0, 2.5, 0], [0, 0, 2.5], [2.5, 0, 0]], tonic=0.1, samples=11)
    assert run.rhythm is not None
    assert run.rhythm.outcome == "rest"
    assert run.rhythm.state is not None
    flow = run.rhythm.flow
    start, end = flow.start(default_start(run.loop.network)), run.rhythm.settled + 300
    late = solve_ivp(lambda t, z: flow.rate(z), (0, end), start, "LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
    assert late == pytest.approx(run.rhythm.state, abs=1e-5 * np.abs(run.rhythm.state).max())


def test_the_winners_of_a_chain_without_adaptation_stay() -> None:
    """A pair without adaptation toggles once: its winner goes to e/(1 + d) = 1, and its strip to its own limit."""
    found = loop_rhythm(looped(chain(15, adaptation=0.0), PAPER, 0.0))
    assert found.outcome == "rest"
    assert found.state is not None
    assert np.maximum(found.state[:2], 0) == pytest.approx([1.0, 0.0], abs=1e-12)
    assert found.flow.rate(found.state) == pytest.approx(np.zeros(len(found.state)), abs=1e-12)


@pytest.mark.parametrize("network", [unit(), ring(3), chain(3), unit(tonic=0.3)])
def test_without_feedback_the_cycle_is_the_one_that_the_motion_reaches(network: Network) -> None:
    loop = looped(network, PAPER, 0.0)
    found, flow, start = loop_rhythm(loop), LoopFlow(loop), default_start(network)
    followed = _Follower(flow, start).run(flow.start(start))
    assert found.outcome == followed.outcome == "cycle"
    assert found.period == pytest.approx(followed.period, rel=1e-10)
    assert found.multiplier == pytest.approx(followed.multiplier, abs=1e-9)
    assert found.amplitudes == pytest.approx(followed.amplitudes, rel=1e-9)
    assert found.angle_amplitudes == pytest.approx(followed.angle_amplitudes, rel=1e-9)
    assert found.lags == pytest.approx(followed.lags, abs=1e-6)


def test_without_feedback_a_rest_is_the_one_that_the_motion_reaches() -> None:
    loop = looped(unit(4.5), PAPER, 0.0)
    found, flow, start = loop_rhythm(loop), LoopFlow(loop), default_start(loop.network)
    followed = _Follower(flow, start).run(flow.start(start))
    assert found.outcome == followed.outcome == "rest"
    assert found.state == pytest.approx(followed.state, abs=1e-12)
    assert found.rest_angles == pytest.approx(followed.rest_angles, rel=1e-9)


@pytest.mark.parametrize(("count", "inhibition"), [(2, 1.0), (3, 1.0), (5, 1.0)])
def test_a_motion_that_stands_still_on_a_line_of_rests_is_said_to_be_on_the_edge(count: int, inhibition: float) -> None:
    """Without adaptation and with a = 1 two neurons rest wherever y_1 + y_2 = e; followed, it took 100,000 steps."""
    found = rhythm(ring(count, inhibition, adaptation=0.0) if count > 2 else unit(inhibition, adaptation=0.0))
    assert found.outcome == "undecided"
    assert found.cause.code == "cpg-edge"
    assert found.settled < 10
    assert found.swing.tolist() == [0.0]


@pytest.mark.parametrize("seed", range(5))
def test_no_motion_leaves_an_ellipsoid(seed: int) -> None:
    """Motions that start on its surface never reach the room of a gate."""
    random = np.random.default_rng(seed)
    a = np.triu(random.normal(size=(6, 6)), 1) - np.eye(6)  # one rate, one eigenvector
    gates, room = random.normal(size=(3, 6)), random.uniform(0.5, 2, 3)
    kept, flows = Ellipsoid(a, gates, room), [expm(a * t) for t in np.linspace(0, 20, 300)]
    for direction in random.normal(size=(20, 6)):
        sizes = np.geomspace(1e-6, 1e3, 2000)
        held = [kept.holds(size * direction) for size in sizes]
        away = sizes[np.flatnonzero(held)[-1]] * direction
        assert (np.abs(gates @ np.stack([later @ away for later in flows], axis=1)) < room[:, None]).all()


@pytest.mark.parametrize(("rate", "proven"), [(-1.0, True), (-0.2, True), (1e-3, False)])
def test_an_ellipsoid_is_proven_where_all_modes_decay(rate: float, proven: bool) -> None:
    """One rate in a chain of eight modes, which are no basis."""
    a = rate * np.eye(8) + np.eye(8, k=1)
    kept = Ellipsoid(a, np.eye(8), np.ones(8))
    assert kept.proven is proven
    assert kept.holds(np.full(8, 1e-12)) is proven


@pytest.mark.parametrize("length", [1.0, 0.37, 1e-9])
def test_the_exponential_of_many_states(length: float) -> None:
    flow = Flow(chain(15))
    piece = flow._series(default_start(flow.network)[:30] > 0)
    assert piece.rows is None
    assert piece.exponential(length) == pytest.approx(expm(piece.matrix * length), abs=1e-14)
