"""The sum of modes against the exact engine and the closed form."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identify.current import currents
from ilg_circuit.identify.modal import modal_currents
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.models import electrical_model

VALUES = {
    "rc": (233.0, 20.0, 0.2),
    "rc2": (400.0, 40.0, 0.02, 100.0, 0.1),
    "rc3": (1000.0, 60.0, 0.004, 100.0, 0.02, 150.0, 0.15),
    "warburg": (300.0, 10.0, 50.0, 8.0),
    "cpe": (1000.0, 10.0, 0.02, 0.8),
}
DRIVES = {
    "step": PiecewiseLinear.step(2.0),
    "square": PiecewiseLinear.square(-1.0, 2.0, 7.0, 60.0),
    "bends": PiecewiseLinear(np.array([0.0, 3.0, 3.0, 11.0, 40.0]), np.array([0.0, 1.0, -0.5, 2.0, 2.0])),
}


@pytest.mark.parametrize("resistance", [0.0, 2.0])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", VALUES)
def test_modes_are_the_exact_engine_s(model: str, drive: str, resistance: float) -> None:
    kind = electrical_model(model)
    ports = [kind.port([v * factor if v != 0.8 else v for v in VALUES[model]], resistance) for factor in (1.0, 1.3)]
    t = np.sort(np.concatenate([np.linspace(0.0, 60.0, 41), np.geomspace(1e-3, 50.0, 20)]))
    exact = currents(ports, DRIVES[drive], t, "exact")
    found = modal_currents(ports, DRIVES[drive], t)
    assert found == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())


def test_a_long_record_goes_in_blocks() -> None:
    t = np.linspace(0.0, 60.0, 5003)
    found = modal_currents([electrical_model("rc").port(VALUES["rc"], 2.0)], DRIVES["step"], t)[0]
    assert found == pytest.approx(
        2 * formulas.current_step(t, *formulas.current_constants(*VALUES["rc"], 2.0)), rel=1e-9
    )
