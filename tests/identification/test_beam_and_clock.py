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


def test_intervals_hold_both_beams_where_a_later_clock_resembles_inertia() -> None:
    """Without inertia the gain was 4 standard errors off, and its interval did not hold the truth (68 of 100 did)."""
    run = ilg.simulate("paper", "step:4V", "80 s", engine="exact", step=0.04)
    random = np.random.default_rng([11, 1])
    clock = np.arange(-6.0, 80.0, 0.04)
    seen = np.interp(clock, run.time, run.displacement, left=0.0)
    seen += 0.01 * np.ptp(seen) * random.standard_normal(len(clock))
    found = ilg.identify({"time_s": clock + 20.0, "displacement_m": seen}, "paper", drive="step:4V", engine="exact")
    for name, truth in TRUTH.items():
        low, high = found[name].interval
        assert low <= truth <= high, name
    low, high = found["displacement_delay"].interval
    assert low <= 20.0 <= high
    assert found.actuator.coupling is not None
    assert found.actuator.coupling.beam == "static"
    assert "clock-or-inertia" in [f.code for f in found.findings]
