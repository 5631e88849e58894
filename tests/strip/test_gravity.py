"""A hanging strip: the linear beam under its own weight and a load's, solved as a boundary value problem beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from ilg_circuit.circuit import Load
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Mounting
from ilg_circuit.strip.elements import gravity_ratio, hanging_stiffness, lumped_elements
from ilg_circuit.strip.validity import assumptions


def hanging(modulus: float, load_position: float = 30e-3) -> Actuator:
    geometry = replace(PAPER.geometry, load_position=load_position)
    material = replace(PAPER.material, youngs_modulus=modulus)
    return replace(PAPER, geometry=geometry, material=material, mounting=Mounting("hanging"))


def share(strip: Actuator, hung: float = 0.0) -> float:
    """What gravity leaves of the displacement at L_F."""
    stiffness = lumped_elements(strip).stiffness
    return stiffness / (stiffness + hanging_stiffness(strip, hung))


@pytest.mark.parametrize(
    ("modulus", "load_position", "hung", "millimetres"),
    [
        (2e6, 30e-3, 0.0, 2.13682),
        (2e6, 15e-3, 0.0, 0.417513),
        (0.3e6, 15e-3, 0.0, 0.0520868),
        (2e6, 30e-3, 20e-6, 1.54605),
        (2e6, 30e-3, 50e-6, 1.08389),
    ],
)
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_displacement_at_rest(modulus: float, load_position: float, hung: float, millimetres: float, beam: str) -> None:
    strip = hanging(modulus, load_position)
    load = Load(mass=hung) if hung else None
    if beam == "static" and load:
        return  # a load needs the dynamic beam
    response = simulate(strip, PiecewiseLinear.step(4.0), [0.0, 6000.0], beam=beam, load=load, engine="exact")
    assert response.displacement[-1] == pytest.approx(1e-3 * millimetres, rel=3e-6)


@pytest.mark.parametrize("part", [1.0, 0.7, 0.2])
@pytest.mark.parametrize("hung", [0.0, 3e-5, 1e-3])
@pytest.mark.parametrize("modulus", [1e8, 2e6, 1e5])
def test_the_series_solves_the_beam(part: float, hung: float, modulus: float) -> None:
    strip = hanging(modulus, part * 30e-3)
    own = 8 * gravity_ratio(strip)
    load = own * hung / (1250 * 5e-3 * 0.5e-3 * 30e-3)

    # slope, curvature less k0 = 1, deflection of EI (y'' - k0)'' = (T y')' along x in units of L0
    def slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], (own * (1 - x) + load) * y[0], y[0]])

    def ends(clamp: np.ndarray, tip: np.ndarray) -> np.ndarray:
        return np.array([clamp[0], clamp[2], tip[1] - 1])

    x = np.linspace(0, 1, 201)
    solved = solve_bvp(slopes, ends, x, np.vstack([x, np.ones_like(x), x**2 / 2]), tol=1e-9, max_nodes=20000)
    assert solved.success
    assert share(strip, hung) == pytest.approx(2 * solved.sol(part)[2] / part**2, rel=1e-6)


def test_without_weight_nothing_is_left_to_gravity() -> None:
    strip = hanging(1e12, 20e-3)
    assert share(strip) == pytest.approx(1.0, abs=1e-5)
    # to first order 7/60 r of a strip that is measured at its end
    stiff = hanging(1e9)
    assert 1 - share(stiff) == pytest.approx(8 * gravity_ratio(stiff) * 7 / 60, rel=1e-2)


@pytest.mark.parametrize("orientation", ["hanging", "horizontal"])
def test_the_number_does_not_know_where_the_load_is(orientation: str) -> None:
    numbers = [
        next(
            row.number
            for row in assumptions(replace(hanging(2e6, at), mounting=Mounting(orientation)))
            if row.name.startswith("gravity")
        )
        for at in (10e-3, 15e-3, 30e-3)
    ]
    assert numbers == pytest.approx([1.5 * 1250 * 9.80665 * 30e-3**3 / (2e6 * 0.5e-3**2)] * 3, rel=1e-12)
    assert numbers[0] == pytest.approx(0.993, abs=5e-4)
