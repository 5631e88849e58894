"""The block bootstrap: the covariance's errors for white residuals, larger and right for correlated ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.fit.bootstrap import block_bootstrap, block_length
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.result import FitResult

T = np.linspace(0.0, 5.0, 400)


def exponential(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[:, :1] * np.exp(-values[:, 1:] * T)


def noise(rho: float, seed: int, size: float = 0.02) -> NDArray[np.float64]:
    """AR(1) of standard deviation ``size``."""
    rng = np.random.default_rng(seed)
    shocks = rng.standard_normal(len(T) + 200) * np.sqrt(1 - rho**2)
    x = np.zeros(len(shocks))
    for k in range(1, len(x)):
        x[k] = rho * x[k - 1] + shocks[k]
    return size * x[200:]


def fitted(rho: float, seed: int) -> FitResult:
    truth = exponential(np.array([[2.0, 0.7]]))[0]
    return fit_data(exponential, truth + noise(rho, seed), ("size", "rate"), np.array([1.5, 1.0]))


def test_white_residuals_give_the_covariance_s_errors() -> None:
    fit = fitted(0.0, 1)
    found = block_bootstrap(fit)
    assert found.errors == pytest.approx(fit.errors, rel=0.15)
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(found.errors)
    assert (found.intervals[:, 0] < fit.values).all()
    assert (found.intervals[:, 1] > fit.values).all()


def test_correlated_residuals_have_the_spread_of_repeated_measurements() -> None:
    fits = [fitted(0.8, seed) for seed in range(60)]
    spread = np.std([fit.values for fit in fits], axis=0, ddof=1)
    naive = np.mean([fit.errors for fit in fits], axis=0)
    blocks = np.mean([block_bootstrap(fit, draws=300).errors for fit in fits], axis=0)
    assert (spread > 2 * naive).all(), "an AR(1) of 0.8 makes errors three times as large"
    # sixty repetitions know the spread to a tenth; blocks of finite length fall a little short
    assert blocks == pytest.approx(spread, rel=0.35)


def test_slopes_are_those_of_the_model() -> None:
    fit = fitted(0.0, 3)
    size, rate = fit.values
    assert fit.slopes[:, 0] == pytest.approx(np.exp(-rate * T), rel=1e-5)
    assert fit.slopes[:, 1] == pytest.approx(-size * T * np.exp(-rate * T), abs=1e-5)


def test_block_length_grows_with_correlation_and_stays_within_the_record() -> None:
    lengths = [block_length(noise(rho, 5)) for rho in (0.0, 0.5, 0.9)]
    assert lengths == sorted(lengths)
    assert lengths[0] <= 4
    assert block_length(np.ones(10) + 1e-3 * np.arange(10)) <= 2


def test_the_same_seed_gives_the_same_answer() -> None:
    fit = fitted(0.5, 2)
    assert (block_bootstrap(fit).errors == block_bootstrap(fit).errors).all()
    assert (block_bootstrap(fit, seed=1).errors != block_bootstrap(fit).errors).all()
