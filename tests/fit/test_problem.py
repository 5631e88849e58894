"""Shared and per-record parameters in one least squares, held against scipy's and what is known of an exponential."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import curve_fit

from ilg_circuit.errors import SolveError
from ilg_circuit.fit.bootstrap import block_bootstrap
from ilg_circuit.fit.fitting import fit, fit_without
from ilg_circuit.fit.observation import Observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem
from ilg_circuit.fit.reported import correlated
from ilg_circuit.fit.result import FitResult
from ilg_circuit.identification.port_start import combined

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 200)
NAMES = ("size", "rate")
PARAMETERS = tuple(map(Parameter, NAMES))


def decay(values: Array) -> Array:
    return np.asarray(values[:, :1] * np.exp(-values[:, 1:] * T))


def observed(source: str, data: Array, sigma: float) -> Observation:
    """An exponential with an offset of its own."""
    return Observation(source, "y", "", T, data, NAMES, decay, np.ones((len(T), 1)), sigma)


def part(
    source: str, size: float, rate: float, *, offset: float = 0.0, noise: float = 0.01, seed: int = 0
) -> Observation:
    data = size * np.exp(-rate * T) + offset + noise * np.random.default_rng(seed).standard_normal(len(T))
    return observed(source, data, noise)


def fitted(*parts: Observation, per_record: frozenset[str] = frozenset()) -> FitResult:
    problem = Problem(parts, PARAMETERS, per_record)
    return fit(problem, np.ones(len(problem.labels)))


def test_values_and_errors_are_scipy_s() -> None:
    parts = [part("a", 2.0, 0.7, offset=0.5, seed=1), part("b", 2.0, 0.7, noise=0.03, seed=2)]
    found = fitted(*parts)

    def both(_: Array, size: float, rate: float, first: float, second: float) -> Array:
        wave = size * np.exp(-rate * T)
        return np.concatenate([wave + first, wave + second])

    data = np.concatenate([p.data for p in parts])
    sigma = np.repeat([0.01, 0.03], len(T))
    values, covariance = curve_fit(both, np.tile(T, 2), data, [1.0, 1.0, 0.0, 0.0], sigma=sigma)
    assert found.values == pytest.approx(values[:2], rel=1e-6)
    assert found.nuisance == pytest.approx(values[2:], abs=1e-6)
    assert found.nuisance_of(1) == pytest.approx(values[3:], abs=1e-6)
    pooled = np.sqrt(np.diag(covariance))[:2]
    assert found.pooled_errors == pytest.approx(pooled, rel=1e-3)
    assert found.errors == pytest.approx(pooled, rel=0.1), "each observation has a variance of its own"


def test_each_observation_s_variance_counts_where_sigmas_are_wrong() -> None:
    """The noise of one file is ten times what its sigma says; errors are the spread of repeated measurements."""

    def made(seed: int) -> FitResult:
        loud = part("b", 2.0, 0.7, noise=0.1, seed=2 * seed + 1)
        return fitted(part("a", 2.0, 0.7, seed=2 * seed), observed("b", loud.data, 0.01))

    fits = [made(seed) for seed in range(80)]
    spread = np.std([f.values for f in fits], axis=0, ddof=1)
    assert np.mean([f.errors for f in fits], axis=0) == pytest.approx(spread, rel=0.25)


def test_a_parameter_per_record_is_each_source_s_and_its_mean_geometric() -> None:
    found = fitted(part("a", 2.0, 0.7, seed=1), part("b", 4.5, 0.7, seed=2), per_record=frozenset({"size"}))
    assert found.labels == ("size[a]", "size[b]", "rate")
    assert found.values == pytest.approx([2.0, 4.5, 0.7], rel=0.02)
    assert [found.means[name] for name in NAMES] == pytest.approx([3.0, 0.7], rel=0.02)
    own = np.array([found.by_label()["size[b]"], found.by_label()["rate"]])
    assert found.fitted(1) == pytest.approx(found.problem.observations[1].fitted(own), abs=1e-6)
    assert found.residuals_of(1) == pytest.approx(found.problem.observations[1].data - found.fitted(1))


def test_a_fixed_value_does_not_move() -> None:
    problem = Problem((part("a", 2.0, 0.7),), PARAMETERS).holding("rate", 0.7)
    found = fit(problem, np.ones(1))
    assert found.labels == ("size",)
    assert found.by_label() == {"size": pytest.approx(2.0, rel=0.01), "rate": 0.7}


def test_observations_that_share_no_parameter_are_fitted_by_themselves() -> None:
    a, b = part("a", 2.0, 0.7, seed=1), part("b", 4.5, 0.3, seed=2)
    found = fitted(a, b, per_record=frozenset(NAMES))
    assert found.problem.components() == [[0], [1]]
    assert len(found.parts) == 2
    for source, alone in (("a", fitted(a)), ("b", fitted(b))):
        at = [found.labels.index(f"{name}[{source}]") for name in NAMES]
        assert found.values[at] == pytest.approx(alone.values, rel=1e-9)
        assert found.errors[at] == pytest.approx(alone.errors, rel=1e-9)
    assert found.correlations[found.labels.index("size[a]"), found.labels.index("size[b]")] == 0


def test_without_one_is_the_fit_of_the_others() -> None:
    parts = [part(name, 2.0, 0.7, seed=k) for k, name in enumerate("abc")]
    left = fit_without(fitted(*parts), [1])
    assert left.values == pytest.approx(fitted(parts[0], parts[2]).values, rel=1e-4)
    assert [o.source for o in left.problem.observations] == ["a", "c"]


def test_what_the_others_do_not_hold_cannot_be_predicted() -> None:
    ones = np.ones((len(T), 1))
    flat = Observation("flat", "y", "", T, np.zeros(len(T)), NAMES, lambda v: np.zeros((len(v), len(T))), ones, 0.01)
    with pytest.raises(SolveError):
        fit_without(fitted(part("a", 2.0, 0.7), flat), [0])


def test_each_observation_is_drawn_from_its_own_residuals() -> None:
    """Noise that wanders in one file alone: its blocks are its own, and the other's small noise stays small."""
    random = np.random.default_rng(5)
    wander = np.convolve(random.standard_normal(len(T) + 9), np.ones(10) / 3, mode="valid")
    quiet = part("quiet", 2.0, 0.7, noise=0.001, seed=1)
    found = fitted(quiet, observed("loud", 2.0 * np.exp(-0.7 * T) + 0.1 * wander, 0.1), per_record=frozenset({"size"}))
    assert correlated(found)
    errors = dict(zip(found.labels, block_bootstrap(found).errors.tolist(), strict=True))
    assert errors["size[quiet]"] < 0.002
    assert errors["size[loud]"] > 0.02


