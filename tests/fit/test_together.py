"""Shared and own parameters in one least squares, held against scipy's and against what is known of a straight line."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import curve_fit

from ilg_circuit.errors import SolveError
from ilg_circuit.fit.bootstrap import block_bootstrap, correlated
from ilg_circuit.fit.together import Parameters, Part, Together, fit_together, squares
from ilg_circuit.identify.joint_start import combined

T = np.linspace(0.0, 5.0, 200)
FREE = np.full(2, np.inf)


def part(source: str, size: float, rate: float, *, offset: float = 0.0, noise: float = 0.01, seed: int = 0) -> Part:
    """size exp(-rate t) with an offset of its own."""
    data = size * np.exp(-rate * T) + offset + noise * np.random.default_rng(seed).standard_normal(len(T))

    def modelled(values: np.ndarray) -> np.ndarray:
        return np.asarray(values[:, :1] * np.exp(-values[:, 1:] * T))

    return Part(source, data, np.ones((len(T), 1)), modelled, noise)


def fitted(*parts: Part, own: frozenset[str] = frozenset()) -> Together:
    return fit_together(parts, Parameters(("size", "rate"), FREE, own), np.tile([1.0, 1.0], (len(parts), 1)))


def test_values_and_errors_are_scipy_s() -> None:
    parts = [part("a", 2.0, 0.7, offset=0.5, seed=1), part("b", 2.0, 0.7, noise=0.03, seed=2)]
    found = fitted(*parts)

    def both(_: np.ndarray, size: float, rate: float, first: float, second: float) -> np.ndarray:
        wave = size * np.exp(-rate * T)
        return np.concatenate([wave + first, wave + second])

    data = np.concatenate([p.data for p in parts])
    sigma = np.repeat([0.01, 0.03], len(T))
    values, covariance = curve_fit(both, np.tile(T, 2), data, [1.0, 1.0, 0.0, 0.0], sigma=sigma)
    assert found.fit.values == pytest.approx(values[:2], rel=1e-6)
    assert found.fit.nuisance == pytest.approx(values[2:], abs=1e-6)
    assert found.fit.errors == pytest.approx(np.sqrt(np.diag(covariance))[:2], rel=1e-3)


def test_an_own_parameter_is_each_part_s_and_its_mean_geometric() -> None:
    found = fitted(part("a", 2.0, 0.7, seed=1), part("b", 4.5, 0.7, seed=2), own=frozenset({"size"}))
    assert found.fit.names == ("size[a]", "size[b]", "rate")
    assert found.values(0) == pytest.approx([2.0, 0.7], rel=0.02)
    assert found.values(1) == pytest.approx([4.5, 0.7], rel=0.02)
    assert found.mean == pytest.approx([3.0, 0.7], rel=0.02)
    assert found.residuals(1) == pytest.approx(found.parts[1].data - found.parts[1].fitted(found.values(1)), abs=1e-6)


def test_without_one_is_the_fit_of_the_others() -> None:
    parts = [part(name, 2.0, 0.7, seed=k) for k, name in enumerate("abc")]
    left = fitted(*parts).without(1)
    alone = fitted(parts[0], parts[2])
    assert left.fit.values == pytest.approx(alone.fit.values, rel=1e-4)
    assert [p.source for p in left.parts] == ["a", "c"]


def test_what_the_others_do_not_hold_cannot_be_predicted() -> None:
    flat = Part("flat", np.zeros(len(T)), np.ones((len(T), 1)), lambda v: np.zeros((len(v), len(T))), 0.01)
    with pytest.raises(SolveError):
        fitted(part("a", 2.0, 0.7), flat).without(0)


def test_each_part_is_drawn_from_its_own_residuals() -> None:
    """Noise that wanders in one part alone: its blocks are its own, and the other's small noise stays small."""
    random = np.random.default_rng(5)
    wander = np.convolve(random.standard_normal(len(T) + 9), np.ones(10) / 3, mode="valid")
    quiet, loud = part("quiet", 2.0, 0.7, noise=0.001, seed=1), part("loud", 2.0, 0.7, noise=0.1, seed=2)
    loud = Part("loud", 2.0 * np.exp(-0.7 * T) + 0.1 * wander, loud.nuisance, loud.modelled, 0.1)
    found = fitted(quiet, loud, own=frozenset({"size", "rate"}))
    assert correlated(found.fit)
    errors = dict(zip(found.fit.names, block_bootstrap(found.fit).errors.tolist(), strict=True))
    assert errors["size[quiet]"] < 0.002
    assert errors["size[loud]"] > 0.02


def test_own_answers_are_combined_by_what_each_knows() -> None:
    parts = [part("a", 2.0, 0.7, noise=0.001, seed=1), part("b", 2.0, 0.7, noise=0.1, seed=2)]
    own = [fitted(p).fit for p in parts]
    names = ("size", "rate", "unseen")
    values = combined(names, np.full(3, np.inf), own, [200.0, 200.0])
    joint = fitted(*parts).fit
    assert values[:2] == pytest.approx(joint.values, rel=1e-3)
    assert np.isnan(values[2])
    assert squares(parts, values[:2]) == pytest.approx(float(joint.residuals @ joint.residuals), rel=0.01)
