"""Profile likelihood: exact for linear models, right for others, open where data set no limit, honest if it fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import t as student

from ilg_circuit.errors import SolveError
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.intervals import uncertainties
from ilg_circuit.fit.profile import profile
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 120)
LINE = np.vstack([np.ones_like(T), T])


def fitted(
    model: Callable[[Array], Array], truth: list[float], noise: float, seed: int = 1, offset: bool = False
) -> FitResult:
    wave = model(np.array([truth]))[0]
    data = wave + 0.3 * offset + noise * np.random.default_rng(seed).standard_normal(len(T))
    extra = np.ones((len(T), 1)) if offset else None
    return fit_data(model, data, tuple(f"p{k}" for k in range(len(truth))), np.array(truth), extra)


def line(values: Array) -> Array:
    return values @ LINE


def decay(values: Array) -> Array:
    return values[:, :1] * np.exp(-values[:, 1:2] * T)


@pytest.mark.parametrize("wider", [1.0, 2.5])
def test_of_a_linear_model_it_is_student_s_interval(wider: float) -> None:
    """Whatever the coordinates: the sum of squares is a parabola in the values."""
    fit = fitted(line, [2.0, 0.8], 0.4)
    half = student.ppf(0.975, len(T) - 2) * wider * fit.errors
    for found, value, away in zip(profile(fit, np.full(2, wider)), fit.values, half, strict=True):
        assert (found.low, found.high) == pytest.approx((value - away, value + away), rel=2e-4)


def test_of_a_curve_it_is_what_a_search_by_hand_finds() -> None:
    """The rate's ends, the amplitude and the offset eliminated by linear least squares."""
    fit = fitted(decay, [1.0, 0.6], 0.15, offset=True)
    data = fit.problem.data

    def squares(rate: float) -> float:
        basis = np.column_stack([np.exp(-rate * T), np.ones_like(T)])
        rest = data - basis @ np.linalg.lstsq(basis, data, rcond=None)[0]
        return float(rest @ rest)

    best = minimize_scalar(squares, bounds=(0.05, 5.0), method="bounded", options={"xatol": 1e-9})
    limit = best.fun * (1 + student.ppf(0.975, len(T) - 3) ** 2 / (len(T) - 3))
    ends = [brentq(lambda rate: squares(rate) - limit, *bracket) for bracket in ((0.01, best.x), (best.x, 20.0))]
    found = profile(fit, np.ones(2))[1]
    assert (found.low, found.high) == pytest.approx(ends, rel=1e-3)
    assert found.high - best.x > 1.05 * (best.x - found.low), "the interval is lopsided, as a covariance cannot be"


def test_a_side_without_a_limit_is_open() -> None:
    """A conductance that may be zero: its resistance has a least value and no largest."""

    def leak(values: Array) -> Array:
        return values[:, :1] * np.exp(-T) + 1 / values[:, 1:2]

    fit = fitted(leak, [2.0, 25.0], 0.3, seed=2)
    amplitude, resistance = profile(fit, np.ones(2))
    assert not amplitude.open_below
    assert not amplitude.open_above
    assert resistance.open_above
    conductance, error = 1 / fit.values[1], fit.errors[1] / fit.values[1] ** 2
    least = 1 / (conductance + student.ppf(0.975, len(T) - 2) * error)
    assert resistance.low == pytest.approx(least, rel=1e-3)
    found = uncertainties(fit, "profile")
    entry = found.estimates["p1"].to_dict()
    assert entry["ci95_profile"] == [pytest.approx(least, rel=1e-3), None]
    assert entry["method"] == "profile"
    assert "no upper limit" in entry["method_note"]
    assert [(f.code, f.values["parameter"], f.values["sides"]) for f in found.findings] == [
        ("profile-open", "p1", "upper")
    ]
    assert "the data give no upper limit of p1 within a factor of 1e+06" in str(found.findings[0])


def test_a_profile_that_fails_says_so_and_a_bootstrap_stands_in() -> None:
    fit = fitted(decay, [2.0, 0.7], 0.1)
    rate = float(fit.values[1])

    def walled(values: Array) -> Array:
        if (values[:, 1] > rate * 1.02).any():
            raise SolveError("no circuit beyond")
        return decay(values)

    blind = fit_data(walled, fit.problem.data, fit.labels, fit.values)
    found = uncertainties(blind, "profile")
    spoiled = found.estimates["p1"]
    assert spoiled.method == "bootstrap"
    assert "ended early" in spoiled.note
    assert spoiled.ci95_profile is None
    assert spoiled.reported[1] == spoiled.ci95_bootstrap
    assert ("profile-failed", "p1") in [(f.code, f.values["parameter"]) for f in found.findings]
    assert "p1" in found.details[0]["failed"]


def test_a_profile_with_a_second_minimum_gives_no_interval() -> None:
    """A fit at the lesser of two minima, the ridge between them lower than the criterion: the walk meets the other."""
    random = np.random.default_rng(0)
    basis = np.linalg.qr(random.standard_normal((120, 4)))[0].T
    noise = random.standard_normal(120)
    noise -= basis.T @ (basis @ noise)

    def waves(values: Array) -> Array:
        x, size = values[:, :1], values[:, 1:2]
        return (x - 1) * (x - 3) * basis[0] + 0.3 * (x - 1) * basis[1] + size * basis[2]

    lesser = fit_data(waves, noise + 5 * basis[2], ("place", "size"), np.array([3.2, 5.0]))
    assert lesser.values[0] > 2.5
    assert profile(lesser, np.ones(2))[0].failure
