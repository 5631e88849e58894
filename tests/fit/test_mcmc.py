"""The Markov chain: Student's t for a linear model, repeatable, and honest about its length."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import t as student

from ilg_circuit.errors import InputError
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.intervals import uncertainties
from ilg_circuit.fit.mcmc import sample
from ilg_circuit.fit.result import FitResult

Array = NDArray[np.float64]
T = np.linspace(-1.0, 1.0, 16)
DESIGN = np.vstack([np.ones_like(T), T])


def fitted(nuisance: Array | None = None) -> FitResult:
    """Linear in the logarithms, in which the prior is flat: the posterior is Student's t exactly."""
    data = np.log([2.0, 1.5]) @ DESIGN + 0.3 * np.random.default_rng(3).standard_normal(len(T))
    return fit_data(lambda v: np.log(v) @ DESIGN, data, ("a", "b"), np.array([1.0, 1.0]), nuisance)


@pytest.mark.parametrize("nuisances", [0, 1])
def test_of_a_linear_model_the_posterior_is_student_s(nuisances: int) -> None:
    pytest.importorskip("emcee")
    fit = fitted(T[:, None] ** 2 if nuisances else None)
    chain = sample(fit, np.ones(2))
    assert chain.converged
    x = np.log(chain.draws)
    errors = fit.errors / fit.values
    for k in range(2):
        for level in (0.025, 0.25, 0.5, 0.75, 0.975):
            quantile = (np.quantile(x[:, k], level) - np.log(fit.values[k])) / errors[k]
            exact = student.ppf(level, fit.degrees_of_freedom)
            # as far as a chain of this length knows a quantile
            draws = len(x) / chain.autocorrelation
            spread = np.sqrt(level * (1 - level) / draws) / student.pdf(exact, fit.degrees_of_freedom)
            assert quantile == pytest.approx(exact, abs=4 * spread)
    wider = sample(fit, np.full(2, 2.0))
    assert np.log(wider.draws).std(axis=0) == pytest.approx(2 * x.std(axis=0), rel=0.25)


def test_the_same_seed_gives_the_same_chain_and_a_short_one_says_so() -> None:
    pytest.importorskip("emcee")
    fit = fitted()
    first, again, other = (sample(fit, np.ones(2), seed=s, most_steps=20) for s in (1, 1, 2))
    assert (first.draws == again.draws).all()
    assert (first.draws != other.draws).any()
    assert not first.converged
    assert "less than the 50" in first.length


def test_without_emcee_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(InputError, match=r"ilg-circuit\[mcmc\]"):
        uncertainties(fitted(), "mcmc")
