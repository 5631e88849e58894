"""Fits of Ogden materials to load tests, and the choice among them."""

from __future__ import annotations

import numpy as np
import pytest
from gels import TWO, readings
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.errors import InputError
from ilg_circuit.hyperelastic import LoadTest, Ogden, characterise, fit_model
from ilg_circuit.hyperelastic.estimates import correlations, derived
from ilg_circuit.hyperelastic.material import stress_basis, stress_basis_slope
from ilg_circuit.units import format_quantity


@settings(max_examples=12)
@given(
    g=log_floats(1e2, 1e7),
    share=st.floats(0.1, 0.6),
    high=st.floats(3.0, 6.0),
    low=st.floats(-4.0, 1.5),
)
def test_an_exact_material_is_recovered(g: float, share: float, high: float, low: float) -> None:
    assume(abs(low) > 0.3)
    true = Ogden.from_moduli([g, g * share], [low, high])
    found = fit_model(readings(true), "ogden", 2)
    order = np.argsort(found.material.alpha)
    assert np.array(found.material.alpha)[order] == pytest.approx([low, high], abs=1e-5)
    assert np.array(found.material.moduli)[order] == pytest.approx([g, g * share], rel=1e-5)
    assert found.undetermined == ()


@pytest.mark.parametrize("true", [Ogden.neo_hookean(2500.0), Ogden.mooney_rivlin(900.0, 300.0)])
def test_the_ladder_stops_where_the_data_do(true: Ogden) -> None:
    result = characterise(readings(true, noise=0.005))
    assert result.material.alpha == true.alpha
    assert result.material.mu == pytest.approx(true.mu, rel=0.05)
    assert {(f.model, f.terms) for f in result.candidates} > {("neo-hookean", 1), ("mooney-rivlin", 2), ("ogden", 1)}
    assert result.warnings == ()


def test_standard_errors_are_the_scatter_of_repeated_fits() -> None:
    """Noisy repetitions: E and predictions scatter as their stated errors say, and 95 % intervals hold the truth."""
    fits = [fit_model(readings(TWO, noise=0.01, seed=k), "ogden", 2) for k in range(50)]
    scatter = np.std([f.material.youngs_modulus for f in fits], ddof=1)
    assert scatter == pytest.approx(np.mean([3 * f.modulus_error for f in fits]), rel=0.35)
    intervals = [derived(f)["youngs_modulus"].ci95 or (np.nan, np.nan) for f in fits]
    assert np.mean([low <= TWO.youngs_modulus <= high for low, high in intervals]) >= 0.85
    for mode, stretch in (("uniaxial", 2.0), ("equibiaxial", 3.0)):
        scatter = np.std([float(f.material.nominal(mode, stretch)) for f in fits], ddof=1)
        assert scatter == pytest.approx(np.mean([f.nominal_error(mode, stretch) for f in fits]), rel=0.35)
    for k in range(4):
        scatter = np.std([(*f.material.mu, *f.material.alpha)[k] for f in fits], ddof=1)
        assert scatter == pytest.approx(np.mean([np.sqrt(f.parameter_covariance()[k, k]) for f in fits]), rel=0.35)


def test_the_answer_does_not_depend_on_the_seed() -> None:
    tests = readings(TWO, noise=0.01)
    fits = [fit_model(tests, "ogden", 2, seed=seed) for seed in range(4)]
    for other in fits[1:]:
        assert other.material.alpha == pytest.approx(fits[0].material.alpha, rel=1e-4)
        assert other.bic == pytest.approx(fits[0].bic, abs=1e-6)
    again = fit_model(tests, "ogden", 2, seed=0)
    assert again.material == fits[0].material  # bit for bit


def test_statistics_are_their_definitions() -> None:
    fit = fit_model(readings(TWO, noise=0.02), "ogden", 1)
    residuals = np.concatenate([t.stress - fit.material.nominal(t.mode, t.stretch) for t in fit.tests])
    n = len(residuals)
    assert np.concatenate(fit.residuals) == pytest.approx(residuals)
    assert fit.rmse == pytest.approx(np.sqrt(np.mean(residuals**2)))
    assert fit.bic - fit.aic == pytest.approx(2 * (np.log(n) - 2))
    scale = max(np.abs(t.stress).max() for t in fit.tests)
    assert fit.aic == pytest.approx(n * np.log(np.mean(residuals**2) / scale**2) + 4)
    matrix = correlations(fit)
    assert set(matrix) == {"mu_1, alpha_1"}
    assert -1 <= matrix["mu_1, alpha_1"] <= 1


