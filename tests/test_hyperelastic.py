"""Ogden materials, fits to load tests, and the command that makes them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.actuator import PAPER
from ilg_circuit.actuator_file import load_actuator
from ilg_circuit.cli import main
from ilg_circuit.errors import InputError
from ilg_circuit.hyperelastic import MODES, Characterisation, LoadTest, Ogden, characterise, fit_model, read_load_test
from ilg_circuit.hyperelastic.material import stress_basis, stress_basis_slope
from ilg_circuit.hyperelastic.report import (
    correlations,
    derived,
    parameters,
    plot_characterisation,
    table,
    to_json,
    write_actuator,
)
from ilg_circuit.units import format_quantity

MODE = st.sampled_from(list(MODES))
STRETCH = log_floats(0.3, 5.0)
ALPHA = st.one_of(st.floats(0.3, 9.0), st.floats(-9.0, -0.3))

#: A gel with two terms of both signs, and one that stiffens; moduli of the paper's size.
TWO = Ogden((4000.0, -300.0), (2.4, -3.0))
STRETCHES = {"uniaxial": np.linspace(1.02, 3.0, 25), "equibiaxial": np.linspace(1.02, 2.2, 15)} | {
    "planar": np.linspace(1.03, 2.6, 12)
}


@st.composite
def materials(draw: st.DrawFn) -> Ogden:
    """Stable materials of one to four terms: mu_i alpha_i > 0."""
    alpha = draw(st.lists(ALPHA, min_size=1, max_size=4))
    return Ogden.from_moduli([draw(log_floats(1e2, 1e6)) for _ in alpha], alpha)


def readings(material: Ogden, *modes: str, noise: float = 0.0, seed: int = 3) -> list[LoadTest]:
    """Tests of a known material; ``noise`` in parts of each test's largest stress."""
    random = np.random.default_rng(seed)
    tests = []
    for mode in modes or MODES:
        stress = material.nominal(mode, STRETCHES[mode])
        tests.append(
            LoadTest(mode, STRETCHES[mode], stress + noise * stress.max() * random.standard_normal(len(stress)))
        )
    return tests


def principal(mode: str, stretch: float) -> np.ndarray:
    free = stretch ** MODES[mode]
    return np.array([stretch, {"uniaxial": free, "equibiaxial": stretch, "planar": 1.0}[mode], free])


# -- material ----------------------------------------------------------------------------------------------------------


@given(materials(), MODE, STRETCH)
def test_stress_is_the_slope_of_the_energy(material: Ogden, mode: str, stretch: float) -> None:
    """Work of the test per volume: dW = P dl, twice that where two directions are pulled."""
    h = 1e-5 * stretch
    above, below = (float(material.energy(principal(mode, stretch + d))) for d in (h, -h))
    work = float(material.nominal(mode, stretch)) * (2 if mode == "equibiaxial" else 1)
    # rounding of the two energies, and the third derivative of powers up to 19
    tolerance = 1e-15 * (abs(above) + abs(below)) / h + 2e-7 * abs(work) + 1e-9 * material.shear_modulus
    assert (above - below) / (2 * h) == pytest.approx(work, abs=10 * tolerance)


@given(materials(), MODE, STRETCH)
def test_slope_is_the_derivative_of_the_stress(material: Ogden, mode: str, stretch: float) -> None:
    h = 1e-5 * stretch
    ends = material.nominal(mode, [stretch - h, stretch + h])
    found = float(material.slope(mode, stretch))
    scale = float(np.abs(ends).max()) / h
    assert (ends[1] - ends[0]) / (2 * h) == pytest.approx(found, rel=1e-6, abs=1e-14 * scale)


@given(materials())
def test_moduli_are_the_slopes_at_rest(material: Ogden) -> None:
    g = 0.5 * sum(m * a for m, a in zip(material.mu, material.alpha, strict=True))
    assert material.shear_modulus == pytest.approx(g)
    assert material.youngs_modulus == pytest.approx(3 * g)
    for mode, factor in (("uniaxial", 3), ("equibiaxial", 6), ("planar", 4)):
        assert float(material.slope(mode, 1.0)) == pytest.approx(factor * g)
        assert float(material.nominal(mode, 1.0)) == 0.0
        assert float(material.hardening(mode, 1.0)) == pytest.approx(2 * g)


@given(materials(), st.lists(STRETCH, min_size=2, max_size=2), st.permutations([0, 1, 2]))
def test_energy_does_not_know_directions(material: Ogden, two: list[float], order: list[int]) -> None:
    stretches = np.array([*two, 1 / (two[0] * two[1])])
    energy = float(material.energy(stretches))
    assert float(material.energy(stretches[order])) == pytest.approx(energy, rel=1e-9)
    assert energy >= 0
    assert float(material.energy(np.ones(3))) == 0.0


