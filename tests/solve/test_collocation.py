"""Collocation of nonlinear ports against an integration of the same equations, and its derivatives against answers."""

from __future__ import annotations

import numpy as np
import pytest
from every_model import port_of, values_of
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.identification.modal import STEP, perturbed
from ilg_circuit.solve import collocation, collocation_mesh
from ilg_circuit.solve.collocation import Nearby, answer_slopes, answers
from ilg_circuit.solve.ode import port_response
from ilg_circuit.strip.models import electrical_model
from ilg_circuit.strip.port import Port

T = np.linspace(0.0, 20.0, 41)
SINE = np.linspace(0.0, 20.0, 11)
DRIVES = {
    "step": PiecewiseLinear.step(3.0),
    "square": PiecewiseLinear.square(-2.0, 2.0, 12.0, 20.0),
    "triangle": PiecewiseLinear(np.array([0.0, 5, 15, 20]), np.array([0.0, 3, -3, 0])),
    "sine": PiecewiseLinear(SINE, 3 * np.sin(0.6 * SINE)),
}
MODELS = ("rc+growing", "rc2+growing", "rc3+growing", "rc+saturating", "rc+steric", "rc+sinh", "rc2+growing+sinh")


@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", MODELS)
def test_answers_are_those_of_an_integration(model: str, drive: str, electrodes: float) -> None:
    port = port_of(model, electrodes)
    expected, _ = port_response(port, DRIVES[drive], T)
    assert np.abs(answers([port], DRIVES[drive], T)[0] - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("model", ["rc+growing", "rc+steric", "rc2+growing+sinh"])
def test_a_current_is_answered_by_the_voltage(model: str) -> None:
    port = port_of(model, 5.0)
    drive = PiecewiseLinear.square(-0.01, 0.01, 12.0, 20.0, unit="A")
    expected, _ = port_response(port, drive, T)
    found = answers([port], drive, T, by_current=True)[0]
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("by_current", [False, True])
@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_slopes_are_the_differences_of_answers(
    monkeypatch: pytest.MonkeyPatch, model: str, electrodes: float, by_current: bool
) -> None:
    monkeypatch.setattr(collocation, "_ACCURACY", 1e-9)  # of which the differences of answers leave a thousand times
    kind, values, step = electrical_model(model), np.array(values_of(model)), 1e-3
    drive = PiecewiseLinear(np.array([0.0, 4, 4, 16, 20]), np.array([1.0, 3, -2, 3, 0]), rest=1.0)
    if by_current:
        drive = PiecewiseLinear(drive.times, 0.01 * drive.values, unit="A")

    def made(sets: np.ndarray) -> list[Port]:
        return [kind.port(v.tolist(), electrodes) for v in sets]

    found, slopes = answer_slopes(made(perturbed(values)), drive, T, STEP, by_current=by_current)
    assert found == pytest.approx(answers(made(values[None]), drive, T, by_current=by_current)[0], rel=1e-12)
    for k in range(len(values)):
        moved = np.exp(step * np.eye(len(values))[k])
        above, below = answers(made(np.array([values * moved, values / moved])), drive, T, by_current=by_current)
        expected = (above - below) / (2 * step)
        assert np.abs(slopes[:, k] - expected).max() < 1e-5 * np.abs(found).max()


def test_a_strip_at_rest_under_a_voltage_stays_there() -> None:
    port = port_of("rc2+growing+sinh", 5.0)
    still = PiecewiseLinear(np.array([0.0]), np.array([2.0]), rest=2.0)
    expected = float(port.electron_current(port.inner_voltage(2.0)))
    assert answers([port], still, T)[0] == pytest.approx(expected, rel=1e-9)


@example("packing_fraction", 0.0, [0.0], 0.0, [0.0, 7.4e-185])  # whose square is no number
@settings(max_examples=25)
@given(
    law=st.sampled_from(["capacitance_slope", "saturation_voltage", "packing_fraction"]),
    constant=st.floats(0.0, 1.0),
    rates=st.lists(st.floats(-3.0, 2.0), min_size=1, max_size=3),
    electrodes=st.sampled_from([0.0, 0.5, 50.0]),
    corners=st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=12),
)
def test_ports_of_all_proportions_are_solved(
    law: str, constant: float, rates: list[float], electrodes: float, corners: list[float]
) -> None:
    """Time constants from 10 ms to 1000 s beside each other, and charges far into saturation."""
    most = max(np.abs(corners).max(), 0.1)
    of = {
        "capacitance_slope": (-0.9 + 10 * constant) / most,
        "saturation_voltage": most * (0.14 + constant),
        "packing_fraction": 10 ** (-4 + 3.9 * constant),
    }
    branches = tuple((20.0, 10**-rate / 20) for rate in rates)
    port = Port(500.0, branches, electrodes, **{law: of[law]})
    drive = PiecewiseLinear(np.linspace(0.0, 18.0, len(corners)), np.array(corners))
    found = answers([port], drive, T)[0]
    assert np.isfinite(found).all()
    # the electron path takes v/Rdc, and the ions are charged by what flows beside it
    assert np.abs(found).max() <= most / 500.0 + 2 * most * len(branches) / 20.0