def test_stability_is_imposed_unless_lifted() -> None:
    """A material with a negative term: the constrained fit cannot follow, the free one does and says so."""
    soft = Ogden.from_moduli([3000.0, -600.0], [2.0, -2.0])
    tests = readings(soft, noise=0.002)
    held = characterise(tests, terms=2)
    assert held.material.stable_by_sign
    free = characterise(tests, model="mooney-rivlin", constrained=False)
    assert free.material.moduli == pytest.approx(soft.moduli, rel=0.05)
    assert free.fit.rmse < held.fit.rmse
    assert not free.material.stable_by_sign
    assert {i.mode for i in free.instabilities} >= {"equibiaxial"}
    told = " ".join(free.warnings)
    assert "unstable in equibiaxial load: Drucker's condition fails between" in told
    assert "dP/dl <= 0" in told
    assert not held.instabilities


def test_a_falling_nominal_stress_is_found_in_a_stable_material() -> None:
    """alpha below 1: mu alpha > 0, but the force over the undeformed area has a maximum."""
    true = Ogden.from_moduli([1000.0], [0.1])
    result = characterise(readings(true, "equibiaxial", "uniaxial", noise=0.002), terms=1)
    kinds = {i.kind for i in result.instabilities}
    assert kinds == {"slope"}
    first = next(i for i in result.instabilities if i.mode == "uniaxial")
    stretch = np.linspace(1.01, 3, 2000)
    falls = stretch[result.material.slope("uniaxial", stretch) <= 0]
    assert first.low == pytest.approx(falls[0], rel=0.01)


def test_one_test_alone_shows_what_it_says_of_others() -> None:
    result = characterise(readings(TWO, "uniaxial", noise=0.01))
    value = format_quantity(float(result.material.nominal("equibiaxial", 3.0)), "Pa", 4)
    told = next(line for line in result.warnings if "uniaxial test alone" in line)
    assert f"at stretch 3 it predicts {value} equibiaxial" in told
    assert not any("test alone" in line for line in characterise(readings(TWO, noise=0.01)).warnings)


@pytest.mark.parametrize(("mode", "shown"), [("equibiaxial", "uniaxial"), ("planar", "equibiaxial")])
def test_every_test_alone_is_warned_of(mode: str, shown: str) -> None:
    result = characterise(readings(TWO, mode, noise=0.01))
    assert any(f"{mode} test alone" in line and f"jointly with {shown}" in line for line in result.warnings)


def test_an_absurd_prediction_is_called_so() -> None:
    steep = Ogden.from_moduli([1000.0], [-8.0])
    told = " ".join(characterise(readings(steep, "uniaxial", noise=0.005), terms=1).warnings)
    stretch = np.linspace(1.01, 3, 4000)
    ratio = steep.nominal("equibiaxial", stretch) / steep.nominal("uniaxial", stretch)
    start = stretch[ratio > 10][0]
    assert "that is absurd, from stretch " in told
    assert float(told.split("absurd, from stretch ")[1].split()[0]) == pytest.approx(start, rel=0.02)
    both = " ".join(characterise(readings(steep, "uniaxial", "planar", noise=0.005), terms=1).warnings)
    assert "no equibiaxial test was given" in both
    assert "absurd" in both


def test_planar_alone_cannot_tell_the_sign_of_alpha() -> None:
    true = Ogden.from_moduli([1000.0], [-3.0])
    result = characterise(readings(true, "planar", noise=0.005), terms=1)
    assert result.material.alpha[0] == pytest.approx(3.0, abs=0.1)
    told = next(line for line in result.warnings if "does not determine the sign of alpha" in line)
    value = float(Ogden.from_moduli(result.material.moduli, [-result.material.alpha[0]]).nominal("equibiaxial", 2.6))
    assert f"{value / 1e3:.4g} kPa" in told


def test_of_equal_planar_fits_it_is_always_the_same_one() -> None:
    tests = readings(Ogden.from_moduli([1000.0, 10.0], [-1.5, 6.0]), "planar", noise=0.002)
    assert all(min(fit_model(tests, "ogden", 2, seed=seed).material.alpha) > 0 for seed in range(6))


def test_planar_alone_is_ambiguous_even_for_the_neo_hookean() -> None:
    """alpha = 2 and -2 are the same planar curve, and differ by l^2 or so in a sheet."""
    result = characterise(readings(Ogden.neo_hookean(1000.0), "planar", noise=0.005))
    assert result.fit.model == "neo-hookean"
    assert any("does not determine the sign of alpha" in line for line in result.warnings)


