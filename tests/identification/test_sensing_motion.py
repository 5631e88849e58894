"""The motion of a sense record: jumps and noise between its readings are no law of sensing, and gaps tell none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.identification.sensed import SensedData
from ilg_circuit.identification.sensing import SensingFit
from ilg_circuit.measurements.waves import Sensed
from ilg_circuit.strip.actuator import Sensing

STRIP = replace(ilg.PAPER, sensing=Sensing(instantaneous=3.0, gain_1=-2.0, time_1=4.0))
TRUTH = {"sensing_instantaneous": 3.0, "sensing_gain_1": -2.0, "sensing_time_1": 4.0}
REST = 5.0


@cache
def sensed(motion: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    run = ilg.sense(STRIP, motion, times=np.arange(0, 60, 0.02), terminals="open", engine="exact")
    return run.time, run.displacement, run.voltage


def record(motion: str, seed: int, every: float, noise: float, of_motion: float = 0.0) -> dict[str, np.ndarray]:
    """A strip at rest, and moved from 5 s on; white noise of voltage and displacement over their spans."""
    time, displacement, voltage = sensed(motion)
    t = np.arange(-REST, 59.95, every)
    x, v = (np.where(t < -1e-9, 0.0, np.interp(t + 1e-9, time, y)) for y in (displacement, voltage))
    random = np.random.default_rng(seed)
    v = v + noise * np.ptp(v) * random.standard_normal(len(t))
    x = x + of_motion * np.ptp(x) * random.standard_normal(len(t))
    return {"time_s": t + REST, "displacement_mm": 1e3 * x, "voltage_mV": 1e3 * v}


def assert_true(fit: SensingFit, errors: float, within: float) -> None:
    assert fit.success
    for name, truth in TRUTH.items():
        assert fit[name].value == pytest.approx(truth, abs=errors * fit[name].reported[0]), name
        assert fit[name].value == pytest.approx(truth, rel=within), name


@pytest.mark.parametrize(
    ("motion", "every", "noise", "within"),
    [("step:1mm", 1.0, 0.01, 0.25), ("square:-1mm..1mm,20s", 0.2, 0.001, 0.04)],
)
def test_a_tip_that_jumps_between_readings(motion: str, every: float, noise: float, within: float) -> None:
    fit = ilg.identify_sensing(record(motion, 2, every, noise), "paper")
    assert_true(fit, 3.0, within)
    low, high = fit["sensing_instantaneous"].reported[1]
    assert low <= 3.0 <= high


@pytest.mark.parametrize("motion", ["sine:1mm,0.1Hz", "triangle:1mm,20s"])
def test_noise_of_the_displacement_is_no_motion(motion: str) -> None:
    assert_true(ilg.identify_sensing(record(motion, 0, 0.2, 0.01, of_motion=0.01), "paper"), 3.5, 0.15)


def test_a_motion_that_the_strip_follows_is_no_noise() -> None:
    """A tip moved at random between its readings, as an instrument of random steps does."""
    t = np.arange(0.0, 60.0, 0.2)
    random = np.random.default_rng(3)
    moved = 1e-3 * random.standard_normal(len(t))
    followed = SensedData.of(Sensed("a", t, moved, 2.0 * moved, "open"))
    assert not followed.noise
    np.testing.assert_allclose(followed.drive.value(t), moved - moved[0], atol=1e-12)
    assert SensedData.of(Sensed("a", t, moved, random.standard_normal(len(t)), "open")).noise > 5e-4


@pytest.mark.parametrize("until", [23.0, 32.0])
def test_a_gap_in_which_the_tip_moves_is_refused(until: float) -> None:
    whole = record("sine:1mm,0.1Hz", 0, 0.2, 0.01)
    keep = (whole["time_s"] < 20) | (whole["time_s"] > until)
    gap = {name: values[keep] for name, values in whole.items()}
    with pytest.raises(InputError, match=r"no readings from 19\.8 s to .* the tip moves") as refused:
        ilg.identify_sensing(gap, "paper")
    assert "\n" not in str(refused.value)


def test_a_gap_in_which_the_tip_stands_still_is_none() -> None:
    whole = record("step:1mm", 0, 0.2, 0.01)
    keep = (whole["time_s"] < 30) | (whole["time_s"] > 36)
    fit = ilg.identify_sensing({name: values[keep] for name, values in whole.items()}, "paper")
    assert_true(fit, 3.0, 0.15)
