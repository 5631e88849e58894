"""Networks of Matsuoka's neurons: any weights, and the wirings in use; CPG §6.3.

    Tr x_i' = -x_i - d v_i - sum_j W_ij y_j + e_i       Ta v_i' = -v_i + y_i        y_i = max(0, x_i)

"CPG" is the motion simulation and control paper of 2019. x is a neuron's inner state, v its fatigue, y its output, all
dimensionless. W_ij is how much neuron j inhibits neuron i; a negative weight excites.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, argument, visible
from ..files import read_bytes
from ..units import si

#: CPG §6.3. The mutual inhibition a was lost from the paper's text; 2.5 lies in the middle of the window of a cycle.
INHIBITION = 2.5
ADAPTATION = 3.0
TONIC = 1.0
RISE_TIME = 0.12
ADAPTATION_TIME = 0.3
#: CPG §6.3 starts three neurons from (x1, x2, x3, v1, v2, v3) = (0.12, 0, 0, 0, 0, 0.12).
START = 0.12

#: Couplings ks and kc of a chain under which a body of fifteen units carries about one wavelength.
CHAIN_SAME, CHAIN_CROSS = 0.1, 0.1

MOST_NEURONS = 200

#: Beyond this, squares and differences of numbers overflow or lose all digits in double precision.
_LARGEST = 1e30
_SMALLEST_TIME = 1e-30
#: Largest file of weights.
_MOST_BYTES = 50_000_000


@dataclass(frozen=True)
class Network:
    """Neurons wired by ``weights``.

    ``weights`` (n, n): W_ij, how much the output of neuron j inhibits neuron i (given as any array, kept as tuples);
    ``adaptation`` d >= 0; ``tonic`` e, one number for all or one for each neuron; ``rise_time`` Tr and
    ``adaptation_time`` Ta [s]. ``units`` are pairs (extensor, flexor) of neurons counted from 0, whose difference of
    outputs drives a segment; without any, the network drives with y_1 - y_2. Raises InputError for arguments that do
    not make a network.
    """

    weights: ArrayLike
    adaptation: float = ADAPTATION
    tonic: float | tuple[float, ...] = TONIC
    rise_time: float = RISE_TIME
    adaptation_time: float = ADAPTATION_TIME
    units: tuple[tuple[int, int], ...] = ((0, 1),)

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", _checked_weights(self.weights))
        for name in ("rise_time", "adaptation_time"):
            value = getattr(self, name)
            if not _SMALLEST_TIME <= value <= _LARGEST:
                raise InputError(f"{name} is {value:g} s; it must be more than zero and finite")
        if not 0 <= self.adaptation <= _LARGEST:
            raise InputError(f"adaptation is {self.adaptation:g}; it must be zero or more and finite")
        tonic = np.atleast_1d(np.asarray(self.tonic, dtype=float))
        if tonic.ndim != 1 or len(tonic) not in (1, self.size):
            raise InputError(f"tonic has {tonic.size} values; give one, or one for each of the {self.size} neurons")
        if not (np.abs(tonic) <= _LARGEST).all():
            raise InputError(f"tonic is {self.tonic}; it must be finite")
        if self.size == 1 and self.units == ((0, 1),):
            raise InputError("the weights are of one neuron; the output is y_1 - y_2, so give two or more")
        if not self.units or any(not (0 <= k < self.size) for unit in self.units for k in unit):
            raise InputError(
                f"units {self.units} name neurons that are not there; count them from 0 to {self.size - 1}"
            )

    def slowed(self, factor: float) -> Network:
        """Return the network with both time constants ``factor`` times as long."""
        return replace(self, rise_time=factor * self.rise_time, adaptation_time=factor * self.adaptation_time)

    @property
    def size(self) -> int:
        """Number of neurons n."""
        return len(self.matrix)

    @cached_property
    def matrix(self) -> Array:
        """W (n, n)."""
        matrix = np.array(self.weights, dtype=float)
        matrix.setflags(write=False)
        return matrix

    @cached_property
    def tonics(self) -> Array:
        """e (n,)."""
        return np.array(np.broadcast_to(np.asarray(self.tonic, dtype=float), self.size))

    @cached_property
    def readout(self) -> Array:
        """(units, n): a row times y is the output y_extensor - y_flexor of a unit."""
        rows = np.zeros((len(self.units), self.size))
        for row, (extensor, flexor) in zip(rows, self.units, strict=True):
            row[extensor] += 1.0
            row[flexor] -= 1.0
        return rows


def _checked_weights(weights: ArrayLike) -> tuple[tuple[float, ...], ...]:
    try:
        matrix = np.array(weights, dtype=float)
    except (TypeError, ValueError):
        raise InputError("the weights are no matrix of numbers; give n rows of n numbers") from None
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        shape = " x ".join(str(k) for k in matrix.shape)
        raise InputError(f"the weights are {shape or 'one number'}; they must be square: a row and a column a neuron")
    if not 1 <= len(matrix) <= MOST_NEURONS:
        raise InputError(f"the weights are of {len(matrix)} neurons; at most {MOST_NEURONS} are possible")
    wrong = np.argwhere(~(np.abs(matrix) <= _LARGEST))
    if len(wrong):
        i, j = wrong[0]
        raise InputError(f"weight {i + 1},{j + 1} is {matrix[i, j]:g}; every weight must be a finite number")
    return tuple(tuple(row) for row in matrix.tolist())


# -- wirings -----------------------------------------------------------------------------------------------------------


def mutual_weights(neurons: int, inhibition: float = INHIBITION) -> Array:
    """Return W (n, n) of neurons that all inhibit one another by ``inhibition`` a; two of them are the paper's unit."""
    _check_count(neurons)
    return inhibition * (1 - np.eye(neurons))