@given(materials(), STRETCH)
def test_tests_are_kin(material: Ogden, stretch: float) -> None:
    """A sheet pulled to l in two directions is a column pressed to l^-2; planar at 1/l is planar at l, turned."""
    pulled = float(material.cauchy("equibiaxial", stretch))
    pressed = float(material.cauchy("uniaxial", stretch**-2.0))
    assert pulled == pytest.approx(-pressed, rel=1e-9, abs=1e-12 * material.shear_modulus)
    assert float(material.cauchy("planar", 1 / stretch)) == pytest.approx(
        -float(material.cauchy("planar", stretch)), rel=1e-9, abs=1e-12 * material.shear_modulus
    )


@given(materials(), MODE, STRETCH)
def test_both_conventions_are_the_same_material(material: Ogden, mode: str, stretch: float) -> None:
    again = Ogden.from_moduli(material.moduli, material.alpha)
    assert again.mu == pytest.approx(material.mu, rel=1e-14)
    assert again.alpha == material.alpha
    assert sum(material.moduli) == pytest.approx(material.shear_modulus)
    # W = sum 2 mu_i/alpha_i^2 (...), written out
    l3 = principal(mode, stretch)
    other = sum(2 * g / a**2 * ((l3**a).sum() - 3) for g, a in zip(material.moduli, material.alpha, strict=True))
    scale = sum(2 * g / a**2 for g, a in zip(material.moduli, material.alpha, strict=True))
    assert float(material.energy(l3)) == pytest.approx(other, rel=1e-8, abs=1e-12 * scale)


@given(materials(), MODE, log_floats(0.3, 5.0))
def test_positive_products_are_stable(material: Ogden, mode: str, stretch: float) -> None:
    assert material.stable_by_sign
    assert float(material.hardening(mode, stretch)) > 0
    assert float(material.nominal(mode, stretch)) * (stretch - 1) >= 0


@given(materials(), MODE, STRETCH)
def test_hardening_is_the_smallest_stiffness(material: Ogden, mode: str, stretch: float) -> None:
    """Against the eigenvalues of the stiffness restricted to strains of zero sum."""
    stiff = sum(m * a * principal(mode, stretch) ** a for m, a in zip(material.mu, material.alpha, strict=True))
    plane = np.array([[1, -1, 0], [1, 1, -2]]).T / np.sqrt([2, 6])
    eigenvalues = np.linalg.eigvalsh(plane.T @ np.diag(stiff) @ plane)
    found = float(material.hardening(mode, stretch))
    assert found == pytest.approx(eigenvalues[0], rel=1e-6, abs=1e-13 * eigenvalues[1])


@given(MODE, STRETCH, st.floats(-9, 9))
def test_basis_and_its_slope(mode: str, stretch: float, alpha: float) -> None:
    h = 1e-4
    l = np.array([stretch])  # noqa: E741
    ends = [stress_basis(mode, l, [alpha + d]).item() for d in (-h, h)]
    found = stress_basis_slope(mode, l, [alpha]).item()
    assert (ends[1] - ends[0]) / (2 * h) == pytest.approx(found, rel=1e-6, abs=1e-10)


def test_basis_is_smooth_through_alpha_zero() -> None:
    """There the stress is that of W = G (ln l)^2 ..., (1 - k) 2 ln(l)/l."""
    l = np.array([0.5, 2.0])  # noqa: E741
    for mode, k in MODES.items():
        expected = 2 * (1 - k) * np.log(l) / l
        assert stress_basis(mode, l, [0.0])[:, 0] == pytest.approx(expected)
        assert stress_basis(mode, l, [1e-9])[:, 0] == pytest.approx(expected, rel=1e-8)
        assert stress_basis_slope(mode, l, [0.0])[:, 0] == pytest.approx((1 - k**2) * np.log(l) ** 2 / l)


def test_simple_rungs_are_their_textbook_forms() -> None:
    l = np.array([0.6, 1.3, 2.5])  # noqa: E741
    assert Ogden.neo_hookean(3.0).nominal("uniaxial", l) == pytest.approx(3 * (l - l**-2))
    mooney = Ogden.mooney_rivlin(0.7, 0.2)
    assert mooney.nominal("uniaxial", l) == pytest.approx(2 * (1 - l**-3) * (0.7 * l + 0.2))
    assert mooney.nominal("equibiaxial", l) == pytest.approx(2 * (l - l**-5) * (0.7 + 0.2 * l**2))
    assert mooney.nominal("planar", l) == pytest.approx(2 * (l - l**-3) * (0.7 + 0.2))
    assert mooney.shear_modulus == pytest.approx(2 * (0.7 + 0.2))
    assert mooney.cauchy("planar", l) == pytest.approx(l * mooney.nominal("planar", l))


