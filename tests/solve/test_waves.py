"""Derivatives of single modes by their poles, against steps in the complex plane."""

import numpy as np
import pytest

from ilg_circuit.arrays import Array
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.solve.waves import Numbers, waves_under_lines

_RANDOM = np.random.default_rng(1)
_DRIVES = {
    "step": PiecewiseLinear.step(2.0),
    "square": PiecewiseLinear.square(-1.0, 2.0, 7.0, 60.0),
    "lines": PiecewiseLinear(np.sort(_RANDOM.uniform(0, 60, 40)), _RANDOM.normal(size=40)),
    "lines and levels": PiecewiseLinear((0.0, 3.0, 9.0, 9.0, 30.0), (0.0, 1.0, 1.0, -2.0, -2.0)),
}


def _waves(poles: Numbers, drive: PiecewiseLinear, times: Array, *, slopes: bool = False) -> Numbers:
    return np.concatenate([waves for _, waves in waves_under_lines(poles, drive, times, slopes=slopes)])


@pytest.mark.parametrize("samples", [30, 9000])  # from sample to sample, and from edge to edge in several blocks
@pytest.mark.parametrize("drive", _DRIVES.values(), ids=_DRIVES)
def test_the_derivative_of_a_real_mode_is_that_of_a_complex_step(drive: PiecewiseLinear, samples: int) -> None:
    times = np.sort(_RANDOM.uniform(0, 60, samples))
    poles = -np.append(np.geomspace(1e-4, 300, 8), 0.01 / 7)[None]
    step = 1e-30 * np.abs(poles)  # whose differences have no rounding
    found = _waves(poles, drive, times, slopes=True)
    turned = _waves(poles + 1j * step, drive, times)[:, 0]
    for mine, right in ((found[:, 0], turned.real), (found[:, 1], turned.imag / step)):
        assert np.all(np.abs(mine - right).max(axis=0) <= 1e-11 * np.abs(right).max(axis=0))


@pytest.mark.parametrize("drive", _DRIVES.values(), ids=_DRIVES)
def test_the_derivative_of_a_complex_mode_is_that_of_a_circle_round_its_pole(drive: PiecewiseLinear) -> None:
    times = np.sort(_RANDOM.uniform(0, 60, 500))
    poles = (-np.geomspace(1e-3, 100, 6) * np.exp(0.7j))[None]
    points = np.exp(2j * np.pi * np.arange(8) / 8)  # Cauchy's integral by the trapezoidal rule
    round_it = [_waves(poles * (1 + 1e-3 * turn), drive, times)[:, 0] / (1e-3 * poles * turn) for turn in points]
    found, right = _waves(poles, drive, times, slopes=True)[:, 1], np.mean(round_it, axis=0)
    assert np.all(np.abs(found - right).max(axis=0) <= 1e-10 * np.abs(right).max(axis=0))


def test_a_pole_at_zero_integrates_and_its_derivative_integrates_twice() -> None:
    times = np.linspace(0.0, 4.0, 50)
    found = _waves(np.array([[0.0, -1.0]]), PiecewiseLinear.step(2.0), times, slopes=True)
    np.testing.assert_allclose(found[:, :, 0], np.stack([2 * times, times**2], axis=1), rtol=1e-13)
