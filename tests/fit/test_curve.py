"""The public least-squares call: linear regression as the textbook has it, and no guess sold as an answer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.fit.curve import fit_curve

X = np.linspace(0.0, 5.0, 40)
RANDOM = np.random.default_rng(0)
NOISE = RANDOM.standard_normal(40)


def decay(x: Any, a: float, b: float) -> Any:
    return a * np.exp(-b * x)


def test_a_line_is_linear_regression() -> None:
    y = 2 + 3 * X + 0.1 * NOISE
    found = fit_curve(lambda x, a, b: a + b * x, X, y, [0, 0], names=("a", "b"))
    matrix = np.column_stack([np.ones(40), X])
    expected, squares = np.linalg.lstsq(matrix, y, rcond=None)[:2]
    covariance = float(squares[0]) / 38 * np.linalg.inv(matrix.T @ matrix)
    assert found.labels == ("a", "b")
    assert "b" in found
    assert "c" not in found
    assert found.values == pytest.approx(expected, rel=1e-10)
    assert found.covariance == pytest.approx(covariance, rel=1e-7)
    assert found.residuals_of(0) == pytest.approx(y - matrix @ expected, abs=1e-10)
    assert found.deviation == pytest.approx(np.sqrt(float(squares[0]) / 38))
    assert found.correlations[0, 1] == pytest.approx(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]))
    from scipy.stats import t

    assert found.intervals[1] == pytest.approx(expected[1] + np.array([-1, 1]) * t.ppf(0.975, 38) * found.errors[1])
    assert found.bic - found.aic == pytest.approx(2 * (np.log(40) - 2))


def test_a_line_through_three_points_has_one_degree_of_freedom() -> None:
    """What is left over is (1, -2, 1)/6 times the second difference, here 6: its squares, 6, are the variance."""
    found = fit_curve(lambda x, a, b: a + b * x, np.array([-1.0, 0.0, 1.0]), np.array([0.0, 0.0, 6.0]), [0, 0])
    assert found.degrees_of_freedom == 1
    assert found.errors == pytest.approx([np.sqrt(6 / 3), np.sqrt(6 / 2)])


def test_weights() -> None:
    sigma = np.where(np.arange(40) % 2, 0.01, 1.0)
    y = decay(X, 3, 0.5) + sigma * NOISE
    relative = fit_curve(decay, X, y, [1, 1], sigma=sigma)
    twice = fit_curve(decay, X, y, [1, 1], sigma=2 * sigma)
    absolute = fit_curve(decay, X, y, [1, 1], sigma=sigma, absolute_sigma=True)
    assert twice.errors == pytest.approx(relative.errors, rel=1e-6)
    assert absolute.errors == pytest.approx(relative.errors / relative.deviation, rel=1e-6)
    assert np.abs(relative.values - [3, 0.5]).max() < 0.01


def test_complex_curves() -> None:
    truth = 3 / (1 + 2j * X)
    y = truth + 0.01 * (NOISE + 1j * np.random.default_rng(1).standard_normal(40))
    found = fit_curve(lambda x, a, b: a / (1 + 1j * b * x), X, y, [1, 1])
    assert found.values == pytest.approx([3, 2], rel=0.02)
    assert found.degrees_of_freedom == 78
    real, imaginary = np.split(found.residuals_of(0), 2)
    assert real + 1j * imaginary == pytest.approx(y - found.values[0] / (1 + 1j * found.values[1] * X))


def test_exact_data_leave_no_error() -> None:
    found = fit_curve(decay, X, decay(X, 3, 2), [1, 1])
    assert found.values == pytest.approx([3, 2], rel=1e-12)
    assert found.errors.max() < 1e-12


def test_a_far_start_and_any_seed() -> None:
    y = decay(X, 3, 2) + 0.01 * NOISE
    near = fit_curve(decay, X, y, [3, 2])
    for seed in range(3):
        assert fit_curve(decay, X, y, [1e3, 1e-2], seed=seed).values == pytest.approx(near.values, rel=1e-7)


def test_of_equal_minima_the_nearest_is_given() -> None:
    def two(x: Any, a: float, b: float, c: float, d: float) -> Any:
        return a * np.exp(-b * x) + c * np.exp(-d * x)

    y = two(X, 1, 0.3, 2, 3) + 1e-4 * NOISE
    first, second = (fit_curve(two, X, y, s) for s in ([1, 0.2, 1, 4], [1, 4, 1, 0.2]))
    assert first.values == pytest.approx([1, 0.3, 2, 3], rel=1e-2)
    assert second.values == pytest.approx(first.values[[2, 3, 0, 1]], rel=1e-6)


@pytest.mark.parametrize(
    ("model", "y"),
    [
        (lambda x, a, b: a * b * x, 2 * X + 0.1 * NOISE),  # only the product is there
        (lambda x, a, b: (a + b) * x, 2 * X + 0.1 * NOISE),
        (lambda x, a, b: a * np.exp(-b * x), np.r_[5.0, -0.1 * np.abs(NOISE[1:])]),  # b runs away
        (lambda x, a, b: a + np.floor(b) * x, 2 * X + 0.1 * NOISE),  # b is not felt
        (lambda x, a, b: a + np.sqrt(-1 - b**2) * x, 2 * X + 0.1 * NOISE),  # never a value
    ],
)
def test_what_has_no_answer_is_refused(model: Any, y: Any) -> None:
    with pytest.raises(SolveError, match=r"diverged|did not converge|second time|no finite value"):
        fit_curve(model, X, y, [1, 1])


def test_a_minimum_found_once_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    from ilg_circuit.fit import curve

    monkeypatch.setattr(curve, "_searched", _only_one_run(curve._searched))
    with pytest.raises(SolveError, match="not reached a second time"):
        fit_curve(decay, X, decay(X, 3, 2) + 0.01 * NOISE, [1, 1])


def _only_one_run(original: Any) -> Any:
    from ilg_circuit.fit.multistart import Search

    def searched(*args: Any) -> Any:
        found, own = original(*args)
        return Search(found.runs[:1], 1), own

    return searched


def test_a_point_with_a_slope_is_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    """No offset is small enough: every run then counts as one that still moves."""
    monkeypatch.setattr("ilg_circuit.fit.minimise.OFFSET", 0.0)
    with pytest.raises(SolveError, match="did not converge"):
        fit_curve(decay, X, decay(X, 3, 2) + 0.01 * NOISE, [1, 0.1])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"y": np.r_[np.nan, X[1:]]}, "finite numbers y"),
        ({"y": np.zeros((2, 20))}, "row of finite"),
        ({"start": [np.inf, 1]}, "finite start"),
        ({"start": []}, "finite start"),
        ({"sigma": 0.0}, "positive and finite"),
        ({"x": X[:2], "y": X[:2]}, "2 numbers do not determine 2"),
        ({"x": X[:3]}, r"shape \(3,\) for y of shape \(40,\)"),
        ({"names": ("a",)}, "1 names for 2 parameters"),
    ],
)
def test_wrong_input(arguments: dict[str, Any], said: str) -> None:
    given: dict[str, Any] = {"x": X, "y": decay(X, 3, 2) + 0.01 * NOISE, "start": [1, 1]} | arguments
    with pytest.raises(InputError, match=said):
        fit_curve(decay, given.pop("x"), given.pop("y"), given.pop("start"), **given)