@pytest.mark.parametrize(
    ("make", "hint"),
    [
        (lambda: Ogden((1.0,), (2.0, 3.0)), "one pair for each term"),
        (lambda: Ogden((), ()), "one pair for each term"),
        (lambda: Ogden((np.nan,), (2.0,)), "give finite values"),
        (lambda: Ogden((1.0,), (0.0,)), "alpha is 0"),
        (lambda: Ogden.from_moduli([1.0], [0.0]), "alpha is 0"),
        (lambda: TWO.nominal("biaxial", 2.0), "test is 'biaxial'; choose one of uniaxial, equibiaxial, planar"),
        (lambda: TWO.nominal("uniaxial", [1.0, 0.0]), "stretch 0: a stretch is deformed over undeformed length"),
        (lambda: TWO.nominal("uniaxial", np.nan), "stretch nan"),
        (lambda: TWO.energy([2.0, 1.0, 1.0]), "product is 1"),
        (lambda: TWO.energy([1.0, 1.0]), "product is 1"),
    ],
)
def test_what_is_no_material_or_stretch(make: Callable[[], object], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        make()


# -- fits --------------------------------------------------------------------------------------------------------------


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
    assert any(f"{mode} test alone" in line and f"jointly with --{shown}" in line for line in result.warnings)


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
    told = next(line for line in result.warnings if "cannot tell alpha from -alpha" in line)
    value = float(Ogden.from_moduli(result.material.moduli, [-result.material.alpha[0]]).nominal("equibiaxial", 2.6))
    assert f"{value / 1e3:.4g} kPa" in told


def test_of_equal_planar_fits_it_is_always_the_same_one() -> None:
    tests = readings(Ogden.from_moduli([1000.0, 10.0], [-1.5, 6.0]), "planar", noise=0.002)
    assert all(min(fit_model(tests, "ogden", 2, seed=seed).material.alpha) > 0 for seed in range(6))


def test_planar_alone_is_ambiguous_even_for_the_neo_hookean() -> None:
    """alpha = 2 and -2 are the same planar curve, and differ by l^2 or so in a sheet."""
    result = characterise(readings(Ogden.neo_hookean(1000.0), "planar", noise=0.005))
    assert result.fit.model == "neo-hookean"
    assert any("cannot tell alpha from -alpha" in line for line in result.warnings)


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
    assert "--weights relative follows them" in told
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
    assert any("residuals are not noise" in line for line in characterise(tests, model="neo-hookean").warnings)


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


# -- report ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def result() -> Characterisation:
    return characterise(readings(TWO, noise=0.01), terms=2)


def test_parameters_have_errors_and_intervals_of_their_sign(result: Characterisation) -> None:
    for name, p in parameters(result.fit).items():
        assert p.stderr is not None
        assert p.stderr > 0
        assert p.ci95 is not None
        assert p.ci95[0] < p.value < p.ci95[1]
        if name.startswith("mu"):
            assert p.ci95[0] * p.ci95[1] > 0
    more = derived(result.fit)
    assert more["youngs_modulus"].value == pytest.approx(3 * more["shear_modulus"].value)
    assert more["mu_1_other_convention"].value == pytest.approx(result.material.moduli[0])


def test_held_parameters_say_so() -> None:
    fit = fit_model(readings(TWO, noise=0.01), "mooney-rivlin")
    found = parameters(fit)
    assert found["alpha_2"].held == "Mooney-Rivlin by definition"
    assert found["alpha_2"].stderr is None
    again = Ogden.mooney_rivlin(derived(fit)["c10"].value, derived(fit)["c01"].value)
    assert again.mu == pytest.approx(fit.material.mu)


def test_json_is_json_even_where_nothing_is_determined(result: Characterisation) -> None:
    told = json.loads(json.dumps(to_json(result), allow_nan=False))
    assert "mu_i/alpha_i (l1" in told["convention"]
    assert "2 mu_i/alpha_i^2" in told["other_convention"]
    assert set(told["statistics"]["tests"]) == set(MODES)
    hopeless = characterise(readings(Ogden.neo_hookean(1e3), "planar"), model="mooney-rivlin")
    told = json.loads(json.dumps(to_json(hopeless), allow_nan=False))
    assert told["parameters"]["mu_1"]["stderr"] is None
    assert told["predictions"][0]["stderr"] is None
    assert told["correlations"] == {}
    assert "undetermined" in table(hopeless)


def test_table_names_both_conventions(result: Characterisation) -> None:
    text = table(result)
    assert "convention: W = sum mu_i/alpha_i (" in text
    assert "other convention: W = sum 2 mu_i/alpha_i^2 (" in text
    for word in ("shear_modulus", "youngs_modulus", "AIC", "BIC", "uniaxial", "equibiaxial", "planar", "Cauchy"):
        assert word in text


@pytest.mark.parametrize("modes", [(), ("uniaxial",)], ids=["joint", "uniaxial"])
def test_picture(tmp_path: Path, modes: tuple[str, ...]) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):  # text as text
        plot_characterisation(characterise(readings(TWO, *modes, noise=0.01), terms=2), tmp_path / "fit.svg")
    text = (tmp_path / "fit.svg").read_text(encoding="utf-8")
    for label in ("nominal stress [kPa]", "stretch [1]", "data - fit [", "uniaxial, measured", "uniaxial, fit"):
        assert label in text
    assert ("planar, predicted" in text) == bool(modes)
    assert ("planar, measured" in text) != bool(modes)
    assert ("beyond the readings" in text) != bool(modes)


