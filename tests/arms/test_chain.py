"""The arm as a chain of arcs: exact arcs, the elastica, frequencies, energies, and the lattice as it is refined."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.arms import Activation, Arm, Fluid, Plane, activation, run, simulate
from ilg_circuit.arms.chain import Chain, Contact
from ilg_circuit.arms.chain_motion import _between, bends_of
from ilg_circuit.arms.lattice import mounted, strip_arm
from ilg_circuit.arms.statics import equilibrium, lattice_error, natural_frequencies
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.curvature import Curvatures
from ilg_circuit.simulation.elastica import Acting, elastica
from ilg_circuit.strip.actuator import CANTILEVER_EIGENVALUE

#: Free strain of the paper's strip at 4 V.
STRAIN = 2.2113870e-3


def beam(segments: int, formulation: str = "chain", **changes: Any) -> Arm:
    return replace(strip_arm(segments=segments), formulation=formulation, **changes)


def four(arm: Arm) -> Activation:
    """Return strains of alternating sign in four equal parts of an arm."""
    signs = np.repeat([1.0, -1.0, 1.0, -1.0], arm.segments // 4)
    return activation(arm, [0.0], STRAIN * signs[None])


def tip(arm: Arm, drive: Activation) -> np.ndarray:
    return np.asarray(equilibrium(arm, drive)[0][-1].mean(axis=0))


def test_exact_for_constant_curvature_where_a_lattice_is_refined_towards_it() -> None:
    exact = [29.97800e-3, 0.99476e-3]
    for n in (4, 16):
        np.testing.assert_allclose(tip(beam(n), four(beam(n))), exact, atol=5e-9)
    lattice = {n: tip(beam(n, "beam"), four(beam(n, "beam")))[1] for n in (16, 32)}
    assert lattice[16] == pytest.approx(0.95701e-3, abs=5e-9)
    assert lattice[32] == pytest.approx(0.99385e-3, abs=5e-9)


def test_under_weight_it_is_the_elastica_with_an_error_of_second_order() -> None:
    free = Curvatures(np.zeros(1), np.ones(1), np.full((1, 1), 1.5))
    x, y, angle = elastica(free, 1.0, Acting(weight=(1.0, -6.0), force=(0.5, -1.0)), np.array([1.0]))
    errors = []
    for n in (8, 16):
        ones = np.ones(n)
        chain = Chain(ones / n, ones, 2 * ones, 0.01 * ones, weight=0.5 - 3j, pull=0.5 - 1j)
        angles = chain.equilibrium(1.5 * ones)
        away = chain.positions(angles)[-1] - (x[0, 0] + 1j * y[0, 0])
        errors.append([abs(away), abs(angles[-1] - angle[0, 0])])
    np.testing.assert_allclose(np.divide(*errors), 4.0, rtol=0.05)
    assert max(errors[1]) < 2e-3


def test_frequencies_are_those_of_a_beam() -> None:
    n = 40
    found = natural_frequencies(beam(n), 2)
    first = beam(n).first_frequency
    np.testing.assert_allclose(found, [first, first * (4.694091 / CANTILEVER_EIGENVALUE) ** 2], rtol=2e-3)
    heavy = mounted(beam(n, youngs_modulus=2e6), "hanging")
    still = Activation(np.zeros(1), np.zeros((1, n, 3)))
    lattice = natural_frequencies(replace(heavy, formulation="beam"), 2, still)
    np.testing.assert_allclose(natural_frequencies(heavy, 2, still), lattice, rtol=6e-3)


def test_energies_balance_with_everything_that_acts() -> None:
    n = 3
    arm = beam(
        n, youngs_modulus=2e5, damping=2e-3, gravity=(0.0, -9.80665), direction=0.2, curvature=5.0, tip_thickness=3e-4,
        fluid=Fluid(density=800.0), plane=Plane((0.0, -1e-3), (0.1, 1.0), 5.0, 2.0),
    )  # fmt: skip
    times = np.linspace(0.0, 0.15, 31)
    strains = 0.02 * np.sin(40 * times)[:, None] * np.linspace(1, -1, n)
    motion = simulate(arm, activation(arm, times, strains), times, tolerance=1e-5)
    assert motion.balance_error < 1e-4
    works = np.abs(motion.works[-1])
    assert (works > 1e-3 * works.max()).all()  # actuators, damping, drag and impact all take part
    assert motion.energies[:, 2].max() == 0
    assert motion.edge_forces.shape == (31, n, 2)


@pytest.mark.parametrize("place", [0.9, 0.37])
def test_energies_change_by_what_actuators_do_less_what_is_lost(place: float) -> None:
    """With a mass, a spring and a dashpot at a place, a weight at the end, drag, and a plane that is touched."""
    draw, n = np.random.default_rng(5), 5
    angles, rates, bends, bending = draw.normal(0, 0.5, (4, n))
    chain = Chain(
        *draw.uniform([[0.1], [0.5], [0.7], [0.01]], [[0.3], [1.0], [1.4], [0.02]], (4, n)),
        base=0.3, loss=0.2, weight=1 - 2j, drag=draw.uniform(0.5, 1.0, (n, 2)),
        contact=Contact(0.5j, np.exp(1.2j), 30.0, 0.1), place=place, load=(0.4, 3.0, 0.7), rest=0.2, pull=0.4 - 0.3j,
    )  # fmt: skip
    faster = chain.accelerations(angles, rates, bends)
    step = 1e-6
    after, before = (
        chain.energies(angles + h * rates + h**2 * faster / 2, rates + h * faster, bends + h * bending).sum()
        for h in (step, -step)
    )
    powers = chain.powers(angles, rates, bends, bending)
    assert (np.abs(powers) > 1e-3).all()
    assert (after - before) / (2 * step) == pytest.approx(powers[0] - powers[1:].sum(), rel=1e-7)


def test_at_rest_the_faces_carry_weight_and_moment() -> None:
    n = 8
    arm = mounted(beam(n, youngs_modulus=2e6), "hanging")
    drive = activation(arm, [0.0], np.zeros((1, n)))
    motion = simulate(arm, drive, [0.0, 1e-3])
    mass = arm.density * arm.depth * arm.thickness * arm.segment_length
    weights = mass * 9.80665 * (n - 0.5 - np.arange(n))
    np.testing.assert_allclose(motion.edge_forces[-1].sum(axis=1), weights, rtol=1e-9)
    assert (np.diff(motion.edge_forces[-1]) == pytest.approx(0.0, abs=1e-15)) is True


def test_a_motion_is_that_of_the_lattice_as_both_are_refined() -> None:
    times = np.linspace(0.0, 1.0, 21)
    apart = []
    for n in (16, 32):
        chain, lattice = beam(n), beam(n, "beam")
        drive = activation(chain, times, STRAIN * np.sin(6 * times)[:, None] * np.ones(n))  # the second mode's
        tips = [simulate(arm, drive, times, tolerance=1e-5).tip for arm in (chain, lattice)]
        apart.append(np.abs(tips[0] - tips[1]).max() / np.ptp(tips[1][:, 1]))
    assert apart[0] < 0.02
    assert apart[1] < apart[0] / 4


def test_a_start_is_kept_and_a_free_chain_keeps_its_energy() -> None:
    arm = beam(3, damping=0.0)
    drive = activation(arm, [0.0], np.zeros((1, 3)))
    bending = activation(arm, [0.0], np.full((1, 3), 5 * STRAIN))
    bent, _ = equilibrium(arm, bending)
    np.testing.assert_allclose(equilibrium(arm, bending, start=bent)[0], bent, atol=1e-12)
    motion = simulate(arm, drive, [0.0, 0.199, 0.2, 0.201, 0.5], start=(bent, 0 * bent), tolerance=1e-6)
    np.testing.assert_allclose(motion.positions[0], bent, atol=1e-15)
    energy = motion.energies.sum(axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-5)
    later = (motion.positions[2], motion.velocities[2])
    second = simulate(arm, drive, [0.0, 0.3], start=later, tolerance=1e-6, method="explicit")
    np.testing.assert_allclose(second.tip[1], motion.tip[4], atol=1e-7)
    rate = (motion.positions[3] - motion.positions[1]) / 2e-3
    np.testing.assert_allclose(motion.velocities[2], rate, atol=1e-3 * np.abs(rate).max())


@pytest.mark.parametrize("count", [1, 2, 4])
def test_what_acts_is_linear_between_its_times_and_constant_beyond(count: int) -> None:
    times, values = np.array([0.0, 1.0, 1.5, 4.0])[:count], np.random.default_rng(2).normal(size=(count, 3))
    at = _between(times, values)
    for t in (-1.0, 0.0, 0.3, 1.0, 1.2, 1.5, 3.0, 4.0, 9.0):
        assert at(t) == pytest.approx([np.interp(t, times, column) for column in values.T], abs=1e-14)


def test_refusals() -> None:
    arm = beam(3)
    with pytest.raises(InputError, match="keeps its length"):
        bends_of(arm, np.full((1, 3, 3), 0.01))
    with pytest.raises(InputError, match="1 to 3"):
        natural_frequencies(arm, 4)
    with pytest.raises(InputError, match="start"):
        equilibrium(arm, activation(arm, [0.0], np.zeros((1, 3))), start=np.zeros((2, 2, 2)))
    with pytest.raises(InputError, match="one of beam, chain, yekutieli"):
        ilg.arm("1ms", formulation="rope")


def test_a_chain_by_the_front_door() -> None:
    moved = ilg.arm(
        "50ms", segments=4, formulation="chain", activation="sine", samples=6, mounting="hanging", settled=True
    )
    assert moved.motion.arm.formulation == "chain"
    assert moved.motion.balance_error < 1e-4
    assert moved.motion.tip[0, 1] == pytest.approx(-0.03, abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "how"),
    [
        ({}, {}),
        ({"orientation": "hanging", "youngs_modulus": "2MPa"}, {"load": "mass=20mg,damping=1uN*s/m"}),
        (
            {"orientation": "horizontal", "youngs_modulus": "20MPa", "load_position": "15mm"},
            {"load": "stiffness=1mN/m"},
        ),
        ({"orientation": "horizontal", "youngs_modulus": "20MPa"}, {"tip": "clamped"}),
    ],
)
def test_a_slow_strip_with_inertia_is_at_rest_in_each_instant(changes: dict[str, str], how: dict[str, str]) -> None:
    strip = ilg.load("paper").with_(**changes)
    run = ilg.simulate(strip, "ramp:5mV/s", "400s", samples=41, engine="exact", **how)
    moving, still = ilg.shape(run, "arm"), ilg.shape(run)
    np.testing.assert_array_equal(moving.s, still.s)
    bent = max(np.abs(still.y - still.y[0]).max(), 1e-4)
    np.testing.assert_allclose(moving.y[1:], still.y[1:], atol=0.01 * bent + 2e-4 * np.abs(still.y).max())


def test_a_strip_swings_as_its_circuit_does() -> None:
    run = ilg.simulate("paper", "step:1V", "20s", samples=201, engine="exact")
    moving, still = ilg.shape(run, "arm"), ilg.shape(run)
    swing, lumped = moving.tip[:, 1] - still.tip[:, 1], run.displacement - still.tip[:, 1]
    assert np.ptp(swing) == pytest.approx(np.ptp(lumped), rel=0.1)  # the circuit has the first mode alone
    assert np.corrcoef(swing, lumped)[0, 1] > 0.98
    with pytest.raises(InputError, match="t = 0"):
        ilg.shape(ilg.simulate("paper", "step:1V", times=[1.0, 2.0], engine="exact"), "arm")


def test_a_lattice_says_how_far_it_errs_and_is_refined_by_default(monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = beam(16, "beam")
    error = 1 - 0.95701 / 0.99385
    assert lattice_error(coarse, four(coarse)) == pytest.approx(error, rel=0.02)
    assert lattice_error(beam(16), four(coarse)) == 0.0
    assert lattice_error(beam(4, "beam"), activation(beam(4), [0.0], np.zeros((1, 4)))) < 1e-9
    finer, drive, (event,) = run._fine(coarse, four(coarse), refining=True)
    assert (finer.segments, drive.values.shape) == (32, (1, 32, 3))
    assert event.finding.values["error"] < 0.01
    kept, _, (event,) = run._fine(coarse, four(coarse), refining=False)
    assert kept is coarse
    assert event.finding.values["error"] == pytest.approx(error, rel=0.02)
    monkeypatch.setattr(run, "_MOST_REFINED", 30)
    for most, segments in ((0.01, 15), (0.0, 30)):
        monkeypatch.setattr(run, "LATTICE_ERROR", most)
        motion = ilg.arm("10ms", samples=3, tolerance=1e-2).motion
        assert motion.arm.segments == segments
        assert motion.signals["voltages"].shape == (3, segments)
        assert "arm-lattice-error" in {e.finding.code for e in motion.events}
    assert ilg.arm("10ms", segments=3, samples=3, tolerance=1e-2).motion.arm.segments == 3


def test_stiffness_is_the_slope_of_what_acts_with_a_wall_a_load_and_weight() -> None:
    n = 5
    ones = np.ones(n)
    chain = Chain(
        ones / n, ones, 2 * ones, 0.05 * ones, weight=0.5 - 3j, pull=0.5 - 1j, place=0.5, load=(0.0, 3.0, 0.0),
        contact=Contact(-0.12j, 1j, 40.0, 0.0),
    )  # fmt: skip
    angles = -0.5 * np.cumsum(np.random.default_rng(3).uniform(0.0, 0.3, n))
    z = np.cumsum(chain.panels.steps(angles).sum(axis=-1))
    assert any((depth > 0).any() for _, depth, _, _ in chain.touching(angles, 0 * angles, z, 0 * z))

    def acting_on(at: np.ndarray) -> np.ndarray:
        return np.asarray(chain.slopes(at)[0] @ chain.accelerations(at, 0 * at, 1.5 * ones))

    h = 1e-6
    slopes = np.column_stack([(acting_on(angles + h * e) - acting_on(angles - h * e)) / (2 * h) for e in np.eye(n)])
    stiffness = chain.slopes(angles)[1]
    np.testing.assert_allclose(slopes, -stiffness, atol=1e-8 * np.abs(stiffness).max())
