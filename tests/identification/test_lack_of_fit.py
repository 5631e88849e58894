"""The test for lack of fit: noise of any colour passes, and what a model lacks is found long before it is seen."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import lack_of_fit as module
from ilg_circuit.identification.lack_of_fit import Lack, lack_of_fit

Array = NDArray[np.float64]

T = np.linspace(-6.0, 300.0, 800)
#: A staircase of many levels, a ramp, and a step.
DRIVES = {
    "staircase": PiecewiseLinear(
        np.repeat(np.arange(0.0, 300.0, 20.0), 2)[1:], np.repeat([2.0, -1, 3, 1, -2] * 3, 2)[:-1]
    ),
    "triangle": PiecewiseLinear(np.arange(0.0, 301.0, 50.0), np.array([0.0, 3, 0, -3, 0, 3, 0])),
    "step": PiecewiseLinear.step(3.0),
}


def wave(drive: PiecewiseLinear, time: float, power: int = 1) -> Array:
    """Return the low-pass of a power of a drive, by small steps of the exact answer to a constant."""
    fine = np.linspace(0.0, 300.0, 60_001)
    u = drive.value(fine) ** power
    decay = np.exp(-(fine[1] - fine[0]) / time)
    low = lfilter([0.0, 1 - decay], [1.0, -decay], u)
    return np.where(T >= 0, np.interp(T, fine, low), 0.0)


def slopes(drive: PiecewiseLinear) -> Array:
    """Return what a fit of one branch of 10 s has explained: offset, electrons, and R and C of the branch."""
    u = np.where(T >= 0, drive.value(np.maximum(T, 0.0)), 0.0)
    near = (wave(drive, 10.1) - wave(drive, 9.9)) / 0.2
    return np.column_stack([np.ones(len(T)), u, wave(drive, 10.0), near])


def left(drive: PiecewiseLinear, values: Array) -> Array:
    """Return what the fit of one branch leaves of ``values``."""
    q, _ = np.linalg.qr(slopes(drive))
    return np.asarray(values - q @ (q.T @ values))


def found(drive: PiecewiseLinear, values: Array) -> Lack:
    """What is lacking by the last readings, at T; those before them are at rest, too."""
    more = len(values) - len(T)
    since = np.append(T[0] + (T[1] - T[0]) * np.arange(-more, 0), T)
    residuals = np.append(values[:more], left(drive, values[more:]))
    lack = lack_of_fit(since, drive, residuals, np.vstack([np.zeros((more, 4)), slopes(drive)]))
    assert lack is not None
    return lack


def noise(seed: int, correlation: float = 0.0, rest: int = 0) -> Array:
    """Noise of readings at T, with ``rest`` more of them before."""
    white = np.random.default_rng(seed).standard_normal(len(T) + rest + 200)
    return np.asarray(lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], white)[200:])


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize(("correlation", "most"), [(0.0, 2), (0.7, 2), (0.9, 5)])
def test_noise_is_noise(name: str, correlation: float, most: int) -> None:
    """The tests are at levels of 0.1 % to 0.6 %; at a correlation of 0.9 only 40 of 800 readings are independent."""
    many = [found(DRIVES[name], noise(k, correlation)) for k in range(100)]
    assert sum(lack.anything for lack in many) <= most


@pytest.mark.parametrize("name", DRIVES)
def test_a_time_constant_that_is_missing_is_found_below_the_noise(name: str) -> None:
    missing = left(DRIVES[name], wave(DRIVES[name], 60.0))
    missing *= 0.35 / float(np.sqrt(np.mean(missing**2)))  # of the noise: the misfit is 1.06 of it
    many = [found(DRIVES[name], noise(k) + missing) for k in range(20)]
    assert all(lack.anything and lack.relaxations for lack in many)
    assert sum(lack.law for lack in many) <= 1
    assert np.mean([lack.share for lack in many]) == pytest.approx(0.35**2 / (1 + 0.35**2), abs=0.05)


@pytest.mark.parametrize("by_current", [False, True])
@pytest.mark.parametrize("name", ["staircase", "triangle"])
def test_a_relaxation_of_negative_conductance_is_no_branch(name: str, by_current: bool) -> None:
    """A current that falls behind a step, and the voltage under a current that rises, are those of R and C."""
    drive = DRIVES[name]
    missing = left(drive, wave(drive, 60.0))
    missing *= 0.5 / float(np.sqrt(np.mean(missing**2)))
    for sign in (1.0, -1.0):
        # a low-pass is the drive less a high-pass, and the drive itself is explained
        branch = sign > 0 if by_current else sign < 0
        for k in range(10):
            lack = lack_of_fit(T, drive, left(drive, noise(k)) + sign * missing, slopes(drive), by_current=by_current)
            assert lack is not None
            assert lack.relaxations
            assert lack.branches == branch


@pytest.mark.parametrize("name", ["staircase", "triangle"])
@pytest.mark.parametrize("power", [2, 3])
def test_a_law_of_the_voltage_is_found_and_told_from_relaxations(name: str, power: int) -> None:
    missing = left(DRIVES[name], wave(DRIVES[name], 15.0, power))
    missing *= 0.5 / float(np.sqrt(np.mean(missing**2)))
    assert all(found(DRIVES[name], noise(k) + missing).law for k in range(20))


def test_under_a_step_a_law_is_no_other_than_relaxations() -> None:
    """The square of a constant voltage is constant: nothing tells them apart."""
    step = DRIVES["step"]
    assert not any(found(step, noise(k) + wave(step, 40.0, 3)).law for k in range(20))


def test_what_several_files_lack_is_what_any_of_them_does() -> None:
    assert Lack.of_any([Lack(), Lack(anything=True, law=True, share=0.2)]) == Lack(True, False, True, 0.2)
    assert Lack.of_any([Lack(), Lack(branches=True)]) == Lack(branches=True)
    assert Lack.of_any([Lack(), None]) is None
    assert Lack.of_any([]) == Lack()


def test_coloured_noise_is_that_of_the_readings_at_rest() -> None:
    """Noise that is correlated after the onset alone is no noise, and where little is independent nothing is known."""
    drive = DRIVES["staircase"]
    assert sum(found(drive, noise(k, 0.7, rest=60)).coloured for k in range(40)) >= 38
    # 15 readings at rest show a correlation of 0.7 in some sets, and none where there is none
    assert sum(found(drive, noise(k, 0.7)).coloured for k in range(40)) >= 10
    for correlation in (0.5, 0.9):
        after = [np.where(T < 0, noise(k), noise(k, correlation)) for k in range(40)]
        assert sum(found(drive, values).coloured for values in after) <= 2
    assert not any(found(drive, noise(k, 0.98)).coloured for k in range(40))


def test_some_readings_of_a_long_record_are_tested(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = DRIVES["staircase"]
    monkeypatch.setattr(module, "_MOST_READINGS", 300)
    missing = left(drive, wave(drive, 60.0))
    assert found(drive, noise(0) + missing / float(np.sqrt(np.mean(missing**2)))).relaxations
    assert not found(drive, noise(0)).anything


def test_records_that_are_too_long_or_too_short_are_not_tested(monkeypatch: pytest.MonkeyPatch) -> None:
    step = DRIVES["step"]
    few = slice(8, 22)
    assert lack_of_fit(T[few], step, noise(1)[few], slopes(step)[few]) is None
    monkeypatch.setattr(module, "_MOST_POINTS", 100)
    assert lack_of_fit(T, step, noise(1), slopes(step)) is None