def test_the_modulus_goes_into_an_actuator(result: Characterisation, tmp_path: Path) -> None:
    write_actuator(result, PAPER, tmp_path / "fitted.toml")
    found = load_actuator(tmp_path / "fitted.toml")
    modulus = result.material.youngs_modulus
    assert found == replace(PAPER, material=replace(PAPER.material, youngs_modulus=modulus))
    assert "# youngs_modulus = 3 G fitted by" in (tmp_path / "fitted.toml").read_text()


def test_no_actuator_of_negative_modulus(tmp_path: Path) -> None:
    nonsense = Ogden.from_moduli([2000.0, -3000.0], [3.0, -2.0])
    stretch = np.linspace(2.0, 4, 20)
    test = LoadTest("uniaxial", stretch, nonsense.nominal("uniaxial", stretch))
    result = characterise([test], terms=2, constrained=False)
    assert result.material.shear_modulus < 0
    assert any("no material has that" in line for line in result.warnings)
    with pytest.raises(InputError, match="which no strip has"):
        write_actuator(result, PAPER, tmp_path / "fitted.toml")
    assert list(tmp_path.iterdir()) == []


# -- files -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "stretch,stress_kPa\n1.0,0\n1.1,2\n1.5,7\n",
        "stress_Pa,stretch\n0,1\n2000,1.1\n7000,1.5\n",
        "Stretch;Stress [kPa]\n1,1;2,0\n1,5;7,0\n",
        "stress_kPa stretch\n  2.0   1.1\r\n  7.0   1.5\r\n",
        "stretch, stress_kPa\n1.1 2.0\n1.5 7.0\n",
        "stretch [-],nominal stress (kPa)\n1.1,2\n,3\n1.2,\n1.5,7\n",
        "stretch_%\tengineering_stress_MPa\n110\t0.002\n150\t0.007\n",
        "stretch_ratio,true_stress_kPa\n1.1,2.2\n1.5,10.5\n",
        "lambda,cauchy_stress_kPa,note\n1.1,2.2,a\n1.5,10.5,b\n",
    ],
    ids=["csv", "order", "semicolons", "spaces", "mixed", "gaps", "percent", "true", "cauchy"],
)
def test_files(tmp_path: Path, text: str) -> None:
    path = tmp_path / "data.csv"
    path.write_bytes(text.encode())
    test = read_load_test(path, "uniaxial")
    assert test.stretch == pytest.approx([1.1, 1.5])
    assert test.stress == pytest.approx([2000.0, 7000.0])
    assert test.source == "data.csv"


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("0.1 1.1\n0.2 1.2\n", "no column for stretch: the first row holds numbers, not names; put a row of names"),
        ("stretch,stress\n1.1,2\n", "column 'stress' has no unit; write it like 'stress_Pa'"),
        ("stretch_mm,stress_Pa\n1.1,2\n", "unit 'mm' does not measure a pure number; leave it out"),
        ("stretch,stress_V\n1.1,2\n", "unit 'V' does not measure"),
        (
            "strain_%,stress_Pa\n10,2\n",
            "no column for stretch; not understood: 'strain_%'; .* like stretch, stress_MPa",
        ),
        ("stretch,force_N\n1.1,2\n", "no column for stress; not understood: 'force_N'"),
        ("stretch,stress_Pa,true_stress_Pa\n1.1,2,2.2\n", "a nominal and a true stress; leave one out"),
        ("stretch,stress_Pa\n,2\n1.1,\n", "no row has both"),
        ("stretch,true_stress_Pa\n0,2\n1.1,2\n", "stretch 0"),
        ("stretch,stress_Pa\n-1,2\n1.1,2\n", "stretch -1"),
        ("", "the file is empty; it needs a header row such as stretch, stress_MPa"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"data\.csv: .*" + hint.replace("(", r"\(")):
        read_load_test(path, "uniaxial")


