"""Solves a nonlinear port's equations by collocation at all times at once, with derivatives by its parameters.

Between neighbouring nodes the states are cubics that fulfil the equations at both nodes and halfway (Lobatto IIIA,
order 4; Hairer and Wanner 1996, section IV.5). Newton's method solves all of them together: each of its steps is one
banded system, and the last one also gives the derivatives. Steps are split where a cubic misses the equations between
its nodes (Kierzenka and Shampine 2001). This is much faster than an engine that goes from step to step, and as
approximate: an engine judges what a fit makes of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..strip.port import Port

#: Error of a step, relative to the largest state, up to which it is not split.
_ACCURACY = 1e-6
#: Change of the states, relative to the largest, at which Newton's method has converged; most of its steps.
_CONVERGED, _MOST_STEPS = 1e-9, 60
#: Rounds of splitting; largest number of parts of a step in each; largest number of nodes.
_ROUNDS, _MOST_PARTS, _MOST_NODES = 8, 8, 200_000
#: Steps after a jump of the drive, in the shortest time constant, before any are split.
_FIRST = np.concatenate([[0.0], 0.1 * 1.6 ** np.arange(9)])
#: Points between two nodes at which cubics are checked, in steps: those of a quadrature by Lobatto.
_CHECKED = (0.5 - np.sqrt(21) / 14, 0.5 + np.sqrt(21) / 14)
#: Iterations of Newton's method for the voltage across a sinh path, which converges from one side.
_MOST_INNER = 60


@dataclass(frozen=True)
class _Equations:
    """The equations of a port: states x (points, m) are its charges over their capacitances [V].

    With w the voltages of the charges and v the voltage across the ion path, x' = matrix w + driven v, and the current
    of the ions is currents w + conductance v. By ``by_current`` the source is a current and the answer a voltage.
    """

    port: Port
    by_current: bool = False

    @cached_property
    def linear(self) -> tuple[Array, Array, Array, float]:
        """``matrix`` (m, m) [1/s], ``driven`` (m,) [1/s], ``currents`` (m,) [S] and ``conductance`` [S]."""
        r, c = np.array(self.port.branches).T
        return np.diag(-1 / (r * c)), 1 / (r * c), -1 / r, float((1 / r).sum())

    @cached_property
    def leads(self) -> float:
        """Conductance [S] between the source and the ion path; infinite where the source lies across it."""
        if self.by_current:
            return 0.0
        return 1 / self.port.electrode_resistance if self.port.electrode_resistance else np.inf

    def rest(self, level: float) -> Array:
        """Return the states (m,) at rest under a ``level`` of the voltage, or without charge."""
        law, inner = self.port.charge_law, 0.0 if self.by_current else self.port.inner_voltage(level)
        return np.full(len(self.port.branches), inner if law is None else float(law.charge(inner)))

    def bounds(self, most: float) -> float:
        """Return the largest size of a state [V] under voltages up to ``most`` [V]."""
        law = self.port.charge_law
        if law is None:
            return np.inf
        return float(law.charge(min(most, law.largest * (1 - 1e-9)))) * (1 + 1e-12)

    def fastest(self, most: float) -> float:
        """Return the fastest rate [1/s] near 0 V or under ``most`` [V]."""
        matrix, driven, currents, conductance = self.linear
        if not np.isinf(self.leads):
            matrix = matrix - np.outer(driven, currents) / (conductance + self.leads + 1 / self.port.dc_resistance)
        return float(np.abs(np.linalg.eigvals(matrix)).max())

    def voltages(self, x: Array) -> tuple[Array, Array]:
        """Return the voltages w [V] of states and their derivatives, of any shape."""
        law = self.port.charge_law
        if law is None:
            return x, np.ones_like(x)
        w = law.voltage(x)
        return w, 1 / np.maximum(law.slope(w), 1e-12)

    def _across(self, driven: Array, conductance: float) -> tuple[Array, Array]:
        """Return v [V] with i(v) + (conductance + leads) v = ``driven`` [A], i the electrons', and that slope [S]."""
        total, port = conductance + self.leads, self.port
        if port.emission_voltage is None:
            slope = total + 1 / port.dc_resistance
            return driven / slope, np.full(len(driven), slope)
        small, scale = port.saturation_current, port.emission_voltage
        size = np.abs(driven)
        v = scale * np.arcsinh(size / small)
        if total:
            v = np.minimum(v, size / total)
        for _ in range(_MOST_INNER):
            # convex, and from above: it falls to the root
            step = (small * np.sinh(v / scale) + total * v - size) / (small / scale * np.cosh(v / scale) + total)
            v = v - step
            if (np.abs(step) <= 1e-14 * v).all():
                break
        return np.copysign(v, driven), small / scale * np.cosh(v / scale) + total

    def inner(self, source: Array, w: Array) -> tuple[Array, Array]:
        """Return the voltage v (points,) across the ion path, and its derivatives (points, m) by w."""
        if np.isinf(self.leads):
            return source, np.zeros_like(w)
        _, _, currents, conductance = self.linear
        v, slope = self._across(source * (self.leads or 1.0) - w @ currents, conductance)
        return v, -currents / slope[:, None]

    def rates(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return x' (points, m) [V/s] and its derivatives (points, m, m) [1/s] by x."""
        matrix, driven, _, _ = self.linear
        w, bent = self.voltages(x)
        v, moved = self.inner(source, w)
        slopes = (matrix + driven[:, None] * moved[:, None, :]) * bent[:, None, :]
        return w @ matrix.T + v[:, None] * driven, slopes

    def answer(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return the current [A] (points,), or by current the voltage [V], and its derivatives (points, m) by x."""
        _, _, currents, conductance = self.linear
        w, bent = self.voltages(x)
        v, moved = self.inner(source, w)
        if self.by_current:
            return v + self.port.electrode_resistance * source, moved * bent
        found = self.port.electron_current(v) + w @ currents + conductance * v
        if np.isinf(self.leads):
            return found, currents * bent
        return found, -self.leads * moved * bent


@dataclass(frozen=True)
class _Mesh:
    """``nodes`` (n + 1,) [s] and the source on each of n steps: where it begins, ends, and its middle is the mean."""

    nodes: Array
    left: Array
    right: Array

    @classmethod
    def of(cls, drive: PiecewiseLinear, nodes: Array) -> _Mesh:
        left = drive.value(nodes[:-1])
        middle = drive.value((nodes[:-1] + nodes[1:]) / 2)
        return cls(nodes, left, 2 * middle - left)

    @cached_property
    def steps(self) -> Array:
        return np.diff(self.nodes)[:, None]

    def source(self, part: float) -> Array:
        return self.left + part * (self.right - self.left)


def answers(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, *, by_current: bool = False) -> Array:
    """Return the currents [A] (ports, samples) into ``ports`` at ``t`` >= 0 [s]; ``by_current`` the voltages [V].

    Ports of R-C branches start at rest under the drive's level, without charge where that is a current. A row is nan
    where the equations cannot be solved.
    """
    found = np.full((len(ports), len(t)), np.nan)
    for row, port in zip(found, ports, strict=True):
        equations = _Equations(port, by_current)
        with suppress(SolveError):
            mesh, x = _solved(equations, drive, t)
            row[:] = equations.answer(drive.value(t), x[np.searchsorted(mesh.nodes, t)])[0]
    return found


def answer_slopes(
    ports: Sequence[Port], drive: PiecewiseLinear, t: Array, step: float, *, by_current: bool = False
) -> tuple[Array, Array]:
    """Return the answer (samples,) of one port and its derivatives (samples, p) by logarithms of its parameters.

    ``ports`` (2 p + 1) are it, those with one parameter larger by a ``step`` of its logarithm, those with one smaller.
    Raises SolveError where the equations cannot be solved.
    """
    base, *others = (_Equations(port, by_current) for port in ports)
    count = len(others) // 2
    mesh, x = _solved(base, drive, t)
    missed, before, after = _missed(base, mesh, x)
    starts = np.array([each.rest(drive.rest) for each in others])
    first = (starts[:count] - starts[count:]) / (2 * step)
    each = [_missed(other, mesh, x)[0] for other in others]
    right = np.stack([(each[j] - each[count + j]) / (2 * step) for j in range(count)], axis=-1)
    right[0] += before[0] @ first.T
    moved = np.concatenate([first.T[None], _substituted(before, after, -right)])
    at, source = np.searchsorted(mesh.nodes, t), drive.value(t)
    found, by_state = base.answer(source, x[at])
    direct = [other.answer(source, x[at])[0] for other in others]
    slopes = np.stack([(direct[j] - direct[count + j]) / (2 * step) for j in range(count)], axis=-1)
    return found, slopes + np.einsum("nm,nmp->np", by_state, moved[at])


def _solved(equations: _Equations, drive: PiecewiseLinear, t: Array) -> tuple[_Mesh, Array]:
    """Return a mesh whose nodes hold ``t`` (samples,), and the states (nodes, m) at them."""
    end = float(t[-1])
    most = drive.largest()
    edges = np.concatenate([[0.0], drive.breakpoints(end), [end]])
    jumps = np.append(0.0, drive.jumps(end))
    close = (jumps[:, None] + _FIRST / equations.fastest(most)).ravel()
    nodes = np.unique(np.concatenate([edges, t, close[close < end]]))
    start = equations.rest(drive.rest)
    bound = np.inf if equations.by_current else equations.bounds(max(most, abs(drive.rest)))
    x = np.tile(start, (len(nodes), 1))
    for _ in range(_ROUNDS):
        mesh = _Mesh.of(drive, nodes)
        x = _newton(equations, mesh, x, bound)
        parts = _parts(equations, mesh, x)
        if (parts == 1).all():
            return mesh, x
        counts = np.append(parts, 1)
        inner = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        finer = np.repeat(nodes, counts) + inner * np.repeat(np.append(np.diff(nodes) / parts, 0.0), counts)
        if len(finer) > _MOST_NODES:
            break
        x = np.stack([np.interp(finer, nodes, column) for column in x.T], axis=1)
        nodes = finer
    raise SolveError("the port's equations need more steps than are sensible; its values are out of all proportion")


def _missed(equations: _Equations, mesh: _Mesh, x: Array) -> tuple[Array, Array, Array]:
    """Return what the steps miss (n, m), and its derivatives (n, m, m) by the states before and after each."""
    h = mesh.steps
    f0, j0 = equations.rates(mesh.left, x[:-1])
    f1, j1 = equations.rates(mesh.right, x[1:])
    fm, jm = equations.rates(mesh.source(0.5), (x[:-1] + x[1:]) / 2 + h / 8 * (f0 - f1))
    h3, identity = h[:, :, None], np.eye(x.shape[1])
    before = -identity - h3 / 6 * (j0 + 4 * jm @ (identity / 2 + h3 / 8 * j0))
    after = identity - h3 / 6 * (j1 + 4 * jm @ (identity / 2 - h3 / 8 * j1))
    return x[1:] - x[:-1] - h / 6 * (f0 + 4 * fm + f1), before, after


def _substituted(before: Array, after: Array, right: Array) -> Array:
    """Return the changes (n, m, p) of the states behind the first that make up for ``right`` (n, m, p)."""
    from scipy.linalg import solve_banded

    count, m = right.shape[:2]
    lower, upper = 2 * m - 1, m - 1
    bands = np.zeros((lower + upper + 1, count * m))
    for i in range(m):
        for j in range(m):
            bands[upper + i - j, j::m] = after[:, i, j]
            bands[upper + m + i - j, j : (count - 1) * m : m] = before[1:, i, j]
    found = solve_banded((lower, upper), bands, right.reshape(count * m, -1), overwrite_ab=True, check_finite=False)
    return np.asarray(found.reshape(right.shape))


def _newton(equations: _Equations, mesh: _Mesh, x: Array, bound: float) -> Array:
    """Return the states (nodes, m) that fulfil the equations, from a guess whose first state holds."""
    for _ in range(_MOST_STEPS):
        with np.errstate(all="ignore"):
            missed, before, after = _missed(equations, mesh, x)
            change = _substituted(before, after, -missed[:, :, None])[:, :, 0]
        if not np.isfinite(change).all():
            break
        moved = np.clip(x[1:] + change, -bound, bound)
        size = np.abs(moved).max(initial=np.abs(x[0]).max(initial=1e-300))
        done = np.abs(moved - x[1:]).max() <= _CONVERGED * size
        x = np.concatenate([x[:1], moved])
        if done:
            return x
    raise SolveError("the port's equations could not be solved; its values are out of all proportion")


def _parts(equations: _Equations, mesh: _Mesh, x: Array) -> Array:
    """Return the number of parts (n,) into which each step is to be split."""
    h = mesh.steps
    f0, _ = equations.rates(mesh.left, x[:-1])
    f1, _ = equations.rates(mesh.right, x[1:])
    rise = (x[1:] - x[:-1]) / h
    worst = np.zeros(len(h))
    for s in _CHECKED:
        # Hermite's cubic and its slope
        at = x[:-1] + h * (s * f0 + s**2 * (3 * rise - 2 * f0 - f1) + s**3 * (f0 + f1 - 2 * rise))
        slope = f0 + 2 * s * (3 * rise - 2 * f0 - f1) + 3 * s**2 * (f0 + f1 - 2 * rise)
        off = slope - equations.rates(mesh.source(s), at)[0]
        worst = np.maximum(worst, np.abs(h * off).max(axis=1))
    size = np.abs(x).max(initial=1e-300)
    return np.clip(np.ceil((worst / (_ACCURACY * size)) ** 0.25), 1, _MOST_PARTS).astype(int)