def ring_weights(neurons: int, inhibition: float = INHIBITION) -> Array:
    """Return W (n, n) of a ring in which each neuron inhibits both its neighbours."""
    one_way = one_way_ring_weights(neurons, inhibition)
    return np.where(one_way, one_way, one_way.T)


def one_way_ring_weights(neurons: int, inhibition: float = INHIBITION) -> Array:
    """Return W (n, n) of a ring in which neuron k inhibits neuron k + 1 only."""
    _check_count(neurons)
    return inhibition * np.roll(np.eye(neurons), 1, axis=0)


def chain_weights(
    units: int, inhibition: float = INHIBITION, same: float = CHAIN_SAME, cross: float = CHAIN_CROSS
) -> Array:
    """Return W (2 n, 2 n) of n two-neuron units in a row, the tail first, along which a wave travels to the head.

    Neuron k of a unit receives + ``same`` y_k - ``cross`` y_(other k) of its tailward neighbour (ks, kc).
    """
    if not 1 <= units <= MOST_NEURONS // 2:
        raise InputError(f"{units} units: a chain has 1 to {MOST_NEURONS // 2}")
    inside = inhibition * np.array([[0.0, 1.0], [1.0, 0.0]])
    between = np.array([[-same, cross], [cross, -same]])
    weights = np.kron(np.eye(units), inside) + np.kron(np.eye(units, k=-1), between)
    return np.asarray(weights, dtype=np.float64)


def _check_count(neurons: int) -> None:
    if not 2 <= neurons <= MOST_NEURONS:
        raise InputError(f"{neurons} neurons: give 2 to {MOST_NEURONS}")


def unit(inhibition: float = INHIBITION, **constants: Any) -> Network:
    """Return the paper's oscillator: two neurons that inhibit each other. ``constants`` are those of `Network`."""
    return Network(mutual_weights(2, inhibition), **constants)


def ring(neurons: int = 3, inhibition: float = INHIBITION, *, one_way: bool = False, **constants: Any) -> Network:
    """Return a ring of neurons that inhibit both neighbours, or only the next. ``constants`` are those of `Network`."""
    weights = one_way_ring_weights if one_way else ring_weights
    return Network(weights(neurons, inhibition), **constants)


def chain(
    units: int = 15,
    inhibition: float = INHIBITION,
    *,
    same: float = CHAIN_SAME,
    cross: float = CHAIN_CROSS,
    **constants: Any,
) -> Network:
    """Return the units in a row, tail first; see `chain_weights`. ``constants`` are those of `Network`."""
    pairs = tuple((2 * k, 2 * k + 1) for k in range(units))
    return Network(chain_weights(units, inhibition, same, cross), units=pairs, **constants)


#: Topology -> its weights, and the usual number of neurons. In a chain two neurons make a unit.
_TOPOLOGIES = {"mutual": (mutual_weights, 2), "ring": (ring_weights, 3), "one-way-ring": (one_way_ring_weights, 3)}


