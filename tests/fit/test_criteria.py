"""Independent samples by the integrated autocorrelation time: the analytic values of AR(1), white noise, structures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.signal import lfilter

from ilg_circuit.fit.criteria import (
    information_criterion,
    integrated_time,
    parts_by_time,
    residual_windows,
    samples_for_bic,
)


def ar1(phi: float, count: int, seed: int) -> NDArray[np.float64]:
    noise = np.random.default_rng(seed).standard_normal(count + 500)
    return np.asarray(lfilter([1.0], [1.0, -phi], noise)[500:])


@pytest.mark.parametrize("phi", [0.3, 0.6, 0.9])
def test_ar1_has_its_analytic_time(phi: float) -> None:
    found = [integrated_time(ar1(phi, 20000, seed)) for seed in range(5)]
    assert np.mean(found) == pytest.approx((1 + phi) / (1 - phi), rel=0.1)


def test_white_and_alternating_noise_is_all_independent() -> None:
    assert np.mean([samples_for_bic([ar1(0.0, 300, seed)]) == 300 for seed in range(100)]) > 0.97
    assert np.mean([integrated_time(ar1(0.0, 1000, seed)) for seed in range(20)]) == pytest.approx(1, abs=0.1)
    assert integrated_time(ar1(-0.7, 5000, 0)) == 1.0


def test_an_offset_and_a_drift_are_a_few_samples() -> None:
    assert integrated_time(np.ones(400)) > 100
    assert samples_for_bic([np.linspace(-1, 1, 400)]) < 10


def test_a_record_s_fast_part_does_not_drown_in_its_drift() -> None:
    """Noise of a second, then 100 s of drift at the same rate: the samples of the noise still count."""
    t = np.arange(-20, 10000) / 100
    residuals = np.where(t < 1, ar1(0.0, len(t), 0), 3 * np.sin(t / 15))
    parts = parts_by_time(t, residuals)
    assert sum(map(len, parts)) == len(t)
    assert np.array_equal(np.concatenate(parts), residuals)
    assert samples_for_bic(parts) > 70 > 40 > samples_for_bic([residuals])


def test_parts_are_what_was_before_the_onset_and_then_the_windows() -> None:
    t = np.arange(-20, 10000) / 100
    windows = residual_windows(t, t, t[-1])
    assert [len(part) for part in parts_by_time(t, t)] == [20, *(window.count for window in windows)]
    assert [part[0] for part in parts_by_time(t, t)[2:]] == [t[t >= window.start][0] for window in windows[1:]]


@given(arrays(np.float64, st.integers(1, 60), elements=st.floats(-1e3, 1e3)))
def test_there_are_no_more_independent_samples_than_samples(residuals: NDArray[np.float64]) -> None:
    assert 1 <= integrated_time(residuals) <= len(residuals) * 2
    assert 5 <= samples_for_bic([residuals]) <= max(len(residuals), 5)


@pytest.mark.parametrize("phi", [0.0, 0.6])
def test_windows_of_time_hardly_change_what_is_stationary(phi: float) -> None:
    t = np.arange(5000.0)
    residuals = ar1(phi, 5000, 1)
    assert samples_for_bic(parts_by_time(t, residuals)) == pytest.approx(5000 * (1 - phi) / (1 + phi), rel=0.15)


def test_the_bic_is_that_of_normal_residuals_on_independent_samples() -> None:
    residuals = np.array([1.0, -2.0, 3.0, -4.0])
    assert information_criterion(residuals, 3, 2.5) == pytest.approx(2.5 * np.log(7.5) + 3 * np.log(2.5), rel=1e-14)
