"""Solves a nonlinear port's equations by collocation at all times at once, with derivatives by its parameters.

In every step the states are cubics that fulfil the equations at three points, the last of which is the step's end
(Radau IIA, order 5; Hairer and Wanner 1996, section IV.5): where states decay the equations have one solution, however
fast they do. Newton's method solves all steps together: each of its steps is one banded system or, where states do not
depend on each other, one recursion per state; the last gives the derivatives too. A step is split where its cubic
misses the equations at its beginning. This is much faster than an engine that goes from step to step, and approximates
as it does: an engine judges what a fit makes of it. The cubics give the states at any time, so that there are as many
steps as the states need, however many samples are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import ON_EDGE, PiecewiseLinear
from ..errors import SolveError
from ..strip.port import Port
from .collocation_mesh import POINTS, UNSOLVED, Mesh
from .modes import recursion
from .port_equations import PortEquations
from .waves import jumps_until

#: What a cubic may miss over a step, relative to the largest state: a current may be a small difference of these.
_ACCURACY = 2e-7
#: Change of the states, relative to the largest, at which Newton's method has converged: its square is left. The same
#: as long as steps are split; the largest number of its steps.
_CONVERGED, _ROUGHLY, _MOST_STEPS = 1e-6, 1e-2, 20
#: Rounds of splitting and of the last convergence; largest number of parts of a step in each.
_ROUNDS, _MOST_PARTS = 16, 8
#: Largest factor between rates of two ports of which one begins on the other's mesh.
_SIMILAR = 1.5
#: Steps in the first window of time where Newton's method does not converge for all of them; largest number of windows.
_WINDOW, _MOST_WINDOWS = 32, 300
#: Steps after a jump of the drive, in the shortest time constant, before any are split.
_FIRST = np.concatenate([[0.0], 0.2 * 2.0 ** np.arange(6)])
#: Radau IIA: the weights of the rates at the points of a step for each of them.
_ROOT = np.sqrt(6.0)
_WEIGHTS = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)
#: Coefficients (3, 3) of t, t^2, t^3 of the cubics that are zero where a step begins and 1 at one of its points.
_CUBICS = np.linalg.inv(POINTS[:, None] ** np.arange(1, 4))
#: Where in a step the equations are looked at again, and a polynomial there that is zero at its points and 1 where it
#: begins, to which what its cubic misses is in proportion.
_CHECKS = np.array([0.0, 0.4])
_BETWEEN = np.prod(1 - _CHECKS[:, None] / POINTS, axis=1)


def _cofactors() -> Array:
    """Return the coefficients (10, 8) of the cofactors and of the determinant of 1 - weights diag(a), see `_products`.

    They are linear in each of the three a, so that their values where these are 0 or 1 determine them.
    """
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    matrices = np.eye(3) - _WEIGHTS * corners[:, None]
    sizes = np.linalg.det(matrices)
    values = np.column_stack([(sizes[:, None, None] * np.linalg.inv(matrices)).reshape(8, 9), sizes])
    return np.linalg.solve(_products(corners.T).T, values).T


def _products(a: Array) -> Array:
    """Return the products (8, ...) of all subsets of three factors ``a`` (3, ...)."""
    one, two, three = a
    return np.stack([np.ones_like(one), one, two, three, two * three, one * three, one * two, one * two * three])


_COFACTORS = _cofactors()


@dataclass(frozen=True)
class _Solution:
    """The states of ``equations`` on a ``mesh``: the ``start`` (m,), and ``states`` (3, m, n) at its steps' points.

    The start of derivatives by p parameters is (p, m), their states are (3, p, m, n).
    """

    equations: PortEquations
    mesh: Mesh
    start: Array
    states: Array

    @property
    def before(self) -> Array:
        """The states (m, n) where the steps begin."""
        return np.concatenate([self.start[..., None], self.states[-1, ..., :-1]], axis=-1)

    def at(self, t: Array, jumps: Array | None = None) -> Array:
        """Return the states (m, samples) at ``t`` [s]; where steps begin they may have jumped by ``jumps`` (m, n)."""
        steps = np.maximum(np.searchsorted(self.mesh.nodes, t) - 1, 0)
        along = (t - self.mesh.nodes[steps]) / self.mesh.steps[steps]
        parts = _CUBICS.T @ along ** np.arange(1, 4)[:, None]
        before = self.before if jumps is None else self.before + jumps
        found = (1 - parts.sum(axis=0)) * before[..., steps]
        for part, states in zip(parts, self.states, strict=True):
            found += part * states[..., steps]
        return np.asarray(found)

    def missed(self) -> tuple[Array, Array]:
        """Return what the equations miss at the points (3, m, n), and the derivatives of the rates, see `rates`."""
        rates, slopes = self.equations.rates(self.mesh.source, self.states)
        return self.states - self.before - self.mesh.steps * _weighted(rates), slopes

    def changed(self, slopes: Array, right: Array) -> Array:
        """Return the changes (3, p, m, n) of the states that make up for ``right`` (3, p, m, n).

        ``slopes`` (3, m, m, n) are those of the rates, (3, m, n) where each depends on its own state alone.
        """
        return self._each(slopes, right) if slopes.ndim == 3 else self._banded(slopes, right)

    def _each(self, slopes: Array, right: Array) -> Array:
        """Return what `changed` does of states that do not depend on each other.

        The three equations of a step are solved by their cofactors, and its end follows from its begin.
        """
        *cofactors, size = np.tensordot(_COFACTORS, _products(self.mesh.steps * slopes), 1)
        inverse = np.reshape(cofactors, (3, 3, *size.shape)) / size
        found = np.stack([(row[:, None] * right).sum(axis=0) for row in inverse])
        kept = inverse.sum(axis=1)[:, None]  # of a change of the state where the step begins
        forth, gained = (np.ascontiguousarray(np.moveaxis(x[2], -1, 0)) for x in (kept, found))
        ends = recursion(forth, gained, np.zeros(1))
        found[..., 1:] += kept[..., 1:] * np.moveaxis(ends, 0, -1)[..., :-1]
        return found

    def _banded(self, slopes: Array, right: Array) -> Array:
        """Return what `changed` does of states that depend on each other."""
        from scipy.linalg import solve_banded

        _, columns, m, count = right.shape
        size = 3 * m
        # within a step (3, m) by (3, m)
        blocks = -np.einsum("n,ij,jabn->niajb", self.mesh.steps, _WEIGHTS, slopes)
        blocks = blocks.reshape(count, size, size) + np.eye(size)
        lower, upper = size + m - 1, size - 1
        bands = np.zeros((lower + upper + 1, count, size))
        for i in range(size):
            for j in range(size):
                bands[upper + i - j, :, j] = blocks[:, i, j]
            # and of the state before it
            earlier = size - m + i % m
            bands[upper + size + i - earlier, :, earlier] = -1.0
        given = right.transpose(3, 0, 2, 1).reshape(count * size, columns)
        found = solve_banded((lower, upper), bands.reshape(-1, count * size), given, check_finite=False)
        return np.asarray(found.reshape(count, 3, m, columns).transpose(1, 3, 2, 0))

    def split(self, drive: PiecewiseLinear, parts: NDArray[np.intp]) -> _Solution:
        """Return a guess with every step in so many equal parts (n,), on lines between what is known."""
        mesh = self.mesh.split(drive, parts)
        known = np.append(0.0, self.mesh.points.T.ravel())
        states = np.column_stack([self.start, self.states.transpose(1, 2, 0).reshape(len(self.start), -1)])
        return replace(self, mesh=mesh, states=np.stack([np.interp(mesh.points, known, row) for row in states], axis=1))

    def parts(self) -> NDArray[np.intp]:
        """Return the number of parts (n,) into which each step is to be split."""
        powers, mesh, changes = np.arange(1, 4), self.mesh, self.states - self.before
        there = self.before + np.tensordot(_CHECKS[:, None] ** powers @ _CUBICS, changes, 1)
        rise = np.tensordot(powers * _CHECKS[:, None] ** (powers - 1) @ _CUBICS, changes, 1)
        rates = self.equations.rates(mesh.left + _CHECKS[:, None] * (mesh.right - mesh.left), there)[0]
        off = np.abs((rise - mesh.steps * rates) / _BETWEEN[:, None, None]).max(axis=(0, 1))
        size = np.abs(self.states).max(initial=1e-300)
        return np.clip(np.ceil((off / (_ACCURACY * size)) ** 0.25), 1, _MOST_PARTS).astype(np.intp)


class Nearby:
    """Holds the last solution under one drive up to one time, beside which that of a similar port is sought.

    A fit asks for similar ports again and again. Answers agree with those without it as far as these are accurate.
    """

    def __init__(self) -> None:
        self._rates = np.zeros(0)
        self._found: _Solution | None = None

    def guess(self, equations: PortEquations, start: Array) -> _Solution | None:
        """Return a guess of the solution from ``start`` (m,), None if there is none of a port that is similar."""
        if self._found is None or not (np.abs(np.log(equations.own / self._rates)) < np.log(_SIMILAR)).all():
            return None
        return _Solution(equations, self._found.mesh, start, self._found.states)

    def keep(self, found: _Solution, *, anew: bool) -> None:
        """Keep a solution, on a mesh of its own if it was found ``anew``."""
        self._found = found
        if anew:
            self._rates = found.equations.own


def _weighted(rates: Array) -> Array:
    """Return the sums over the points of a step (3, ...) that move a state to each of them."""
    return np.tensordot(_WEIGHTS, rates, 1)


def answers(
    ports: Sequence[Port],
    drive: PiecewiseLinear,
    t: Array,
    *,
    by_current: bool = False,
    nearby: Nearby | None = None,
) -> Array:
    """Return the currents [A] (ports, samples) into ``ports`` at ``t`` >= 0 [s]; ``by_current`` the voltages [V].

    Ports of R-C branches start at rest under the drive's level, without charge where that is a current. A row is nan
    where the equations cannot be solved. They are sought beside the solution that is ``nearby``.
    """
    found = np.full((len(ports), len(t)), np.nan)
    for row, port in zip(found, ports, strict=True):
        equations = PortEquations(port, by_current)
        with suppress(SolveError):
            row[:] = equations.answer(drive.value(t), _solved(equations, drive, t, nearby or Nearby()).at(t))[0]
    return found


def answer_slopes(
    ports: Sequence[Port],
    drive: PiecewiseLinear,
    t: Array,
    step: float,
    *,
    by_current: bool = False,
    nearby: Nearby | None = None,
) -> tuple[Array, Array]:
    """Return the answer (samples,) of one port and its derivatives (samples, p) by logarithms of its parameters.

    ``ports`` (2 p + 1) are it, those with one parameter larger by a ``step`` of its logarithm, those with one smaller.
    It is sought beside the solution that is ``nearby``. Raises SolveError where the equations cannot be solved.
    """
    base, *others = (PortEquations(port, by_current) for port in ports)
    solution = _solved(base, drive, t, nearby or Nearby())

    def differences(of: Callable[[PortEquations, Array, Array], Array], source: Array, x: Array) -> Array:
        w = base.voltages(x)[0]  # most parameters leave the law as it is
        return _by_step([of(e, source, w if e.law == base.law else e.voltages(x)[0]) for e in others], step)

    rates = differences(PortEquations.moving, solution.mesh.source, solution.states)
    right = solution.mesh.steps * _weighted(rates.swapaxes(0, 1))
    first = _by_step([e.rest(drive.rest) for e in others], step)
    right[..., 0] += first
    moved = replace(solution, start=first, states=solution.changed(solution.missed()[1], right)).at(t)
    source, x = drive.value(t), solution.at(t)
    found, by_state = base.answer(source, x)
    return found, (differences(PortEquations.read, source, x) + (by_state * moved).sum(axis=1)).T


def jump_slopes(
    port: Port, drive: PiecewiseLinear, t: Array, *, by_current: bool = False, nearby: Nearby | None = None
) -> Array:
    """Return derivatives [1/s] (samples, j) of a port's answer by the times of the onset and of the ``drive``'s jumps.

    Between jumps up to the last of ``t`` (samples,) the drive must be constant. A jump that comes later moves the
    states from there on by what it adds to their rates. Raises SolveError as `answer_slopes`.
    """
    equations = PortEquations(port, by_current)
    solution = _solved(equations, drive, t, nearby or Nearby())
    jumps = jumps_until(drive, float(t[-1]))
    after, x = drive.value(jumps), solution.at(jumps)
    moved = equations.rates(np.append(drive.rest, after[:-1]), x)[0] - equations.rates(after, x)[0]
    if by_current:  # without charge before the onset, at rest
        moved[:, 0] = -equations.rates(after, x)[0][:, 0]
    steps = np.searchsorted(solution.mesh.nodes, jumps)
    inside = np.flatnonzero(steps < len(solution.mesh.steps))
    begins = np.zeros((len(jumps), *solution.states.shape[1:]))
    begins[inside, :, steps[inside]] = moved.T[inside]
    still = np.zeros((len(jumps), len(x)))
    changes = solution.changed(solution.missed()[1], np.tile(begins, (3, 1, 1, 1)))
    states = replace(solution, start=still, states=changes).at(t, begins)
    j, k = np.nonzero(np.abs(jumps[:, None] - t) <= ON_EDGE * t)  # samples on a jump come behind it
    states[j, :, k] = moved.T[j]
    by_state = equations.answer(drive.value(t), solution.at(t))[1]
    return np.asarray((by_state * states).sum(axis=1).T)


def _by_step(found: list[Array], step: float) -> Array:
    """Return derivatives (p, ...) of what was ``found`` (2 p,) with one parameter larger, or smaller, by a ``step``."""
    larger, smaller = np.split(np.array(found), 2)
    return np.asarray((larger - smaller) / (2 * step))


def _solved(equations: PortEquations, drive: PiecewiseLinear, t: Array, nearby: Nearby) -> _Solution:
    """Return the solution up to the last of ``t`` (samples,), and keep it ``nearby``."""
    most = max(drive.largest(), abs(drive.rest))
    law = equations.law
    if law is not None and not equations.by_current and most >= law.largest:
        raise SolveError(f"{most:.4g} V are reached, and the charge rises only up to {law.largest:.4g} V")
    start, bound = equations.rest(drive.rest), equations.bound(most)
    guess = nearby.guess(equations, start)
    if guess is not None:
        solution = _split(guess, drive, bound, _CONVERGED)
    else:
        end = float(t.max())
        jumps = np.append(0.0, drive.jumps(end))
        close = (jumps[:, None] + _FIRST / equations.own.max()).ravel()
        nodes = np.unique(np.concatenate([[0.0], drive.breakpoints(end), close[close < end], [end]]))
        mesh = Mesh.of(drive, nodes)
        solution = _split(_Solution(equations, mesh, start, _standing(start, mesh)), drive, bound, _ROUGHLY)
    nearby.keep(solution, anew=guess is None)
    return solution


def _split(guess: _Solution, drive: PiecewiseLinear, bound: float, converged: float) -> _Solution:
    """Return the solution from a ``guess`` on its mesh, whose steps are split where they are too long.

    Before the last split it may be ``converged`` less than that.
    """
    for _ in range(_ROUNDS):
        found = _newton(guess, bound, converged)
        solution = _in_windows(guess.equations, drive, guess.mesh, guess.start, bound) if found is None else found
        parts = solution.parts()
        if not (parts == 1).all():
            guess = solution.split(drive, parts)
        elif converged == _CONVERGED or found is None:
            return solution
        else:
            guess, converged = solution, _CONVERGED
    raise SolveError(UNSOLVED)


def _standing(state: Array, mesh: Mesh) -> Array:
    """Return a guess (3, m, n) of states that stay what they are (m,)."""
    return np.tile(state[:, None], (3, 1, len(mesh.steps)))


def _newton(guess: _Solution, bound: float, converged: float = _CONVERGED) -> _Solution | None:
    """Return the solution from a guess, None where Newton's method does not converge."""
    for _ in range(_MOST_STEPS):
        with np.errstate(all="ignore"):
            missed, slopes = guess.missed()
            change = guess.changed(slopes, -missed[:, None])[:, 0]
        if not np.isfinite(change).all():
            return None
        states = np.clip(guess.states + change, -bound, bound)
        moved = np.abs(states - guess.states).max()
        guess = replace(guess, states=states)
        if moved <= converged * max(np.abs(states).max(), np.abs(guess.start).max(), 1e-300):
            return guess
    return None


def _in_windows(equations: PortEquations, drive: PiecewiseLinear, mesh: Mesh, start: Array, bound: float) -> _Solution:
    """Return the solution by one window of time after the other, as long as Newton's method converges in each.

    A single step where it does not is split. Raises SolveError for too many windows.
    """
    states, first, width, before = [], 0, _WINDOW, start
    for _ in range(_MOST_WINDOWS):
        window = Mesh.of(drive, mesh.nodes[first : first + width + 1])
        guess = _standing(before, window)
        found = _newton(_Solution(equations, window, before, guess), bound)
        if found is not None:
            states.append(found.states)
            before, first, width = found.states[-1, :, -1], first + len(window.steps), 2 * width
            if first == len(mesh.steps):
                return _Solution(equations, mesh, start, np.concatenate(states, axis=-1))
        elif width > 1:
            width = max(width // 4, 1)
        else:
            parts = np.ones(len(mesh.steps), dtype=np.intp)
            parts[first] = _MOST_PARTS
            mesh = mesh.split(drive, parts)
    raise SolveError(UNSOLVED)
