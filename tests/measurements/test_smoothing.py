"""Smoothing: noise goes, shape stays, and where there is no noise nothing changes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.measurements.smoothing import WIDTHS, smoothed, summit

Array = NDArray[np.float64]


def answer(t: Array) -> Array:
    """A fast rise, a slow fall: time constants of 0.3 and 40 s."""
    return np.exp(-t / 40) - np.exp(-t / 0.3)


@pytest.mark.parametrize("uneven", [False, True])
def test_noise_goes_and_shape_stays(uneven: bool) -> None:
    t = np.r_[np.arange(0, 5, 0.02), np.arange(5, 100, 0.2)] if uneven else np.arange(0, 100, 0.05)
    noise = 0.01
    y = answer(t) + noise * np.random.default_rng(2).standard_normal(len(t))
    found = smoothed(t, y)
    error = found.values - answer(t)
    assert np.sqrt(np.mean(error**2)) < 0.4 * noise
    assert np.abs(error).max() < 3.5 * noise, "the fast rise is not smeared"
    assert np.abs(error[t > 10]).max() < 1.5 * noise
    assert found.noise == pytest.approx(noise, rel=0.15)
    assert found.widths[0] < found.widths[-len(t) // 4]
    assert set(found.widths) <= set(WIDTHS)


def test_stated_errors_are_those_of_the_noise() -> None:
    t = np.arange(0, 50, 0.1)
    errors = []
    for seed in range(20):
        found = smoothed(t, 1 + 0.1 * np.random.default_rng(seed).standard_normal(len(t)))
        errors.append(((found.values - 1) / found.stderr)[100:-100])
    assert np.std(errors) == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize("y", [np.zeros(50), np.linspace(0, 1, 50), np.arange(10.0)])
def test_nothing_changes_without_noise(y: Array) -> None:
    found = smoothed(np.arange(len(y), dtype=float), y)
    assert found.values == pytest.approx(y, abs=1e-12)


def test_the_top_of_a_leaning_peak() -> None:
    t = np.arange(0, 20, 0.02)
    truth = np.log(40 / 0.3) * 40 * 0.3 / (40 - 0.3)
    tops = []
    for seed in range(10):
        y = answer(t) + 0.003 * np.random.default_rng(seed).standard_normal(len(t))
        top = summit(t, y, smoothed(t, y))
        assert top is not None
        tops.append(top)
    at, height = np.mean(tops, axis=0)
    assert at == pytest.approx(truth, abs=0.06)
    assert height == pytest.approx(answer(np.array([truth]))[0], abs=0.002)


def test_no_top_without_smoothing() -> None:
    t = np.arange(10.0)
    assert summit(t, -((t - 4.0) ** 2), smoothed(t, -((t - 4.0) ** 2))) is None
