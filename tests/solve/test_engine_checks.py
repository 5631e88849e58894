"""What the engines check of themselves and callers build on: signs, grids that ngspice must keep, finite results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ilg_circuit.circuit import Element, Netlist, Output, electrical_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError, StoppedEarlyError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.solve.exact import exact_on_panels, exact_outputs
from ilg_circuit.solve.grid import Grid
from ilg_circuit.solve.ngspice import Session, session
from ilg_circuit.solve.panels import Panels
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.solve.stepped import Batch

RC = "rc\nR1 in out 1.0\nC1 out 0 1.0 IC=0.0\nVdrive in 0 external\n"
GRID = np.linspace(0.0, 5.0, 51)


def netlist(*elements: Element, quantities: tuple[str, ...]) -> Netlist:
    outputs = tuple(Output(q, "", ((q, 1.0),)) for q in quantities)
    return Netlist("test", (Element("Vdrive", ("in", "0"), 0.0), *elements), outputs)


@pytest.mark.parametrize("engine", ["exact", "ngspice"])
def test_a_current_source_takes_from_its_plus_and_gives_to_its_minus(engine: str) -> None:
    """Between two nodes that each have a resistor to ground: -I R at plus, + I R at minus."""
    parts = (
        Element("I1", ("a", "b"), 2.0), Element("R1", ("a", "0"), 3.0), Element("R2", ("b", "0"), 5.0),
        Element("R3", ("in", "c"), 1.0), Element("C1", ("c", "0"), 1.0),
    )  # fmt: skip
    circuit = netlist(*parts, quantities=("v(a)", "v(b)"))
    found = transient(circuit, PiecewiseLinear.step(1.0), np.linspace(0.0, 1.0, 5), engine=engine)
    assert found.output("v(a)") == pytest.approx(-6.0, rel=1e-9)
    assert found.output("v(b)") == pytest.approx(10.0, rel=1e-9)


def test_a_result_of_the_exact_engine_that_is_not_finite_is_none() -> None:
    """A circuit that feeds itself grows by a factor e every second, beyond all numbers after twelve minutes."""
    parts = (
        Element("C1", ("a", "0"), 1.0),
        Element("G1", ("0", "a", "a", "0"), 1.0),
        Element("G2", ("0", "a", "in", "0"), 1.0),
    )
    system = state_space([netlist(*parts, quantities=("v(a)",))])
    step = PiecewiseLinear.step(1.0)
    assert exact_outputs(system, step, np.array([0.0, 1.0]))[0, 0] == pytest.approx([0.0, np.expm1(1.0)])
    with np.errstate(all="ignore"):
        with pytest.raises(SolveError, match="not finite"):
            exact_outputs(system, step, np.array([0.0, 500.0, 1000.0]))
        with pytest.raises(SolveError, match="not finite"):
            exact_on_panels(system, step, Panels(np.array([0.0, 600.0]), np.array([600.0, 600.0]), 1200.0))


# -- ngspice's steps ---------------------------------------------------------------------------------------------------


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Runs the circuit with vectors of time and voltage in place of those that ngspice gives back."""

    def run(time: list[float], voltage: list[float], grid: list[float]) -> Any:
        vectors = {"time": time, "out": voltage}
        monkeypatch.setattr(Session, "_vector", lambda _self, name, **_: np.array(vectors[name.rpartition(".")[2]]))
        with session().loaded(RC, 5.0, ["out"]) as go:
            return go(np.array(grid), np.zeros(len(grid)))

    return run


def test_a_run_that_stops_before_the_end_is_none(held: Callable[..., Any]) -> None:
    assert held([1.0, 2.0, 5.0], [0.1, 0.2, 0.3], [0.0, 1.0, 2.0, 5.0]).tolist() == [[0.1, 0.2, 0.3]]
    with pytest.raises(SolveError, match=r"stopped at 4.9 s of 5 s"):
        held([1.0, 2.0, 4.9], [0.1, 0.2, 0.3], [0.0, 1.0, 2.0, 5.0])
    with pytest.raises(SolveError, match=r"stopped at 0 s of 5 s"):
        held([], [], [0.0, 1.0, 2.0, 5.0])


