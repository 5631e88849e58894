"""Balanced states: the same answer from fewer states, whatever the units of those that it is had from."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov

from ilg_circuit.solve.balance import balanced

Array = NDArray[np.float64]

A = np.array([[-1.0, 0.5, 0.0, 0.0], [0.0, -3.0, 1.0, 0.0], [0.2, 0.0, -10.0, 0.0], [0.0, 0.0, 0.0, -2.0]])
B, C = np.array([1.0, 0.5, 2.0, 1.0]), np.array([1.0, -0.3, 0.7, 0.0])  # the last state is not shown


def answer(a: Array, b: Array, c: Array) -> NDArray[np.complex128]:
    return np.array([c @ np.linalg.solve(1j * w * np.eye(len(a)) - a, b) for w in np.geomspace(0.01, 1e3, 30)])


@pytest.mark.parametrize("units", [np.ones(4), np.array([1.0, 1e5, 1e-5, 1e3])])
def test_a_state_that_is_not_seen_is_left_out_and_the_answer_stays(units: Array) -> None:
    a, b, c = balanced(A * units / units[:, None], B / units, C * units)
    assert a.shape == (3, 3)
    assert answer(a, b, c) == pytest.approx(answer(A, B, C), rel=1e-6)
    both = [solve_continuous_lyapunov(a, -np.outer(b, b)), solve_continuous_lyapunov(a.T, -np.outer(c, c))]
    # as much reached as shown, but for the shift of poles by a hundredth
    assert np.diag(both[0]) == pytest.approx(np.diag(both[1]), rel=0.05)
    assert (np.diff(np.diag(both[0])) < 0).all()


def test_fewer_states_are_off_by_no_more_than_twice_what_is_left_out() -> None:
    """Glover's bound, by the Hankel singular values."""
    squares = solve_continuous_lyapunov(A, -np.outer(B, B)) @ solve_continuous_lyapunov(A.T, -np.outer(C, C))
    values = np.sqrt(np.sort(np.linalg.eigvals(squares).real)[::-1][:3])
    for order in (1, 2):
        off = np.abs(answer(*balanced(A, B, C, order)) - answer(A, B, C)).max()
        assert 0.01 * values[order] < off < 2.1 * values[order:].sum()
