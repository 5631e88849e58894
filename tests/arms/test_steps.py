"""A step of either method: order conditions of the coefficients, control of the error, and what one step gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.arms import Fluid, strip_arm
from ilg_circuit.arms import explicit as runge_kutta
from ilg_circuit.arms import implicit as rosenbrock
from ilg_circuit.arms.energy import energies
from ilg_circuit.arms.explicit import Integration, accept, change_step, explicit, largest_error
from ilg_circuit.arms.implicit import implicit
from ilg_circuit.arms.lattice import model

Array = NDArray[np.float64]
Kernel = Callable[..., None]

ARM = replace(strip_arm(segments=3), fluid=Fluid(), damping=1e-3, gravity=(3.0, -9.0), curvature=20.0)
SMALL = model(ARM)


def integration(state: tuple[Array, Array], stops: list[float], slope: float, tolerance: float) -> Integration:
    """Return a run from a state on, with strains from 0.01 that grow at a rate; its first step is to the first stop."""
    count, n = len(stops), ARM.segments
    ends = np.array([0.01, 0.01 + slope])[:, None, None] * np.linspace(1, 2, 3 * n).reshape(n, 3)
    return Integration(
        np.array(stops), np.arange(count), np.array([0.0, 1.0]), ends,
        np.repeat(np.stack(state)[None], 3, axis=0), np.array([0.0, stops[1], 0.0, 0.0, 0.0, 0.0, np.inf, 0.0]),
        np.zeros(5, dtype=np.int64), np.empty((count, 2, n + 1, 4)), np.empty((count, n)), np.empty((count, 4)),
        (tolerance, 1e3 * tolerance),
    )  # fmt: skip


def at_rest() -> tuple[Array, Array]:
    q = ARM.rest_positions().reshape(-1, 4)
    return q, np.zeros_like(q)


@pytest.fixture(scope="module")
def moving() -> tuple[Array, Array]:
    """A state in motion that keeps its areas."""
    run = integration(at_rest(), [0.0, 2e-3], 0.0, 1e-9)
    run.clock[1] = 1e-5
    explicit(SMALL, run)
    assert run.counts[4] == runge_kutta.DONE
    return run.samples[-1, 0].copy(), run.samples[-1, 1].copy()


# -- coefficients ------------------------------------------------------------------------------------------------------


def test_the_explicit_method_is_of_order_five_and_its_error_of_order_four() -> None:
    """Butcher's conditions; a stage's row sums to its time, and what is linear in A is so by each tree."""
    A = np.vstack([np.zeros(7), np.pad(runge_kutta._A, ((0, 0), (0, 1)))])
    c = np.append(0.0, runge_kutta._C)
    np.testing.assert_allclose(A.sum(axis=1), c, atol=1e-14)
    b = A[-1]
    fourth = {
        1: c**0, 1 / 2: c, 1 / 3: c**2, 1 / 6: A @ c, 1 / 4: c**3, 1 / 8: c * (A @ c), 1 / 12: A @ c**2,
        1 / 24: A @ (A @ c),
    }  # fmt: skip
    fifth = [
        (c**4, 1 / 5), (c**2 * (A @ c), 1 / 10), (c * (A @ c**2), 1 / 15), (c * (A @ A @ c), 1 / 30),
        ((A @ c) ** 2, 1 / 20), (A @ c**3, 1 / 20), (A @ (c * (A @ c)), 1 / 40), (A @ A @ c**2, 1 / 60),
        (A @ A @ A @ c, 1 / 120),
    ]  # fmt: skip
    for value, tree in fourth.items():
        assert b @ tree == pytest.approx(value, abs=1e-14)
        assert runge_kutta._ERROR @ tree == pytest.approx(0.0, abs=1e-14)
    for tree, value in fifth:
        assert b @ tree == pytest.approx(value, abs=1e-14)
    assert abs(runge_kutta._ERROR @ c**4) > 1e-4


def test_the_implicit_method_is_of_order_four_and_its_error_of_order_three() -> None:
    """Hairer, Wanner, section IV.7: trees by A where branches meet, else by B, the sum of A and the Jacobian's part."""
    part = np.linalg.inv(np.eye(6) / rosenbrock._GAMMA - np.pad(rosenbrock._C, ((0, 0), (0, 1))))
    A = np.pad(rosenbrock._A, ((0, 0), (0, 1))) @ part
    B = A + part
    times, slopes = A.sum(axis=1), part.sum(axis=1)
    np.testing.assert_allclose(times, rosenbrock._TIMES, atol=1e-13)
    np.testing.assert_allclose(slopes, rosenbrock._SLOPES, atol=1e-13)
    whole = np.append(rosenbrock._A[-1], 1.0) @ part
    embedded = np.append(rosenbrock._A[-1], 0.0) @ part
    middle = (np.append(rosenbrock._A[-1], 1.0) / 2 + np.append(rosenbrock._INSIDE, 0.0)) @ part
    b, one = B.sum(axis=1), np.ones(6)
    third = [(one, 1, 1), (b, 1 / 2, 2), (times**2, 1 / 3, 3), (B @ b, 1 / 6, 3)]
    fourth = [(times**3, 1 / 4), (times * (A @ b), 1 / 8), (B @ times**2, 1 / 12), (B @ B @ b, 1 / 24)]
    for tree, value, order in third:
        assert whole @ tree == pytest.approx(value, abs=1e-13)
        assert embedded @ tree == pytest.approx(value, abs=1e-13)
        assert middle @ tree == pytest.approx(value / 2**order, abs=1e-13)
    for tree, value in fourth:
        assert whole @ tree == pytest.approx(value, abs=1e-13)


