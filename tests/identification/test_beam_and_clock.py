"""A displacement made with the beam's inertia: its delay and its drift are the dynamic beam's, not the static one's."""

from __future__ import annotations

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.identification.identification import Identification
from ilg_circuit.strip.actuator import PAPER

TRUTH = {
    f"coupling_{name}": getattr(PAPER.coupling, name) for name in ("gain", "zero", "damping_ratio", "natural_frequency")
}


def moved(seed: int, rest: float) -> tuple[np.random.Generator, dict[str, np.ndarray]]:
    """The paper's strip under a step of 4 V after ``rest`` [s] of readings, the current with noise."""
    run = ilg.simulate("paper", "step:4V", "60 s", engine="exact", step=0.2)
    before = np.arange(-round(rest / 0.2), 0) * 0.2
    random = np.random.default_rng(seed)

    def padded(wave: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros(len(before)), wave])

    current = padded(run.current) + random.normal(0, 5e-4, len(before) + len(run.time))
    t = np.concatenate([before, run.time])
    return random, {
        "time": t, "voltage": padded(run.voltage), "current": current, "displacement": padded(run.displacement)
    }  # fmt: skip


def assert_true(fit: Identification) -> None:
    assert fit.actuator.coupling is not None
    assert fit.actuator.coupling.beam == "dynamic"
    for name, truth in TRUTH.items():
        assert fit[name].value == pytest.approx(truth, abs=3.5 * fit[name].stderr), name


def test_a_camera_s_delay() -> None:
    random, data = moved(4, 5.0)
    clock = np.arange(0, 60, 0.2)
    seen = np.interp(clock - 3.0, data["time"], data["displacement"]) + random.normal(0, 1.26e-5, len(clock))
    data["displacement"] = (clock, seen)  # type: ignore[assignment]
    fit = ilg.identify(strip="paper", model="rc", engine="exact", **data)
    assert_true(fit)
    low, high = fit["displacement_delay"].interval
    assert low <= 3.0 <= high


def test_a_drift_beside_a_short_rest() -> None:
    random, data = moved(3, 3.0)
    data["displacement"] = data["displacement"] + random.normal(0, 1.26e-6, len(data["time"]))
    assert_true(ilg.identify(strip="paper", model="rc", engine="exact", **data))
