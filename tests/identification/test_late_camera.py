"""A camera that starts after the voltage, or has few readings at rest: its gain is right, or there is none."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.findings import codes
from ilg_circuit.identification.identification import Identification
from ilg_circuit.measurements.track import beginning

#: Rest of the current before the voltage [s], and what the camera's clock reads more than the voltage's.
REST, LATE = 10.0, 0.37
TRUTH = {
    f"coupling_{name}": getattr(ilg.PAPER.coupling, name)
    for name in ("gain", "zero", "damping_ratio", "natural_frequency")
}


@cache
def moved(drive: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    run = ilg.simulate("paper", drive, "100 s", step=0.02, engine="exact", beam="static")
    return run.time, run.voltage, run.current, run.displacement


def camera(drive: str, first: float, fps: float, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] by the camera's clock and displacements [m] from ``first`` [s] after the onset on."""
    time, _, _, displacement = moved(drive)
    t = np.arange(first, 100.0, 1 / fps)
    seen = np.interp(t, time, displacement, left=0.0)
    spread = noise * np.ptp(displacement) * np.random.default_rng(seed).standard_normal(len(t))
    return t + REST + LATE, seen + spread


def fitted(drive: str, seen: tuple[np.ndarray, np.ndarray], delay: float | None = None) -> Identification:
    time, voltage, current, _ = moved(drive)
    t = np.arange(-REST, 100.0, 0.2)
    u, i = (np.where(t < 0, 0.0, np.interp(t + 1e-9, time, y)) for y in (voltage, current))
    i = i + 1e-3 * np.abs(i).max() * np.random.default_rng(1).standard_normal(len(t))
    return ilg.identify(
        {"time_s": t + REST, "voltage_V": u, "current_A": i},
        "paper",
        displacement=seen,
        displacement_delay=delay,
        model="rc",
        engine="exact",
        coupling="ec31",
    )


def assert_true(fit: Identification) -> None:
    assert fit.success
    for name, truth in TRUTH.items():
        assert fit[name].value == pytest.approx(truth, abs=3.5 * fit[name].reported[0]), name


@pytest.mark.parametrize("first", [1.0, 3.0])
def test_after_a_step_there_is_no_gain_without_the_delay(first: float) -> None:
    seen = camera("step:2V", first, 5.0, 0.01)
    fit = fitted("step:2V", seen)
    assert fit.coupling is None
    assert "displacement-not-fitted" in codes(fit.findings)
    assert any("give displacement_delay" in text for text in fit.warnings)
    stated = fitted("step:2V", seen, LATE)
    assert_true(stated)
    assert stated["coupling_gain"].reported[0] < 0.2 * TRUTH["coupling_gain"]


def test_later_edges_tell_the_delay_of_a_camera_that_starts_late() -> None:
    drive = "square:-2V..2V,20s"
    fit = fitted(drive, camera(drive, 3.0, 5.0, 0.01))
    assert_true(fit)
    low, high = fit["displacement_delay"].reported[1]
    assert low <= LATE <= high
    assert high - low < 0.5


@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_few_readings_at_rest_are_a_rest(noise: float) -> None:
    fit = fitted("step:2V", camera("step:2V", -REST, 0.5, noise))
    assert_true(fit)
    low, high = fit["displacement_delay"].reported[1]
    assert low <= LATE <= high


def test_what_moves_from_the_first_reading_on_has_no_rest() -> None:
    sure = [
        beginning(*camera("step:2V", first, fps, 0.01, seed))[1]
        for first in (1.0, 3.0, 20.0)
        for fps in (1.0, 5.0, 25.0)
        for seed in range(5)
    ]
    assert not any(sure)
    assert all(beginning(*camera("step:2V", -REST, 25.0, 0.01, seed))[1] for seed in range(5))


@pytest.mark.parametrize("seed", range(4))
def test_a_tip_that_only_trembles_gives_no_gain(seed: int) -> None:
    """Filmed from when it has settled; noise gave a natural frequency 6 standard errors off."""
    t = np.arange(40.0, 100.0, 0.2)
    seen = t + REST, 6e-3 + 3e-5 * np.random.default_rng(seed).standard_normal(len(t))
    fit = fitted("step:2V", seen, 0.0)
    assert fit.coupling is None
    assert "displacement-not-fitted" in codes(fit.findings)
    assert fit["capacitance"].value == pytest.approx(0.35, rel=0.05)