# -- control of the error ----------------------------------------------------------------------------------------------


def test_the_largest_error_is_found_in_whichever_rod_and_direction() -> None:
    run = integration(at_rest(), [0.0, 1.0], 0.0, 1e-6)
    for j in range(1, 9):
        error_q, error_v = np.full((9, 4), 1e-7), np.full((9, 4), 1e-4)
        error_q[j, j % 4] = -5e-6
        assert largest_error(run, error_q, error_v) == pytest.approx(5.0)
        assert run.counts[3] == j
        error_v[j, j % 4] = 7e-3
        assert largest_error(run, error_q, error_v) == pytest.approx(7.0)
        error_v[j, j % 4] = np.nan
        assert largest_error(run, error_q, error_v) == math.inf


@pytest.mark.parametrize(
    ("step", "error", "accepted", "following"),
    [
        (1.0, 1.0, True, 0.9),  # errors go with the fifth power: at the bound, nine tenths of the step
        (1.0, 2.0**-5, True, 1.8),
        (1.0, 1e-30, True, 3.0),
        (1.0, 2.0**5, False, 0.45),
        (1.0, math.inf, False, 0.2),
        (0.3, 2.0**-5, True, 1.0),  # a step that a stop cut short
        (0.7, 2.0**-5, True, 1.26),
        (0.3, 1.0, True, 0.27),
    ],
)
def test_the_next_step_is_what_the_error_allows(step: float, error: float, accepted: bool, following: float) -> None:
    run = integration(at_rest(), [0.0, 1.0], 0.0, 1e-6)
    assert change_step(run, step, error, 5.0) is accepted
    assert run.clock[1] == pytest.approx(following)
    assert run.counts[2] == (not accepted)
    assert run.counts[4] == runge_kutta.RUNNING


@pytest.mark.parametrize(("error", "why"), [(2.0, "TOO_SMALL"), (math.inf, "NOT_FINITE")])
def test_a_run_ends_where_no_step_is_small_enough(error: float, why: str) -> None:
    run = integration(at_rest(), [0.0, 1.0], 0.0, 1e-6)
    assert not change_step(run, 1e-14, error, 5.0)
    assert run.counts[4] == getattr(runge_kutta, why)


# -- one step ----------------------------------------------------------------------------------------------------------


def test_actuators_of_an_arm_that_stands_still_do_what_its_energy_gains() -> None:
    """Simpson's rule is exact for strains that are a parabola in time: the energy is one in the strains."""
    run = integration(at_rest(), [0.0, 0.5], 0.0, 1e-6)
    strains = np.random.default_rng(7).uniform(0.0, 0.02, (3, ARM.segments, 3))
    stored = np.zeros((2, 4))
    for k in (0, 1):
        energies(SMALL, run.states[0, 0], run.states[0, 1], strains[2 * k], stored[k])
    change = stored[1].sum() - stored[0].sum()
    accept(SMALL, run, 0.5, True, strains, np.zeros(ARM.segments))
    assert run.works[1, 0] == pytest.approx(change, rel=1e-9)
    assert (strains[0] == strains[2]).all()
    assert run.clock[[0, 6, 7]] == pytest.approx([0.5, 0.5, 0.5])
    assert run.counts.tolist() == [1, 1, 0, 0, runge_kutta.DONE]


def one(kernel: Kernel, state: tuple[Array, Array], step: float) -> Integration:
    """Return a run of one step of a method, whatever its error."""
    run = integration(state, [0.0, step], 2.0, 1e9)
    kernel(SMALL, run)
    assert run.counts.tolist()[:3] == [1, 1, 0]
    return run


@pytest.mark.parametrize(
    ("kernel", "longest", "powers"), [(explicit, 1.6e-4, (6, 5, 5)), (implicit, 8e-5, (3.5, 3.5, 4))]
)
def test_errors_of_a_step_go_with_a_power_of_it(
    kernel: Kernel, longest: float, powers: tuple[float, float, float], moving: tuple[Array, Array]
) -> None:
    """Errors of the velocities at its end, and in its middle, and of the balance of energies, as the step is halved.

    That is about the order and one, but for the implicit method, whose stages keep the areas only to a lower order.
    """
    found = []
    for step in (longest, longest / 2):
        run = one(kernel, moving, step)
        exact = integration(moving, [0.0, step / 2, step], 2.0, 1e-13)
        exact.clock[1] = step / 20
        explicit(SMALL, exact)
        stored = np.zeros((2, 4))
        for k in (0, 1):
            strains = run.values[0] + run.stops[k] * (run.values[1] - run.values[0])
            energies(SMALL, run.samples[k, 0], run.samples[k, 1], strains, stored[k])
        balance = stored[1].sum() - stored[0].sum() - run.works[1, 0] + run.works[1, 1:].sum()
        apart = [np.abs(run.samples[1, 1] - exact.samples[2, 1]), np.abs(run.states[1, 1] - exact.samples[1, 1])]
        found.append([apart[0].max(), apart[1].max(), abs(balance)])
    assert (np.log2(np.array(found[0]) / np.array(found[1])) > powers).all()
