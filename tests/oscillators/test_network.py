"""Networks, wirings, starts and weights in files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.network import (
    Network,
    chain,
    chain_weights,
    checked_start,
    default_start,
    mutual_weights,
    one_way_ring_weights,
    read_weights,
    ring,
    ring_weights,
    unit,
)
from ilg_circuit.oscillators.symmetry import quotient


def test_wirings() -> None:
    assert mutual_weights(2, 3.0).tolist() == [[0, 3], [3, 0]]
    assert ring_weights(2, 3.0).tolist() == [[0, 3], [3, 0]]
    assert ring_weights(3, 3.0).tolist() == mutual_weights(3, 3.0).tolist()
    assert ring_weights(4, 1.0).tolist() == [[0, 1, 0, 1], [1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 1, 0]]
    one_way = one_way_ring_weights(3, 2.0)
    assert [tuple(pair) for pair in np.argwhere(one_way)] == [(0, 2), (1, 0), (2, 1)]  # k inhibits k + 1


def test_a_chain_receives_from_its_tail() -> None:
    w = chain_weights(2, 2.0, same=0.3, cross=0.4)
    assert w.tolist() == [[0, 2, 0, 0], [2, 0, 0, 0], [-0.3, 0.4, 0, 2], [0.4, -0.3, 2, 0]]
    assert chain(3).readout.tolist() == [[1, -1, 0, 0, 0, 0], [0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 1, -1]]


def test_starts() -> None:
    assert default_start(unit()).tolist() == [0.12, 0, 0, 0]
    assert default_start(ring(3)).tolist() == [0.12, 0, 0, 0, 0, 0.12]  # the paper's six numbers
    assert default_start(chain(2)).tolist() == [0.12, 0, 0.12, 0, 0, 0, 0, 0]
    assert checked_start(unit(), None).tolist() == default_start(unit()).tolist()
    with pytest.raises(InputError, match="3 values; 2 neurons need 4"):
        checked_start(unit(), [1, 2, 3])
    with pytest.raises(InputError, match="not finite"):
        checked_start(unit(), [1, 2, 3, np.nan])


def test_networks_are_values() -> None:
    assert unit() == unit()
    assert hash(unit()) == hash(unit())
    assert unit() != unit(2.6)
    with pytest.raises(ValueError, match="read-only"):
        unit().matrix[0, 0] = 1


SQUARE = [[0.0, 1.0], [1.0, 0.0]]
WRONG = {
    "not square": ({"weights": [[0.0, 1.0]]}, "1 x 2; they must be square"),
    "ragged": ({"weights": [[0.0, 1.0], [1.0]]}, "no matrix of numbers"),
    "text": ({"weights": "many"}, "no matrix of numbers"),
    "one number": ({"weights": 1.0}, "one number; they must be square"),
    "none": ({"weights": np.zeros((0, 0))}, "0 neurons"),
    "one neuron": ({"weights": [[0.0]]}, "give two or more"),
    "too many": ({"weights": np.zeros((201, 201))}, "at most 200"),
    "NaN weight": ({"weights": [[0.0, np.nan], [1.0, 0.0]]}, "weight 1,2 is nan"),
    "endless weight": ({"weights": [[0.0, 1.0], [np.inf, 0.0]]}, "weight 2,1 is inf"),
    "no rise": ({"rise_time": 0.0}, "rise_time is 0 s; it must be more than zero"),
    "negative rise": ({"rise_time": -1.0}, "rise_time is -1 s"),
    "NaN time": ({"adaptation_time": np.nan}, "adaptation_time is nan s"),
    "endless time": ({"adaptation_time": np.inf}, "adaptation_time is inf s"),
    "negative adaptation": ({"adaptation": -0.1}, "adaptation is -0.1; it must be zero or more"),
    "NaN adaptation": ({"adaptation": np.nan}, "adaptation is nan"),
    "NaN tonic": ({"tonic": np.nan}, "tonic is nan; it must be finite"),
    "tonics": ({"tonic": (1.0, 2.0, 3.0)}, "3 values; give one, or one for each of the 2 neurons"),
    "units": ({"units": ((0, 2),)}, "that are not there"),
}


@pytest.mark.parametrize(("given", "hint"), WRONG.values(), ids=WRONG)
def test_what_is_no_network(given: dict[str, object], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        Network(**{"weights": SQUARE, **given})  # type: ignore[arg-type]


@pytest.mark.parametrize("build", [mutual_weights, ring_weights, one_way_ring_weights])
@pytest.mark.parametrize("count", [-1, 0, 1, 201])
def test_counts_that_make_no_wiring(build: object, count: int) -> None:
    assert callable(build)
    with pytest.raises(InputError, match=f"{count} neurons: give 2 to 200"):
        build(count)


def test_units_that_make_no_chain() -> None:
    with pytest.raises(InputError, match="0 units"):
        chain(0)


def test_weights_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "w.csv"
    path.write_text("# a, comment\n0, 2.5 ,-1e-3\n\n1,0,2\n3;4;0\n", encoding="utf-8-sig")
    assert read_weights(path).tolist() == [[0, 2.5, -1e-3], [1, 0, 2], [3, 4, 0]]


FILES = {
    "empty": ("# nothing\n", "the file is empty"),
    "text": ("0,x\n1,0\n", "line 1, column 2: 'x' is not a finite number"),
    "blank": ("0,\n1,0\n", "line 1, column 2: '' is not a finite number"),
    "NaN": ("0,1\nnan,0\n", "line 2, column 1: 'nan'"),
    "ragged": ("0,1\n1\n", "line 2 has 1 numbers, the first row 2"),
    "not square": ("0,1,2\n1,0,2\n", "2 rows of 3 numbers; the weights must be square"),
}


@pytest.mark.parametrize(("text", "hint"), FILES.values(), ids=FILES)
def test_files_that_hold_no_weights(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "w.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=hint) as caught:
        read_weights(path)
    assert "w.csv" in str(caught.value)


def test_a_file_that_is_not_there_or_no_text(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read"):
        read_weights(tmp_path / "none.csv")
    (tmp_path / "w.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        read_weights(tmp_path / "w.csv")


def test_classes_of_neurons_that_stay_alike() -> None:
    network = ring(4)
    alike = quotient(network, np.array([1, 0, 1, 0, 0, 0, 0, 0], dtype=float))
    assert alike.classes.tolist() == [0, 1, 0, 1]
    assert alike.network.matrix.tolist() == [[0, 5], [5, 0]]
    state = np.array([1.0, 2, 3, 4])
    assert alike.folded(alike.unfolded(state)).tolist() == state.tolist()
    # alike in start, but one receives from a third
    w = [[0, 1, 0], [1, 0, 1], [0, 0, 0]]
    assert quotient(Network(w), np.array([1.0, 1, 0, 0, 0, 0])).trivial
    assert quotient(Network(SQUARE, tonic=(1.0, 1.5)), np.zeros(4)).trivial
