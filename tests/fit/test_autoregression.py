"""Autocorrelated residuals: intervals that hold the truth, whatever the correlation, the sampling and the rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ilg_circuit.fit.autoregression import _Noise, _noise, _restricted, _variances, autoregression
from ilg_circuit.fit.fitting import finished, fit_data
from ilg_circuit.fit.intervals import uncertainties
from ilg_circuit.fit.observation import Observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem
from ilg_circuit.fit.reported import autocorrelated, reported_covariance, widening, with_autocorrelation
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 300)


def slopes(t: Array) -> Array:
    """Those of a relaxation, its rate, and an offset."""
    return np.column_stack([np.exp(-t), t * np.exp(-t), np.ones_like(t)])


def dense(steps: Array) -> Array:
    """S, the correlations of all samples whose neighbours correlate by ``steps``."""
    logs = np.concatenate([[0.0], np.cumsum(np.log(steps))])
    return np.exp(-np.abs(logs[:, None] - logs))


def noise(random: np.random.Generator, steps: Array) -> Array:
    """Noise of variance 1 whose neighbours correlate by ``steps``."""
    x = random.standard_normal(len(steps) + 1)
    for k, step in enumerate(steps.tolist(), 1):
        x[k] = step * x[k - 1] + np.sqrt(1 - step**2) * x[k]
    return x


def linear(*rows: tuple[Array, Array, Array], channels: int = 1) -> FitResult:
    """The fit of rows (places, slopes, data), truth 0, by parameters that they share."""
    names = tuple(f"p{k}" for k in range(rows[0][1].shape[1]))

    def row(k: int, x: Array, j: Array, data: Array) -> Observation:
        none = np.zeros((len(data), 0))
        return Observation(f"{k}", "y", "", x, data, names, lambda v: v @ j.T, none, channels=channels)

    problem = Problem(tuple(row(k, *r) for k, r in enumerate(rows)), tuple(Parameter(n, lower=-np.inf) for n in names))
    j, data = np.vstack([r[1] for r in rows]), problem.data
    best = np.asarray(np.linalg.lstsq(j, data, rcond=None)[0], dtype=np.float64)
    return finished(problem, best, np.empty(0), data - j @ best, j, offset=0.0, evaluations=1)


@pytest.mark.parametrize(("phi", "least", "most"), [(0.0, 0.93, 0.97), (0.7, 0.90, 0.97), (0.9, 0.90, 0.97)])
def test_ninety_five_percent_means_that(phi: float, least: float, most: float) -> None:
    """Of 200 sets, as they are reported by default; of these a block bootstrap alone holds the truth in 88 and 79 %."""
    random, hits = np.random.default_rng(4), []
    for _ in range(200):
        found = uncertainties(linear((T, slopes(T), noise(random, np.full(len(T) - 1, phi)))))
        hits.append([low <= 0 <= high for low, high in (e.reported[1] for e in found.estimates.values())])
    assert least <= np.mean(hits) <= most, np.mean(hits, axis=0)


steps = st.lists(st.floats(0.0, 0.99), min_size=8, max_size=30).map(np.array)


@given(steps)
@settings(max_examples=40, deadline=None)
def test_the_noise_is_that_of_its_matrix(correlations: Array) -> None:
    """Products with S and the restricted likelihood, O(n), are those of the dense matrices."""
    random = np.random.default_rng(len(correlations))
    columns = random.standard_normal((len(correlations) + 1, 3))
    matrix = dense(np.maximum(correlations, 1e-300))
    assert _Noise(1.0, correlations).correlated(columns) == pytest.approx(matrix @ columns, abs=1e-9)
    whitened = np.linalg.solve(matrix, columns)
    x, r = columns[:, :2], columns[:, 2]
    information = x.T @ whitened[:, :2]
    power = r @ whitened[:, 2] - r @ whitened[:, :2] @ np.linalg.solve(information, x.T @ whitened[:, 2])
    logs = np.linalg.slogdet(matrix)[1] + np.linalg.slogdet(information)[1]
    expected = 0.5 * (logs + (len(r) - 2) * np.log(power))
    assert _restricted(columns, correlations) == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_variances_are_those_whose_expectation_the_squares_are() -> None:
    """Two rows of one fit, each of whose noise moves the residuals of both."""
    random = np.random.default_rng(0)
    tangent = np.linalg.qr(random.standard_normal((50, 4)))[0]
    rows = [np.arange(30), np.arange(30, 50)]
    matrices, truth = [dense(np.full(29, 0.8)), dense(np.full(19, 0.3))], [2.0, 5.0]
    whole = np.zeros((50, 50))
    for row, matrix, v in zip(rows, matrices, truth, strict=True):
        whole[np.ix_(row, row)] = v * matrix
    left = np.eye(50) - tangent @ tangent.T
    expected = np.diag(left @ whole @ left.T)
    residuals = [np.sqrt(expected[row]) for row in rows]
    spread = [tangent[row].T @ m @ tangent[row] for row, m in zip(rows, matrices, strict=True)]
    assert _variances(residuals, [tangent[row] for row in rows], spread) == pytest.approx(truth, rel=1e-10)


@pytest.mark.parametrize("phi", [0.7, 0.9])
def test_errors_are_those_of_repeated_measurements(phi: float) -> None:
    """Of the correlation itself: REML is not biased by the parameters, as the residuals' own correlation is."""
    random, j = np.random.default_rng(1), slopes(T)
    fits = [autoregression(linear((T, j, noise(random, np.full(len(T) - 1, phi))))) for _ in range(80)]
    inverse = np.linalg.pinv(j)
    truth = np.sqrt(np.diag(inverse @ dense(np.full(len(T) - 1, phi)) @ inverse.T))
    # the mean of eighty scatters by a thirtieth
    assert np.mean([f.errors for f in fits], axis=0) == pytest.approx(truth, rel=0.1)
    assert np.mean([f.correlations for f in fits]) == pytest.approx(phi, abs=0.02)
    assert np.mean([f.samples for f in fits]) == pytest.approx(len(T) * (1 - phi) / (1 + phi), rel=0.2)


