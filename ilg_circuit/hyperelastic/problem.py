"""Turns the stresses of load tests into observations, and makes the problem of fitting terms to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..fit.observation import Observation
from ..fit.parameter import Parameter
from ..fit.problem import Problem
from ..measurements.load_test import LoadTest
from .material import stress_basis, stress_derivatives

#: Number of readings of all tests together in the search; the last descent uses all of them.
MOST_READINGS = 300


def stress_observation(test: LoadTest, sigma: Array, signs: Array) -> Observation:
    """Return the nominal stress of a load test as an observation of terms whose moduli have ``signs``.

    ``sigma`` (m,) [Pa] is the standard deviation by which its residuals are divided.
    """
    n = len(signs)

    def predict(sets: Array) -> Array:
        basis = stress_basis(test.mode, test.stretch, sets[:, None, n:])
        return (basis * (signs * sets[:, :n])[:, None]).sum(axis=-1)

    def derivatives(p: Array) -> Array:
        slopes = stress_derivatives(test.mode, test.stretch, signs * p[:n], p[n:])
        slopes[:, :n] *= signs
        return slopes

    return Observation(
        source=test.source,
        quantity="stress",
        unit="Pa",
        x=test.path,
        data=test.stress,
        names=_names(n),
        predict=predict,
        nuisance=np.zeros((len(test.stress), 0)),
        sigma=sigma,
        size=float(np.abs(test.stress).max()),
        derivatives=derivatives,
    )


def residual_units(tests: tuple[LoadTest, ...], weighting: str) -> list[Array]:
    """Return the standard deviation [Pa] of each reading, by test: the largest stress over the reading's weight."""
    stress = np.concatenate([t.stress for t in tests])
    scale = float(np.abs(stress).max())
    weights = np.ones_like(stress)
    if weighting == "relative":
        weights = 1 / np.maximum(np.abs(stress / scale), 0.01)
        weights /= np.sqrt(np.mean(weights**2))
    return np.split(scale / weights, np.cumsum([len(t.stress) for t in tests])[:-1])


def stress_problem(
    tests: Sequence[LoadTest],
    sigmas: Sequence[Array],
    fixed: tuple[float, ...] | None,
    steepest: float,
    signs: Array,
) -> Problem:
    """Return the problem of ``tests`` and terms whose moduli have ``signs``, with alphas up to ``steepest``."""
    n, names = len(signs), _names(len(signs))
    moduli = [Parameter(name, "g", "Pa", "size of a term's part of the shear modulus") for name in names[:n]]
    alphas = [Parameter(name, "alpha", "", "exponent", -steepest, steepest) for name in names[n:]]
    observations = tuple(stress_observation(t, s, signs) for t, s in zip(tests, sigmas, strict=True))
    held = dict(zip(names[n:], fixed, strict=True)) if fixed else {}
    return Problem(observations, (*moduli, *alphas), fixed=held)


def thinned(tests: tuple[LoadTest, ...], sigmas: list[Array]) -> tuple[list[LoadTest], list[Array]]:
    """Return a few hundred readings, for the search from many starts; all of them if there are no more."""
    step = -(-sum(len(t.stretch) for t in tests) // MOST_READINGS)
    kept, units = [], []
    for t, sigma in zip(tests, sigmas, strict=True):
        n = len(t.stretch)
        every = step if n > 10 * step else 1  # a test of few readings keeps them all
        # the last reading, where the material is stiffest, is kept
        part = np.argsort(t.stretch, kind="stable")[(n - 1) % every :: every]
        kept.append(replace(t, stretch=t.stretch[part], stress=t.stress[part], branch=t.branch or "all"))
        units.append(sigma[part])
    return kept, units


def _names(terms: int) -> tuple[str, ...]:
    return tuple(f"{kind}_{i + 1}" for kind in ("modulus", "alpha") for i in range(terms))