def test_what_the_data_leave_open_is_said_and_not_chosen() -> None:
    tests = readings(Ogden.neo_hookean(2000.0), noise=0.01)
    asked = characterise(tests, terms=4)
    assert asked.fit.undetermined
    assert any("take a simpler model" in line for line in asked.warnings)
    assert not characterise(tests).fit.undetermined


def test_a_closer_fit_is_not_chosen_if_it_leaves_a_parameter_open() -> None:
    """One last reading beyond a limit of extensibility: a steep term of any modulus takes it up and lowers the BIC."""
    true = Ogden.from_moduli([3000.0, 40.0], [1.8, 5.0])
    stretch = np.linspace(1.05, 6.0, 40)
    stress = true.nominal("uniaxial", stretch) * (1 + 0.002 * np.random.default_rng(1).standard_normal(40))
    stress[-1] *= 1.3
    tests = [LoadTest("uniaxial", stretch, stress), *readings(true, "equibiaxial", noise=0.002)]
    result = characterise(tests)
    closest = min(result.candidates, key=lambda f: f.bic)
    assert closest.undetermined
    assert closest.bic < result.fit.bic
    assert not result.fit.undetermined


def test_moduli_extrapolated_to_rest_are_said() -> None:
    far = LoadTest("uniaxial", np.linspace(1.5, 3, 20), TWO.nominal("uniaxial", np.linspace(1.5, 3, 20)))
    assert any(
        line.startswith("extrapolation: the nearest reading to stretch 1") for line in characterise([far]).warnings
    )


def test_a_modulus_that_small_strains_contradict_is_said() -> None:
    """A bad model's E is not the slope at rest."""
    stiffening = Ogden.from_moduli([1000.0, 3.0], [1.5, 12.0])
    tests = readings(stiffening)
    bad = characterise(tests, model="neo-hookean")
    assert bad.small_strain_modulus is not None
    assert bad.small_strain_modulus[0] == pytest.approx(stiffening.youngs_modulus, rel=0.1)
    told = next(line for line in bad.warnings if line.startswith("E is "))
    assert "weighting='relative' follows them" in told
    assert not any(line.startswith("E is ") for line in characterise(tests, terms=2).warnings)


def test_relative_weighting_follows_small_stresses() -> None:
    tests = readings(Ogden.from_moduli([1000.0, 3.0], [1.5, 12.0]))
    errors = {
        w: abs(fit_model(tests, "ogden", 1, weighting=w).material.youngs_modulus - 3009.0)
        for w in ("absolute", "relative")
    }
    assert errors["relative"] < 0.7 * errors["absolute"]


def test_structured_residuals_are_said() -> None:
    tests = readings(Ogden.from_moduli([1000.0, 3.0], [1.5, 12.0]), noise=1e-4)
    assert any("residuals are autocorrelated" in line for line in characterise(tests, model="neo-hookean").warnings)


def test_predictions_where_asked() -> None:
    result = characterise(readings(TWO, "uniaxial", "equibiaxial", noise=0.01), at=[1.5, 2.5])
    by = {(p.mode, p.stretch): p for p in result.predictions}
    assert len(by) == 6
    for (mode, stretch), p in by.items():
        assert p.nominal == pytest.approx(float(result.material.nominal(mode, stretch)))
        assert p.cauchy == pytest.approx(stretch * p.nominal)
        assert p.error > 0
    assert {key for key, p in by.items() if p.measured} == {
        ("uniaxial", 1.5),
        ("uniaxial", 2.5),
        ("equibiaxial", 1.5),
    }
    told = [line for line in result.warnings if line.startswith("extrapolation: no ")]
    assert told == [
        "extrapolation: no equibiaxial reading reaches stretch 2.5",
        "extrapolation: no planar reading reaches stretch 1.5, 2.5",
    ]


def test_thousands_of_readings_are_searched_thinned_and_fitted_whole() -> None:
    stretch = np.linspace(1.001, 3.0, 4001)
    random = np.random.default_rng(5)
    many = [
        LoadTest(m, stretch, TWO.nominal(m, stretch) + 50 * random.standard_normal(len(stretch)))
        for m in ("uniaxial", "equibiaxial")
    ]
    few = readings(TWO, "planar", noise=0.005)  # a short test beside long ones keeps its readings
    fit = fit_model([*many, *few], "ogden", 2)
    assert fit.samples == 2 * 4001 + 12
    assert fit.material.youngs_modulus == pytest.approx(TWO.youngs_modulus, abs=4 * 3 * fit.modulus_error)
    assert 3 * fit.modulus_error < 0.003 * TWO.youngs_modulus
    # at the minimum of all readings the residuals are orthogonal to what each parameter does
    residuals = np.concatenate(fit.residuals)
    for derivative in (stress_basis, stress_basis_slope):
        columns = np.concatenate([derivative(t.mode, t.stretch, fit.material.alpha) for t in fit.tests])
        cosines = residuals @ columns / (np.linalg.norm(residuals) * np.linalg.norm(columns, axis=0))
        assert np.abs(cosines).max() < 1e-5


