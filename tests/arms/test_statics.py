"""Equilibria and natural frequencies against closed forms, with errors that fall as the lattice gets finer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import airy, jn_zeros

from ilg_circuit.arms import OCTOPUS, Arm, Muscle, activation, passive, strip_arm
from ilg_circuit.arms.lattice import GRAVITY, SHEAR_CORRECTION, SHEAR_RATIO, cell_areas
from ilg_circuit.arms.statics import equilibrium, natural_frequencies
from ilg_circuit.errors import InputError

SIZES = (15, 30, 60)


def falling(error: Callable[[int], float], last: float, factor: float = 1.5) -> None:
    """Errors fall at least by ``factor`` with each halving, down to ``last``."""
    errors = [abs(error(n)) for n in SIZES]
    assert errors[0] > factor * errors[1] > factor**2 * errors[2], errors
    assert errors[2] <= last, errors


def bent(arm: Arm, strain: float) -> np.ndarray:
    """Centreline at rest under a uniform eigenstrain."""
    drive = activation(arm, [0.0], np.full((1, arm.segments), strain))
    return equilibrium(arm, drive)[0].mean(axis=1)


def test_first_natural_frequency_is_eulers_and_bernoullis(strip: Arm) -> None:
    def error(n: int) -> float:
        return natural_frequencies(replace(strip, segments=n))[0] / strip.first_frequency - 1

    assert abs(error(15)) < 0.007
    assert abs(error(30)) < 0.001
    # what is left is the shear and the rotation that Euler and Bernoulli leave out
    assert error(120) == pytest.approx(-5e-4, abs=1.5e-4)


def test_higher_natural_frequencies(strip: Arm) -> None:
    exact = strip.first_frequency * (np.array([4.694091, 7.854757]) / 1.875104) ** 2
    found = natural_frequencies(replace(strip, segments=60), 3)[1:]
    assert found == pytest.approx(exact, rel=0.01)


def test_sag_under_small_gravity(strip: Arm) -> None:
    g = 1e-4
    bending = 1.5 * strip.density * g * strip.length**4 / (strip.youngs_modulus * strip.thickness**2)
    shear = strip.density * g * strip.length**2 / (2 * SHEAR_CORRECTION * SHEAR_RATIO * strip.youngs_modulus)

    def error(n: int) -> float:
        arm = replace(strip, segments=n, gravity=(0.0, -g))
        return -equilibrium(arm, passive(arm))[0][-1, :, 1].mean() / (bending + shear) - 1

    assert abs(error(15)) < 0.01
    assert abs(error(30)) < 0.001
    assert abs(error(120)) < 1e-4


@pytest.mark.parametrize("strain", [2.21e-3, 0.02])
def test_uniform_eigenstrain_makes_a_circle(strip: Arm, strain: float) -> None:
    """Curvature 2 eps/h."""
    bend = 2 * strain / strip.thickness
    turn = bend * strip.length
    tip = np.array([np.sin(turn), 1 - np.cos(turn)]) / bend

    def error(n: int) -> float:
        return float(np.linalg.norm(bent(replace(strip, segments=n), strain)[-1] - tip)) / strip.length

    falling(error, 3e-4, factor=4)


def test_an_eigenstrain_bends_towards_the_normal(strip: Arm) -> None:
    assert bent(strip, 1e-3)[-1, 1] > 0
    assert bent(strip, -1e-3)[-1] == pytest.approx(bent(strip, 1e-3)[-1] * [1, -1], abs=1e-12)


def test_equilibria_keep_areas(strip: Arm) -> None:
    q, _ = equilibrium(strip, activation(strip, [0.0], np.full((1, 15), 0.03)))
    assert cell_areas(q) == pytest.approx(cell_areas(strip.rest_positions()), rel=1e-11)


def test_symmetric_eigenstrain_lengthens_and_stays_straight(strip: Arm) -> None:
    values = np.zeros((1, 15, 3))
    values[:, :, :2] = 0.01
    q, _ = equilibrium(strip, activation(strip, [0.0], values))
    assert np.abs(q.mean(axis=1)[:, 1]).max() < 1e-15
    # a third of E A is the edges': they pull against the rods that the constant area shortens
    assert q[-1, 0, 0] / strip.length - 1 == pytest.approx(0.01 / 3, rel=0.05)


def test_the_chain_that_a_soft_strip_hangs_as(strip: Arm) -> None:
    """First frequency of a heavy chain, j0/2 sqrt(g/L), L stretched; bending is left out by E and h."""
    thin = replace(strip, thickness=10e-6, youngs_modulus=7.6e5, gravity=(0.0, -GRAVITY), direction=-np.pi / 2)

    def error(n: int) -> float:
        arm = replace(thin, segments=n)
        drive = passive(arm)
        length = -equilibrium(arm, drive)[0][-1, 0, 1]
        chain = jn_zeros(0, 1)[0] / 2 * np.sqrt(GRAVITY / length)
        return natural_frequencies(arm, 1, drive)[0] / chain - 1

    falling(error, 0.01)


@pytest.mark.parametrize("ratio", [1.0, 10.0])
def test_a_hanging_strip_bends_less(strip: Arm, ratio: float) -> None:
    """E I w''' = T w' with w'' the free curvature at the tip: Airy functions; 0.535 at r = 1, 0.139 at r = 10."""
    stiff = replace(
        strip, youngs_modulus=1.5 * strip.density * GRAVITY * strip.length**3 / (strip.thickness**2 * ratio)
    )
    arm = replace(stiff, segments=30, gravity=(0.0, -GRAVITY), direction=-np.pi / 2)
    strain = 1e-4
    free = strain / arm.thickness * arm.length**2
    x = np.linspace(0, 1, 20001)
    lam = (8 * ratio) ** (1 / 3)  # length over (E I/(rho A g))^(1/3)
    ai, aip, bi, bip = airy(lam * (1 - x))
    ends = np.array([[ai[0], bi[0]], [-lam * aip[-1], -lam * bip[-1]]])
    c = np.linalg.solve(ends, [0.0, 2.0])
    exact = np.trapezoid(c[0] * ai + c[1] * bi, x)
    assert exact == pytest.approx({1.0: 0.535, 10.0: 0.139}[ratio], abs=2e-3)
    assert bent(arm, strain)[-1, 0] / free == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("n", [15, 60])
def test_a_soft_hanging_strip_is_stable(n: int) -> None:
    """5 % of tension: a shear energy counted in the cells only lets rods tilt by turns at n = 15."""
    arm = strip_arm(segments=n, mounting="hanging")
    frequencies = natural_frequencies(arm, 3, passive(arm))
    assert frequencies.min() > 20


def test_pre_tension_is_in_balance() -> None:
    """An untapered yekutieli arm rests in its rest shape, for any r."""
    for ratio in (0.5, 0.8):
        arm = replace(
            OCTOPUS, gravity=(0.0, 0.0), tip_thickness=None, tip_depth=None, muscle=replace(Muscle(), rest_ratio=ratio)
        )
        q, p = equilibrium(arm, passive(arm))
        assert q == pytest.approx(arm.rest_positions(), abs=1e-12)
        assert p == pytest.approx(arm.muscle.passive * (1 - ratio))


@pytest.mark.parametrize("count", [0, 46])
def test_too_many_frequencies_are_refused(strip: Arm, count: int) -> None:
    with pytest.raises(InputError, match="has 1 to 45"):
        natural_frequencies(strip, count)


def test_a_wrong_start_is_refused(strip: Arm) -> None:
    with pytest.raises(InputError, match=r"shape \(16, 2, 2\)"):
        equilibrium(strip, passive(strip), start=np.zeros((3, 2, 2)))
