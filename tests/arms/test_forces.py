"""Kernels: forces against energies, Jacobians against differences, pressures against the constraint they hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.arms import OCTOPUS, Arm, Fluid, Plane, strip_arm
from ilg_circuit.arms.banded import PER_ROD, WIDTH, assemble, factorise, matrix, solve, vector
from ilg_circuit.arms.energy import crosses_itself, energies, powers
from ilg_circuit.arms.forces import acceleration, add_pressures, area_gradient, forces
from ilg_circuit.arms.jacobian import derivatives, multiply
from ilg_circuit.arms.lattice import Model, cell_areas, model

Array = NDArray[np.float64]

#: One that the first rods of a curved arm are in, and the others are not.
PLANE = Plane((0.0, 3e-3), (0.1, 1.0), stiffness=50.0, damping=3.0)
ARMS = {
    "beam": strip_arm(segments=4),
    "one segment": strip_arm(segments=1),
    "curved in water": replace(strip_arm(segments=5), fluid=Fluid(), tip_depth=2e-3, curvature=20.0, plane=PLANE),
    "yekutieli": replace(OCTOPUS, segments=4),
}


def state(arm: Arm) -> tuple[Model, Array, Array, Array, Array]:
    """Some disturbed state: model, positions, velocities, activations, pressures."""
    random = np.random.default_rng(3)
    q = arm.rest_positions().reshape(-1, 4)
    q = q + 0.05 * min(arm.thickness, arm.segment_length) * random.standard_normal(q.shape)
    v = 0.01 * random.standard_normal(q.shape)
    q[0], v[0] = arm.rest_positions()[0].ravel(), 0.0
    return model(arm), q, v, random.uniform(0, 0.1, (arm.segments, 3)), random.standard_normal(arm.segments)


@pytest.mark.parametrize("name", ARMS)
def test_forces_do_the_work_that_energies_and_losses_say(name: str) -> None:
    """f . v = -d(stored - kinetic)/dt + actuators' power - losses, at any state."""
    m, q, v, a, _ = state(ARMS[name])
    rate = np.random.default_rng(4).uniform(-1, 1, a.shape)
    f, power = np.zeros_like(q), np.zeros(4)
    forces(m, q, v, a, f)
    powers(m, q, v, a, rate, power)
    step, stored = 1e-6, []
    for sign in (1, -1):
        out = np.zeros(4)
        energies(m, q + sign * step * v, v, a + sign * step * rate, out)
        stored.append(out[1:].sum())
    change = (stored[0] - stored[1]) / (2 * step)
    largest = max(abs(change), np.abs(power).max())
    assert (f * v).sum() == pytest.approx(-change + power[0] - power[1:].sum(), abs=1e-7 * largest)


def test_a_plane_pushes_and_never_pulls() -> None:
    """k d (1 - chi v) inside, nothing outside, and nothing on a node that leaves faster than 1/chi."""
    arm = replace(strip_arm(segments=1), plane=Plane((0.0, 0.0), (0.0, 1.0), stiffness=50.0, damping=3.0))
    with_plane, without = model(arm), model(replace(arm, plane=None))
    q = arm.rest_positions().reshape(-1, 4)
    for height, speed, expected in (
        (-1e-4, 0.0, 50e-4), (-1e-4, 0.1, 35e-4), (-1e-4, -0.1, 65e-4), (-1e-4, 0.5, 0.0), (-1e-4, 1 / 3, 0.0),
        (1e-4, 0.0, 0.0), (1e-4, -1.0, 0.0), (0.0, -1.0, 0.0),
    ):  # fmt: skip
        place, v = q.copy(), np.zeros_like(q)
        place[1, 3], v[1, 3] = height, speed
        place[0, [1, 3]] = place[1, 1] = 1.0  # far from the plane
        found = []
        for m in (with_plane, without):
            f = np.zeros_like(q)
            forces(m, place, v, np.zeros((1, 3)), f)
            found.append(f)
        push = found[0] - found[1]
        assert push[1, 3] == pytest.approx(expected, abs=1e-12 * np.abs(found[1]).max()), (height, speed)
        push[1, 3] = 0.0
        assert not push.any()


