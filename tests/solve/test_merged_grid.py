"""Nodes and samples of one piece of the grid, put together."""

from __future__ import annotations

import numpy as np

from ilg_circuit.solve.grid import _merged


def test_samples_beyond_a_piece_and_beside_its_ends_are_not_in_it() -> None:
    piece, near = np.array([1.0, 1.5, 2.0]), 1e-9
    samples = np.array([0.2, 1.0 + near / 2, 1.25, 1.5 + near / 2, 2.0 - near / 2, 2.0 + near / 2, 3.0])
    # the node at 1.5 gives way to the sample beside it; the ends stay
    assert _merged(piece, samples, near).tolist() == [1.0, 1.25, 1.5 + near / 2, 2.0]
