"""Propagation over intervals, against the eigenvalues of matrices that are diagonal in a known basis."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.solve import propagators
from ilg_circuit.solve.propagators import Halves, Propagators

#: Poles of eight decades [1/s], and a basis that is far from orthogonal but well conditioned.
POLES = -(10.0 ** np.linspace(-2, 6, 9))
BASIS = np.eye(9) + 0.2 * np.random.default_rng(5).standard_normal((9, 9))
MATRIX = (BASIS * POLES @ np.linalg.inv(BASIS))[None]
START = np.random.default_rng(6).standard_normal((1, 9, 1))


def after(width: float) -> np.ndarray:
    """Return the state (9,) after ``width`` [s]."""
    return np.asarray(BASIS @ (np.exp(POLES * width) * np.linalg.solve(BASIS, START[0, :, 0])))


@pytest.mark.parametrize("width", [10.0, 9.999999, 3.7, 0.1, 1e-5, 3e-9, 0.0])
def test_a_width_is_the_sum_of_halves(width: float) -> None:
    found = Halves(MATRIX, 10.0).after(width, START)[0, :, 0]
    np.testing.assert_allclose(found, after(width), rtol=0, atol=1e-9 * np.abs(START).max())


@pytest.mark.parametrize("count", [3, 300])
def test_a_state_goes_through_regular_and_irregular_intervals(count: int) -> None:
    """Half of the widths are drawn, half are one: of 300 the drawn ones are made of halves."""
    widths = np.where(np.arange(count) % 2, 0.01, np.random.default_rng(7).uniform(0.0, 0.02, count))
    fractions = np.array([0.3, 1.0])
    through = Propagators(MATRIX, widths, fractions)
    x, time = START, 0.0
    for k, width in enumerate(widths.tolist()):
        states = through.after(k, x)[0]
        for fraction, state in zip(fractions.tolist(), states, strict=True):
            np.testing.assert_allclose(state, after(time + fraction * width), rtol=0, atol=1e-8)
        x, time = states[-1][None, :, None], time + width


def test_exponentials_are_computed_once_and_as_many_kept_as_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    real = propagators.exponentials
    monkeypatch.setattr(propagators, "exponentials", lambda m, widths: made.append(widths) or real(m, widths))
    widths = np.resize([0.01, 0.03], 100)
    through = Propagators(MATRIX, widths, np.ones(1))
    for k in range(len(widths)):
        through.after(k, START)
    assert len(made) == 2
    monkeypatch.setattr(propagators, "_MOST_KEPT", 3 * MATRIX.size)
    through = Propagators(MATRIX, np.resize(0.01 * np.array([1.0, 3.0, 7.0, 11.0, 13.0]), 100), np.ones(1))
    kept = []
    for k in range(100):
        through.after(k, START)
        kept.append(len(through._kept))
    assert max(kept) == 3


def test_nothing_moves_without_a_matrix_or_time() -> None:
    assert (Halves(0 * MATRIX, 5.0).after(5.0, START) == START).all()
    assert (Halves(MATRIX, 0.0).after(0.0, START) == START).all()