# -- command -----------------------------------------------------------------------------------------------------------

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`ilg-circuit ogden` in this process, in a folder with one file for each test."""
    monkeypatch.chdir(tmp_path)
    for test in readings(TWO, noise=0.005):
        rows = "".join(f"{a!r},{b / 1e3!r}\n" for a, b in zip(test.stretch.tolist(), test.stress.tolist(), strict=True))
        Path(f"{test.mode}.csv").write_text(f"stretch,stress_kPa\n{rows}")

    def call(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as caught:
            main(["ogden", *arguments])
        streams = capsys.readouterr()
        return int(caught.value.code or 0), streams.out, streams.err

    return call


ALL = ("--uniaxial", "uniaxial.csv", "--equibiaxial", "equibiaxial.csv", "--planar", "planar.csv")


def test_command(run: Run) -> None:
    code, out, err = run(*ALL, "--terms", "2")
    assert code == 0
    assert err == ""
    assert "uniaxial.csv (uniaxial), equibiaxial.csv (equibiaxial), planar.csv (planar): Ogden with 2 terms" in out


def test_command_json(run: Run, tmp_path: Path) -> None:
    before = sorted(tmp_path.iterdir())
    code, out, err = run(*ALL, "--json", "--at", "2")
    told = json.loads(out)
    assert code == 0
    assert err == ""
    assert told["model"] == "ogden"
    assert told["terms"] == 2
    assert told["derived"]["youngs_modulus"]["value"] == pytest.approx(TWO.youngs_modulus, rel=0.05)
    assert told["derived"]["youngs_modulus"]["unit"] == "Pa"
    assert {p["stretch"] for p in told["predictions"]} == {2.0}
    assert sorted(tmp_path.iterdir()) == before  # nothing is written unasked


def test_command_warns_on_stderr_and_in_json(run: Run) -> None:
    code, out, err = run("--uniaxial", "uniaxial.csv", "--json")
    assert code == 0
    told = json.loads(out)["warnings"]
    assert [f"warning: {line}" for line in told] == err.splitlines()
    assert "it predicts" in told[0]
    assert "equibiaxial" in told[0]


def test_command_writes_what_is_asked(run: Run) -> None:
    code, _, err = run(
        *ALL, "--actuator", "paper", "--out", "fitted.toml", "--plot", "fit.png", "--weights", "relative"
    )
    assert code == 0, err
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    modulus = tomllib.loads(Path("fitted.toml").read_text())["material"]["youngs_modulus"]
    assert float(modulus.split()[0]) == pytest.approx(TWO.youngs_modulus / 1e3, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        ((), "no test was given; give at least one of --uniaxial, --equibiaxial, --planar"),
        ((*ALL, "--terms", "0"), "terms is 0; an Ogden fit has 1 to 4"),
        ((*ALL, "--terms", "5"), "terms is 5"),
        ((*ALL, "--terms", "two"), "--terms"),
        ((*ALL, "--model", "yeoh"), "'neo-hookean'"),
        (("--uniaxial", "none.csv"), "cannot read 'none.csv'"),
        ((*ALL, "--out", "fitted.toml"), "--out without --actuator"),
        ((*ALL, "--actuator", "paper"), "--actuator without --out"),
        ((*ALL, "--actuator", "pper", "--out", "fitted.toml"), "no actuator 'pper'"),
        ((*ALL, "--plot", "fit.gif"), "end its name in .png, .pdf or .svg"),
        ((*ALL, "--actuator", "paper", "--out", "none/fitted.toml"), "does not exist"),
        ((*ALL, "--actuator", "paper", "--out", "planar.csv"), "name the same file"),
        (("--uniaxial", "planar.csv", "--planar", "planar.csv"), "name the same file"),
        ((*ALL, "--at", "0"), "stretch 0 to predict at"),
        ((*ALL, "--at", "nan"), "stretch nan to predict at"),
    ],
)
def test_command_refuses_in_one_line(run: Run, tmp_path: Path, arguments: tuple[str, ...], hint: str) -> None:
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1
    assert err.startswith("ilg-circuit: ")
    assert hint in err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
