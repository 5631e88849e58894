"""Ports are answered without an engine as the engine does, and as their derivatives say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import port_of, strip_of, values_of

from ilg_circuit.circuit.strip import port_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification.modal import perturbed
from ilg_circuit.identification.motion import Motion
from ilg_circuit.identification.port_model import PortModel
from ilg_circuit.identification.port_response import (
    Response,
    closed,
    current_slopes,
    currents_of,
    engine_currents,
    voltage_slopes,
    voltages_of,
)
from ilg_circuit.solve import collocation, transient
from ilg_circuit.strip.actuator import Coupling
from ilg_circuit.strip.models import Ladders, electrical_model

T = np.linspace(0.0, 30.0, 31)
DRIVE = PiecewiseLinear(np.array([0.0, 10, 10, 20, 30]), np.array([1.0, 3, -2, 3, 0]), rest=1.0)
CURRENT = PiecewiseLinear(np.array([0.0, 10, 10, 30]), np.array([0.01, 0.01, -0.01, -0.01]), unit="A")
LADDERS = Ladders(band=(1e-3, 20.0), sections=12)
NONLINEAR = ("rc+growing", "rc+saturating", "rc+steric", "rc+sinh", "rc2+growing+sinh")


@pytest.mark.parametrize(
    ("model", "electrodes"), [*((m, e) for m in NONLINEAR for e in (0.0, 5.0)), ("warburg+sinh", 0.0)]
)
def test_currents_are_the_engines(model: str, electrodes: float) -> None:
    kind, values = electrical_model(model), np.array(values_of(model))
    assert closed(PortModel(kind, electrodes))
    ports = [kind.port(v.tolist(), electrodes, LADDERS) for v in perturbed(values)]
    expected = engine_currents(ports[:1], DRIVE, T, "ngspice", 1e-7)[0]
    found = currents_of(ports[:1], DRIVE, T)[0]
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    slopes = current_slopes(ports, DRIVE, T)
    assert slopes is not None
    assert slopes[0] == pytest.approx(found, rel=1e-9, abs=1e-12)
    assert slopes[1].shape == (len(T), len(values))


@pytest.mark.parametrize("model", ["rc+sinh", "rc2+sinh", "warburg+sinh"])
def test_an_electron_path_solved_by_itself_takes_its_share_of_the_whole(model: str) -> None:
    """Straight across the voltage it knows nothing of the ions: the whole circuit in one run gives the same current."""
    values = np.array(values_of(model))
    ports = [electrical_model(model).port((f * values).tolist(), 0.0, LADDERS) for f in (1.0, 1.3)]
    parted = engine_currents(ports, DRIVE, T, "ngspice", 1e-7)
    whole = transient([port_netlist(port, rest=DRIVE.rest) for port in ports], DRIVE, T, accuracy=1e-7)
    np.testing.assert_allclose(parted, whole.values[:, 0], rtol=0, atol=4e-7 * np.abs(parted).max())


@pytest.mark.parametrize("model", ["rc+growing", "rc2+growing+sinh"])
def test_voltages_are_the_engines(model: str) -> None:
    port = port_of(model, 5.0)
    assert closed(PortModel(electrical_model(model), 5.0), by_current=True)
    run = transient([port_netlist(port, by_current=True)], CURRENT, T)
    expected = run.output("voltage")
    assert np.abs(voltages_of([port], CURRENT, T)[0] - expected).max() < 1e-6 * np.abs(expected).max()
    ports = [electrical_model(model).port(v.tolist(), 5.0) for v in perturbed(np.array(values_of(model)))]
    slopes = voltage_slopes(ports, CURRENT, T)
    assert slopes is not None
    assert slopes[0] == pytest.approx(expected, rel=1e-5, abs=1e-6)


#: Levels whose jumps lie between samples, on one, and at the last one.
LEVELS = PiecewiseLinear(
    np.array([0.0, 4.4, 4.4, 10.0, 10.0, 21.3, 21.3, 30.0, 30.0]), np.array([2.0, 2, -1, -1, 3, 3, 0, 0, 1.5]), rest=1.0
)


def at_jump(drive: PiecewiseLinear, k: int, by: float) -> PiecewiseLinear:
    """Return the drive with its jump ``k`` later ``by`` so many seconds."""
    times = drive.times.copy()
    times[2 * k - 1 : 2 * k + 1] += by
    return replace(drive, times=times)


@pytest.mark.parametrize(
    ("model", "by_current"),
    [
        *((m, False) for m in ("rc", "rc3", "warburg", "rc2+sinh", "rc2+growing", "rc+steric", "rc+saturating")),
        *((m, True) for m in ("rc2", "warburg", "rc2+growing", "rc+steric")),
    ],
)
@pytest.mark.parametrize("electrodes", [0.0, 5.0])
def test_derivatives_by_jumps_are_the_differences_of_answers(
    monkeypatch: pytest.MonkeyPatch, model: str, by_current: bool, electrodes: float
) -> None:
    """Later by a little, and earlier; a sample on a jump has the right limit, which comes with an earlier one only."""
    monkeypatch.setattr(collocation, "_ACCURACY", 1e-10)  # of which the differences leave ten thousand times
    if "sinh" in model and electrodes:
        pytest.skip("solved with the ions, as the laws of charge are")
    port = electrical_model(model).port(values_of(model), electrodes, LADDERS)
    by = 1e-7 if port.ladder else 1e-4  # a ladder answers a jump within microseconds
    drive = replace(LEVELS, values=0.01 * LEVELS.values, rest=0.0, unit="A") if by_current else LEVELS
    t = np.append(np.arange(-3.0, 30.0), 30.0)

    def answer(of: PiecewiseLinear) -> np.ndarray:
        return Response(of, by_current).answers([port], t[t >= 0])[0]

    found = Response(drive, by_current).prediction(lambda values: [port] * len(values), t).by_jumps(np.zeros(1))
    assert found is not None
    assert found.shape == (len(t), 5)
    assert not found[t < 0].any()
    for k in range(1, 5):
        on = bool(np.isin(drive.times[2 * k], t))
        later, earlier = (0.0 if on else by), -by
        expected = (answer(at_jump(drive, k, later)) - answer(at_jump(drive, k, earlier))) / (later - earlier)
        # a difference to one side alone has an error in proportion to its step
        close = 0.02 if on else 1e-5
        assert np.abs(found[t >= 0, k] - expected).max() < close * np.abs(expected).max()


@pytest.mark.parametrize(
    ("model", "by_current"),
    [*((m, False) for m in ("rc2", "warburg", "rc+sinh")), *((m, c) for m in NONLINEAR[:3] for c in (False, True))],
)
def test_an_answer_goes_with_all_its_jumps(monkeypatch: pytest.MonkeyPatch, model: str, by_current: bool) -> None:
    """The onset and all jumps later by the same time: the answer is the same, so much later."""
    monkeypatch.setattr(collocation, "_ACCURACY", 1e-10)
    port, t = port_of(model, 0.0), np.arange(0.5, 29.0)
    drive = replace(LEVELS, values=0.01 * LEVELS.values, rest=0.01, unit="A") if by_current else LEVELS
    response = Response(drive, by_current)
    found = response.prediction(lambda values: [port] * len(values), t).by_jumps(np.zeros(1))
    assert found is not None
    later, earlier = (response.answers([port], t + by)[0] for by in (1e-4, -1e-4))
    expected = (earlier - later) / 2e-4
    assert np.abs(found.sum(axis=1) - expected).max() < 1e-5 * np.abs(expected).max()


def test_derivatives_by_jumps_are_of_levels_alone() -> None:
    port = port_of("rc", 0.0)
    assert Response(DRIVE).prediction(lambda values: [port] * len(values), T).by_jumps(np.zeros(1)) is None


def test_a_displacement_does_not_know_a_nonlinear_circuit_straight_across_the_voltage() -> None:
    strip = strip_of("rc+growing+sinh")
    motion = Motion(strip, "dynamic", "ngspice")
    assert motion.linear
    coupling = strip.coupling
    assert isinstance(coupling, Coupling)
    values = np.array([[coupling.gain, coupling.zero, coupling.damping_ratio, coupling.natural_frequency]])
    drive = DRIVE.from_rest()
    run = transient([strip_netlist(strip, beam="dynamic")], drive, T)
    expected = run.output("displacement")
    assert np.abs(motion.displacements(drive, T, values)[0] - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_ladder_beside_a_sinh_path_needs_the_engine_behind_electrodes_and_under_a_current() -> None:
    kind = electrical_model("warburg+sinh")
    assert not closed(PortModel(kind, 5.0))
    assert not closed(PortModel(kind, 0.0), by_current=True)
