"""Solves a nonlinear port's equations by collocation at all times at once, with derivatives by its parameters.

In every step the states are cubics that fulfil the equations at three points, the last of which is the step's end
(Radau IIA, order 5; Hairer and Wanner 1996, section IV.5): where states decay the equations have one solution, however
fast they do. Newton's method solves all steps together: each of its steps is one banded system or, where states do not
depend on each other, one recursion per state; the last gives the derivatives too. A step is split where its cubic
misses the equations at its beginning. This is much faster than an engine that goes from step to step, and approximates
as it does: an engine judges what a fit makes of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..strip.port import Port
from .modes import recursion

#: What a cubic may miss over a step, relative to the largest state.
_ACCURACY = 2e-6
#: Change of the states, relative to the largest, at which Newton's method has converged: its square is left. The same
#: as long as steps are split; the largest number of its steps.
_CONVERGED, _ROUGHLY, _MOST_STEPS = 1e-6, 1e-3, 20
#: Rounds of splitting and of the last convergence; largest number of parts of a step in each; largest number of steps.
_ROUNDS, _MOST_PARTS, _MOST_NODES = 16, 8, 50_000
#: Steps in the first window of time where Newton's method does not converge for all of them; largest number of windows.
_WINDOW, _MOST_WINDOWS = 32, 300
_UNSOLVED = "the port's equations take more steps than are sensible: its values are out of all proportion"
#: Steps after a jump of the drive, in the shortest time constant, before any are split.
_FIRST = np.concatenate([[0.0], 0.2 * 2.0 ** np.arange(6)])
#: Radau IIA: the points of a step, and the weights of their rates for each of them.
_ROOT = np.sqrt(6.0)
_POINTS = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])
_WEIGHTS = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)
#: Weights of a step's points for the slope of the cubic through them at its beginning, in steps.
_SLOPES = np.linalg.inv(_POINTS[:, None] ** np.arange(1, 4))[0]
#: Iterations of Newton's method for the voltage across a sinh path, which converges from one side.
_MOST_INNER = 60


@dataclass(frozen=True)
class _Equations:
    """The equations of a port: states x (points, m) are its charges over their capacitances [V].

    With w the voltages of the charges and v the voltage across the ion path, x' = (v - w)/(R C), and the ions' current
    is the sum of (v - w)/R. By ``by_current`` the source is a current and the answer a voltage.
    """

    port: Port
    by_current: bool = False

    @cached_property
    def own(self) -> Array:
        """The rates 1/(R C) (m,) [1/s] of the branches near 0 V, behind no other resistance."""
        r, c = np.array(self.port.branches).T
        return np.asarray(1 / (r * c))

    @cached_property
    def conductances(self) -> Array:
        """The conductances 1/R (m,) [S] of the branches."""
        return np.array([1 / r for r, _ in self.port.branches])

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

    def bound(self, most: float) -> float:
        """Return the largest size of a state [V] under voltages up to ``most`` [V]; by current there is none."""
        law = self.port.charge_law
        if law is None or self.by_current:
            return np.inf
        return float(law.charge(most)) * (1 + 1e-12)

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
        g = self.conductances
        v, slope = self._across(source * (self.leads or 1.0) + w @ g, float(g.sum()))
        return v, g / slope[:, None]

    def rates(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return x' (points, m) [V/s] and its derivatives (points, m, m) [1/s] by x.

        Of branches straight across the source each state's derivative by itself alone (points, m).
        """
        w, bent = self.voltages(x)
        v, moved = self.inner(source, w)
        rates = (v[:, None] - w) * self.own
        if np.isinf(self.leads):
            return rates, -self.own * bent
        slopes = self.own[:, None] * (moved[:, None, :] - np.eye(len(self.own))) * bent[:, None, :]
        return rates, slopes

    def answer(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return the current [A] (points,), or by current the voltage [V], and its derivatives (points, m) by x."""
        w, bent = self.voltages(x)
        v, moved = self.inner(source, w)
        if self.by_current:
            return v + self.port.electrode_resistance * source, moved * bent
        found = self.port.electron_current(v) + (v[:, None] - w) @ self.conductances
        # behind leads the current is (source - v) leads
        return found, (-self.conductances if np.isinf(self.leads) else -self.leads * moved) * bent


@dataclass(frozen=True)
class _Mesh:
    """``nodes`` (n + 1,) [s] and the source where each of the n steps begins and ends, between which it is straight."""

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
        return np.diff(self.nodes)

    @cached_property
    def source(self) -> Array:
        """The source at the points of the steps (n, 3)."""
        return self.left[:, None] + _POINTS * (self.right - self.left)[:, None]

    @cached_property
    def points(self) -> Array:
        """The times [s] of the points of the steps (n, 3)."""
        times = self.nodes[:-1, None] + _POINTS * self.steps[:, None]
        times[:, -1] = self.nodes[1:]
        return times

    def split(self, drive: PiecewiseLinear, parts: NDArray[np.intp]) -> _Mesh:
        """Return the mesh with every step in so many equal parts (n,). Raises SolveError for too many of them."""
        if parts.sum() > _MOST_NODES:
            raise SolveError(_UNSOLVED)
        inner = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        begins = np.repeat(self.nodes[:-1], parts) + inner * np.repeat(self.steps / parts, parts)
        return _Mesh.of(drive, np.append(begins, self.nodes[-1]))


@dataclass(frozen=True)
class _Solution:
    """The states of ``equations`` on a ``mesh``: the ``start`` (m,), and ``states`` (n, 3, m) at its steps' points."""

    equations: _Equations
    mesh: _Mesh
    start: Array
    states: Array

    @property
    def before(self) -> Array:
        """The states (n, m) where the steps begin."""
        return np.concatenate([self.start[None], self.states[:-1, -1]])

    def at(self, t: Array) -> Array:
        """Return the states (samples, m) at nodes ``t`` [s]."""
        return np.concatenate([self.start[None], self.states[:, -1]])[np.searchsorted(self.mesh.nodes, t)]

    def missed(self, equations: _Equations) -> tuple[Array, Array]:
        """Return what ``equations`` miss at the points (n, 3, m), and the derivatives of the rates, see `rates`."""
        count, _, m = self.states.shape
        rates, slopes = equations.rates(self.mesh.source.ravel(), self.states.reshape(3 * count, m))
        made = np.einsum("ij,njm->nim", _WEIGHTS, rates.reshape(count, 3, m))
        missed = self.states - self.before[:, None] - self.mesh.steps[:, None, None] * made
        return missed, slopes.reshape(count, 3, *slopes.shape[1:])

    def changed(self, slopes: Array, right: Array) -> Array:
        """Return the changes (n, 3, m, p) of the states that make up for ``right`` (n, 3, m, p).

        ``slopes`` (n, 3, m, m) are those of the rates, (n, 3, m) where each depends on its own state alone.
        """
        return self._each(slopes, right) if slopes.ndim == 3 else self._banded(slopes, right)

    def _each(self, slopes: Array, right: Array) -> Array:
        """Return what `changed` does of states that do not depend on each other.

        The three equations of a step are solved by their cofactors, and its end follows from its begin.
        """
        along = np.ascontiguousarray(self.mesh.steps * slopes.transpose(1, 2, 0))  # times last: products run along them
        within = np.eye(3)[:, :, None, None] - _WEIGHTS[:, :, None, None] * along
        down, twice = within[[1, 2, 0]], within[[2, 0, 1]]
        cofactors = down[:, [1, 2, 0]] * twice[:, [2, 0, 1]] - down[:, [2, 0, 1]] * twice[:, [1, 2, 0]]
        cofactors /= (within[0] * cofactors[0]).sum(axis=0)
        given = np.ascontiguousarray(right.transpose(1, 3, 2, 0))
        found = cofactors[0, :, None] * given[0]
        for k in (1, 2):
            found += cofactors[k, :, None] * given[k]
        kept = cofactors.sum(axis=0)[:, None]  # of a change of the state where the step begins
        forth, gained = (np.ascontiguousarray(np.moveaxis(x, -1, 0)) for x in np.broadcast_arrays(kept[2], found[2]))
        ends = recursion(forth, gained, np.zeros(found.shape[1:3]))
        found[..., 1:] += kept[..., 1:] * np.moveaxis(ends, 0, -1)[..., :-1]
        return found.transpose(3, 0, 2, 1)

    def _banded(self, slopes: Array, right: Array) -> Array:
        """Return what `changed` does of states that depend on each other."""
        from scipy.linalg import solve_banded

        count, _, m, columns = right.shape
        size = 3 * m
        # within a step (3, m) by (3, m)
        blocks = -self.mesh.steps[:, None, None, None, None] * np.einsum("ij,njab->niajb", _WEIGHTS, slopes)
        blocks = blocks.reshape(count, size, size) + np.eye(size)
        lower, upper = size + m - 1, size - 1
        bands = np.zeros((lower + upper + 1, count, size))
        for i in range(size):
            for j in range(size):
                bands[upper + i - j, :, j] = blocks[:, i, j]
            # and of the state before it
            earlier = size - m + i % m
            bands[upper + size + i - earlier, :, earlier] = -1.0
        found = solve_banded(
            (lower, upper), bands.reshape(-1, count * size), right.reshape(count * size, columns), check_finite=False
        )
        return np.asarray(found.reshape(right.shape))

    def parts(self) -> NDArray[np.intp]:
        """Return the number of parts (n,) into which each step is to be split."""
        steps = self.mesh.steps[:, None]
        rise = np.einsum("j,njm->nm", _SLOPES, self.states - self.before[:, None])
        off = np.abs(rise - steps * self.equations.rates(self.mesh.left, self.before)[0]).max(axis=1)
        size = np.abs(self.states).max(initial=1e-300)
        return np.clip(np.ceil((off / (_ACCURACY * size)) ** 0.25), 1, _MOST_PARTS).astype(np.intp)


def answers(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, *, by_current: bool = False) -> Array:
    """Return the currents [A] (ports, samples) into ``ports`` at ``t`` >= 0 [s]; ``by_current`` the voltages [V].

    Ports of R-C branches start at rest under the drive's level, without charge where that is a current. A row is nan
    where the equations cannot be solved.
    """
    found = np.full((len(ports), len(t)), np.nan)
    for row, port in zip(found, ports, strict=True):
        equations = _Equations(port, by_current)
        with suppress(SolveError):
            row[:] = equations.answer(drive.value(t), _solved(equations, drive, t).at(t))[0]
    return found


def answer_slopes(
    ports: Sequence[Port], drive: PiecewiseLinear, t: Array, step: float, *, by_current: bool = False
) -> tuple[Array, Array]:
    """Return the answer (samples,) of one port and its derivatives (samples, p) by logarithms of its parameters.

    ``ports`` (2 p + 1) are it, those with one parameter larger by a ``step`` of its logarithm, those with one smaller.
    Raises SolveError where the equations cannot be solved.
    """
    base, *others = (_Equations(port, by_current) for port in ports)

    def differences(found: list[Array]) -> Array:
        larger, smaller = np.split(np.array(found), 2)
        return np.moveaxis((larger - smaller) / (2 * step), 0, -1)

    solution = _solved(base, drive, t)
    right = -differences([solution.missed(other)[0] for other in others])
    first = differences([other.rest(drive.rest) for other in others])
    right[0] += first
    moved = replace(solution, start=first, states=solution.changed(solution.missed(base)[1], right)).at(t)
    source, x = drive.value(t), solution.at(t)
    found, by_state = base.answer(source, x)
    direct = differences([other.answer(source, x)[0] for other in others])
    return found, direct + np.einsum("nm,nmp->np", by_state, moved)


def _solved(equations: _Equations, drive: PiecewiseLinear, t: Array) -> _Solution:
    """Return the solution on a mesh whose nodes hold ``t`` (samples,)."""
    end, most = float(t[-1]), max(drive.largest(), abs(drive.rest))
    law = equations.port.charge_law
    if law is not None and not equations.by_current and most >= law.largest:
        raise SolveError(f"{most:.4g} V are reached, and the charge rises only up to {law.largest:.4g} V")
    jumps = np.append(0.0, drive.jumps(end))
    close = (jumps[:, None] + _FIRST / equations.own.max()).ravel()
    nodes = np.unique(np.concatenate([[0.0], drive.breakpoints(end), close[close < end], t]))
    bound = equations.bound(most)
    start = equations.rest(drive.rest)
    mesh = _Mesh.of(drive, nodes)
    guess, converged = np.tile(start, (len(mesh.steps), 3, 1)), _ROUGHLY
    for _ in range(_ROUNDS):
        found = _newton(_Solution(equations, mesh, start, guess), bound, converged)
        solution = _in_windows(equations, drive, mesh, start, bound) if found is None else found
        parts = solution.parts()
        if (parts == 1).all():
            if converged == _CONVERGED or found is None:
                return solution
            mesh, guess, converged = solution.mesh, solution.states, _CONVERGED
            continue
        mesh = solution.mesh.split(drive, parts)
        known = np.append(0.0, solution.mesh.points.ravel())
        states = np.concatenate([start[None], solution.states.reshape(-1, len(start))])
        guess = np.stack([np.interp(mesh.points, known, column) for column in states.T], axis=-1)
    raise SolveError(_UNSOLVED)


def _newton(guess: _Solution, bound: float, converged: float = _CONVERGED) -> _Solution | None:
    """Return the solution from a guess, None where Newton's method does not converge."""
    for _ in range(_MOST_STEPS):
        with np.errstate(all="ignore"):
            missed, slopes = guess.missed(guess.equations)
            change = guess.changed(slopes, -missed[..., None])[..., 0]
        if not np.isfinite(change).all():
            return None
        states = np.clip(guess.states + change, -bound, bound)
        moved = np.abs(states - guess.states).max()
        guess = replace(guess, states=states)
        if moved <= converged * max(np.abs(states).max(), np.abs(guess.start).max(), 1e-300):
            return guess
    return None


def _in_windows(equations: _Equations, drive: PiecewiseLinear, mesh: _Mesh, start: Array, bound: float) -> _Solution:
    """Return the solution by one window of time after the other, as long as Newton's method converges in each.

    A single step where it does not is split. Raises SolveError for too many windows.
    """
    states, first, width, before = [], 0, _WINDOW, start
    for _ in range(_MOST_WINDOWS):
        window = _Mesh.of(drive, mesh.nodes[first : first + width + 1])
        guess = np.tile(before, (len(window.steps), 3, 1))
        found = _newton(_Solution(equations, window, before, guess), bound)
        if found is not None:
            states.append(found.states)
            before, first, width = found.states[-1, -1], first + len(window.steps), 2 * width
            if first == len(mesh.steps):
                return _Solution(equations, mesh, start, np.concatenate(states))
        elif width > 1:
            width = max(width // 4, 1)
        else:
            parts = np.ones(len(mesh.steps), dtype=np.intp)
            parts[first] = _MOST_PARTS
            mesh = mesh.split(drive, parts)
    raise SolveError(_UNSOLVED)