def test_a_port_out_of_all_proportion_is_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(collocation_mesh, "_MOST", 10)
    hard, easy = port_of("rc+steric"), port_of("rc+growing")
    few = np.array([0.0, 10.0, 20.0])
    found = answers([hard, easy], DRIVES["square"], few)
    assert np.isnan(found).all()
    with pytest.raises(SolveError, match="out of all proportion"):
        answer_slopes([hard] * 3, DRIVES["square"], few, STEP)


def test_a_charge_that_no_longer_rises_is_no_number() -> None:
    port = Port(500.0, ((20.0, 0.1),), capacitance_slope=-0.4)
    below, beyond = PiecewiseLinear.step(2.4), PiecewiseLinear.step(2.6)
    assert np.isfinite(answers([port], below, T)).all()
    assert np.isnan(answers([port], beyond, T)).all()


def test_windows_of_time_give_what_the_whole_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A charge that saturates at once, solved from zero, which Newton's method does not manage for all times."""
    port = Port(1e4, ((50.0, 1e-3),), 2.0, saturation_voltage=0.4)
    drive = PiecewiseLinear(np.array([0.0, 7, 7, 14, 20]), np.array([0.0, 3, -3, -3, 3]))
    expected, _ = port_response(port, drive, T)
    monkeypatch.setattr(collocation, "_MOST_STEPS", 6)
    found = answers([port], drive, T)[0]
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", ["rc2+growing", "rc+steric"])
def test_there_are_as_many_steps_as_the_states_need(model: str, drive: str) -> None:
    """A hundred times the samples are read from the same steps."""
    few, many = Nearby(), Nearby()
    answers([port_of(model)], DRIVES[drive], T, nearby=few)
    found = answers([port_of(model)], DRIVES[drive], np.linspace(0.0, 20.0, 4001), nearby=many)[0]
    assert few._found is not None
    assert many._found is not None
    assert np.array_equal(few._found.mesh.nodes, many._found.mesh.nodes)
    assert len(few._found.mesh.steps) < 1000
    assert found[::100] == pytest.approx(answers([port_of(model)], DRIVES[drive], T)[0], rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("model", ["rc+growing", "rc2+growing+sinh", "rc+steric"])
def test_answers_beside_another_are_the_same(monkeypatch: pytest.MonkeyPatch, model: str) -> None:
    """Ports go far from the first in small steps and in large ones, beside which none is near."""
    kind, values, nearby = electrical_model(model), np.array(values_of(model)), Nearby()
    runs: list[int] = []
    newton = collocation._newton
    monkeypatch.setattr(collocation, "_newton", lambda *given: runs.append(1) or newton(*given))
    for factor in (1.0, 1.02, 1.1, 1.3, 1.7, 5.0, 0.2):
        port = kind.port((values * factor).tolist(), 5.0)
        alone = answers([port], DRIVES["square"], T)[0]
        few = len(runs)
        beside = answers([port], DRIVES["square"], T, nearby=nearby)[0]
        assert np.abs(beside - alone).max() < 1e-6 * np.abs(alone).max()
        if factor in {1.02, 1.1}:
            assert len(runs) - few < few
        runs.clear()
