"""Linear netlist -> state space, for one netlist or many of one topology at once.

The classical state-variable method: with every capacitor replaced by a voltage source and every inductor by a current
source the circuit is resistive, and one modified nodal analysis (MNA) gives all voltages and currents as a linear
function of the states and the drive. Capacitor currents and inductor voltages then are the states' rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, ComplexArray
from ..circuit.netlist import GROUND, Netlist
from ..errors import InputError, SolveError

#: Largest pole of an integrator, relative to the fastest; rate for steady states, relative to the slowest other pole.
_STANDS_STILL, _SLOW = 1e-14, 1e-6
_BRANCH_KINDS = frozenset("VEHC")  # kinds that carry a current unknown; a capacitor is a source of its own state


@dataclass(frozen=True)
class StateSpace:
    """x' = A x + B u, y = C x + D u for ``n`` netlists; u is (drives, 1), the 1 feeding constant sources.

    Shapes with k drives: a (n, s, s), b (n, s, k + 1), c (n, o, s), d (n, o, k + 1).
    """

    a: Array
    b: Array
    c: Array
    d: Array
    output_names: tuple[str, ...]

    def of(self, members: NDArray[np.intp]) -> StateSpace:
        """Return the systems of some of the netlists, by index."""
        return replace(self, a=self.a[members], b=self.b[members], c=self.c[members], d=self.d[members])

    def poles(self) -> ComplexArray:
        """Return the eigenvalues of A [1/s], shape (n, s)."""
        return np.asarray(np.linalg.eigvals(self.a), dtype=complex)

    def steady(self) -> Array:
        """Return the outputs (n, o) at rest under 1 V of the first drive; see `gains`."""
        return np.asarray(self.gains()[..., 0])

    def gains(self) -> Array:
        """Return the outputs (n, o, k) at rest under 1 V of each of k drives alone.

        An integrator without input does not change them. Raises SolveError for a circuit that never comes to rest.
        """
        speeds = np.abs(self.poles())
        speeds[speeds <= _STANDS_STILL * speeds.max(axis=1, keepdims=True, initial=1e-300)] = np.inf
        slow = _SLOW * speeds.min(axis=1)[:, None, None]
        identity = np.eye(self.a.shape[1])
        at = [refined_solve(k * slow * identity - self.a, self.b[:, :, :-1]) for k in (1.0, 2.0)]
        x = 2 * at[0] - at[1]  # the answer at s = 0, from two small s
        if not np.isfinite(x).all():
            raise SolveError("the circuit does not come to rest under a constant voltage")
        return np.asarray(self.c @ x + self.d[:, :, :-1])


def state_space(netlists: Sequence[Netlist]) -> StateSpace:
    """Stamp netlists of one topology.

    Raises InputError when the topologies differ, SolveError when a circuit has no state space of this kind: a loop of
    capacitors and voltage sources, a cut set of inductors and current sources, or a node that hangs in the air.
    """
    first = netlists[0]
    if any(netlist.topology != first.topology for netlist in netlists):
        raise InputError("netlists solved together must share one topology")
    stamp = _Stamp(first)
    values: Array = np.array([netlist.values for netlist in netlists], dtype=np.float64)
    matrix, right = stamp.fill(values)
    try:
        solution: Array = np.asarray(refined_solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        solution = np.full_like(right, np.nan)
    if not np.isfinite(solution).all():
        raise SolveError(
            f"the exact engine cannot solve '{first.title}': a loop of capacitors and sources, a cut of inductors, or "
            "an unconnected node; use the ngspice engine"
        )
    solution = np.append(solution, np.zeros_like(solution[:, :1]), axis=1)  # ground
    rates = stamp.rates(solution, values)
    outputs = stamp.outputs(solution, netlists)
    s = stamp.states
    return StateSpace(
        rates[..., :s], rates[..., s:], outputs[..., :s], outputs[..., s:], tuple(o.name for o in first.outputs)
    )


def refined_solve(matrix: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Solve linear equations with two refinements, so that nanovolts beside kilovolts stay accurate (Skeel 1980)."""
    solution = np.linalg.solve(matrix, right)
    for _ in range(2):
        solution = solution - np.linalg.solve(matrix, matrix @ solution - right)
    return np.asarray(solution)


