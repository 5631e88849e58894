"""What the data determine, by name; and that no other model is chosen."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.result import FitResult
from ilg_circuit.identify.scout import Scouting
from numpy.typing import NDArray
from synthetic import record, step, two_branches

from ilg_circuit.errors import SolveError
from ilg_circuit.fit.identifiability import diagnose
from ilg_circuit.identify import identify, selection
from ilg_circuit.identify.current import CurrentFit, fit_current

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
    assert "act alike" in found.reason
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["determined"] is False


def test_an_open_profile_is_named() -> None:
    """A record that ends long before the steady current leaves Rdc without an upper limit."""
    found = fit_current(record(step(), 6.0, 101, noise=0.003, seed=44).measurement(), 0.0, "rc", "exact")
    assert "dc_resistance has no upper limit" in found.identifiability.open
    assert any("profile open" in w for w in found.warnings)


def test_the_rank_counts_what_is_known_to_a_factor_of_e() -> None:
    data = np.random.default_rng(0).standard_normal(len(T)) + 5.0
    fit = fit_data(lambda v: v[:, :1] + 0.05 * np.log(v[:, 1:]) * T, data, ("sure", "unsure"), np.array([5.0, 1.0]))
    found = diagnose(fit)
    assert fit.errors[1] / fit.values[1] > 0.5
    assert found.rank == int((np.linalg.svd(fit.slopes * fit.values / np.std(fit.residuals, ddof=2))[1] > 1).sum())
    assert "unsure" in found.loose


@pytest.mark.parametrize("seed", range(3))
def test_whatever_auto_takes_beyond_rc_is_determined(seed: int) -> None:
    r = record(step(), 60.0, 151, strip=two_branches(), noise=0.005, seed=seed)
    found = identify(r.measurement(), base=r.strip, engine="exact")
    assert found.model == "rc" or found.current.identifiability.determined


@pytest.fixture(scope="module")
def fits() -> dict[str, CurrentFit]:
    m = record(step(), 300.0, 151, strip=two_branches(), noise=1e-3, seed=5).measurement()
    return {model: fit_current(m, 0.0, model, "exact") for model in ("rc", "rc2")}


def chosen_among(fits: dict[str, CurrentFit]) -> tuple[str, selection.Candidate]:
    """The model that is chosen of these fits, and what becomes of rc2."""

    def fit(measurement: object, held: float, model: str) -> CurrentFit:
        if model not in fits:
            raise SolveError("not among them")
        return fits[model]

    m = record(step(), 300.0, 151, strip=two_branches(), noise=1e-3, seed=5).measurement()
    chosen, candidates = selection.choose(m, 0.0, fit, [])
    return chosen.model, next(c for c in candidates if c.model == "rc2")


def test_a_best_fit_that_is_not_determined_is_not_chosen_and_the_verdict_says_why(fits: dict[str, CurrentFit]) -> None:
    assert chosen_among(fits)[0] == "rc2"
    vague = replace(fits["rc2"].identifiability, rank=4, open=("capacitance_2 has no upper limit",))
    model, candidate = chosen_among(fits | {"rc2": replace(fits["rc2"], identifiability=vague)})
    assert model == "rc"
    assert "rank 4 of 5; profile open: capacitance_2 has no upper limit" in candidate.verdict
    entry = candidate.to_json()["identifiability"]
    assert isinstance(entry, dict)
    assert (entry["rank"], entry["determined"]) == (4, False)


def test_a_best_fit_reached_only_once_is_not_chosen(fits: dict[str, CurrentFit]) -> None:
    lucky = replace(fits["rc2"], scouting=Scouting(fits["rc2"].fit.values, 15, 1))
    model, candidate = chosen_among(fits | {"rc2": lucky})
    assert model == "rc"
    assert "not reached a second time" in candidate.verdict
