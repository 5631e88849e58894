"""The arm in motion: both methods against closed forms, each other, and the balance of energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ilg_circuit.arms import (
    OCTOPUS,
    Activation,
    Arm,
    Motion,
    Plane,
    activation,
    choose,
    passive,
    sampled,
    simulate,
    sine,
    stiffening_wave,
    strip_arm,
)
from ilg_circuit.arms.activation import corners
from ilg_circuit.arms.dynamics import _failure, stiffness
from ilg_circuit.arms.explicit import NOT_FINITE, TOO_SMALL
from ilg_circuit.arms.statics import equilibrium, natural_frequencies
from ilg_circuit.errors import InputError, SolveError

PERIOD = 1.035463
LEAST_DAMPED = 1e-3  # s, loss time of a lightly damped strip
DRY = replace(OCTOPUS, gravity=(0.0, 0.0))


@pytest.fixture(scope="module")
def light() -> Arm:
    return replace(strip_arm(), damping=LEAST_DAMPED)


def wave(arm: Arm, strain: float, duration: float) -> Activation:
    """A travelling wave of eigenstrain."""
    x = (np.arange(arm.segments) + 0.5) / arm.segments
    times = np.linspace(0, duration, int(200 * duration) + 1)
    return sampled(arm, lambda t: strain * np.sin(2 * np.pi * (t[:, None] - x)) * np.minimum(t[:, None], 1.0), times)


@pytest.mark.parametrize(("method", "damping"), [("explicit", 1e-3), ("implicit", 1e-3), ("implicit", 0.1)])
def test_a_released_beam_swings_with_its_natural_frequencies_and_damping(
    light: Arm, method: str, damping: float
) -> None:
    """Kelvin-Voigt: a mode of angular frequency w decays with w^2 damping/2."""
    arm = replace(light, segments=6, damping=damping)
    positions, _ = equilibrium(arm, activation(arm, [0.0], np.full((1, 6), 1e-4)))
    times = np.linspace(0.5, 5.0, 100)
    start = (positions, np.zeros_like(positions))
    y = simulate(arm, passive(arm), times, method=method, start=start).tip[:, 1]
    w = natural_frequencies(arm, 3)
    exponents = -(w**2) * damping / 2 + 1j * np.sqrt(w**2 - (w**2 * damping / 2) ** 2 + 0j)
    modes = np.exp(times[:, None] * exponents)
    basis = np.concatenate([modes.real, modes.imag], axis=1)
    left = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
    assert np.abs(left).max() < 2e-3 * np.abs(y).max()


def test_both_methods_agree(light: Arm) -> None:
    drive = wave(light, 0.05, 1.0)
    times = np.linspace(0, 1.0, 21)
    one, two = (simulate(light, drive, times, method=m, tolerance=1e-7) for m in ("explicit", "implicit"))
    assert one.tip == pytest.approx(two.tip, abs=1e-6 * light.length)
    assert one.pressures == pytest.approx(two.pressures, abs=1e-3 * np.abs(two.pressures).max())
    assert one.works[-1] == pytest.approx(two.works[-1], abs=1e-4 * np.abs(two.works[-1]).max())


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_energy_and_areas_over_five_seconds(light: Arm, method: str) -> None:
    """Shear and damping counted; gravity works too."""
    arm = replace(light, segments=8, gravity=(0.0, -0.01))
    motion = simulate(arm, wave(arm, 0.03, 5.0), np.linspace(0, 5, 101), method=method, tolerance=5e-7)
    assert motion.balance_error < 1e-5
    assert motion.area_drift < 1e-6
    assert (np.abs(motion.energies).max(axis=0) > 0).all()
    assert (motion.works[-1, :2] > 0).all()
    assert motion.works[-1, 2:].tolist() == [0.0, 0.0]


def test_energy_and_areas_of_the_gel_strip() -> None:
    arm = strip_arm()
    motion = simulate(arm, sine(arm, 2.21e-3, PERIOD, 5.0), np.linspace(0, 5, 101))
    assert motion.method == "implicit"
    assert motion.balance_error < 1e-5
    assert motion.area_drift < 1e-6


def test_a_finer_wave_of_large_strain_converges() -> None:
    """A shear energy counted at the rods only lets the axis of a fine lattice buckle into a saw-tooth here."""
    base = Arm(0.3, 17e-3, 18e-3, 1000.0, youngs_modulus=1e6, damping=0.026)
    tips = {}
    for n in (15, 30, 60):
        arm = replace(base, segments=n)
        motion = simulate(arm, wave(arm, 0.08, 1.2), [0.4, 0.8, 1.2], tolerance=1e-4)
        tips[n] = motion.tip
        saw = np.abs(np.diff(motion.centreline, n=3, axis=1)).max() / arm.segment_length
        assert saw < 0.1
    error = [np.abs(tips[n] - tips[60]).max() / base.length for n in (15, 30)]
    print(f"tip of 15 segments {error[0]:.1%} of the length from that of 60, of 30 {error[1]:.1%}")
    assert error[0] > 2 * error[1]


@pytest.mark.parametrize("arm", [replace(strip_arm(), damping=0.05), DRY], ids=["beam", "yekutieli"])
def test_mirrored_input_makes_a_mirrored_motion(arm: Arm) -> None:
    times = np.linspace(0, 0.5, 6)
    tips = [simulate(arm, sine(arm, sign * 0.02, 0.4, 0.5), times).positions for sign in (1, -1)]
    mirrored = tips[1][:, :, ::-1] * [1, -1]
    assert np.abs(tips[0] - tips[0][0]).max() > 1e-4
    assert tips[0] == pytest.approx(mirrored, abs=1e-9 * arm.length)


@pytest.mark.parametrize("arm", [strip_arm(), DRY], ids=["beam", "yekutieli"])
def test_symmetric_activation_stays_straight(arm: Arm) -> None:
    values = np.zeros((3, 15, 3))
    values[1:, :, :2] = 0.05
    motion = simulate(arm, activation(arm, [0.0, 0.1, 1.0], values), np.linspace(0, 0.5, 6))
    assert np.abs(motion.centreline[:, :, 1]).max() < 1e-10 * arm.length
    longer = motion.tip[-1, 0] - motion.tip[0, 0]
    assert longer > 0 if arm.formulation == "beam" else longer < -0.05 * arm.length


def test_passive_muscles_nearly_rest() -> None:
    """The taper leaves the pre-tension of a lattice out of balance by its square only."""
    motion = simulate(DRY, passive(DRY), np.linspace(0, 1, 11))
    assert np.abs(motion.positions - motion.positions[0]).max() < 4e-3 * DRY.length
    assert np.abs(motion.centreline[:, :, 1]).max() < 1e-12


def test_muscles_across_lengthen_the_arm() -> None:
    values = np.zeros((2, 15, 3))
    values[1, :, 2] = 0.5
    motion = simulate(DRY, activation(DRY, [0.0, 0.2], values), [0.0, 0.5])
    assert motion.tip[-1, 0] > 1.3 * DRY.length


def test_the_reach_straightens_the_arm() -> None:
    motion = simulate(OCTOPUS, stiffening_wave(OCTOPUS, 1.8), np.linspace(0, 1.8, 181))
    steps = np.diff(motion.centreline, axis=1)
    heading = np.degrees(np.unwrap(np.arctan2(steps[..., 1], steps[..., 0]), axis=1))
    at = {t: heading[round(100 * t)] for t in (0.6, 1.0, 1.8)}
    assert np.ptp(at[0.6]) > 60  # bent at the base
    assert np.abs(at[1.0][:5]).max() < 10  # the base is straight, the bend has moved on towards the tip
    assert np.abs(at[1.0][8:]).max() > 60
    assert np.abs(at[1.8]).max() < 15
    assert motion.tip[-1, 0] > 0.98 * OCTOPUS.length
    assert motion.balance_error < 1e-5
    assert motion.area_drift < 1e-6
    assert motion.method == "explicit"


def test_a_cell_is_half_stiff_when_the_middle_of_the_front_has_come_to_its_own_middle() -> None:
    duration, bend, speed, front, n = 2.5, 0.6, 0.3, 0.06, OCTOPUS.segments
    wave = stiffening_wave(OCTOPUS, duration, bend=bend, speed=speed, front=front)
    for k in (0, 3, n - 1):
        reached = bend + ((k + 0.5) * OCTOPUS.length / n + front / 2) / speed
        assert reached < duration
        assert np.interp(reached, wave.time, wave.values[:, k, 1]) == pytest.approx(0.5, abs=1e-3)
    assert (wave.values[wave.time <= bend, :, 1] == 0).all()


def test_drag_and_the_plane_take_energy(light: Arm) -> None:
    plane = Plane((0.0, -2e-3), (0.0, 1.0), stiffness=1.0, damping=50.0)
    arm = replace(light, gravity=(0.0, -0.5), plane=plane, segments=8)
    motion = simulate(arm, passive(arm), np.linspace(0, 2, 41))
    assert motion.positions[:, :, :, 1].min() > -2.2e-3
    assert motion.works[-1, 3] > 0
    assert motion.balance_error < 1e-5
    assert any(e.finding.code == "arm-touches-plane" for e in motion.events)


def test_the_method_is_chosen_by_stiffness() -> None:
    gel, octopus = strip_arm(), OCTOPUS
    assert choose(gel, passive(gel), 1.0)[0] == "implicit"
    assert choose(octopus, passive(octopus), 1.0)[0] == "explicit"
    assert choose(strip_arm(segments=200), passive(strip_arm(segments=200)), 1.0)[0] == "implicit"
    assert "steps a second" in choose(gel, passive(gel), 1.0)[1]
    # the fastest rates: the longitudinal wave's and faster; Kelvin-Voigt decay is damping times their square
    rates = stiffness(gel, passive(gel))
    assert rates.decay == pytest.approx(gel.damping * rates.oscillation**2, rel=0.05)
    # without damping areas alone decay: as exp(-beta t) (1 + beta t)
    loose = replace(gel, damping=0.0)
    assert stiffness(loose, passive(gel)).decay == pytest.approx(2 * gel.stabilisation)


def test_steps_pass_over_samples_of_something_smooth(light: Arm) -> None:
    smooth, sharp = sine(light, 1e-3, 1.0, 1.0), activation(light, [0.0, 0.5, 1.0], np.outer([0, 1e-3, 0], np.ones(15)))
    assert len(corners(smooth, 1e-3)) == 2
    assert len(corners(smooth, 1e-6)) > 150
    assert corners(sharp, 1e-3).tolist() == [0.0, 0.5, 1.0]


def test_events_say_what_was_done(light: Arm) -> None:
    motion = simulate(light, sine(light, 1e-3, 1.0, 1.0), [0.5, 1.0], tolerance=1e-4)
    texts = [e.text for e in motion.events]
    assert any("implicit method" in text for text in texts)
    assert any("0.0001 of 0.0005 m" in text for text in texts)
    assert any("refused" in text for text in texts)
    assert motion.warnings == ()


def test_an_arm_that_crosses_itself_is_reported(light: Arm) -> None:
    arm = replace(light, segments=30, damping=0.4, density=10.0)
    rolled = activation(arm, [0.0, 1.0, 2.0], np.outer([0, 0.07, 0.07], np.ones(30)))
    motion = simulate(arm, rolled, np.linspace(0, 2, 41), tolerance=1e-4)
    assert len(motion.warnings) == 1
    assert "crosses itself at segment" in motion.warnings[0]


def test_progress_and_sampling(light: Arm) -> None:
    seen: list[int] = []
    times = [0.0, 0.1, 0.25]
    motion: Motion = simulate(light, passive(light), times, progress=lambda done, total: seen.append(done))
    assert motion.time.tolist() == times
    assert seen[-1] == 1000


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
def test_a_motion_that_blows_up_names_segment_and_time(light: Arm) -> None:
    q = light.rest_positions()
    v = np.zeros_like(q)
    v[7] = 1e200
    with pytest.raises(SolveError, match=r"in segment \d+ at 0 s"):
        simulate(light, passive(light), [1.0], start=(q, v))


def test_failures_in_one_line(light: Arm) -> None:
    from ilg_circuit.arms.dynamics import _prepare

    run = _prepare(light, passive(light), np.array([1.0]), 1e-6, None)
    run.counts[3:], run.clock[0] = (4, NOT_FINITE), 0.25
    assert "not finite any more in segment 4 at 0.25 s" in str(_failure(run))
    run.counts[4] = TOO_SMALL
    assert "no step is small enough for the arm in segment 4 at 0.25 s" in str(_failure(run))


@pytest.mark.parametrize(
    ("times", "options", "hint"),
    [
        ([], {}, "finite sample times"),
        ([np.nan], {}, "finite sample times"),
        ([1.0, 0.5], {}, "ascending"),
        ([-1.0, 0.5], {}, "ascending"),
        ([0.0], {}, "ascending"),
        ([1.0], {"method": "magic"}, "choose one of auto, explicit, implicit"),
        ([1.0], {"tolerance": 0.0}, "give 1e-12 to 1e-2"),
        ([1.0], {"start": (np.zeros(3), np.zeros(3))}, "give finite positions and velocities"),
    ],
)
def test_wrong_input_is_refused(light: Arm, times: list[float], options: dict[str, Any], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        simulate(light, passive(light), times, **options)


@pytest.mark.parametrize(
    ("time", "values", "hint"),
    [
        ([0.0], np.zeros((1, 3)), r"shape \(1, 3\); give \(1, 15\) or \(1, 15, 3\)"),
        ([0.0, 0.0], np.zeros((2, 15)), "ascending"),
        ([0.0], np.full((1, 15), np.nan), "segment 1 at 0 s is nan"),
        ([0.0], np.full((1, 15), 0.6), "0.6; give -0.5 to 0.5"),
        ([0.0], "text", "arrays of numbers"),
    ],
)
def test_wrong_activations_are_refused(light: Arm, time: list[float], values: Any, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        activation(light, time, values)


def test_activation_of_muscles() -> None:
    drive = activation(OCTOPUS, [0.0, 1.0], np.outer([0.5, -0.25], np.ones(15)))
    assert drive.values[:, 0].tolist() == [[0.5, 0.0, 0.0], [0.0, 0.25, 0.0]]
    assert drive.at([0.5, 2.0])[:, 0].tolist() == [[0.25, 0.125, 0.0], [0.0, 0.25, 0.0]]
    with pytest.raises(InputError, match=r"segment 1 at 0 s is -0\.1; give 0 to 1"):
        activation(OCTOPUS, [0.0], np.full((1, 15, 3), -0.1))
    with pytest.raises(InputError, match="choose the formulation yekutieli"):
        stiffening_wave(strip_arm(), 1.0)
    with pytest.raises(InputError, match="the activation is for 15 segments, the arm has 30"):
        simulate(replace(OCTOPUS, segments=30), drive, [1.0])
