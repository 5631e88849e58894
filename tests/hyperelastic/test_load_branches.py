"""Loading, unloading and reloading are told apart by the order of the rows, and only one of them is fitted."""

from __future__ import annotations

import numpy as np
import pytest
from gels import TWO, cycles, readings
from hypothesis import given, settings
from hypothesis import strategies as st

from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.hyperelastic import LoadTest, characterise
from ilg_circuit.measurements.branches import KINDS, area_shares, find_legs


def kinds(stretch: np.ndarray) -> list[tuple[str, int]] | None:
    """Kind and number of rows of each branch of these stretches."""
    legs = find_legs(stretch, stretch - 1)
    return None if legs is None else [(leg.kind, len(leg.stretch)) for leg in legs]


UP = np.linspace(1.0, 2.0, 21)
DOWN = UP[::-1][1:]


@settings(max_examples=30)
@given(
    peak=st.one_of(st.floats(1.05, 6.0), st.floats(0.3, 0.95)),
    rows=st.integers(12, 120),
    noise=st.floats(0.0, 0.004),
    seed=st.integers(0, 2**16),
)
def test_every_row_of_noisy_cycles_is_of_its_branch(peak: float, rows: int, noise: float, seed: int) -> None:
    """Three ways of ``rows`` steps; only rows within the noise of a turn may be told wrong."""
    way = np.linspace(1.0, peak, rows + 1)
    true = np.concatenate([way, way[::-1][1:], way[1:]])
    scatter = noise * abs(peak - 1) * np.random.default_rng(seed).standard_normal(len(true))
    found = kinds(true + scatter)
    assert found is not None
    assert [kind for kind, _ in found] == ["loading", "unloading", "reloading"]
    slack = 1 + int(np.ceil(10 * noise * rows))
    ends = np.cumsum([count for _, count in found])[:2]
    assert np.abs(ends - [rows + 1, 2 * rows + 1]).max() <= slack


def test_what_goes_farther_than_ever_before_is_loading() -> None:
    longer = np.linspace(1.0, 3.0, 41)
    found = kinds(np.concatenate([UP, DOWN, longer[1:]]))
    assert found == [("loading", 21), ("unloading", 20), ("reloading", 20), ("loading", 20)]


@pytest.mark.parametrize(
    "stretch",
    [UP, UP[::-1], np.linspace(0.9, 0.995, 31), np.linspace(0.7, 1.6, 25)],
    ids=["tension", "falling", "compression by stretch", "through 1"],
)
def test_one_way_is_one_branch_and_all_of_it_is_fitted(stretch: np.ndarray) -> None:
    test = LoadTest("uniaxial", stretch, TWO.nominal("uniaxial", stretch))
    assert len(test.legs) == 1
    assert len(test.taking("loading").stretch) == len(test.stretch)
    assert "branches" not in codes(characterise([test], model="neo-hookean").findings)


def test_both_sides_of_1_have_branches_of_their_own() -> None:
    cycle = 1 + 0.3 * np.sin(np.linspace(0, 4 * np.pi, 161))
    found = kinds(cycle)
    assert found is not None
    loading, unloading, reloading = "loading", "unloading", "reloading"
    assert [kind for kind, _ in found] == [*2 * (loading, unloading), *2 * (reloading, unloading)]
    # a table of compression, then of tension, has no unloading
    assert kinds(np.concatenate([np.linspace(0.99, 0.5, 20), UP[1:]])) == [("loading", 20), ("loading", 20)]
    assert kinds(np.concatenate([UP[1:], np.linspace(0.5, 0.99, 20)])) == [("loading", 20), ("loading", 20)]


def test_specimens_one_after_another_are_all_loading() -> None:
    test = LoadTest("uniaxial", np.tile(UP[1:], 3), np.tile(TWO.nominal("uniaxial", UP[1:]), 3))
    result = characterise([test], terms=1)
    assert result.fit.samples == 60
    told = next(f for f in result.findings if f.code == "loading-repeated")
    assert told.values["times"] == 3


