"""Samples of a transient: on edges, at the ends, few, many and irregular; and the accuracy asked for."""

from __future__ import annotations

import numpy as np
import pytest
from engines import AGREEMENT, DRIVES, assert_engines_agree, largest_difference
from numpy.typing import NDArray

from ilg_circuit.circuit import electrical_netlist, strip_netlist
from ilg_circuit.errors import InputError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.solve.grid import design_grid
from ilg_circuit.solve.sampling import _interpolated
from ilg_circuit.strip.actuator import PAPER

Array = NDArray[np.float64]


# -- samples -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
@pytest.mark.parametrize("duration", [45.0, 75.0, 80.0])
def test_samples_on_edges_are_right_limits(engine: str, duration: float) -> None:
    """Also where the run ends on an edge (45 s, 75 s)."""
    net = electrical_netlist(600.0, ((20.0, 0.1),))
    drive = parse_drive("square:4V,30s", duration)
    edges = np.arange(0, duration + 1, 15.0)
    found = transient(net, drive, edges, engine=engine).output("current")
    left = transient(net, drive, np.append(edges[1:] - 1e-9, duration), engine="exact").output("charge")[:-1] / 0.1
    voltage = np.where(np.arange(len(edges)) % 2, 0.0, 4.0)
    expected = voltage / 600 + (voltage - np.insert(left, 0, 0.0)) / 20
    assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_the_end_of_a_run_is_as_good_as_its_middle(engine: str) -> None:
    """A run that stops on an edge has the same past as one that goes on."""
    t = np.arange(0, 45.5, 0.5)
    net = strip_netlist(PAPER)
    short = transient(net, parse_drive("square:4V,30s", 45.0), t, engine=engine)
    long = transient(net, parse_drive("square:4V,30s", 90.0), np.arange(0, 90.5, 0.5), engine=engine)
    before = len(t) - 1
    scale = np.abs(long.values).max(axis=2, keepdims=True) + 1e-300
    assert (np.abs(short.values - long.values[:, :, : len(t)])[..., :before] <= AGREEMENT * scale).all()


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7, 1.1])
def test_engines_agree_on_samples_that_all_but_hit_an_edge(period: float) -> None:
    """An edge at 3*0.1 s and a sample at 0.3 s differ in the last bit and mean the same."""
    drive = parse_drive(f"square:4V,{period}s", 10 * period)
    assert_engines_agree(electrical_netlist(666.0, ((20.0, 0.35),)), drive, np.linspace(0, 10 * period, 201))


@pytest.mark.parametrize("apart", [1e-5, 1e-8, 1e-11])
def test_two_samples_next_to_each_other_do_not_spoil_those_that_follow(apart: float) -> None:
    """A capacitor's current over a short step is rounded, and a long step after it took that on: 2e-6 of the peak."""
    net, drive = electrical_netlist(600.0, ((20.0, 0.1),)), parse_drive("ramp:1V/s", 4.0)
    t = np.array([1.0, 1.0 + apart, 2.0, 3.0, 4.0])
    found = transient(net, drive, t)
    expected = t / 600 + 0.1 * -np.expm1(-t / 2.0)
    error = np.abs(found.output("current") - expected).max() / expected.max()
    assert error <= found.errors[0, found.names.index("current")] < 1e-7


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
@pytest.mark.parametrize("times", [[0.0], [0.0, 100.0], [0.0, 1e-6, 50.0]])
def test_the_sample_at_zero_is_the_right_limit(engine: str, times: list[float]) -> None:
    waves = transient(strip_netlist(PAPER), parse_drive("step:4V", 100.0), times, engine=engine)
    assert waves.output("current")[0] == pytest.approx(0.2118, rel=1e-7)
    assert waves.output("charge")[0] == pytest.approx(0.0, abs=1e-7 * 1.4)
    assert waves.output("displacement")[0] == pytest.approx(0.0, abs=1e-7 * 4e-3)


