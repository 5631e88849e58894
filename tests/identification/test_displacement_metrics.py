"""Metrics of a measured displacement: as the closed form has them, whatever camera, sign, drift, noise and drive."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from synthetic import current_data, drives, record, step

from ilg_circuit.drive import Drive, PiecewiseLinear
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.displacement import fit_displacement
from ilg_circuit.identification.displacement_metrics import DisplacementMetrics, constant_until, displacement_metrics
from ilg_circuit.report.displacement_metrics import metrics_rows
from ilg_circuit.strip.actuator import PAPER


def metrics(drive: Drive, duration: float = 300.0, samples: int = 601, **how: Any) -> DisplacementMetrics | None:
    r = record(drive, duration, samples, rest=20, displacement=True, seed=3, **how)
    return displacement_metrics(fit_displacement(current_data(r, "exact"), PAPER))


@pytest.mark.parametrize(
    ("voltage", "how"),
    [
        (4.0, {"noise": 0.003}),
        (4.0, {}),
        (4.0, {"noise": 0.003, "rest_position": 5e-3, "axis": -1.0}),
        (-4.0, {"noise": 0.003}),
        (-4.0, {"noise": 0.003, "axis": -1.0}),
    ],
)
def test_the_papers_step_whatever_the_camera(voltage: float, how: dict[str, float]) -> None:
    found = metrics(step(voltage), **how)
    assert found is not None
    side = np.sign(voltage)
    for part in (found.measured, found.model):
        assert part.final == pytest.approx(side * 3.9805e-3, abs=2e-5)
        assert part.peak == pytest.approx(side * 4.339e-3, abs=2.5e-5)
        assert part.peak_time == pytest.approx(48.1, abs=1.5)
        assert part.overshoot == pytest.approx(0.09, abs=0.008)
        assert part.settling_time == pytest.approx(75.4, abs=2.0)
        assert part.back_relaxation == pytest.approx(3.585e-4, abs=3e-5)


def test_measured_figures_keep_the_drift_that_the_model_is_fitted_beside() -> None:
    drift = 2e-6
    r = record(step(), 300.0, 601, rest=60, displacement=True, seed=3, noise=0.003, drift=drift, rest_position=-1e-3)
    fit = fit_displacement(current_data(r, "exact"), PAPER)
    found = displacement_metrics(fit)
    assert found is not None
    assert fit.drift == pytest.approx(drift, rel=0.05)
    assert found.model.final == pytest.approx(3.9805e-3, abs=2e-5)
    assert found.measured.final == pytest.approx(3.9805e-3 + 0.975 * 300 * drift, abs=2e-5)
    assert found.rest == pytest.approx(-1e-3, abs=2e-5)


def test_a_record_that_ends_before_the_peak_has_none() -> None:
    found = metrics(step(), 30.0, 301, noise=0.003)
    assert found is not None
    assert found.peak is None
    assert {name: text for name, text, _ in metrics_rows(found)}["overshoot"] == "none seen"
    assert np.isnan(found.measured.settling_time)
    assert found.to_dict()["measured"]["peak_time"] is None


def test_of_a_square_wave_the_first_part_counts() -> None:
    found = metrics(PiecewiseLinear.square(-4.0, 4.0, 200.0, 300.0), noise=0.003)
    assert found is not None
    assert found.until == pytest.approx(100.0)
    assert found.measured.peak_time == pytest.approx(48.1, abs=1.5)


@pytest.mark.parametrize("name", ["sine", "ramp"])
def test_they_are_not_defined_for_a_drive_that_is_never_constant(name: str) -> None:
    assert metrics(drives(4.0)[name], noise=0.003) is None


def test_how_long_a_drive_is_constant() -> None:
    assert constant_until(step()) == np.inf
    assert constant_until(PiecewiseLinear(np.array([0.0, 5.0, 5.0]), np.array([1.0, 1.02, 2.0]))) == 5.0
    assert constant_until(PiecewiseLinear(np.array([0.0, 5.0, 9.0]), np.array([1.0, 1.0, 2.0]))) == 0.0
    assert constant_until(PiecewiseLinear(np.array([0.0, 5.0]), np.array([0.0, 2.0]))) == 0.0


def test_they_are_in_the_table_the_json_and_the_picture(step_fit: Identification) -> None:
    found = step_fit.metrics
    assert found is not None
    text = step_fit.summary()
    assert "figures of the displacement" in text
    assert "back-relaxation" in text
    assert "residuals since the onset" in text
    assert step_fit.to_dict()["displacement"]["figures"] == found.to_dict()
    assert {"current", "displacement"} == set(step_fit.to_dict()["residual_windows"])
    titles = [axes.get_title(loc="left") for axes in step_fit.figure().axes]
    assert any(t.startswith("peak 4.3") and "; model 4.3" in t for t in titles)


def test_without_a_displacement_there_are_none() -> None:
    found = identify(record(step(), 120.0, 121, noise=1e-3).measurement(), model="rc", engine="exact")
    assert found.metrics is None
    assert found.to_dict()["displacement"] == {"figures": None, "laws": []}
    assert "figures" not in found.summary()
