"""The search for a rhythm that brings the tip to a place, and what it says of places that cannot be reached."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ilg_circuit.arms import reach as reaching
from ilg_circuit.arms import simulate, strip_arm
from ilg_circuit.arms.coupling import couple
from ilg_circuit.arms.reach import BOUNDS, Reached, _hypercube, _passing, reach_target
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.oscillators.network import unit
from ilg_circuit.report.arm import reach_figure, reach_text
from ilg_circuit.report.axes import save
from ilg_circuit.strip.actuator import PAPER

ARM = strip_arm(segments=4)
DURATION = 3.0


@pytest.fixture(scope="module")
def beyond() -> Reached:
    """A target within the arm's length that no rhythm reaches."""
    return reach_target(ARM, (20e-3, 8e-3), DURATION, sample=12)


def test_a_place_that_was_visited_is_found_again() -> None:
    values = {"tonic": 0.7, "inhibition": 2.2, "slower": 1.7}
    coupled = couple(unit(2.2, tonic=0.7), 4, DURATION, slower=1.7, reference=0.462008)
    motion = simulate(ARM, coupled.activation(ARM), np.linspace(0, DURATION, 301))
    target = motion.tip[np.abs(motion.tip[:, 1]).argmax()]
    found = reach_target(ARM, target, DURATION, sample=24)
    assert found.reached
    assert found.distance < 0.3 * found.tolerance
    assert found.tolerance == pytest.approx(0.3e-3)
    assert np.hypot(*(found.nearest - target)) == pytest.approx(found.distance)
    for name, (low, high) in found.bounds.items():
        assert low <= found.parameters[name] <= high
        assert low <= values[name] <= high
    # the motion is where it is said to be, and the parameters give that motion
    at = [np.interp(found.time, found.motion.time, axis) for axis in found.motion.tip.T]
    assert at == pytest.approx(found.nearest, abs=1e-6)
    again = couple(
        unit(found.parameters["inhibition"], tonic=found.parameters["tonic"]),
        4,
        DURATION,
        slower=found.parameters["slower"],
        reference=0.4620084335439562,
    )
    strains = np.clip(again.outputs / 0.4620084335439562, -1, 1) * again.largest_strain
    assert found.coupled.strains == pytest.approx(strains, abs=1e-12)
    assert "this position is reached, but the paper's claim" in reach_text(found)
    assert f"{found.motion.tip.shape}" == "(601, 2)"


def test_a_place_out_of_reach_is_a_result(beyond: Reached) -> None:
    assert not beyond.reached
    away = np.hypot(*(beyond.motion.tip - [20e-3, 8e-3]).T).min()
    assert beyond.distance == pytest.approx(away, abs=1e-5)
    assert 9e-3 < beyond.distance < 12e-3
    text = reach_text(beyond)
    assert "NOT reached within 300 um" in text
    assert "'can reach any specified position', does not hold here" in text
    assert "one unit drives all segments alike" in text
    assert "0.00221 turns the tip by 15.2 degrees" in text
    assert "the target is" not in text
    # the bounded voltage: at rest the tip would move by 3.97 mm; inertia carries it somewhat further
    assert 2e-3 < np.abs(beyond.visited[:, 1]).max() < 8e-3
    assert beyond.visited.shape[1] == 2
    assert beyond.sample.shape == (12, 3)
    assert 1e-5 < beyond.share < 0.01


def test_the_search_is_repeatable(beyond: Reached) -> None:
    again = reach_target(ARM, (20e-3, 8e-3), DURATION, sample=12)
    assert again.parameters == beyond.parameters
    assert np.array_equal(again.visited, beyond.visited)
    other = reach_target(ARM, (20e-3, 8e-3), DURATION, sample=12, seed=1)
    assert not np.array_equal(other.sample, beyond.sample)


def test_the_local_search_improves_on_the_sample(beyond: Reached) -> None:
    best = np.hypot(*(beyond.visited - beyond.target).T).min()
    assert beyond.distance < best


def test_beyond_the_length_of_the_arm_through_the_circuit() -> None:
    found = reach_target(ARM, (0.0, 40e-3), DURATION, mode="circuit", sample=4, times=np.linspace(0, DURATION, 31))
    text = reach_text(found)
    assert "the target is 40 mm from the base, the arm 30 mm long" in text
    assert f"the strips' circuits keep {found.coupled.scales[0].kept:.2%} of the ideal amplitude" in text
    # 3 s through these circuits hardly move the arm at all
    assert np.abs(found.visited[:, 1]).max() < 0.1e-3
    assert len(found.motion.time) == 31
    assert set(found.motion.signals) == {"outputs", "voltages", "charges"}


def test_the_search_computes_what_the_full_motion_does() -> None:
    """Coarse sampling and steps, and a strip a unit instead of one a segment, change little."""
    for mode in ("ideal", "circuit", "charge"):
        search = reaching._Search(ARM, "chain", mode, PAPER, 4.0, DURATION, None)
        point = np.array([0.9, 0.5, 0.6, 0.4])
        _, motion = search.in_full(search.parameters(point), np.linspace(0, DURATION, 301))
        tips = search.tips(point)
        moved = np.abs(motion.tip[:, 1]).max()
        assert tips[-1] == pytest.approx(motion.tip[-1], abs=0.01 * moved)
        assert np.abs(tips[:, 1]).max() == pytest.approx(moved, rel=0.01)