def test_noise_that_lives_in_time_or_in_the_index_is_found() -> None:
    """Log-spaced samples: the likelier distance is taken, and by time a long one makes no neighbours."""
    random = np.random.default_rng(2)
    times = np.geomspace(0.01, 5.0, 200)
    gaps = np.diff(times) / np.median(np.diff(times))
    candidates, nothing = (np.ones(199), gaps), np.zeros((200, 0))
    even = [_noise(noise(random, np.full(199, 0.8)), nothing, candidates) for _ in range(20)]
    assert all(np.ptp(found.steps) == 0 for found in even), "by index"
    assert np.mean([found.steps[0] for found in even]) == pytest.approx(0.8, abs=0.05)
    timed = [_noise(noise(random, np.exp(-gaps / 2.0)), nothing, candidates) for _ in range(20)]
    assert all(np.ptp(found.steps) > 0.3 for found in timed), "by time"
    assert np.exp(np.mean([np.log(found.length) for found in timed])) == pytest.approx(2.0, rel=0.2)


def test_rows_are_taken_along_their_places_each_by_itself() -> None:
    """Two channels: one wanders, one does not; the order in which points are given does not matter."""
    random = np.random.default_rng(3)
    j = np.vstack([slopes(T), slopes(T) * [1.0, -1.0, 0.0]])
    data = np.concatenate([noise(random, np.full(len(T) - 1, 0.9)), random.standard_normal(len(T))])
    found = autoregression(linear((T, j, data), channels=2))
    assert found.correlations[0] == pytest.approx(0.9, abs=0.05)
    assert found.correlations[1] < 0.2
    shuffled = random.permutation(len(T))
    both = np.concatenate([shuffled, len(T) + shuffled])
    again = autoregression(linear((T[shuffled], j[both], data[both]), channels=2))
    assert again.errors == pytest.approx(found.errors, rel=1e-5)


def test_an_error_is_never_less_than_the_bootstrap_s() -> None:
    """What the model does not describe under noise: the autoregression sees the noise, blocks see the wave."""
    data = np.random.default_rng(5).standard_normal(len(T)) + np.sin(2 * np.pi * T / 1.7)
    fit = linear((T, slopes(T), data))
    assert autocorrelated(fit)
    reported, alone = with_autocorrelation(fit), autoregression(fit)
    blocks = reported.blocks
    assert (blocks.errors > 1.05 * alone.errors).any()
    assert (reported.errors >= 0.999999 * np.maximum(blocks.errors, alone.errors)).all()
    own = fit.intervals_by(alone.errors, alone.freedom)
    assert (reported.intervals[:, 0] <= np.minimum(blocks.intervals[:, 0], own[:, 0])).all()
    assert (reported.intervals[:, 1] >= np.maximum(blocks.intervals[:, 1], own[:, 1])).all()


def test_one_error_everywhere() -> None:
    """The strip's covariance, the walk of profiles and the table have the error that is reported."""
    fit = linear((T, slopes(T), noise(np.random.default_rng(6), np.full(len(T) - 1, 0.8))))
    entries = [e.to_dict() for e in uncertainties(fit).estimates.values()]
    errors = [entry["stderr_autoregression"] for entry in entries]
    assert np.sqrt(np.diag(reported_covariance(fit))) == pytest.approx(errors)
    assert all(entry["method"] == "autoregression" for entry in entries)
    assert all(entry["stderr_bootstrap"] <= entry["stderr_autoregression"] for entry in entries)
    assert (widening(fit) > np.array(errors) / fit.errors).all(), "Student's t of fewer degrees of freedom"
    blocks = uncertainties(fit, "bootstrap").estimates
    assert [e.reported[0] for e in blocks.values()] == [entry["stderr_bootstrap"] for entry in entries]


def test_the_method_that_allows_for_correlation_can_be_asked_for() -> None:
    fit = linear((T, slopes(T), np.random.default_rng(7).standard_normal(len(T))))
    assert all(e.method == "covariance" for e in uncertainties(fit).estimates.values())
    asked = uncertainties(fit, "autoregression").estimates
    assert all(e.method == "autoregression" for e in asked.values())
    assert [e.reported[0] for e in asked.values()] == pytest.approx(fit.errors, rel=0.3)


@pytest.mark.parametrize("count", [3, 6, 40])
def test_data_that_are_met_exactly_and_short_rows(count: int) -> None:
    """No correlation is made up where nothing is left, or too little to tell."""
    t = np.linspace(0.0, 1.0, count)
    fit = fit_data(lambda v: v[:, :1] * np.exp(-v[:, 1:] * t), 2 * np.exp(-t), ("a", "b"), np.array([1.0, 1.5]))
    found = uncertainties(fit, "autoregression").estimates
    assert all(np.isfinite(e.reported[0]) and e.reported[0] < 1e-6 for e in found.values())
