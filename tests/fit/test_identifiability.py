"""What the data determine, by name."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.identifiability import diagnose
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 300)


def two_decays(values: Array) -> Array:
    a, p, b, q = (values[:, k : k + 1] for k in range(4))
    return np.asarray(a * np.exp(-p * T) + b * np.exp(-q * T))


def fitted(truth: list[float], noise: float, seed: int = 1) -> FitResult:
    data = two_decays(np.array([truth]))[0] + noise * np.random.default_rng(seed).standard_normal(len(T))
    return fit_data(two_decays, data, ("a", "p", "b", "q"), np.array(truth))


def test_well_separated_decays_are_determined() -> None:
    found = diagnose(fitted([1.0, 0.3, 1.0, 4.0], 0.01))
    assert (found.rank, found.parameters) == (4, 4)
    assert found.determined
    assert found.condition < 20
    assert (found.loose, found.alike, found.open, found.merged) == ((), (), (), ())


def test_decays_that_are_nearly_one_are_not_and_the_pairs_are_named() -> None:
    found = diagnose(fitted([1.0, 0.8, 1.0, 1.2], 0.02))
    assert not found.determined
    assert found.condition > 50
    assert found.loose
    assert any({a, b} == {"a", "b"} and value < -0.98 for a, b, value in found.alike)
    assert "have the same effect" in found.reason
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["determined"] is False


def test_an_open_profile_is_named() -> None:
    """A leak too small to be seen: its resistance has a least value and no largest."""
    data = np.exp(-T) + 0.05 * np.random.default_rng(3).standard_normal(len(T))
    found = diagnose(
        fit_data(lambda v: v[:, :1] * np.exp(-T) + 1 / v[:, 1:2], data, ("size", "leak"), np.array([1.0, 100.0]))
    )
    assert found.open == ("leak has no upper limit",)
    assert "profile open" in found.reason


def test_branches_with_one_time_constant_are_one() -> None:
    """And parameters that were fixed because nothing feels them count too."""
    fit = fitted([1.0, 0.3, 1.0, 4.0], 0.01)
    merged = diagnose(fit, branches=[(10.0, 0.1), (10.0, 0.11), (50.0, 1.0)])
    assert merged.merged == ("1 and 2",)
    assert not merged.determined
    unfelt = diagnose(fit, unfelt=["cpe_exponent"])
    assert not unfelt.determined
    assert unfelt.reason == "no effect on the data: cpe_exponent"


def test_the_rank_counts_what_is_known_to_a_factor_of_e() -> None:
    data = np.random.default_rng(0).standard_normal(len(T)) + 5.0
    fit = fit_data(lambda v: v[:, :1] + 0.05 * np.log(v[:, 1:]) * T, data, ("sure", "unsure"), np.array([5.0, 1.0]))
    found = diagnose(fit)
    assert fit.errors[1] / fit.values[1] > 0.5
    assert found.rank == int((np.linalg.svd(fit.slopes * fit.values / np.std(fit.residuals, ddof=2))[1] > 1).sum())
    assert "unsure" in found.loose
