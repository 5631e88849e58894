"""Nodes and samples of one piece of the grid, put together."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.solve.grid import _graded, _merged


def test_samples_beyond_a_piece_and_beside_its_ends_are_not_in_it() -> None:
    piece, near = np.array([1.0, 1.5, 2.0]), 1e-9
    samples = np.array([0.2, 1.0 + near / 2, 1.25, 1.5 + near / 2, 2.0 - near / 2, 2.0 + near / 2, 3.0])
    # the node at 1.5 gives way to the sample beside it; the ends stay
    assert _merged(piece, samples, near).tolist() == [1.0, 1.25, 1.5 + near / 2, 2.0]


def test_after_a_short_step_steps_grow_evenly_to_the_next() -> None:
    nodes = _graded(np.array([0.0, 1.0, 2000.0]), before=1e-7)
    steps = 1e-7 * 1e7 ** (np.arange(1, 4) / 4)  # no more than a hundred times from one to the next
    later = 1999.0 ** (1 / 2)
    assert nodes == pytest.approx([0.0, *steps, 1.0, 1.0 + later, 2000.0], rel=1e-12)
