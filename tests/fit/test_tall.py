"""Matrices of long records are factored by blocks of rows: the same numbers, without copies."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np

from ilg_circuit.fit.observation import observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem
from ilg_circuit.fit.tall import blocks, lengths, products, triangle

RANDOM = np.random.default_rng(5)
MATRIX = RANDOM.standard_normal((100_000, 4)) * np.array([1.0, 1e-3, 1e6, 10.0])


def test_blocks_hold_every_row_once() -> None:
    rows = np.concatenate([np.arange(len(MATRIX))[part] for part in blocks(len(MATRIX))])
    assert np.array_equal(rows, np.arange(len(MATRIX)))


def test_the_factor_is_that_of_the_whole_matrix() -> None:
    size = lengths(MATRIX)
    assert np.allclose(size, np.linalg.norm(MATRIX, axis=0), rtol=1e-12)
    found, expected = triangle(MATRIX, size), np.linalg.qr(MATRIX / size, mode="r")
    assert np.allclose(np.abs(found), np.abs(expected), atol=1e-12)


def test_products_are_those_of_the_projected_matrix() -> None:
    basis = np.linalg.qr(np.column_stack([np.ones(len(MATRIX)), np.arange(len(MATRIX))]))[0]
    across = MATRIX - basis @ (basis.T @ MATRIX)
    scale = np.outer(lengths(MATRIX), lengths(MATRIX))
    assert np.allclose(products(MATRIX, basis) / scale, across.T @ across / scale, atol=1e-12)


def test_a_factor_takes_less_memory_than_the_matrix() -> None:
    size = lengths(MATRIX)
    tracemalloc.start()
    try:
        triangle(MATRIX, size)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < MATRIX.nbytes


def test_products_of_slopes_are_those_of_the_projected_slopes() -> None:
    """Of two observations, the second with other linear terms than the first, and other weights."""
    t = np.linspace(0.1, 5.0, 40)
    first = observation(lambda v: v[:, :1] * np.exp(-t / v[:, 1:]), 0 * t, ("size", "time"), nuisance=np.ones((40, 1)))
    terms = np.column_stack([np.ones(40), t])
    second = replace(first, nuisance=terms, sigma=np.linspace(1.0, 2.0, 40))
    problem = Problem((first, second), (Parameter("size"), Parameter("time")))
    x = problem.scales.coordinates(np.array([2.0, 0.7]))
    slopes = problem.derivatives(x)[1]
    projected = slopes - problem.nuisance @ np.linalg.lstsq(problem.nuisance, slopes, rcond=None)[0]
    assert np.allclose(problem.products(slopes), projected.T @ projected, rtol=1e-10)
    assert np.allclose(problem.information(x), projected.T @ projected, rtol=1e-7)
    assert np.allclose(problem.projected(slopes.T).T, projected, atol=1e-12)
