"""Descents from many starts, on a double well: least at 1, with a second and shallower minimum near -1."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.fit.multistart import StartSummary, search

Array = NDArray[np.float64]


def residuals(x: Array) -> Array:
    return np.array([x[0] ** 2 - 1, 0.3 * (x[0] - 1), 0.5])


def jacobian(x: Array) -> Array:
    return np.array([[2 * x[0]], [0.3], [0.0]])


@pytest.mark.parametrize(
    ("starts", "taken", "agreeing"),
    [
        ([2.0, 1.5, 3.0, 0.9], 2, 2),
        ([-2.0, 2.0, -1.5, 1.5, 3.0], 4, 2),
        ([-2.0, -1.5, 2.0, -3.0], 2, 2),  # no one has seen the other minimum by then
        ([-2.0, 2.0, -3.0], 3, 1),
    ],
)
def test_it_ends_once_enough_starts_agree_on_the_best(starts: list[float], taken: int, agreeing: int) -> None:
    found = search(residuals, jacobian, [np.array([x]) for x in starts], enough=2)
    assert (len(found.runs), found.agreeing) == (taken, agreeing)
    whole = search(residuals, jacobian, [np.array([x]) for x in starts])
    assert len(whole.runs) == len(starts)
    assert whole.best.parameters == pytest.approx([1.0])
    assert whole.best.sum_of_squares == pytest.approx(0.25)
    assert whole.agreeing == sum(x > 0 for x in starts)
    assert whole.near(1e-3) == whole.agreeing
    assert whole.near(2.0) == len(starts)  # the shallower one is at 0.25 and 0.35


def test_starts_where_nothing_is_defined_end_no_search() -> None:
    def undefined(x: Array) -> Array:
        return residuals(x) if x[0] < 5 else np.full(3, np.nan)

    found = search(undefined, jacobian, [np.array([x]) for x in (6.0, 7.0, 8.0, 2.0, 1.5, 3.0)], enough=2, polishes=1)
    assert len(found.runs) == 5
    assert found.best.parameters == pytest.approx([1.0], abs=1e-6)


def test_a_minimum_is_confirmed_by_a_second_start_or_where_there_was_no_other() -> None:
    assert StartSummary(1, 1).confirmed
    assert StartSummary(5, 2).confirmed
    assert not StartSummary(5, 1).confirmed
