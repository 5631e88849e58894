"""The voltage whose displacement, or force, is nearest to a path, within limits: a convex programme, by Clarabel.

The voltage is straight lines between nodes at equal times. What follows the path and the current, at the nodes and
half way, are linear in its values there: matrices from the exact engine. An energy limit is a second-order cone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..solve.exact import exact_outputs
from ..solve.state_space import StateSpace

#: Weight of the voltage's changes beside the error, both in parts of their limits: it only settles what the error
#: leaves open.
SMOOTHING = 1e-12
#: Its square root where a path is followed exactly.
_BARELY = 1e-11
#: Tolerances of the solver, which works in units of one.
_TOLERANCE = 1e-11


@dataclass(frozen=True)
class Limits:
    """Limits of ``voltage`` [V], ``slew`` [V/s], ``current`` [A] and ``energy`` [J]; None for no limit."""

    voltage: float
    slew: float | None = None
    current: float | None = None
    energy: float | None = None


@dataclass(frozen=True, eq=False)
class Answers:
    """What follows the path, current and energy as they follow from the values of a voltage at n nodes.

    ``output`` (2n - 1, n) is the displacement [m/V] or the force [N/V] at nodes and half way between them, ``current``
    [A/V] (n, n) that at nodes, ``energy`` (n, n) the form u E u in joule. The constants ``offset`` (2n - 1,),
    ``flowing`` (n,), ``spent`` are what a nonlinear strip adds.
    """

    output: Array
    current: Array
    energy: Array
    offset: Array
    flowing: Array
    spent: float = 0.0


def answers(system: StateSpace, nodes: Array, quantity: str = "displacement") -> Answers:
    """Return what a linear strip answers to a voltage with values at ``nodes`` [s] (n,), equally apart.

    ``quantity`` is the output that shall follow a path.
    """
    n, width = len(nodes), float(nodes[1] - nodes[0])
    fine = np.linspace(0.0, float(nodes[-1]), 2 * n - 1)
    shapes = (
        PiecewiseLinear(np.array([0.0, width]), np.array([1.0, 0.0])),
        PiecewiseLinear(np.array([0.0, width, 2 * width]), np.array([0.0, 1.0, 0.0])),
    )
    first, second = (exact_outputs(system, shape, fine)[0] for shape in shapes)
    found = {}
    for name in (quantity, "current"):
        row = system.output_names.index(name)
        matrix = np.zeros((2 * n - 1, n))
        matrix[:, 0] = first[row]
        for k in range(1, n):
            matrix[2 * (k - 1) :, k] = second[row, : 2 * n - 1 - 2 * (k - 1)]
        found[name] = matrix
    # energy by Simpson's rule: the voltage at nodes and half way between them
    volts = np.zeros((2 * n - 1, n))
    volts[::2] = np.eye(n)
    volts[1::2] = (np.eye(n)[:-1] + np.eye(n)[1:]) / 2
    weights = np.tile([2.0, 4.0], n)[: 2 * n - 1] * width / 6
    weights[0], weights[-1] = width / 6, width / 6
    energy = (volts * weights[:, None]).T @ found["current"]
    current = found["current"]
    return Answers(found[quantity], current[::2], (energy + energy.T) / 2, np.zeros(2 * n - 1), np.zeros(n))


def nearest_voltage(answer: Answers, path: Array, nodes: Array, limits: Limits, smoothing: float = SMOOTHING) -> Array:
    """Return the voltage (n,) [V] whose output is nearest to ``path`` (2n - 1,) in the mean square.

    A path that can be followed has its own voltage, whatever the ``smoothing``. Raises SolveError where no voltage
    keeps the limits, or the solver does not converge.
    """
    own = _inverse(answer, path, limits.voltage)
    if keeps(answer, own, nodes, limits):
        return np.clip(own, -limits.voltage, limits.voltage)
    import clarabel
    from scipy import sparse

    n, width = len(nodes), float(nodes[1] - nodes[0])
    volt = limits.voltage
    # of a path beyond all that the limit could reach, that much is the goal; what is further only weighs
    wanted, reach = path - answer.offset, float(np.abs(answer.output).sum(axis=1).max()) * volt
    near = np.clip(wanted, -reach, reach)
    scale = max(float(np.abs(near).max()), 1e-3 * float(np.abs(answer.output).max()) * volt)
    beyond = (wanted - near) / scale
    far = max(1.0, float(np.abs(beyond).max()))
    one = sparse.identity(n, format="csc")
    change = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n), format="csc")
    # unknowns: the voltage in parts of its limit, and the error in parts of the goal's largest value
    m = len(path)
    weight = trapezoid(m) / m
    rows = [sparse.hstack([sparse.csc_matrix(answer.output * (volt / scale)), -sparse.identity(m)])]
    right = [near / scale]
    cones = [clarabel.ZeroConeT(m)]

    def at_most(matrix: sparse.spmatrix, low: Array, high: Array) -> None:
        wide = sparse.hstack([matrix, sparse.csc_matrix((matrix.shape[0], m))])
        rows.extend([wide, -wide])
        right.extend([high, -low])
        cones.append(clarabel.NonnegativeConeT(2 * matrix.shape[0]))

    at_most(one, -np.ones(n), np.ones(n))
    if limits.slew is not None:
        most = limits.slew * width / volt
        start = sparse.csc_matrix(([1.0], ([0], [0])), shape=(1, n))
        at_most(
            sparse.vstack([start, change]), np.append(0.0, np.full(n - 1, -most)), np.append(0.0, np.full(n - 1, most))
        )
    if limits.current is not None:
        flowing = answer.flowing / limits.current
        at_most(sparse.csc_matrix(answer.current * (volt / limits.current)), -1 - flowing, 1 - flowing)
    if limits.energy is not None:
        left = limits.energy - answer.spent
        if not left > 0:
            raise SolveError(f"an energy of {limits.energy:g} J is less than the strip takes in any case")
        values, vectors = np.linalg.eigh(answer.energy)
        root = (vectors * np.sqrt(np.maximum(values, 0.0))).T * volt / np.sqrt(left)
        rows.append(sparse.hstack([sparse.csc_matrix(np.vstack([np.zeros(n), -root])), sparse.csc_matrix((n + 1, m))]))
        right.append(np.append(1.0, np.zeros(n)))
        cones.append(clarabel.SecondOrderConeT(n + 1))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    quadratic = sparse.block_diag([2 * smoothing * change.T @ change, 2 / far * sparse.diags(weight)], format="csc")
    solver = clarabel.DefaultSolver(
        sparse.triu(quadratic, format="csc"),
        np.append(np.zeros(n), -2 / far * weight * beyond),
        sparse.vstack(rows, format="csc"),
        np.concatenate(right),
        cones,
        settings,
    )
    found = solver.solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        raise SolveError(f"no voltage keeps these limits: the programme is {found.status!s}")
    return np.asarray(np.clip(np.array(found.x[:n]), -1.0, 1.0) * volt)


def _inverse(answer: Answers, path: Array, volt: float) -> Array:
    """Return the smoothest voltage (n,) [V] that follows ``path`` best, without limits."""
    n = answer.output.shape[1]
    scale = max(float(np.abs(answer.output).max()) * volt, 1e-300)
    change = np.diff(np.eye(n), axis=0) * _BARELY
    matrix = np.vstack([answer.output * (volt / scale), change])
    right = np.concatenate([(path - answer.offset) / scale, np.zeros(n - 1)])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0] * volt)


def keeps(answer: Answers, voltage: Array, nodes: Array, limits: Limits, rounding: float = 1e-6) -> bool:
    """Return whether a voltage (n,) keeps the limits at the nodes, up to ``rounding`` in parts of them."""
    more = 1 + rounding
    good = np.abs(voltage).max() <= limits.voltage * more
    if limits.slew is not None:
        rates = np.diff(voltage) / (nodes[1] - nodes[0])
        good = good and abs(voltage[0]) <= rounding * limits.voltage and np.abs(rates).max() <= limits.slew * more
    if limits.current is not None:
        good = good and np.abs(answer.current @ voltage + answer.flowing).max() <= limits.current * more
    if limits.energy is not None:
        good = good and voltage @ answer.energy @ voltage + answer.spent <= limits.energy * more
    return bool(good)


def trapezoid(n: int) -> Array:
    """Return the weights (n,) of a mean over time by the trapezoidal rule, 1 inside."""
    weight = np.ones(n)
    weight[[0, -1]] = 0.5
    return weight
