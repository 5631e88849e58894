"""A real strip's 1.5 V step, third-party data that lies beside the project."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.identify import Record, identify, read_record
from ilg_circuit.identify.current import fit_current

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "ipmc_step" / "step_1V5.csv"

pytestmark = pytest.mark.skipif(not DATA.is_file(), reason="the shared measurements are not beside the project")


@pytest.fixture(scope="module")
def measurement() -> Record:
    return read_record(DATA)


def test_one_pole_is_not_enough_and_says_so(measurement: Record) -> None:
    fit = fit_current(measurement, 0.0, "rc")
    first = (fit.time >= 0) & (fit.time <= 16)
    assert np.sqrt(np.mean(fit.fit.residuals[first] ** 2)) / np.abs(fit.data).max() == pytest.approx(0.023, abs=0.002)
    assert any("one pole is not enough" in line for line in fit.warnings)


def test_two_branches_and_the_displacement(measurement: Record) -> None:
    assert measurement.onset == pytest.approx(2.66)
    found = identify(measurement, model="rc2")
    assert found.model == "rc2"
    fit = found.current
    first = (fit.time >= 0) & (fit.time <= 16)
    assert np.sqrt(np.mean(fit.fit.residuals[first] ** 2)) / np.abs(fit.data).max() <= 0.012
    moved = found.displacement
    assert moved is not None
    assert moved.rest == pytest.approx(5.58e-3, abs=0.02e-3)
    first = (moved.channel.time >= 0) & (moved.channel.time <= 16)
    assert np.sqrt(np.mean((moved.channel.values - moved.fitted)[first] ** 2)) <= 0.015e-3
    assert any("drifts" in line for line in found.warnings)