def wired(
    *,
    topology: str | None = None,
    neurons: int | None = None,
    weights: str | Path | ArrayLike | None = None,
    inhibition: float | None = None,
    same: float | None = None,
    cross: float | None = None,
    rise_time: str | float = RISE_TIME,
    adaptation_time: str | float = ADAPTATION_TIME,
    **constants: Any,
) -> Network:
    """Return a network by the name of its ``topology`` (default mutual), or of ``weights``: W, or a CSV file of it.

    Times are texts such as ``0.12s``, or seconds; ``constants`` are those of `Network`. Raises InputError for arguments
    that contradict one another.
    """
    constants["rise_time"] = si(rise_time, "s", argument("rise_time"))
    constants["adaptation_time"] = si(adaptation_time, "s", argument("adaptation_time"))
    couplings = {name: value for name, value in (("same", same), ("cross", cross)) if value is not None}
    if topology != "chain" and couplings:
        raise InputError(f"{argument(next(iter(couplings)))} belongs to {argument('topology', 'chain')}")
    if weights is not None:
        for name, value in (("neurons", neurons), ("topology", topology), ("inhibition", inhibition)):
            if value is not None:
                raise InputError(f"{argument('weights')} gives the whole network; leave out {argument(name)}")
        matrix = read_weights(Path(weights)) if isinstance(weights, str | Path) else weights
        return Network(matrix, **constants)
    a = INHIBITION if inhibition is None else inhibition
    topology = topology or "mutual"
    if topology == "chain":
        count = 30 if neurons is None else neurons
        if count % 2:
            raise InputError(f"a chain of {count} neurons: its units have two each, so give an even number")
        return chain(count // 2, a, **couplings, **constants)
    if topology not in _TOPOLOGIES:
        raise InputError(f"topology is '{topology}'; choose one of {', '.join(_TOPOLOGIES)}, chain")
    build, usual = _TOPOLOGIES[topology]
    return Network(build(usual if neurons is None else neurons, a), **constants)


# -- starts ------------------------------------------------------------------------------------------------------------


def default_start(network: Network) -> Array:
    """Return the start of CPG §6.3, (2 n,) = (x_1.., v_1..), in which three neurons or more differ.

    Two neurons start from x_1 = 0.12; more from x_1 = v_n = 0.12 (the paper's six numbers, order assumed); every unit
    of a chain like two neurons.
    """
    state = np.zeros(2 * network.size)
    if len(network.units) > 1:
        state[[extensor for extensor, _ in network.units]] = START
    else:
        state[[0] if network.size <= 2 else [0, -1]] = START
    return state


def checked_start(network: Network, start: ArrayLike | None) -> Array:
    """Return ``start`` as an array (2 n,), or the default. Raises InputError for a wrong length or wrong values."""
    if start is None:
        return default_start(network)
    state = np.array(start, dtype=float)
    if state.shape != (2 * network.size,):
        raise InputError(
            f"the start has {state.size} values; {network.size} neurons need {2 * network.size}: x of each, then v of "
            "each"
        )
    if not (np.abs(state) <= _LARGEST).all():
        raise InputError("the start holds a value that is not finite; give numbers")
    return state


# -- weights in a file -------------------------------------------------------------------------------------------------


def read_weights(path: Path) -> Array:
    """Return W from a CSV file of n rows of n numbers; lines that start with # and blank lines are skipped.

    Raises InputError naming file, line and column for what is no square matrix of finite numbers.
    """
    name = visible(path.name)
    try:
        text = read_bytes(path, _MOST_BYTES, "matrix of weights").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{name}: not a text file; write the weights as CSV") from None
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = [cell.strip() for cell in line.replace(";", ",").replace("\t", ",").split(",")]
        rows.append([_weight(cell, f"{name}: line {number}, column {k}") for k, cell in enumerate(cells, 1)])
        if len(rows[-1]) != len(rows[0]):
            raise InputError(f"{name}: line {number} has {len(rows[-1])} numbers, the first row {len(rows[0])}")
    if not rows:
        raise InputError(f"{name}: the file is empty; it needs n rows of n numbers, row i what inhibits neuron i")
    if len(rows) != len(rows[0]):
        raise InputError(
            f"{name}: {len(rows)} rows of {len(rows[0])} numbers; the weights must be square, a row and a column "
            "a neuron"
        )
    return np.array(rows)


def _weight(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in cell:
        raise InputError(f"{where}: '{cell[:40]}' is not a finite number; write 0 where there is no connection")
    return value
