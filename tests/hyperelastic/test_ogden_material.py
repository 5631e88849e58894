"""Ogden materials: stresses, moduli, conventions, stability."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from gels import MODE, STRETCH, TWO, materials, principal
from hypothesis import given
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.errors import InputError
from ilg_circuit.hyperelastic import MODES, Ogden
from ilg_circuit.hyperelastic.material import stress_basis, stress_basis_slope


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