def test_individual_answers_are_combined_by_what_each_knows() -> None:
    parts = [part("a", 2.0, 0.7, noise=0.001, seed=1), part("b", 2.0, 0.7, noise=0.1, seed=2)]
    individual = [fitted(p) for p in parts]
    values = combined([*PARAMETERS, Parameter("unseen")], individual, [200.0, 200.0])
    joint = fitted(*parts)
    assert values[:2] == pytest.approx(joint.values, rel=1e-3)
    assert np.isnan(values[2])
    at = joint.problem.scales.coordinates(values[None, :2])
    assert joint.problem.sum_of_squares(at)[0] == pytest.approx(joint.sum_of_squares, rel=0.01)


def test_derivatives_that_observations_give_are_those_of_the_coordinates() -> None:
    """Of a positive parameter, one between limits, one without, one held and one a record; against differences."""
    names = ("size", "rate", "shift", "power")
    limits = (Parameter("size"), Parameter("rate", upper=2.0), Parameter("shift", lower=-np.inf), Parameter("power"))

    def wave(v: Array) -> Array:
        return np.asarray(v[:, :1] * np.exp(-((v[:, 1:2] * T) ** v[:, 3:])) + v[:, 2:3] * T)

    def slopes(v: Array) -> Array:
        decayed, z = np.exp(-((v[1] * T) ** v[3])), (v[1] * T) ** v[3]
        logs = np.log(np.maximum(v[1] * T, 1e-300))
        return np.stack([decayed, -v[0] * decayed * v[3] * z / v[1], T, -v[0] * decayed * z * logs], axis=1)

    def made(given: bool) -> Problem:
        parts = tuple(
            Observation(source, "y", "", T, np.zeros(len(T)), names, wave, np.ones((len(T), 1)), sigma,
                        derivatives=slopes if given else None)
            for source, sigma in (("a", 0.5), ("b", np.linspace(1.0, 3.0, len(T))))
        )  # fmt: skip
        return Problem(parts, limits, frozenset({"size"})).holding("power", 1.3)

    x = np.array([0.7, -0.4, 0.5, -1.2])
    assert made(True).labels == ("size[a]", "size[b]", "rate", "shift")
    (at, exact), (same, differences) = made(True).derivatives(x), made(False).derivatives(x)
    assert exact == pytest.approx(differences, abs=1e-7 * np.abs(exact).max())
    assert at == pytest.approx(same)
