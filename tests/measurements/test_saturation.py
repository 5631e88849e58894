"""A displacement that stands still at the limit of a camera or sensor is no answer of the strip."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import record, step

from ilg_circuit.findings import codes
from ilg_circuit.identification import identify
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.saturation import saturated
from ilg_circuit.measurements.track import Track, moving
from ilg_circuit.strip.actuator import PAPER

Array = NDArray[np.float64]
T = np.arange(-100, 1200) * 0.1


def settling(noise: float, seed: int = 0, time: float = 15.0) -> Array:
    clean = np.where(T < 0, 0.0, 2e-3 * (1 - np.exp(-np.maximum(T, 0.0) / time)))
    return clean + 2e-3 * noise * np.random.default_rng(seed).standard_normal(len(T))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("noise", [0.0, 0.001, 0.02])
def test_readings_at_a_limit_are_found(noise: float, sign: float) -> None:
    values = settling(noise)
    found, notes = saturated(T, sign * np.minimum(values, 1.4e-3))
    assert [note.code for note in notes] == ["displacement-clipped"]
    assert notes[0].values["level"] == pytest.approx(sign * 1.4e-3)
    assert notes[0].values["count"] == found.sum()
    clean = settling(0.0)
    # all where the strip is beyond the limit by three deviations of the noise, none where it is that far within
    assert found[clean > 1.4e-3 + 6e-3 * noise].all()
    assert not found[clean < 1.4e-3 - 6e-3 * noise].any()


@pytest.mark.parametrize("seed", range(30))
def test_noise_about_a_level_is_at_no_limit(seed: int) -> None:
    values = settling(0.01, seed, time=3.0)
    assert not saturated(T, values)[0].any()
    assert not saturated(T, np.round(values, 7))[0].any()


def test_what_settles_is_at_no_limit() -> None:
    for time in (0.01, 0.3, 2.0):
        assert not saturated(T, settling(0.0, time=time))[0].any(), time


@pytest.mark.parametrize("digit", [2e-5, 1e-4])
def test_a_coarse_resolution_tells_no_limit(digit: float) -> None:
    values = digit * np.round(settling(0.002) / digit)
    assert not saturated(T, values)[0].any()


def test_rest_is_no_limit() -> None:
    values = np.where((T > 10) & (T < 60), 1e-3 * np.sin((T - 10) * np.pi / 50), 0.0)
    assert not saturated(T, values)[0].any()


def test_readings_that_are_all_alike_tell_no_limit() -> None:
    """Nothing is left beside them that would show the resolution; numpy warned of the mean of nothing."""
    for count in (0, 1, 4):
        values = np.where(0.1 * count - 0.01 > T, 0.0, 1e-3)
        assert not saturated(T, values)[0].any()


def test_a_flat_or_short_record_has_none() -> None:
    assert saturated(T, np.zeros(len(T))) == (pytest.approx(np.zeros(len(T), dtype=bool)), ())
    assert not saturated(T[:104], settling(0.0)[:104])[0].any()


def test_a_camera_whose_field_is_left_gives_the_truth_or_says_less() -> None:
    """d(s) followed the edge of the picture: its natural frequency was 84 % off, 40 standard errors, and a success."""
    made = record(step(2.0), 120.0, 601, rest=50, displacement=True, noise=0.005, seed=2)
    moved = made.columns["displacement"]
    clipped = made.changed(displacement=np.minimum(moved, 0.8 * moved.max()))
    found = identify(prepare(clipped.table()), base=PAPER, model="rc", engine="exact", law="ec31")
    assert "displacement-clipped" in codes(found.findings)
    assert PAPER.coupling is not None
    for name in ("gain", "zero", "damping_ratio", "natural_frequency"):
        interval = found.parameters[f"coupling_{name}"].interval
        assert interval is not None
        assert interval[0] <= getattr(PAPER.coupling, name) <= interval[1], name


def test_a_film_of_its_own_is_looked_at_too() -> None:
    values = np.minimum(settling(0.002), 1.4e-3)
    channel, notes = moving(Track("film.csv", T + 10.0, values))
    assert "displacement-clipped" in codes(notes)
    assert channel.values.max() < 1.4e-3
