"""Plans: grids, random designs, lists from files, and what is said of texts that are none."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.errors import InputError
from ilg_circuit.study.dataset import boxes
from ilg_circuit.study.plan import grid_plan, random_plan, read_plan


def test_a_grid_counts_with_its_last_axis_fastest() -> None:
    plan = grid_plan(["thickness=0.2mm:1mm:5", "width=2mm,5mm", "orientation=weightless,horizontal"])
    assert plan.shape == (5, 2, 2)
    assert plan.columns["thickness"].tolist() == pytest.approx([0.2e-3, 0.4e-3, 0.6e-3, 0.8e-3, 1e-3])
    assert plan.columns["thickness"][-1] == 1e-3
    some = plan.designs(3, 6)
    assert some["thickness"].tolist() == pytest.approx([0.2e-3, 0.4e-3, 0.4e-3])
    assert some["width"].tolist() == [5e-3, 2e-3, 2e-3]
    assert some["orientation"].tolist() == ["horizontal", "weightless", "horizontal"]


def test_equal_ratios() -> None:
    plan = grid_plan(["youngs_modulus=1kPa:100kPa:3:log"])
    assert plan.columns["youngs_modulus"].tolist() == pytest.approx([1e3, 1e4, 1e5])


@pytest.mark.parametrize("method", ["lhs", "sobol", "uniform"])
def test_random_designs_fill_their_ranges_and_can_be_repeated(method: str) -> None:
    texts = ["thickness=0.2mm:1mm", "youngs_modulus=1kPa:100kPa:log", "width=2mm,5mm"]
    plan = random_plan(texts, 256, method, seed=3)
    b, e, w = (plan.columns[n] for n in plan.names)
    assert b.min() >= 0.2e-3
    assert b.max() <= 1e-3
    assert np.median(e) == pytest.approx(1e4, rel=0.35)
    assert set(w.tolist()) == {2e-3, 5e-3}
    if method == "lhs":  # one in every 256th of the range
        assert np.unique(np.floor((b - 0.2e-3) / 0.8e-3 * 256)).size == 256
    again, other = random_plan(texts, 256, method, seed=3), random_plan(texts, 256, method, seed=4)
    assert np.array_equal(b, again.columns["thickness"])
    assert not np.array_equal(b, other.columns["thickness"])


def test_a_list_of_designs(tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_text(
        "thickness_mm,youngs_modulus [kPa],damping_ratio,orientation\n0.5,7.6,0.6,hanging\n,8,0.7,sideways\n"
    )
    plan = read_plan(path)
    assert plan.names == ("thickness", "youngs_modulus", "damping_ratio", "orientation")
    assert plan.count == 2
    assert plan.columns["youngs_modulus"].tolist() == [7600.0, 8000.0]
    assert plan.columns["orientation"].tolist() == ["hanging", "sideways"]
    assert np.isnan(plan.columns["thickness"][1])


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("thickness_mm,thick\n1,2\n", "unknown parameter 'thick"),
        ("thickness\n1\n", "write it like 'thickness_m'"),
        ("thickness_V\n1\n", "does not measure"),
        ("thickness_mm,thickness_m\n1,1\n", "two columns give thickness"),
        ("thickness_mm\nthin\n", "line 2: thickness: 'thin' is not a number"),
        ("thickness_mm\n1,2\n", "line 2 has 2 cells"),
        ("thickness_mm\n", "at least one design"),
        ("", "at least one design"),
    ],
)
def test_lists_that_are_none(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "designs.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=hint):
        read_plan(path)


@pytest.mark.parametrize(
    ("texts", "hint"),
    [
        ([], "say what to vary"),
        (["thickness"], "is not understood"),
        (["thickness=0.2mm:1mm"], "does not say how many"),
        (["thickness=1mm:0.2mm:5"], "give the smaller end first"),
        (["thickness=0.2mm:1mm:5", "thickness=1mm,2mm"], "varied twice"),
        (["thickness=0.2:1:5"], "has no unit"),
        (["thickness=0.2mm:1mm:0"], "no designs"),
        (["thickness=0.2mm:1mm:1"], "write thickness=0.2mm"),
        (["thickness=0.2mm:1mm:2.5"], "is not understood"),
        (["orientation=weightless:hanging:3"], "is not understood"),
        (["orientation=sideways"], "choose one of weightless"),
        (["capacitance_slope=0 1/V:1 1/V:5:log"], "begins above zero"),
        (["width=1mm:2mm:10000", "thickness=1mm:2mm:10000"], "more than 10000000"),
    ],
)
def test_grids_that_are_none(texts: list[str], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        grid_plan(texts)


def test_random_designs_that_are_none() -> None:
    for texts, count, method, hint in (
        (["thickness=0.2mm:1mm:5"], 10, "lhs", "leave out ':5'"),
        (["thickness=0.2mm:1mm"], 0, "lhs", "give 1 to"),
        (["thickness=0.2mm:1mm"], 5, "halton", "choose one of lhs"),
        ([], 5, "lhs", "say what to vary"),
    ):
        with pytest.raises(InputError, match=hint):
            random_plan(texts, count, method)


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.data())
def test_boxes_hold_each_element_once(shape: list[int], data: st.DataObject) -> None:
    count = int(np.prod(shape))
    start = data.draw(st.integers(0, count))
    stop = data.draw(st.integers(start, count))
    found = np.full(shape, -1)
    for box, inside in boxes(tuple(shape), start, stop):
        part = np.arange(inside.start, inside.stop)
        found[box] = part.reshape(found[box].shape)
    assert found.ravel().tolist() == [k if start <= k < stop else -1 for k in range(count)]