class _Stamp:
    """Index maps of one topology; everything that depends on values is vectorised over the leading axis."""

    def __init__(self, netlist: Netlist) -> None:
        self.elements = netlist.elements
        self.drives = {name.lower(): k for k, name in enumerate((netlist.drive, *netlist.further))}
        nodes = dict.fromkeys(n for e in netlist.elements for n in e.nodes if n != GROUND)
        self.node = {name: k for k, name in enumerate(nodes)}
        self.node[GROUND] = -1  # the last row, which is left out in the end
        branches = [e for e in netlist.elements if e.kind in _BRANCH_KINDS]
        self.branch = {e.name.lower(): len(nodes) + k for k, e in enumerate(branches)}
        self.dynamic = [k for k, e in enumerate(netlist.elements) if e.kind in "CL"]
        self.state = {netlist.elements[k].name.lower(): i for i, k in enumerate(self.dynamic)}
        self.states = len(self.dynamic)
        self.size = len(nodes) + len(self.branch)

    def fill(self, values: Array) -> tuple[Array, Array]:
        """Return the MNA matrix (n, size, size) and right-hand sides (n, size, states + drives + 1)."""
        matrix = np.zeros((len(values), self.size + 1, self.size + 1))
        constant = self.states + len(self.drives)
        right = np.zeros((len(values), self.size + 1, constant + 1))
        for k, element in enumerate(self.elements):
            value, nodes = values[:, k], [self.node[n] for n in element.nodes]
            plus, minus = nodes[:2]
            name = element.name.lower()
            match element.kind:
                case "R":
                    _transconductance(matrix, nodes + nodes, 1 / value)
                case "G":
                    _transconductance(matrix, nodes, value)
                case "I" | "L":
                    column, current = (constant, value) if element.kind == "I" else (self.state[name], 1.0)
                    right[:, plus, column] -= current
                    right[:, minus, column] += current
                case "F":
                    matrix[:, plus, self.branch[element.control.lower()]] += value
                    matrix[:, minus, self.branch[element.control.lower()]] -= value
                case _:
                    row = self.branch[name]
                    for node, sign in ((plus, 1.0), (minus, -1.0)):
                        matrix[:, node, row] += sign
                        matrix[:, row, node] += sign
                    if element.kind == "C":
                        right[:, row, self.state[name]] = 1.0
                    elif element.kind == "V" and name in self.drives:
                        right[:, row, self.states + self.drives[name]] = 1.0
                    elif element.kind == "V":
                        right[:, row, constant] = value
                    elif element.kind == "E":
                        matrix[:, row, nodes[2]] -= value
                        matrix[:, row, nodes[3]] += value
                    else:  # H
                        matrix[:, row, self.branch[element.control.lower()]] -= value
        return matrix[:, :-1, :-1], right[:, :-1]

    def rates(self, solution: Array, values: Array) -> Array:
        """Return the rows of [A B]: i_C/C and v_L/L."""
        rows = []
        for k in self.dynamic:
            element = self.elements[k]
            if element.kind == "C":
                driving = solution[:, self.branch[element.name.lower()]]
            else:
                plus, minus = (self.node[n] for n in element.nodes)
                driving = solution[:, plus] - solution[:, minus]
            rows.append(driving / values[:, k, None])
        return np.stack(rows, axis=1) if rows else np.zeros((len(values), 0, solution.shape[2]))

    def outputs(self, solution: Array, netlists: Sequence[Netlist]) -> Array:
        """Return the rows of [C D], one an output."""
        quantities = {q: self._quantity(solution, q) for q in netlists[0].quantities}
        rows = []
        for k, output in enumerate(netlists[0].outputs):
            coefficients = np.array([[c for _, c in n.outputs[k].terms] for n in netlists])
            row = np.zeros((len(netlists), solution.shape[2]))
            for j, (q, _) in enumerate(output.terms):
                row += coefficients[:, j, None] * quantities[q]
            rows.append(row)
        return np.stack(rows, axis=1)

    def _quantity(self, solution: Array, quantity: str) -> Array:
        kind, name = quantity[0], quantity[2:-1]
        if kind == "v":
            return solution[:, self.node[name]]
        if name.lower() in self.branch:
            return solution[:, self.branch[name.lower()]]
        current = np.zeros_like(solution[:, 0])  # an inductor's current is a state
        current[:, self.state[name.lower()]] = 1.0
        return current


def _transconductance(matrix: Array, nodes: list[int], value: Array) -> None:
    """Return the current value (v_c+ - v_c-) from plus to minus; a resistor controls itself."""
    plus, minus, control_plus, control_minus = nodes
    for row, sign in ((plus, 1.0), (minus, -1.0)):
        matrix[:, row, control_plus] += sign * value
        matrix[:, row, control_minus] -= sign * value