@pytest.mark.parametrize("times", [[7.0], [99.9, 100.0], [1e-3], [1e-3, 1.0, 1.0 + 1e-6, 60.0]])
def test_few_and_irregular_samples(times: list[float]) -> None:
    net, drive = electrical_netlist(666.0, ((20.0, 0.35),)), parse_drive("step:4V", 100.0)
    found = transient(net, drive, times).output("current")
    expected = 4 * formulas.current_step(times, *formulas.current_constants(666.0, 20.0, 0.35))
    assert found == pytest.approx(expected, abs=AGREEMENT * 0.2)


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:2V,0.1Hz"])
def test_irregular_samples(drive: str) -> None:
    t = np.unique(np.concatenate([np.random.default_rng(5).uniform(0, 100, 100), np.geomspace(1e-6, 100, 20)]))
    assert_engines_agree(strip_netlist(PAPER), parse_drive(drive, 100.0), t)


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:2V,0.1Hz"])
@pytest.mark.parametrize("count", [31, 301, 6001])
def test_interpolated_samples_are_as_good_as_solved_ones(drive: str, count: int) -> None:
    t = np.linspace(0, 95, count)
    net, source = strip_netlist(PAPER), parse_drive(drive, 95.0)
    exact = transient(net, source, t, engine="exact")
    for interpolate in (True, False):
        assert largest_difference(transient(net, source, t, interpolate=interpolate), exact) <= AGREEMENT


# -- accuracy ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("drive", [d for d in DRIVES.values() if d != "square:4V,30s"])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9])
def test_the_accuracy_asked_for_is_kept(drive: str, accuracy: float) -> None:
    t = np.linspace(0, 100, 211)
    net, source = strip_netlist(PAPER), parse_drive(drive, 100.0)
    waves = transient(net, source, t, accuracy=accuracy)
    assert waves.errors.max() <= accuracy
    assert largest_difference(waves, transient(net, source, t, engine="exact")) <= accuracy


@pytest.mark.parametrize("accuracy", [0.0, -1.0, 1e-12, 0.1, float("nan"), float("inf")])
def test_accuracies_that_make_no_sense(accuracy: float) -> None:
    with pytest.raises(InputError, match="must lie between 1e-11 and 1e-2"):
        transient(strip_netlist(PAPER), parse_drive("step:4V", 1.0), [0.0, 1.0], accuracy=accuracy)


def test_unknown_engine_and_no_netlist() -> None:
    with pytest.raises(InputError, match="engine is 'xyce'; choose ngspice or exact"):
        transient(strip_netlist(PAPER), parse_drive("step:4V", 1.0), [0.0, 1.0], engine="xyce")
    with pytest.raises(InputError, match="at least one netlist"):
        transient([], parse_drive("step:4V", 1.0), [0.0, 1.0])


def test_the_error_of_interpolation_bounds_the_true_one() -> None:
    """Over sums of exponentials on their own grids; the caution is needed, and none is wasted."""
    random = np.random.default_rng(0)
    ratios = []
    for _ in range(300):
        poles = -(10 ** random.uniform(-2, 2, random.integers(1, 4)))
        end, amounts = 10 ** random.uniform(0, 2), random.normal(size=len(poles))
        samples = np.linspace(0, end, 1001)
        grid = design_grid(poles.astype(complex), parse_drive("step:1V", end), samples, random.choice([0.1, 0.17, 0.4]))
        at_nodes, truth = (amounts @ np.exp(np.outer(poles, t)) for t in (grid.nodes[1:], samples))
        found, stated = _interpolated(grid, at_nodes[None, None])
        true = np.abs(found[0, 0] - truth).max() / np.abs(at_nodes).max()
        if true > 1e-12:
            ratios.append(true / stated[0, 0])
    assert len(ratios) > 200
    assert 1 / 1.1 < max(ratios) <= 1
