"""Waves of laws of bending that are interpolated between time constants, against the exact ones."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.arrays import Array
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification.coupling_waves import Waves
from ilg_circuit.strip.actuator import PAPER

T = np.linspace(0.01, 40.0, 400)
DRIVES = {"step": PiecewiseLinear.step(1.0), "bent": PiecewiseLinear([0.0, 5.0, 9.0, 30.0], [0.0, 1.0, -1.0, 0.5])}
#: Step of a logarithm for central differences.
STEP = 1e-4


@pytest.fixture(params=[(drive, beam) for drive in DRIVES for beam in ("static", "dynamic")], ids="-".join)
def waves(request: pytest.FixtureRequest) -> Waves:
    drive, beam = request.param
    return Waves(T, DRIVES[drive], PAPER, charge=False, beam=beam)


def assert_close(found: tuple[Array, Array], exact: Array, slopes: Array) -> None:
    """Compare waves to 1e-6 of the largest value, and derivatives to 1e-5."""
    for made, expected, error in ((found[0], exact, 1e-6), (found[1], slopes, 1e-5)):
        np.testing.assert_allclose(made, expected, rtol=0, atol=error * np.abs(expected).max())


@pytest.mark.parametrize("time", [0.3, 2.345, 71.0])
def test_a_relaxation_is_interpolated(waves: Waves, time: float) -> None:
    exact = waves.exact(time * np.exp([0.0, STEP, -STEP]))
    assert_close(waves.relaxed(time), exact[0], (exact[1] - exact[2]) / (2 * STEP))


@pytest.mark.parametrize(("damping", "frequency"), [(1.11, 2.0), (1.5, 0.5), (4.0, 1.0), (30.0, 2.0)])
def test_two_real_poles_are_two_relaxations(waves: Waves, damping: float, frequency: float) -> None:
    steps = np.exp(STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]))
    exact = waves.second_order(*(np.array([damping, frequency]) * steps).T)
    slopes = np.array([exact[1] - exact[2], exact[3] - exact[4]]) / (2 * STEP)
    assert_close(waves.overdamped(damping, frequency), exact[0], slopes)
