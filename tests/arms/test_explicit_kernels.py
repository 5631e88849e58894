"""Small kernels of the explicit method: the activation between its times, and the step to the next stop."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.arms.explicit import Integration, interpolate, next_step


def integration(times: list[float], step: float = 1.0, now: float = 0.0) -> Integration:
    """One cell, whose activation in three channels is 1, 10 and 100 times its place among ``times``; stops at 1, 4."""
    values = np.arange(len(times), dtype=float)[:, None, None] * np.array([1.0, 10.0, 100.0])
    whole, empty = np.zeros(5, dtype=np.int64), np.zeros((1, 1))
    return Integration(
        np.array([0.0, 1.0, 4.0]), whole[:3], np.array(times), values, np.zeros((3, 2, 2, 4)),
        np.array([now, step, 0, 0, 0, 0, 0, 0]), whole, np.zeros((1, 2, 2, 4)), empty, empty, (1.0, 1.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("times", "at", "place"),
    [
        ([0.0, 2.0, 3.0], -1.0, 0.0),
        ([0.0, 2.0, 3.0], 0.0, 0.0),
        ([0.0, 2.0, 3.0], 0.5, 0.25),
        ([0.0, 2.0, 3.0], 2.0, 1.0),
        ([0.0, 2.0, 3.0], 2.75, 1.75),
        ([0.0, 2.0, 3.0], 3.0, 2.0),
        ([0.0, 2.0, 3.0], 9.0, 2.0),
        ([1.0, 2.0], 1.5, 0.5),
        ([1.0], 0.0, 0.0),
        ([1.0], 5.0, 0.0),
    ],
)
def test_an_activation_is_linear_between_its_times_and_held_outside(
    times: list[float], at: float, place: float
) -> None:
    a = np.full((1, 3), np.nan)
    interpolate(integration(times), at, a)
    assert a[0] == pytest.approx(place * np.array([1.0, 10.0, 100.0]), abs=1e-12)


@pytest.mark.parametrize(
    ("now", "step", "expected"),
    [(0.0, 0.2, (0.2, False)), (0.0, 0.7, (0.5, False)), (0.0, 1.0, (1.0, True)), (0.0, 1 - 1e-12, (1.0, True)),
     (0.0, 5.0, (1.0, True)), (0.9, 0.5, (0.1, True)), (0.9, 0.01, (0.01, False))],
)  # fmt: skip
def test_a_step_ends_at_the_next_stop_or_halfway_at_most(now: float, step: float, expected: tuple[float, bool]) -> None:
    found, ends = next_step(integration([0.0], step, now))
    assert found == pytest.approx(expected[0])
    assert ends == expected[1]