def test_parameters_and_bounds_by_rhythm() -> None:
    for rhythm, names in (("chain", set(BOUNDS)), ("ring", {"tonic", "inhibition", "slower"})):
        search = reaching._Search(ARM, rhythm, "ideal", PAPER, 4.0, 20.0, None)
        assert set(search.bounds) == names
        assert search.bounds["slower"][1] == pytest.approx(20.0 / search.period)
        ends = [search.parameters(np.full(len(names), end)) for end in (0.0, 1.0)]
        for name, (low, high) in search.bounds.items():
            assert (ends[0][name], ends[1][name]) == pytest.approx((low, high))
    one_way = reaching._Search(ARM, "one-way-ring", "ideal", PAPER, 4.0, 20.0, None)
    assert one_way.bounds["inhibition"][0] > 2.1664  # below, a one-way ring does not oscillate
    assert reaching._Search(ARM, "unit", "ideal", PAPER, 4.0, 20.0, None).reference == pytest.approx(0.462008, abs=1e-6)


def test_a_latin_hypercube() -> None:
    points = _hypercube(np.random.default_rng(0), 10, 3)
    assert [sorted(column) for column in np.floor(10 * points).T.astype(int).tolist()] == [list(range(10))] * 3


def test_how_near_a_path_passes() -> None:
    path = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.0, 2.0]])
    assert _passing(path, np.array([0.5, 1.0])) == pytest.approx((1.0, 0, 0.25))
    assert _passing(path, np.array([3.0, 1.0])) == pytest.approx((1.0, 1, 0.5))
    assert _passing(path, np.array([2.0, 5.0]))[0] == pytest.approx(3.0)
    assert _passing(path[:1], np.array([3.0, 4.0])) == (5.0, 0, 0.0)


def test_the_share_of_places(beyond: Reached) -> None:
    within = 0.1 * ARM.length
    alone = replace(beyond, tolerance=within, visited=np.array([[0.0, 0.0]]))
    assert alone.share == pytest.approx(0.01, rel=0.02)
    edge = replace(alone, visited=np.array([[ARM.length, 0.0]]))  # a little less than half of it is in the disc
    assert 0.0045 < edge.share < 0.005
    line = np.linspace(-1, 1, 41) * ARM.length
    everywhere = replace(alone, visited=np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2))
    assert everywhere.share == pytest.approx(1.0, abs=0.005)
    assert (
        reach_text(everywhere).splitlines()[-1] == "the paper's claim, 'can reach any specified position', holds here"
    )


def test_motions_that_fail_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    original, calls = reaching.simulate, []

    def failing(*arguments: Any, **options: Any) -> Any:
        calls.append(1)
        if len(calls) % 2:
            raise SolveError("no step is small enough")
        return original(*arguments, **options)

    monkeypatch.setattr(reaching, "simulate", failing)
    monkeypatch.setattr(reaching, "_STARTS", 0)
    found = reach_target(ARM, (29e-3, 1e-3), 1.0, sample=7)  # the eighth, the motion in full, succeeds
    assert found.failed == 4
    assert "4 motions of the search could not be computed" in reach_text(found)
    monkeypatch.setattr(reaching, "simulate", lambda *_, **__: (_ for _ in ()).throw(SolveError("never")))
    with pytest.raises(SolveError, match="none of 3 motions could be computed"):
        reach_target(ARM, (29e-3, 1e-3), 1.0, sample=3)


@pytest.mark.parametrize("target", [(29.9e-3, 1e-3), (0.0, 40e-3)], ids=["inside", "beyond"])
def test_a_picture(beyond: Reached, tmp_path: Path, target: tuple[float, float]) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save(reach_figure(replace(beyond, target=np.array(target))), tmp_path / "reach.svg")
    text = (tmp_path / "reach.svg").read_text(encoding="utf-8")
    for label in ("visited by 12 motions", "x [mm]", "y [mm]", "not reached", "path, best motion", "arm at that time"):
        assert label in text


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        ({"target": (float("nan"), 0.0)}, "give two finite numbers"),
        ({"target": (1.0,)}, "give two finite numbers"),
        ({"target": "here"}, "give two finite numbers"),
        ({"duration": float("nan")}, "duration nan s must be more than zero"),
        ({"tolerance": 0.0}, "tolerance 0 m must be more than zero"),
        ({"seed": -1}, "seed -1 must be zero or more"),
        ({"sample": 1}, "a sample of 1 motions is too small"),
        ({"rhythm_of": "waltz"}, "choose one of unit, ring, one-way-ring, chain"),
        ({"mode": "magic"}, "choose one of ideal, circuit, charge"),
        ({"voltage": -4.0}, "voltage -4 V must be more than zero"),
        ({"actuator": replace(PAPER, coupling=None)}, r"has no \[coupling\]"),
    ],
)
def test_refusals(options: dict[str, Any], hint: str) -> None:
    given: dict[str, Any] = {"arm": ARM, "target": (0.02, 0.01), "duration": 1.0} | options
    with pytest.raises(InputError, match=hint) as caught:
        reach_target(**given)
    assert len(str(caught.value).splitlines()) == 1
