"""Treloar's vulcanised rubber (Trans. Faraday Soc. 40, 59, 1944), third-party data that lies beside the project."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.hyperelastic import MODES, LoadTest, characterise, fit_model, read_load_test

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "treloar"
FILES = dict(zip(MODES, ("Treloar_1944_UT.txt", "Treloar_1944_ET.txt", "Treloar_1944_PS.txt"), strict=True))

pytestmark = pytest.mark.skipif(
    not all((DATA / name).is_file() for name in FILES.values()),
    reason="the shared measurements are not beside the project",
)


@pytest.fixture(scope="module")
def tests(tmp_path_factory: pytest.TempPathFactory) -> dict[str, LoadTest]:
    """The three files with the header that they lack."""
    folder = tmp_path_factory.mktemp("treloar")
    for mode, name in FILES.items():
        (folder / f"{mode}.txt").write_text("stress_MPa stretch\n" + (DATA / name).read_text())
    return {mode: read_load_test(folder / f"{mode}.txt", mode) for mode in FILES}


def test_files(tests: dict[str, LoadTest]) -> None:
    assert [len(t.stretch) for t in tests.values()] == [24, 16, 13]
    assert tests["uniaxial"].stress[-1] == pytest.approx(6.3176e6)
    assert tests["uniaxial"].range == (1.0, 7.6)


def test_joint_fit_is_chosen_with_three_terms_and_close(tests: dict[str, LoadTest]) -> None:
    result = characterise(list(tests.values()))
    fit = result.fit
    assert (fit.model, fit.terms) == ("ogden", 3)
    rms = [np.sqrt(np.mean(r**2)) for r in fit.residuals]
    assert rms[0] <= 0.09e6
    assert rms[1] <= 0.05e6
    assert rms[2] <= 0.05e6
    assert fit.material.stable_by_sign
    assert result.instabilities == ()
    # Ogden (1972) has alpha = 5.0, 1.3, -2.0; least squares over these very readings spreads them further
    assert sorted(fit.material.alpha) == pytest.approx([-2.26, 1.89, 8.45], abs=0.02)
    assert fit.material.youngs_modulus == pytest.approx(1.061e6, rel=2e-3)
    # the tangent at stretch 1 of the readings at small strains is 1.26 +- 0.23 MPa: no contradiction, and none is told
    assert result.small_strain_modulus == (pytest.approx(1.262e6, rel=5e-3), pytest.approx(0.226e6, rel=0.02))
    assert not any(line.startswith("E is ") for line in result.warnings)
    four = next(f for f in result.candidates if f.terms == 4)
    assert four.bic < fit.bic
    assert four.undetermined  # closer, but with a modulus that nobody knows


def test_the_constraint_costs_nothing_here(tests: dict[str, LoadTest]) -> None:
    """Every one of the free fit's terms has mu alpha > 0 too: the minimum is the whole space's."""
    held, free = (fit_model(list(tests.values()), "ogden", 3, constrained=c) for c in (True, False))
    assert free.material.stable_by_sign
    assert free.rmse == pytest.approx(held.rmse, rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_seed_finds_the_same(tests: dict[str, LoadTest], seed: int) -> None:
    first, other = (fit_model(list(tests.values()), "ogden", 3, seed=s) for s in (0, seed))
    assert other.material.alpha == pytest.approx(first.material.alpha, rel=1e-4)
    assert other.result.starts.agreeing >= 5


@pytest.mark.parametrize("terms", [None, 3])
def test_uniaxial_alone_shows_its_equibiaxial_prediction(tests: dict[str, LoadTest], terms: int | None) -> None:
    result = characterise([tests["uniaxial"]], terms=terms)
    predicted = next(p for p in result.predictions if p.mode == "equibiaxial")
    assert predicted.stretch == 7.6
    measured = tests["equibiaxial"]
    there = float(result.material.nominal("equibiaxial", measured.stretch[-1]))
    assert there > 1e4 * measured.stress[-1]
    told = result.warnings[0]
    assert "fitted to the uniaxial test alone" in told
    assert f"at stretch 7.6 it predicts {predicted.nominal:.4g} Pa equibiaxial" in told
    assert "absurd" in told


def test_relative_weighting_gives_the_modulus_of_small_strains(tests: dict[str, LoadTest]) -> None:
    result = characterise(list(tests.values()), terms=3, weighting="relative")
    assert result.small_strain_modulus is not None
    assert result.material.youngs_modulus == pytest.approx(result.small_strain_modulus[0], rel=0.1)
