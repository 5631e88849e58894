"""Errors of a fit where residuals are autocorrelated, and the tangent at stretch 1 that E is compared with."""

from __future__ import annotations

import numpy as np
import pytest
from gels import TWO, readings

from ilg_circuit.findings import codes
from ilg_circuit.fit.reported import with_autocorrelation
from ilg_circuit.hyperelastic import LoadTest, Ogden, characterise, fit_model
from ilg_circuit.hyperelastic.estimates import derived, parameters
from ilg_circuit.hyperelastic.tangent import SMALL, tangent_modulus

ONE = Ogden.from_moduli([3e3], [3.0])


def drifting(seed: int, correlation: float, samples: int = 80) -> LoadTest:
    """Readings of `ONE` whose noise, 1 % of the largest stress, correlates from row to row."""
    white = np.random.default_rng(seed).standard_normal(samples)
    noise = np.empty(samples)
    noise[0] = white[0]
    for k in range(1, samples):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * white[k]
    stretch = np.linspace(1.02, 2.5, samples)
    stress = ONE.nominal("uniaxial", stretch)
    return LoadTest("uniaxial", stretch, stress + 0.01 * stress.max() * noise)


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_intervals_hold_the_truth_whatever_the_correlation(correlation: float) -> None:
    fits = [fit_model([drifting(seed, correlation)], "ogden", 1) for seed in range(24)]
    for name, true in (("youngs_modulus", 9e3), ("alpha_1", 3.0)):
        found = [(derived(f) | parameters(f))[name].reported[1] for f in fits]
        assert np.mean([low <= true <= high for low, high in found]) >= 0.83
    plain = [derived(f)["youngs_modulus"].ci95 or (np.nan, np.nan) for f in fits]
    if correlation:  # as if independent they hold it in fewer than two of three
        assert np.mean([low <= 9e3 <= high for low, high in plain]) < 0.67


def test_reported_errors_are_those_of_the_autoregression() -> None:
    fit = fit_model([drifting(3, 0.8)], "ogden", 1)
    noise = with_autocorrelation(fit.result)
    modulus, alpha = derived(fit)["shear_modulus"], parameters(fit)["alpha_1"]
    assert (modulus.autoregression, alpha.autoregression) == pytest.approx(tuple(noise.errors), rel=1e-6)
    assert modulus.method == "autoregression"
    assert modulus.stderr == pytest.approx(fit.result.errors[0], rel=1e-6)
    entry = modulus.to_dict()
    assert entry["stderr_autoregression"] > entry["stderr"]
    summary = characterise([drifting(3, 0.8)], terms=1).summary()
    assert "from an autoregression of the residuals" in summary


def test_white_residuals_keep_the_covariance() -> None:
    estimate = derived(fit_model(readings(TWO, noise=0.01), "ogden", 2))["youngs_modulus"]
    assert estimate.method == "covariance"
    assert estimate.autoregression is None


def test_the_order_of_rows_is_the_order_of_the_noise() -> None:
    """Up and down, fitted together: neighbours in the file correlate, neighbours by stretch need not."""
    up, down = drifting(5, 0.9, 60), drifting(6, 0.9, 60)
    stretch = np.concatenate([up.stretch, down.stretch[::-1]])
    both = LoadTest("uniaxial", stretch, np.concatenate([up.stress, down.stress[::-1]]))
    fit = fit_model([both.taking("all")], "ogden", 1)
    assert np.array_equal(fit.tests[0].stretch, stretch)
    places = fit.result.problem.observations[0].x
    assert (np.diff(places) >= 0).all()
    assert places[-1] == pytest.approx(2 * (2.5 - 1.02))
    assert fit.reported is not None


def test_each_test_has_a_variance_of_its_own() -> None:
    """Few noisy readings of a sheet beside many clean ones: E scatters as told, not as one variance would have it."""
    stretch = np.linspace(1.02, 1.5, 200)
    strip = LoadTest("uniaxial", stretch, ONE.nominal("uniaxial", stretch))
    fits = [fit_model([strip, *readings(ONE, "equibiaxial", noise=0.04, seed=k)], "ogden", 1) for k in range(30)]
    spread = np.std([f.material.youngs_modulus for f in fits], ddof=1)
    assert spread == pytest.approx(np.mean([3 * np.sqrt(f.plain_covariance[0, 0]) for f in fits]), rel=0.25)
    assert spread > 1.5 * np.mean([3 * f.result.pooled_errors[0] for f in fits])


# -- the tangent at stretch 1 ------------------------------------------------------------------------------------------


def stiffening(seed: int) -> tuple[Ogden, LoadTest]:
    """A gel whose secant over a few percent of strain is far from its tangent at 1, pressed or pulled."""
    random = np.random.default_rng(seed)
    material = Ogden.from_moduli([10 ** random.uniform(2.5, 6)], [random.choice([-1, 1]) * random.uniform(8, 28)])
    stretch = np.linspace(0.9, 0.995, 31) if seed % 2 else np.linspace(1.005, 1.12, 31)
    stress = material.nominal("uniaxial", stretch)
    noise = random.choice([0.001, 0.003, 0.01]) * np.abs(stress).max() * random.standard_normal(31)
    return material, LoadTest("uniaxial", stretch, stress + noise)


def test_a_curve_that_bends_is_no_reason_to_doubt_its_modulus() -> None:
    for seed in range(8):
        material, test = stiffening(seed)
        result = characterise([test], terms=1)
        assert "modulus-differs" not in codes(result.findings)
        assert result.material.youngs_modulus == pytest.approx(material.youngs_modulus, rel=0.1)


def test_the_tangent_is_as_far_from_the_truth_as_it_says() -> None:
    distances = []
    for seed in range(200):
        material, test = stiffening(seed)
        modulus, error = tangent_modulus([test]) or (np.nan, np.nan)
        distances.append((modulus - material.youngs_modulus) / error)
    known = np.array(distances)[np.isfinite(distances)]
    assert len(known) > 150
    assert np.mean(np.abs(known) > 2.5) < 0.06


def test_a_secant_is_not_what_is_told() -> None:
    """Of a gel pressed by 10 %: the secant is more than twice the tangent."""
    material = Ogden.from_moduli([1600.0], [-22.0])
    stretch = np.linspace(0.9, 0.995, 31)
    stress = material.nominal("uniaxial", stretch)
    assert stress[0] / (stretch[0] - 1) > 2 * material.youngs_modulus
    found = tangent_modulus([LoadTest("uniaxial", stretch, stress)])
    assert found is not None
    assert found[0] == pytest.approx(material.youngs_modulus, rel=0.01)


def test_too_few_small_strains_tell_no_tangent() -> None:
    stretch = np.linspace(1.1, 3.0, 20)
    assert (stretch <= 1 + SMALL).sum() < 4
    assert tangent_modulus([LoadTest("uniaxial", stretch, TWO.nominal("uniaxial", stretch))]) is None
