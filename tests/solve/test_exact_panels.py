"""Propagators that are squares of one another give what modes give."""

import numpy as np
import pytest

from ilg_circuit.circuit.load import Load
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import exact
from ilg_circuit.solve.panels import FRACTIONS, WEIGHTS, Panels, design_panels
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import Actuator


@pytest.mark.parametrize("drive", ["step:4V", "square:-4V..2V,30s,0.3", "sine:2V,0.1Hz", "ramp:1V/s"])
@pytest.mark.parametrize("strip", ["paper", "rc2 electrodes", "load inside"])
def test_exponentials_give_what_modes_give(
    strip: str, drive: str, strips: dict[str, Actuator], monkeypatch: pytest.MonkeyPatch
) -> None:
    load = Load(mass=1e-6, stiffness=1e-5, damping=1e-7)
    system = state_space([strip_netlist(strips[strip], load=load)])
    source = parse_drive(drive, 300.0)
    panels = design_panels(system.poles(), source, 300.0)
    assert panels.starts[0] == 0
    assert (panels.starts + panels.widths)[:-1] == pytest.approx(panels.starts[1:], rel=1e-12)
    assert panels.starts[-1] + panels.widths[-1] == pytest.approx(300.0, rel=1e-12)
    points = panels.points.ravel()
    expected = exact.exact_on_panels(system, source, panels).reshape(1, len(system.output_names), -1)
    monkeypatch.setattr(exact, "_by_modes", lambda *_: None)
    values = exact.exact_on_panels(system, source, panels).reshape(expected.shape)
    largest = np.abs(expected).max(axis=2)
    assert (np.abs(values - expected).max(axis=2) <= 1e-10 * largest).all()
    assert (np.abs(exact.exact_outputs(system, source, points) - expected).max(axis=2) <= 1e-10 * largest).all()


def test_the_points_integrate_polynomials() -> None:
    for degree in range(2 * len(FRACTIONS) - 1):
        assert (WEIGHTS * FRACTIONS**degree).sum() == pytest.approx(1 / (degree + 1), rel=1e-13)


def test_only_the_chosen_panels_are_cut() -> None:
    cut = Panels(np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0, 3.0]), 6.0).split(np.array([False, True, False]), 4)
    assert cut.starts.tolist() == [0.0, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert cut.widths.tolist() == [1.0, 0.5, 0.5, 0.5, 0.5, 3.0]
    assert cut.end == 6.0
