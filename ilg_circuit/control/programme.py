"""The voltages whose displacement, force or shape is nearest to a path, within limits: a convex programme, by Clarabel.

Each voltage is straight lines between nodes at equal times. What follows the path and the currents, at the nodes and
half way, are linear in the values there: matrices from the exact engine. An energy limit is a second-order cone.

A strip has one voltage, or one for each of its segments: those of N segments stand one after the other, (N n,).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..drive import Drives, PiecewiseLinear
from ..errors import SolveError
from ..solve.exact import exact_outputs
from ..solve.state_space import StateSpace

#: Weight of the voltage's changes beside the error, both in parts of their limits: it only settles what the error
#: leaves open.
SMOOTHING = 1e-12
#: Its square root where a path is followed exactly.
_BARELY = 1e-11
#: Weight of the voltages' mean square, in parts of their limits, beside the error's, in parts of the path's largest
#: value, where a path leaves open which segments make it.
EFFORT = 1e-6
#: Tolerances of the solver, which works in units of one.
_TOLERANCE = 1e-11


@dataclass(frozen=True)
class Limits:
    """Limits of ``voltage`` [V], ``slew`` [V/s], ``current`` [A] and ``energy`` [J]; None for no limit.

    Several segments have one each; their energy, that of all, is the first one's.
    """

    voltage: float
    slew: float | None = None
    current: float | None = None
    energy: float | None = None


@dataclass(frozen=True, eq=False)
class Answers:
    """What follows the path, currents and energy as they follow from the values of N voltages at n nodes.

    ``output`` (T (2n - 1), N n) are T outputs, such as the displacement [m/V], at nodes and half way between them,
    ``current`` [A/V] (N n, N n) those at nodes, ``energy`` (N n, N n) the form u E u in joule. The constants ``offset``
    (T (2n - 1),), ``flowing`` (N n,), ``spent`` are what a nonlinear strip adds.
    """

    output: Array
    current: Array
    energy: Array
    offset: Array
    flowing: Array
    spent: float = 0.0


def answers(
    system: StateSpace, nodes: Array, followed: str | Sequence[Mapping[str, float]] = "displacement"
) -> Answers:
    """Return what a linear strip answers to voltages with values at ``nodes`` [s] (n,), equally apart.

    ``followed`` is the output that shall follow a path, or for each of several ones the outputs of the circuit with
    their weights.
    """
    n, width = len(nodes), float(nodes[1] - nodes[0])
    fine = np.linspace(0.0, float(nodes[-1]), 2 * n - 1)
    rows = [{followed: 1.0}] if isinstance(followed, str) else followed
    sources = system.b.shape[2] - 1
    names = [f"delivered_{k}" for k in range(sources)] if sources > 1 else ["current"]
    wanted = np.zeros((len(rows) + sources, len(system.output_names)))
    for row, terms in enumerate([*rows, *({name: 1.0} for name in names)]):
        for name, factor in terms.items():
            wanted[row, system.output_names.index(name)] = factor
    shapes = (
        PiecewiseLinear(np.array([0.0, width]), np.array([1.0, 0.0])),
        PiecewiseLinear(np.array([0.0, width, 2 * width]), np.array([0.0, 1.0, 0.0])),
    )
    flat = PiecewiseLinear(np.array([0.0]), np.array([0.0]))
    found = np.zeros((len(wanted), 2 * n - 1, sources, n))
    for source in range(sources):
        drives = (tuple((str(k), shape if k == source else flat) for k in range(sources)) for shape in shapes)
        first, second = (wanted @ exact_outputs(system, Drives(named), fine)[0] for named in drives)
        found[:, :, source, 0] = first
        for k in range(1, n):
            found[:, 2 * (k - 1) :, source, k] = second[:, : 2 * n - 1 - 2 * (k - 1)]
    output, current = found[: len(rows)].reshape(-1, sources * n), found[len(rows) :].reshape(sources, -1, sources * n)
    # energy by Simpson's rule: the voltage at nodes and half way between them
    volts = np.zeros((2 * n - 1, n))
    volts[::2] = np.eye(n)
    volts[1::2] = (np.eye(n)[:-1] + np.eye(n)[1:]) / 2
    weights = np.tile([2.0, 4.0], n)[: 2 * n - 1] * width / 6
    weights[0], weights[-1] = width / 6, width / 6
    energy = np.concatenate([(volts * weights[:, None]).T @ of_source for of_source in current])
    flowing = current[:, ::2].reshape(sources * n, -1)
    return Answers(output, flowing, (energy + energy.T) / 2, np.zeros(len(output)), np.zeros(sources * n))


def nearest_voltage(
    answer: Answers,
    path: Array,
    nodes: Array,
    limits: Limits | Sequence[Limits],
    smoothing: float = SMOOTHING,
    effort: float = 0.0,
) -> Array:
    """Return the voltages (N n,) [V] whose outputs are nearest to ``path`` (T (2n - 1),) in the mean square.

    The squares of T outputs, of one size, are added. A path that can be followed has its own voltages, whatever the
    ``smoothing``; ``effort`` is the weight of the voltages themselves where these are not determined, see `EFFORT`.
    Raises SolveError where no voltage keeps the limits, or the solver does not converge.
    """
    bounds, n = _each(limits), len(nodes)
    volt = np.repeat([of.voltage for of in bounds], n)
    own = _inverse(answer, path, volt, n, effort)
    if keeps(answer, own, nodes, bounds):
        return np.clip(own, -volt, volt)
    import clarabel
    from scipy import sparse

    width, count = float(nodes[1] - nodes[0]), len(volt)
    # of a path beyond all that the limits could reach, that much is the goal; what is further only weighs
    m = 2 * n - 1
    wanted, reach = path - answer.offset, np.abs(answer.output * volt).sum(axis=1)
    near = np.clip(wanted, *(sign * np.repeat(reach.reshape(-1, m).max(axis=1), m) for sign in (-1, 1)))
    scale = max(float(np.abs(near).max()), 1e-3 * float(np.abs(answer.output * volt).max()))
    beyond = (wanted - near) / scale
    far = max(1.0, float(np.abs(beyond).max()))
    # unknowns: the voltages in parts of their limits, and the error, weighted and in as few parts as it has, in parts
    # of the goal's largest value
    weight = np.tile(trapezoid(m) / m, len(path) // m)
    matrix = answer.output * (volt / scale)
    turned, triangle = np.linalg.qr(matrix * np.sqrt(weight)[:, None])
    parts = len(triangle)
    rows = [sparse.hstack([sparse.csc_matrix(triangle), -sparse.identity(parts)])]
    right = [turned.T @ (np.sqrt(weight) * near / scale)]
    cones = [clarabel.ZeroConeT(parts)]

    def at_most(matrix: sparse.spmatrix, most: Array) -> None:
        kept = np.flatnonzero(np.isfinite(most))
        wide = sparse.hstack([matrix, sparse.csc_matrix((count, parts))], format="csr")[kept]
        rows.extend([wide, -wide])
        right.extend([most[kept], most[kept]])
        cones.append(clarabel.NonnegativeConeT(2 * len(kept)))

    def flows_within(most: Array) -> None:
        kept = np.flatnonzero(np.isfinite(most))
        wide = sparse.hstack(
            [sparse.csc_matrix(answer.current[kept] * volt / most[kept, None]), sparse.csc_matrix((len(kept), parts))]
        )
        flowing = answer.flowing[kept] / most[kept]
        rows.extend([wide, -wide])
        right.extend([1 - flowing, 1 + flowing])
        cones.append(clarabel.NonnegativeConeT(2 * len(kept)))

    one, changes = sparse.identity(count, format="csc"), sparse.csc_matrix(_changes(len(bounds), n))
    at_most(one, np.ones(count))
    slews, currents = (np.array([np.inf if v is None else v for v in of]) for of in (
        [of.slew for of in bounds], [of.current for of in bounds]))  # fmt: skip
    if np.isfinite(slews).any():
        most = np.repeat(slews * width, n) / volt
        most[::n] = 0.0  # from zero
        at_most(changes, np.where(np.repeat(np.isfinite(slews), n), most, np.inf))
    if np.isfinite(currents).any():
        flows_within(np.repeat(currents, n))
    if bounds[0].energy is not None:
        left = bounds[0].energy - answer.spent
        if not left > 0:
            raise SolveError(f"an energy of {bounds[0].energy:g} J is less than the strip takes in any case")
        values, vectors = np.linalg.eigh(answer.energy)
        root = (vectors * np.sqrt(np.maximum(values, 0.0))).T * volt / np.sqrt(left)
        cone = np.vstack([np.zeros(count), -root])
        rows.append(sparse.hstack([sparse.csc_matrix(cone), sparse.csc_matrix((count + 1, parts))]))
        right.append(np.append(1.0, np.zeros(count)))
        cones.append(clarabel.SecondOrderConeT(count + 1))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    between = sparse.csc_matrix(np.delete(changes.toarray(), np.arange(0, count, n), axis=0))
    own_weight = 2 * smoothing * between.T @ between + 2 * effort / n * one
    solver = clarabel.DefaultSolver(
        sparse.triu(sparse.block_diag([own_weight, 2 / far * sparse.identity(parts)]), format="csc"),
        np.append(-2 / far * matrix.T @ (weight * beyond), np.zeros(parts)),
        sparse.vstack(rows, format="csc"),
        np.concatenate(right),
        cones,
        settings,
    )
    found = solver.solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        raise SolveError(f"no voltage keeps these limits: the programme is {found.status!s}")
    return np.asarray(np.clip(np.array(found.x[:count]), -1.0, 1.0) * volt)


def _each(limits: Limits | Sequence[Limits]) -> tuple[Limits, ...]:
    return (limits,) if isinstance(limits, Limits) else tuple(limits)


def _changes(sources: int, n: int) -> Array:
    """Return the matrix (N n, N n) of the first value of each voltage and its changes from node to node."""
    return np.asarray(np.kron(np.eye(sources), np.eye(n) - np.eye(n, k=-1)), dtype=np.float64)


def _inverse(answer: Answers, path: Array, volt: Array, n: int, effort: float) -> Array:
    """Return the smoothest voltages (N n,) [V] that follow ``path`` best, without limits; or those of least effort."""
    count = len(volt)
    scale = max(float(np.abs(answer.output * volt).max()), 1e-300)
    if effort:
        scale = max(float(np.abs(path - answer.offset).max()), 1e-3 * scale)
        root = np.sqrt(np.tile(trapezoid(2 * n - 1) / (2 * n - 1), len(path) // (2 * n - 1)))
        less = np.sqrt(effort / n) * np.eye(count)
    else:
        root = np.ones(len(path))
        less = np.delete(_changes(count // n, n), np.arange(0, count, n), axis=0) * _BARELY
    matrix = np.vstack([answer.output * (volt / scale) * root[:, None], less])
    right = np.concatenate([(path - answer.offset) / scale * root, np.zeros(len(less))])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0] * volt)


def keeps(
    answer: Answers, voltage: Array, nodes: Array, limits: Limits | Sequence[Limits], rounding: float = 1e-6
) -> bool:
    """Return whether voltages (N n,) keep the limits at the nodes, up to ``rounding`` in parts of them."""
    more, bounds, n = 1 + rounding, _each(limits), len(nodes)
    currents = (answer.current @ voltage + answer.flowing).reshape(-1, n)
    for of, volts, flowing in zip(bounds, voltage.reshape(-1, n), currents, strict=True):
        good = np.abs(volts).max() <= of.voltage * more
        if of.slew is not None:
            rates = np.diff(volts) / (nodes[1] - nodes[0])
            good = good and abs(volts[0]) <= rounding * of.voltage and np.abs(rates).max() <= of.slew * more
        if of.current is not None:
            good = good and np.abs(flowing).max() <= of.current * more
        if not good:
            return False
    energy = bounds[0].energy
    return energy is None or bool(voltage @ answer.energy @ voltage + answer.spent <= energy * more)


def trapezoid(n: int) -> Array:
    """Return the weights (n,) of a mean over time by the trapezoidal rule, 1 inside."""
    weight = np.ones(n)
    weight[[0, -1]] = 0.5
    return weight
