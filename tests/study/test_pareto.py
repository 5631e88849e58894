"""Fronts against the closed trade-off of displacement and force, a brute-force grid, and the definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_design import D0, SIZES, E, problem

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.study.design import DesignReport
from ilg_circuit.study.pareto import Front, neighbours, nondominated, pareto_front, parse_objectives

pytestmark = pytest.mark.usefixtures("brisk")


def front(
    text: str, varied: tuple[str, ...], requirements: list[str] | None = None, points: int | None = None
) -> Front:
    names = tuple(v.partition("=")[0] for v in varied)
    objectives = parse_objectives(text, names)
    asked = problem(requirements or [], varied, f"min {objectives[0].quantity.name}")
    return pareto_front(asked, objectives, points=points)


def test_displacement_against_force_is_the_closed_form() -> None:
    found = front("displacement_final,force_blocked", (*SIZES, "voltage=1V:4V", "width=2mm:10mm"), points=15)
    y, force = found.simulated["displacement_final"], found.simulated["force_blocked"]
    assert y * force**2 == pytest.approx(np.full(len(y), (12 * D0) ** 3 * (E * 10e-3 / 4) ** 2), rel=1e-5)
    # from end to end, and no gap much longer than the others
    assert y.max() == pytest.approx(12 * D0 * (40 / 0.2) ** 2, rel=1e-5)
    assert y.min() == pytest.approx(12 * D0 * (15 / 1) ** 2, rel=1e-5)
    assert len(found) == 15
    gaps = np.diff(np.sort(np.log(y)))
    assert gaps.max() < 2.5 * gaps.mean()
    assert found.improvable < 1e-6
    assert found.parameters["voltage"] == pytest.approx(np.full(15, 4.0))
    assert found.parameters["width"] == pytest.approx(np.full(15, 10e-3))
    # the small-deflection beam does not hold for all of it, and that is said
    assert found.deflections == pytest.approx(y / found.parameters["free_length"], rel=0.15)  # peak over final
    bent = int((found.deflections > 0.2).sum())
    assert 0 < bent < 15
    assert any(f"{bent} designs have a relative_deflection beyond 0.2" in w for w in DesignReport(front=found).warnings)


def test_three_objectives_against_a_grid() -> None:
    """No design of a fine grid betters a point in all of displacement, force and energy."""
    varied = (*SIZES, "voltage=1V:4V")
    found = front("displacement_final,force_blocked,energy", varied, ["displacement_final>=1mm"], points=20)
    assert len(found) == 20
    asked = problem([], varied, "min energy")
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 3), axis=-1).reshape(-1, 3)
    wanted = [o.quantity for o in found.objectives]
    costs = np.log(asked.space.evaluate(grid, wanted)) * [-1, -1, 1]
    costs = costs[costs[:, 0] <= -np.log(1e-3)]
    ours = np.log(np.stack([found.values[q.name] for q in wanted], axis=1)) * [-1, -1, 1]
    extent = np.ptp(ours, axis=0)
    assert (extent > 0.5).all()
    better = ((ours[:, None] - costs[None]) / extent).min(axis=2)
    assert better.max() < 1e-3
    assert len(nondominated(ours)) == len(ours)
    # and no point of the grid's own front is far from ours
    mine = costs[nondominated(costs)]
    distance = np.abs((mine[:, None] - ours[None]) / extent).max(axis=2).min(axis=1)
    assert distance.max() < 0.35


def test_a_front_within_requirements() -> None:
    found = front("displacement_final,energy", (*SIZES, "voltage=1V:4V"), ["force_blocked>=0.1uN"], points=8)
    assert (found.simulated["force_blocked"] >= 1e-7).all()
    with pytest.raises(SolveError, match="no design"):
        front("displacement_final,energy", SIZES, ["force_blocked>=1N"], points=4)


@given(st.lists(st.tuples(*[st.integers(0, 5)] * 3), min_size=1, max_size=30))
def test_nondominated_is_its_definition(rows: list[tuple[int, ...]]) -> None:
    costs = np.array(rows, dtype=float)
    kept = set(nondominated(costs).tolist())
    for k, row in enumerate(costs):
        dominated = any((o <= row).all() and (o < row).any() for o in costs)
        first = not any((o == row).all() for o in costs[:k])
        assert (k in kept) == (not dominated and first)


def test_neighbours_of_a_curve_are_consecutive() -> None:
    x = np.array([0.0, 0.1, 0.4, 1.0])
    assert neighbours(np.stack([x, (1 - x) ** 2], axis=1)) == [(0, 1), (1, 2), (2, 3)] or neighbours(
        np.stack([x, 1 - x], axis=1)
    ) == [(2, 3), (1, 2), (0, 1)]


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("energy", "two or three"),
        ("energy,energy", "two or three"),
        ("up:energy,force_blocked", "min:energy or max:energy"),
        ("energy,speed", "unknown quantity"),
    ],
)
def test_what_is_no_front(text: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        parse_objectives(text, ())


def test_senses() -> None:
    chosen = parse_objectives("displacement_final,min:force_blocked,voltage", ("voltage",))
    assert [o.sense for o in chosen] == [-1, 1, 1]
