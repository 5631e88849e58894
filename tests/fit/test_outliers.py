"""Outliers: single rows far off their neighbours and the model are named, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.fit.outliers import outlying
from ilg_circuit.identification.outliers import spikes
from ilg_circuit.measurements.record import Channel

Array = NDArray[np.float64]
TIME = np.linspace(-2.0, 40.0, 421)
PIECES = (TIME >= 0).astype(np.intp)


def transient(tau: float, noise: float, seed: int) -> tuple[Array, Array]:
    """A current of two relaxations, and the residuals of the best single one with an offset: smooth, and large."""
    after = np.maximum(TIME, 0)
    data = np.where(TIME >= 0, 0.3 + np.exp(-after / tau) + 0.6 * np.exp(-after / (8 * tau)), 0.0)
    data = data + noise * np.random.default_rng(seed).standard_normal(len(TIME))
    basis = np.column_stack([np.ones(len(TIME)), TIME >= 0, np.where(TIME >= 0, np.exp(-after / (3 * tau)), 0.0)])
    return data, data - basis @ np.linalg.lstsq(basis, data, rcond=None)[0]


def test_no_false_row_though_the_model_is_too_simple() -> None:
    named = 0
    for seed in range(200):
        random = np.random.default_rng([seed, 1])
        data, residuals = transient(10 ** random.uniform(-1, 1), 10 ** random.uniform(-5, -2), seed)
        named += int(outlying(data, residuals, PIECES, 0.0).sum())
    assert named == 0


def test_spikes_of_a_twentieth_of_the_peak_are_named() -> None:
    found = 0
    for seed in range(100):
        random = np.random.default_rng([seed, 2])
        data, _ = transient(2.0, 2e-3, seed)
        residuals = data - transient(2.0, 0.0, seed)[0]
        rows = random.choice(np.arange(30, len(TIME) - 3), 3, replace=False)
        rows = rows[np.r_[True, np.diff(np.sort(rows)) > 3]]
        spikes = np.zeros(len(TIME))
        spikes[rows] = 0.05 * float(np.ptp(data)) * random.choice([-1, 1], len(rows))
        named = outlying(data + spikes, residuals + spikes, PIECES, 0.0)
        found += int(named[rows].all() and named.sum() == len(rows))
    assert found >= 95


def test_first_rows_are_named_only_where_they_answer_less_than_the_next() -> None:
    """A reading taken before the step is one; a fast first row is what a passive strip does."""
    data, _ = transient(2.0, 1e-3, 0)
    residuals = data - transient(2.0, 0.0, 0)[0]
    first = int(np.argmax(TIME >= 0))
    for size, expected in ((-1.5, True), (+1.5, False)):
        changed = np.zeros(len(TIME))
        changed[first] = size
        named = outlying(data + changed, residuals + changed, PIECES, 0.0)
        assert named[first] == expected
        assert not outlying(data + changed, residuals + changed, PIECES, 0.0, jumps=False)[first]


@pytest.mark.parametrize("grain", [0.0, 0.05])
def test_a_digit_is_no_outlier(grain: float) -> None:
    data, _ = transient(2.0, 1e-4, 0)
    residuals = data - transient(2.0, 0.0, 0)[0]
    residuals[200] += 0.04
    assert outlying(data, residuals, PIECES, grain)[200] == (grain == 0.0)


@pytest.mark.parametrize("rows", [50, 171, 321])
def test_no_row_of_a_noisy_displacement_is_a_spike(rows: int) -> None:
    """Neither within the record nor at its ends, where few rows tell the noise."""
    time = np.arange(rows) - 20.0
    clean = 1e-3 * (1 - np.exp(-np.maximum(time, 0.0) / 30))
    named = 0
    for seed in range(100):
        noise = 6e-6 * np.random.default_rng(seed).standard_normal(rows)
        named += int(spikes(Channel(time, clean + noise), PiecewiseLinear.step(4.0)).sum())
    assert named == 0


def test_a_fast_first_row_of_a_record_without_rest_is_no_outlier() -> None:
    """The record begins at an edge, before which the current was zero."""
    data, _ = transient(2.0, 1e-3, 0)
    data, pieces = data[TIME >= 0], PIECES[TIME >= 0]
    residuals = 1e-3 * np.random.default_rng(1).standard_normal(len(data))
    for first, named in ((data[1] + 0.5, []), (0.0, [0])):
        away = np.r_[first - data[0], np.zeros(len(data) - 1)]
        assert np.flatnonzero(outlying(data + away, residuals + away, pieces, 0.0)).tolist() == named