@pytest.mark.parametrize("name", [*ARMS, "drag alone"])
def test_derivatives_are_those_of_the_forces(name: str) -> None:
    arm = ARMS.get(name, replace(ARMS["curved in water"], plane=None))
    m, q, v, a, p = state(arm)
    if name not in ARMS:  # without what is so much stiffer that it hides drag
        m, p = m._replace(spring=m.spring[:0], shear_stiffness=m.shear_stiffness[:0]), 0 * p
    count = len(q)
    S, D = np.zeros((count, 5, 4, 4)), np.zeros((count, 5, 4, 4))
    derivatives(m, q, v, a, p, S, D)

    def total(x: Array, w: Array) -> Array:
        f = np.zeros_like(x)
        forces(m, x, w, a, f)
        add_pressures(x, p, f)
        return f

    direction = np.random.default_rng(5).standard_normal(q.shape)
    for blocks, step, by_velocity in ((S, 1e-6 * arm.thickness, False), (D, 1e-6, True)):
        move = step * direction
        if by_velocity:
            difference = (total(q, v + move) - total(q, v - move)) / (2 * step)
        else:
            difference = (total(q + move, v) - total(q - move, v)) / (2 * step)
        product = np.zeros_like(q)
        multiply(blocks, direction, product)
        assert product == pytest.approx(difference, abs=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("name", ARMS)
def test_pressures_keep_the_areas(name: str) -> None:
    """The second derivative of each area is what the stabilisation asks for: -2 beta A' - beta^2 (A - A0)."""
    m, q, v, a, p = state(ARMS[name])
    acc, work = np.zeros_like(q), np.zeros((len(p), 6))
    acceleration(m, q, v, a, p, acc, work)
    assert np.abs(acc[0]).max() == 0
    step = 1e-7  # the areas are quadratic in positions that move by acc t^2/2, and acc is large
    areas = [cell_areas((q + t * v + t * t / 2 * acc).reshape(-1, 2, 2)) for t in (-step, 0, step)]
    second = (areas[0] - 2 * areas[1] + areas[2]) / step**2
    wanted = -2 * m.beta * (areas[2] - areas[0]) / (2 * step) - m.beta**2 * (areas[1] - m.area)
    assert second == pytest.approx(wanted, abs=1e-4 * np.abs(wanted).max())


def test_banded_equations() -> None:
    m, q, v, a, p = state(ARMS["curved in water"])
    n = len(p)
    S, D, A, x = np.zeros((n + 1, 5, 4, 4)), np.zeros((n + 1, 5, 4, 4)), matrix(n), vector(n)
    derivatives(m, q, v, a, p, S, D)
    assemble(m, q, np.array([area_gradient(q, i) for i in range(n)]), S, D, 1.0, 1e-4, 1e-8, A)
    size = PER_ROD * n
    dense = np.zeros((size, size + 2 * WIDTH))
    for i in range(size):
        dense[i, i : i + 2 * WIDTH + 1] = A[i]
    exact = np.random.default_rng(6).standard_normal(size)
    x[WIDTH : WIDTH + size] = dense[:, WIDTH : WIDTH + size] @ exact
    assert factorise(A)
    solve(A, x)
    assert x[WIDTH : WIDTH + size] == pytest.approx(exact, abs=1e-9)
    assert not factorise(matrix(n))


def test_an_outline_that_crosses_itself_is_seen() -> None:
    arm = replace(strip_arm(segments=20), curvature=150.0)
    loop = replace(arm, curvature=230.0)
    assert crosses_itself(np.ascontiguousarray(arm.rest_positions().reshape(-1, 4))) == 0
    assert crosses_itself(np.ascontiguousarray(loop.rest_positions().reshape(-1, 4))) > 0
