"""A misfit is judged by its size beyond the noise, over windows even by the logarithm of time."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.fit.misfit import FAIL, FAIL_WINDOW, WARN, misfit_of_spectrum, misfit_over_time

TIME = np.linspace(-5.0, 100.0, 2101)


@pytest.mark.parametrize("noise", [1e-6, 1e-3, 0.05, 0.3])
def test_noise_alone_is_no_misfit(noise: float) -> None:
    """Noise of 30 % of the data's size is noise."""
    for seed in range(100):
        residuals = noise * np.random.default_rng(seed).standard_normal(len(TIME))
        found = misfit_over_time(TIME, residuals, noise, 1.0)
        assert found is not None
        assert not found.warn
        assert not found.fail


def test_misfit_early_counts_as_much_as_late() -> None:
    """A tenth of the peak over the first of seven windows is drowned by 2,000 later samples, but not here."""
    early = np.where((TIME >= 0) & (TIME < 0.1), 0.3, 0.0)
    assert np.sqrt(np.mean(early**2)) < 0.01
    found = misfit_over_time(TIME, early, 0.0, 1.0)
    assert found is not None
    assert found.share == pytest.approx(0.3 / np.sqrt(7))
    assert (found.start, found.end) == (0.0, pytest.approx(0.1))
    assert found.worst > FAIL_WINDOW
    assert found.fail


@pytest.mark.parametrize(
    ("size", "warn", "fail"), [(0.5 * WARN, False, False), (2 * WARN, True, False), (1.1 * FAIL, True, True)]
)
def test_thresholds(size: float, warn: bool, fail: bool) -> None:
    found = misfit_over_time(TIME, np.full(len(TIME), size), 0.0, 1.0)
    assert found is not None
    assert found.share == pytest.approx(size)
    assert (found.warn, found.fail) == (warn, fail)


def test_misfit_is_relative_to_the_size_and_beyond_the_noise() -> None:
    residuals = 5e-3 * np.ones(len(TIME))
    whole, beyond = misfit_over_time(TIME, residuals, 0.0, 0.1), misfit_over_time(TIME, residuals, 3e-3, 0.1)
    assert whole is not None
    assert beyond is not None
    assert whole.share == pytest.approx(0.05)
    assert 0.03 < beyond.share < 0.04


def test_no_sample_after_the_onset_has_no_misfit() -> None:
    assert misfit_over_time(np.array([-2.0, -1.0]), np.ones(2), 0.0, 1.0) is None


def test_spectrum_names_its_worst_decade() -> None:
    f = np.geomspace(1e-2, 1e3, 60)
    relative = np.where((f >= 1) & (f < 10), 0.5, 0.01)
    found = misfit_of_spectrum(f, relative)
    assert (found.start, found.end) == (1.0, 10.0)
    assert found.worst == pytest.approx(0.5)
    assert found.share == pytest.approx(np.sqrt(np.mean(relative**2)))
    assert found.warn
    assert found.fail == (found.share > 0.2)