def test_a_run_that_left_the_grid_is_none(held: Callable[..., Any]) -> None:
    """Points of its own are no matter, a missing one is: its neighbour stands for another time."""
    found = held([0.0, 0.5, 1.0, 1.5, 2.0, 5.0, 5.05], [9.0, 9.0, 0.1, 9.0, 0.2, 0.3, 9.0], [0.0, 1.0, 2.0, 5.0])
    assert found.tolist() == [[0.1, 0.2, 0.3]]
    for missed in (1.00001, 1.1):
        with pytest.raises(SolveError, match="left the time grid"):
            held([missed, 2.0, 5.0], [0.1, 0.2, 0.3], [0.0, 1.0, 2.0, 5.0])


def test_within_a_step_that_ngspice_makes_shorter_the_drive_is_a_straight_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """At a share of the step its voltage is that share of the way; at its end, and before the first, the given one."""
    of = session()
    monkeypatch.setattr(of, "_running", True)
    out = of._ffi.new("double *")
    of._grid, of._voltages, of._nudge, of._tiny, of._begun = (
        [0.0, 2.0, 4.0, 9.0],
        [[1.0, 3.0, -1.0, -1.0]],
        0.0,
        1e-15,
        -1.0,
    )
    for position, time, expected in (
        (0, 0.0, 1.0),
        (1, 0.5, 1.5),
        (1, 1.5, 2.5),
        (1, 2.0, 3.0),
        (2, 3.0, 1.0),
        (2, 2.5, 2.0),
    ):
        of._position = position
        of._source_voltage(out, time, of._ffi.NULL, 0, of._ffi.NULL)
        assert out[0] == pytest.approx(expected, abs=1e-15), (position, time)


def test_every_point_of_the_grid_is_asked_for_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    of = session()
    monkeypatch.setattr(of, "_running", True)
    delta = of._ffi.new("double *")
    of._grid, of._position, of._tiny = [0.0, 2.0, 5.0, 9.0], 0, 1e-15
    for time, step in ((0.0, 2.0), (0.5, 1.5), (2.0, 3.0), (4.0, 1.0), (5.0, 4.0)):
        assert of._next_step(time, delta, 0.0, 0, 0, 0, None) == 0
        assert delta[0] == pytest.approx(step, rel=1e-15)
    delta[0] = 0.125  # a step that did not converge is ngspice's own
    assert of._next_step(4.0, delta, 0.0, 1, 0, 0, None) == 1
    assert delta[0] == 0.125


@pytest.mark.parametrize(("stops", "solved"), [(0, True), (1, True), (2, True), (3, False)])
def test_jumps_take_longer_where_ngspice_stops_in_them(
    monkeypatch: pytest.MonkeyPatch, stops: int, solved: bool
) -> None:
    """Ten times, then a hundred times as long; at last the error is the user's."""
    own, rises = Batch._extrapolated, list[float]()

    def stopping(batch: Any, grid: Grid, settled: float | None, *, stiff: bool) -> object:
        rises.append(grid.rise)
        if len(rises) <= stops:
            raise StoppedEarlyError("ngspice stopped at 15 s of 20 s")
        return own(batch, grid, settled, stiff=stiff)

    monkeypatch.setattr(Batch, "_extrapolated", stopping)
    net, drive, t = (
        electrical_netlist(600.0, ((20.0, 0.1),)),
        parse_drive("square:4V,30s", 20.0),
        np.linspace(0, 20, 41),
    )
    if not solved:
        with pytest.raises(StoppedEarlyError):
            transient(net, drive, t)
    else:
        found, exact = transient(net, drive, t), transient(net, drive, t, engine="exact")
        assert np.abs(found.values - exact.values).max() <= found.errors.max() * np.abs(exact.values).max()
    assert np.array(rises)[: stops + 1] / rises[0] == pytest.approx([1.0, 10.0, 100.0][: stops + 1])


def test_a_drive_without_jumps_is_tried_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = list[float]()

    def stopping(batch: Any, grid: Grid, settled: float | None, *, stiff: bool) -> object:
        calls.append(grid.rise)
        raise StoppedEarlyError("ngspice stopped at 15 s of 20 s")

    monkeypatch.setattr(Batch, "_extrapolated", stopping)
    with pytest.raises(StoppedEarlyError):
        transient(electrical_netlist(600.0, ((20.0, 0.1),)), parse_drive("sine:1V,0.1Hz", 20.0), np.linspace(0, 20, 41))
    assert len(calls) == 1
