"""Time grids: ascending, evenly subdivided, with every sample where it belongs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve.grid import Grid, design_grid, representatives
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER

POLES = state_space([strip_netlist(PAPER)]).poles()[0]


def grid_of(drive: str, duration: float, count: int = 61, *, interpolate: bool = True, theta: float = 0.3) -> Grid:
    samples = np.linspace(0, duration, count)
    return design_grid(POLES, parse_drive(drive, duration), samples, theta, interpolate=interpolate)


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:1V,0.1Hz", "ramp:1V/s"])
@pytest.mark.parametrize("count", [2, 61, 5001])
@pytest.mark.parametrize("interpolate", [True, False])
def test_grid_covers_the_run(drive: str, count: int, interpolate: bool) -> None:
    grid = grid_of(drive, 95.0, count, interpolate=interpolate)
    assert grid.nodes[0] == 0
    assert grid.nodes[-1] == 95.0
    assert (np.diff(grid.nodes) > 0).all()
    on_node = grid.index >= 0
    assert grid.nodes[grid.index[on_node]] == pytest.approx(grid.samples[on_node], rel=1e-12, abs=1e-9)
    assert on_node.all() or interpolate
    assert grid.unevenness <= 100


@given(log_floats(1e-3, 1e4), log_floats(1e-2, 1.0), st.integers(2, 200))
def test_grids_ascend_for_any_run(duration: float, theta: float, count: int) -> None:
    samples = np.linspace(0, duration, count)
    drive = PiecewiseLinear(np.array([0, 0.3, 0.3, 0.9]) * duration, np.array([0.0, 1.0, 3.0, -1.0]))
    grid = design_grid(POLES, drive, samples, theta)
    assert (np.diff(grid.nodes) > 0).all()
    assert grid.nodes[-1] == duration
    for part in (2, 3, 4):
        finer = grid.subdivided(part)
        assert len(finer) == part * (len(grid.nodes) - 1) + 1
        assert finer[::part] == pytest.approx(grid.nodes, rel=1e-15, abs=0)
        assert (np.diff(finer) > 0).all()


def test_a_jump_lies_within_one_step_that_no_mode_notices() -> None:
    edges = parse_drive("square:4V,30s", 95.0).breakpoints(95.0)
    grid = grid_of("square:4V,30s", 95.0)
    for edge in edges:
        before, after = grid.nodes[grid.nodes < edge].max(), grid.nodes[grid.nodes > edge].min()
        assert after - before <= 1e-3 / np.abs(POLES).max()
        assert before + after == pytest.approx(2 * edge, rel=1e-12)
    for first, last in grid.segments:
        assert not ((edges > grid.nodes[first]) & (edges < grid.nodes[last])).any()


@pytest.mark.parametrize("count", [20, 191, 5001])
def test_every_sample_belongs_to_the_piece_that_begins_with_it_or_before(count: int) -> None:
    edges = np.concatenate([[0.0], parse_drive("square:4V,30s", 95.0).breakpoints(95.0), [95.1]])
    grid = grid_of("square:4V,30s", 95.0, count)
    for k, sample in enumerate(grid.samples):
        assert edges[grid.piece[k]] <= sample < edges[grid.piece[k] + 1]


def test_steps_follow_the_fastest_mode_and_then_grow() -> None:
    nodes = grid_of("step:4V", 300.0, 2).nodes
    steps = np.diff(nodes)
    fastest = np.abs(POLES).max()
    assert steps[nodes[:-1] < 1 / fastest].max() <= 0.35 / fastest
    assert steps.max() > 10 / fastest


@pytest.mark.parametrize("frequency", [0.1, 5.0])
def test_steps_follow_a_sine_to_the_end(frequency: float) -> None:
    nodes = grid_of(f"sine:1V,{frequency}Hz", 100.0, 2).nodes
    assert np.diff(nodes).max() <= 0.31 / (2 * np.pi * frequency)


@pytest.mark.parametrize("theta", [0.05, 0.2, 0.8])
def test_a_finer_grid_has_more_nodes(theta: float) -> None:
    coarse, fine = (len(grid_of("step:4V", 300.0, 2, theta=part * theta).nodes) for part in (1.0, 0.5))
    assert fine > 1.6 * coarse


def test_small_corners_need_fewer_nodes_than_large_ones() -> None:
    """A fast mode is excited by the change of slope over its rate."""
    poles = -np.geomspace(1e-2, 1e4, 25).astype(complex)
    t = np.linspace(0.0, 100.0, 401)
    sine, zigzag = np.sin(2 * np.pi * t / 20), (-1.0) ** np.arange(401)
    few, many = (len(design_grid(poles, PiecewiseLinear(t, u), t, 0.3).nodes) for u in (sine, zigzag))
    assert few < 0.8 * many


def test_modes_that_corners_hardly_excite_take_no_nodes() -> None:
    """A ladder's modes of three more decades are not followed after the corners of a polygon."""
    t = np.linspace(0.0, 100.0, 401)
    drive = PiecewiseLinear(t, np.sin(2 * np.pi * t / 20))
    slow, fast = (len(design_grid(-np.geomspace(1e-2, end, 25) + 0j, drive, t, 0.3).nodes) for end in (1e6, 1e9))
    assert fast < 1.1 * slow


def test_a_circuit_without_poles_still_has_a_grid() -> None:
    none = np.empty(0, dtype=complex)
    grid = design_grid(none, parse_drive("step:1V", 5.0), np.linspace(0, 5, 11), 0.3)
    assert set(np.linspace(0, 5, 11)) <= set(grid.nodes)


def test_a_run_that_nobody_could_wait_for_is_refused() -> None:
    """An oscillation at 1 THz, for a hundred seconds."""
    poles = np.array([1e12j, -1e12j])
    with pytest.raises(SolveError, match="too fast for a run of 100 s"):
        design_grid(poles, PiecewiseLinear.step(1.0), np.linspace(0.0, 100.0, 11), 0.3)


@given(st.lists(st.tuples(log_floats(1e-3, 90.0), st.sampled_from([0.0, 1e-16, 1e-13, 1e-6, 1e-3])), max_size=9))
def test_nodes_at_bends_are_apart_from_all_others(bends: list[tuple[float, float]]) -> None:
    grid = grid_of("square:4V,30s", 95.0)
    times = np.unique([t * (1 + shift) for t, shift in bends for shift in (0.0, shift)])
    bent = grid.bent(times)
    assert np.isin(grid.nodes, bent.nodes).all()
    assert np.diff(bent.nodes).min() >= min(np.diff(grid.nodes).min(), 1e-12 * 95.0)
    finest = np.diff(bent.nodes)[np.isin(bent.nodes[1:], times) | np.isin(bent.nodes[:-1], times)]
    assert (finest > 1e-13 * 95.0).all()


def test_a_few_modes_stand_for_many_as_fast_and_no_sooner_gone() -> None:
    draw = np.random.default_rng(8)
    modes = -(10 ** draw.uniform(-2, 3, 400)) * np.exp(1j * draw.uniform(-1.5, 1.5, 400))
    few = representatives(modes)
    assert len(few) <= 51  # five decades, by tenths
    assert np.abs(few).max() == pytest.approx(np.abs(modes).max(), rel=1e-12)
    for mode in modes:
        near = few[np.abs(np.log10(np.abs(few) / abs(mode))) < 0.1]
        assert ((np.abs(near) >= abs(mode) * (1 - 1e-12)) & (near.real >= mode.real)).any()
    assert (representatives(modes[:24]) == modes[:24]).all()