@pytest.mark.parametrize("seed", range(4))
def test_rows_in_no_order_are_sorted_and_it_is_said(seed: int) -> None:
    test = cycles(2.0, 2.0)
    order = np.random.default_rng(seed).permutation(len(test.stretch))
    mixed = LoadTest("uniaxial", test.stretch[order], test.stress[order])
    assert not mixed.ordered
    assert (np.diff(mixed.stretch) >= 0).all()
    result = characterise([mixed], model="neo-hookean")
    assert "rows-unordered" in codes(result.findings)
    assert result.fit.samples == len(order)


@pytest.mark.parametrize("peaks", [(2.0,), (2.0, 2.0), (2.0, 2.0, 2.0), (0.6, 0.6)], ids=str)
def test_the_first_loading_is_fitted_and_told(peaks: tuple[float, ...]) -> None:
    result = characterise([cycles(*peaks)], terms=2)
    assert result.fit.samples == 29
    # the material that it was before it was ever stretched is TWO; by all rows it would be softer
    assert result.material.youngs_modulus == pytest.approx(TWO.youngs_modulus, rel=0.05)
    told = next(f for f in result.findings if f.code == "branches")
    counts = {"loading": 29, "unloading": 28 * len(peaks), "reloading": 29 * (len(peaks) - 1)}
    assert told.values["rows"] == {kind: count for kind, count in counts.items() if count}
    assert "fitted: loading, 29 readings" in str(told)
    shown = result.to_dict()["statistics"]["tests"]["uniaxial"]
    assert [leg["branch"] for leg in shown["branches"]][:2] == ["loading", "unloading"]
    assert shown["branch"] == "loading"


def test_hysteresis_is_the_part_of_the_work_that_is_lost() -> None:
    """A loss and a softening that are the same at every stretch are what is told."""
    stress = TWO.nominal("uniaxial", UP)
    rows = [stress, 0.7 * stress[::-1][1:], 0.9 * stress[1:]]
    test = LoadTest("uniaxial", np.concatenate([UP, DOWN, UP[1:]]), np.concatenate(rows))
    shares = {"unloading": pytest.approx(0.3, abs=0.002), "reloading": pytest.approx(0.1, abs=0.002)}
    assert area_shares(test.legs) == shares
    result = characterise([test], model="neo-hookean")
    told = {f.code: f.values["share"] for f in result.findings if f.code in ("hysteresis", "softening")}
    assert told == {"hysteresis": shares["unloading"], "softening": shares["reloading"]}


def test_unloading_that_gains_work_is_rows_the_wrong_way_round() -> None:
    test = cycles(2.0)
    turned = LoadTest("uniaxial", test.stretch[::-1], test.stress[::-1])
    assert "work-gained" in codes(characterise([turned], model="neo-hookean").findings)


@pytest.mark.parametrize("branch", [*KINDS, "all"])
def test_any_branch_can_be_asked_for(branch: str) -> None:
    test = cycles(2.0, 2.0, loss=0.4)
    counts = {**test.counts, "all": len(test.stretch)}
    assert characterise([test], terms=1, branch=branch).fit.samples == counts[branch]


def test_a_branch_has_its_own_modulus() -> None:
    test = cycles(2.0, 2.0, loss=0.4)
    loading, unloading = (characterise([test], terms=1, branch=b).material for b in ("loading", "unloading"))
    assert unloading.youngs_modulus < 0.85 * loading.youngs_modulus


def test_a_branch_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="no row is reloading: there are 29 of loading, 28 of unloading; choose"):
        characterise([cycles(2.0)], branch="reloading")
    with pytest.raises(InputError, match="branch is 'first'; choose one of loading, unloading, reloading, all"):
        characterise(readings(TWO, "uniaxial"), branch="first")
    stretched = LoadTest("uniaxial", np.concatenate([DOWN, UP]), TWO.nominal("uniaxial", np.concatenate([DOWN, UP])))
    with pytest.raises(InputError, match="no row is loading: there are 19 of unloading, 20 of reloading"):
        characterise([stretched])