def test_compression_is_fitted_too() -> None:
    stretch = np.linspace(0.5, 0.98, 25)
    result = characterise([LoadTest("uniaxial", stretch, TWO.nominal("uniaxial", stretch))], terms=2)
    assert result.material.youngs_modulus == pytest.approx(TWO.youngs_modulus, rel=1e-4)
    assert result.predictions[0].stretch == 0.5


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        ({"terms": 0}, "terms is 0; an Ogden fit has 1 to 4"),
        ({"terms": 5}, "terms is 5"),
        ({"model": "yeoh"}, "model is 'yeoh'; choose auto, ogden"),
        ({"model": "ogden"}, "needs its number of terms"),
        ({"model": "neo-hookean", "terms": 2}, "neo-Hookean has 1; leave it out"),
        ({"weighting": "both"}, "weighting is 'both'; choose absolute or relative"),
        ({"at": [0.0]}, "stretch 0 to predict at is far beyond"),
        ({"at": [np.nan]}, "stretch nan to predict at"),
        ({"at": [1e6]}, "give one from"),
    ],
)
def test_wrong_requests(arguments: dict[str, object], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        characterise(readings(TWO, "uniaxial"), **arguments)


def test_tests_must_be_there_and_differ() -> None:
    with pytest.raises(InputError, match="no test was given"):
        characterise([])
    with pytest.raises(InputError, match="two tests are uniaxial"):
        characterise(readings(TWO, "uniaxial", "uniaxial"))


def test_too_few_readings() -> None:
    few = LoadTest("uniaxial", np.array([1.0, 1.1, 1.2, 1.3]), np.array([0.0, 1.0, 1.8, 2.4]))
    with pytest.raises(
        InputError, match="3 readings are too few for Ogden with 3 terms, which has 6 constants: give at"
    ):
        characterise([few], terms=3)
    assert [(f.model, f.terms) for f in characterise([few]).candidates] == [
        ("neo-hookean", 1),
        ("mooney-rivlin", 2),
        ("ogden", 1),
    ]
    one = LoadTest("uniaxial", np.array([1.1]), np.array([1.0]))
    with pytest.raises(InputError, match="one reading is too few"):
        characterise([one])


@pytest.mark.parametrize(
    ("stretch", "stress", "hint"),
    [
        ([1.1, -0.5], [1, 2], r"stretch -0\.5: a stretch is deformed over undeformed length"),
        ([1.1, 0.0], [1, 2], "stretch 0: .* a strain of x is a stretch of 1 \\+ x"),
        ([1.1, 150.0], [1, 2], "stretch 150: .* from 0.01 to 100"),
        ([1.1, np.nan], [1, 2], "a stretch is nan"),
        ([1.1, 1.2], [1, np.inf], "a stress is inf"),
        ([1.1, 1.2], [1], "2 stretches and 1 stresses"),
        ([1.0, 1.2], [0.5, 2], "stress 500 mPa at stretch 1, where nothing pulls; subtract the offset"),
        ([1.0, 1.0], [0, 0], "every stress is zero"),
        ([1.0, 1.0], [0, 1], "at stretch 1, where nothing pulls"),
        ([1.1, 1.2], [1e-9, 2e-9], "the largest stress is 2e-09 Pa, which no material has; check its unit"),
        ([1.1, 1.2], [1e19, 2e19], "which no material has"),
        ([1.1, 1.2], [-1, -2], "opposite signs"),
        ([0.9, 0.8], [1, 2], "opposite signs"),
    ],
)
def test_readings_that_are_none(stretch: list[float], stress: list[float], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        LoadTest("uniaxial", np.array(stretch), np.array(stress, dtype=float))


def test_readings_are_sorted_and_the_unloaded_one_left_out() -> None:
    test = LoadTest("planar", np.array([1.5, 1.0, 1.2]), np.array([5.0, 0.01, 2.0]))
    assert test.stretch.tolist() == [1.2, 1.5]
    assert test.stress.tolist() == [2.0, 5.0]
    assert test.range == (1.0, 1.5)
    with pytest.raises(InputError, match="choose one of uniaxial"):
        LoadTest("shear", np.array([1.1]), np.array([1.0]))
