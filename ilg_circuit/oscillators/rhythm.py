"""Long-term behaviour of a network: a cycle, with period, amplitude and phases to rounding, or rest.

Simulation alone cannot decide: near the edge of a cycle's window a rest state is left, or reached, arbitrarily slowly.
So

- rest is proven: the motion is in the piece of a stable state of rest, and the sum of the sizes of its decaying modes
  keeps it there, so that the flow stays linear (for a piece whose eigenvectors are no basis: it is within an
  ellipsoid z' P z, A'P + P A = -I, inside the piece). Where the sum holds only for a while, as for a state of rest that
  is left slowly, the motion leaps over that time;
- a cycle is a solution of flow(z, T) = z, found by Newton's method with the exact derivative of the flow, that the
  motion has come close to and whose Floquet multipliers do not exceed one.
"""

from __future__ import annotations

from bisect import bisect
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray, Mask
from ..findings import Finding
from .flow import ORDER, Flow, Stretch
from .network import Network, checked_start
from .orbits import CONVERGED, NEAR, closed_orbit, propagated
from .outcome import MARGINAL, Cycle, Rhythm
from .rest import Ellipsoid, RestState, growth, rest_of_piece, rest_states, strong_components
from .symmetry import Quotient, quotient

#: Steps of the flow after which a motion that neither rests nor repeats is called irregular. They last at least the
#: second number times the sum of the time constants.
MOST_STEPS = 100_000
_MOST_STIFF_STEPS = 600_000
_TIME_CONSTANTS, _STEPS_PER_CONSTANT = 60, 8
#: Leaps are taken from this many steps on.
_LEAP = 2000
#: Eigenvectors with a larger condition number are no basis to rely on.
_BASIS = 1e7
#: Most steps of Newton's method, and most steps of its motions relative to those of the motion itself.
_NEWTON_STEPS, _NEWTON_SHARE = 10_000, 1
#: Steps between two looks at the motion.
_CHUNK = 16
#: Longest cycle looked for, in returns of one neuron.
_MOST_RETURNS = 24
#: A motion as slow as this, relative to its size and in rise times, has stopped.
_STOPPED = 1e-10


def rhythm(network: Network, start: ArrayLike | None = None) -> Rhythm:
    """Return the long-term behaviour of ``network`` from ``start`` (2 n,) = (x, v), by default the paper's.

    Raises InputError for a start of the wrong size, or a network whose outputs grow without bound.
    """
    state = checked_start(network, start)
    classes = quotient(network, state)
    small = _Follower(classes.network, classes.folded(state)).run()
    return small if classes.trivial else _unfolded(small, network, state, classes)


def _unfolded(small: Rhythm, network: Network, start: Array, classes: Quotient) -> Rhythm:
    """Return the result for the classes as one for the full network, its stability judged anew.

    With a finding where identical neurons stay identical only because nothing disturbs them.
    """
    members = [np.flatnonzero(classes.classes == c) + 1 for c in range(classes.network.size)]
    groups = [" = ".join(str(k) for k in g) for g in members if len(g) > 1]
    cycle, rest, cause, findings = small.cycle, None, small.cause, small.findings
    if cycle is not None:
        state = classes.unfolded(cycle.state)
        multiplier = _multiplier(network, propagated(Flow(network), state, cycle.period)[0])
        cycle = Cycle(network, state, cycle.period, multiplier)
        if not cycle.stable:
            findings += (Finding("cpg-unstable-cycle", values={"groups": groups, "multiplier": multiplier}),)
    if small.rest is not None:
        rest = classes.unfolded(small.rest)
        x = rest[: network.size]
        code = "cpg-silent" if cause.code == "cpg-died-out" else cause.code
        cause = Finding(code, values={**cause.values, "active": _active(x)})
        rate = growth(network, x > 0)
        if rate > 0:
            findings += (Finding("cpg-unstable-rest", values={"groups": groups, "rate": rate}),)
    full = replace(small, network=network, start=start, rest_states=rest_states(network), cause=cause)
    return replace(full, cycle=cycle, rest=rest, findings=findings)


def _active(x: Array) -> list[int] | str:
    """Return the numbers of the active neurons, counted from 1, or ``none``."""
    return [int(k) + 1 for k in np.flatnonzero(x > 0)] or "none"


class _Piece:
    """The rest of a piece and its linear flow: z = rest + sum_k c_k vectors[:, k] exp(rates[k] t).

    Without a basis of eigenvectors ``inverse`` is None, and ``ellipsoid`` holds what stays at a stable rest.
    """

    def __init__(self, a: Array, rest: RestState) -> None:
        self.rest = rest
        self.rates, self.vectors = (found.astype(complex) for found in np.linalg.eig(a))
        self.inverse: ComplexArray | None = None
        self.ellipsoid: Ellipsoid | None = None
        if np.linalg.cond(self.vectors) < _BASIS:
            self.inverse = np.linalg.inv(self.vectors)
        elif rest.stable:
            self.ellipsoid = Ellipsoid(a, np.eye(len(rest.x), len(a)), np.abs(rest.x))

    def stays(self, away: Array, step: float) -> float:
        """Return a lower bound [s], to a factor of 2, of the stay in the piece of a motion ``away`` (2 n,)."""
        if self.inverse is None:
            return np.inf if self.ellipsoid is not None and self.ellipsoid.holds(away) else 0.0
        n = len(self.rest.x)
        sizes = np.abs(self.vectors[:n] * (self.inverse @ away))
        room = np.abs(self.rest.x) * (1 - 1e-9)
        growth = self.rates.real

        def within(time: float) -> bool:  # convex in time, so what holds at both ends holds between
            with np.errstate(over="ignore", invalid="ignore"):
                return bool((sizes @ np.exp(growth * time) < room).all())

        if not within(0.0):
            return 0.0
        if self.rest.stable:
            return np.inf
        time = step
        while within(2 * time) and time < 1e12 * step:
            time *= 2
        return time if within(time) else 0.0

    def later(self, state: Array, time: float) -> Array:
        """Return the state (2 n,) of the linear flow after ``time`` [s]."""
        assert self.inverse is not None
        c = self.inverse @ (state - self.rest.state)
        return np.asarray(self.rest.state + (self.vectors @ (c * np.exp(self.rates * time))).real)


class _Follower:
    """One motion, followed until its outcome is known."""

    def __init__(self, network: Network, start: Array) -> None:
        self.network, self.start = network, start
        self.flow = Flow(network)
        self.rests = rest_states(network)
        self.returns: list[list[tuple[int, float, Array]]] = [[] for _ in range(network.size)]
        self.recent: deque[Stretch] = deque(maxlen=20_000)
        self.next_search = 0
        self.newton_steps = 0
        self.pieces: dict[bytes, _Piece | None] = {}

    def run(self) -> Rhythm:
        times = self.network.rise_time, self.network.adaptation_time
        stiff = _TIME_CONSTANTS * _STEPS_PER_CONSTANT * sum(times) / min(times)
        most = int(max(MOST_STEPS, min(stiff, _MOST_STIFF_STEPS)))
        time, state, count = 0.0, self.start, 0
        while count < most:
            for stretch in self.flow.stretches(state, np.inf, time):
                if count >= most:
                    break
                if count % _CHUNK == 0:
                    piece = self._piece(stretch.active)
                    stays = piece.stays(stretch.terms[0] - piece.rest.state, stretch.step) if piece else 0.0
                    found = self._resting(stretch, piece, stays) or self._cycling(stretch, count)
                    if found is not None:
                        return found
                    if piece and stays > _LEAP * stretch.step:
                        time, state, count = stretch.begin + stays, piece.later(stretch.terms[0], stays), count + _CHUNK
                        break
                self.recent.append(stretch)
                time, count = stretch.end, count + 1
                if stretch.switched >= 0 and not stretch.active[stretch.switched]:
                    self.returns[stretch.switched].append((count, time, stretch.states(stretch.length)[0]))
        return self._lost(time)

    def _ended(self, outcome: str, cause: Finding, time: float, swing: Array, **found: Any) -> Rhythm:
        """Return the rhythm found at ``time`` [s]."""
        return Rhythm(self.network, self.start, outcome, cause, self.rests, time, swing, **found)

    # -- rest ----------------------------------------------------------------------------------------------------------

    def _resting(self, stretch: Stretch, piece: _Piece | None, stays: float) -> Rhythm | None:
        """Return the rhythm of a motion that provably tends to rest, or that no eigenvalue can decide; else None."""
        state, still = stretch.terms[0], np.zeros(len(self.network.units))
        decayed = np.abs(state).max() <= _STOPPED * np.abs(self.start).max()
        if decayed and not self.network.tonics.any():  # the initial activity of a network without input
            return self._ended("rest", Finding("cpg-died-out"), stretch.begin, still, rest=np.zeros(len(state)))
        moving = float(np.abs(self.flow.rate(state)).max() * self.network.rise_time)
        stopped = moving <= _STOPPED * float(np.abs(state).max())
        if piece is None:  # no rest, or a line of them, on which the motion may stand still
            return self._ended("undecided", Finding("cpg-edge"), stretch.begin, still) if stopped else None
        rest = piece.rest
        ended = np.isinf(stays) if rest.stable else rest.growth <= 0 and stopped
        if ended:
            values = {"active": _active(rest.x), "decay": -rest.growth}
            cause = Finding("cpg-rests" if rest.stable else "cpg-rests-on-edge", values=values)
            return self._ended("rest", cause, stretch.begin, still, rest=rest.state)
        neutral = rest.marginal and stays > 1e9 * stretch.step
        if neutral or (rest.edge and stopped):
            return self._lost(stretch.begin, Finding("cpg-edge"))
        return None

    def _piece(self, active: Mask) -> _Piece | None:
        """Return the piece with just these neurons active, None if it has no rest of its own."""
        key = active.tobytes()
        if key not in self.pieces:
            rest = rest_of_piece(self.network, active)
            self.pieces[key] = None if rest is None else _Piece(self.flow.matrix(active), rest)
        return self.pieces[key]

    # -- cycles --------------------------------------------------------------------------------------------------------

    def _cycling(self, stretch: Stretch, count: int) -> Rhythm | None:
        """Return the rhythm of a motion that has come near to a cycle, else None."""
        cycle = self._cycle(count)
        if cycle is None:
            return None
        cause = Finding("cpg-cycle", values={"multiplier": cycle.multiplier})
        findings = (Finding("cpg-family"),) if abs(cycle.multiplier - 1) <= MARGINAL else ()
        return self._ended("cycle", cause, stretch.begin, cycle.amplitudes(), cycle=cycle, findings=findings)

    def _cycle(self, count: int) -> Cycle | None:
        """Return the cycle that the motion has come near to, if it has."""
        if count < self.next_search or self.newton_steps > _NEWTON_STEPS + _NEWTON_SHARE * count:
            return None
        late = []  # neurons that still switch, by how often they did in the latter half
        for k, r in enumerate(self.returns):
            if len(r) >= 3 and r[-1][0] >= count - max(count // 4, 4 * _CHUNK):
                late.append((len(r) - bisect(r, count // 2, key=lambda entry: entry[0]), k))
        late = [(number, k) for number, k in late if number >= 2]
        if not late:
            return None
        self.next_search = int(count * 1.2)
        returns = self.returns[min(late)[1]]
        size = max(float(np.abs(s).max()) for _, _, s in returns[-_MOST_RETURNS:])
        _, end, state = returns[-1]
        for number, (_, before, earlier) in enumerate(returns[-2 : -2 - _MOST_RETURNS : -1], 1):
            if np.abs(state - earlier).max() <= NEAR * size:
                cycle = self._closed(state, end - before, size, number)
                if cycle is not None:
                    return cycle
        return None

    def _closed(self, state: Array, period: float, size: float, returns: int) -> Cycle | None:
        """Return the cycle, flow(z, T) = z, by Newton's method from a motion that nearly returns; None without one."""
        orbit, steps = closed_orbit(self.flow, state, period, size, 2 * NEAR)
        self.newton_steps += steps
        if orbit is None:
            return None
        cycle = Cycle(self.network, orbit.state, orbit.period, _multiplier(self.network, orbit.monodromy))
        return self._shortest(cycle, size, returns) if cycle.stable else None

    def _shortest(self, cycle: Cycle, size: float, returns: int) -> Cycle:
        """Return the cycle with its least period: Newton's method may have found a multiple."""
        for parts in range(returns, 1, -1):
            monodromy, end, _ = propagated(self.flow, cycle.state, cycle.period / parts)
            if np.abs(end - cycle.state).max() <= 1e3 * CONVERGED * size:
                multiplier = _multiplier(self.network, monodromy)
                return Cycle(self.network, cycle.state, cycle.period / parts, multiplier)
        return cycle

    # -- neither -------------------------------------------------------------------------------------------------------

    def _lost(self, time: float, cause: Finding | None = None) -> Rhythm:
        """Return the rhythm of a motion that reached neither rest nor a cycle; ``cause``: why that is undecidable."""
        low = np.full(len(self.network.units), np.inf)
        high = -low
        for stretch in self.recent:
            grid = np.linspace(0, stretch.length, 5)
            values = stretch.outputs(self.network.readout) @ np.vander(grid, ORDER + 1, increasing=True).T
            low, high = np.minimum(low, values.min(axis=1)), np.maximum(high, values.max(axis=1))
        constants = time / (self.network.rise_time + self.network.adaptation_time)
        if cause is None and constants < _TIME_CONSTANTS / 3:
            cause = Finding("cpg-stiff", values={"time": time})
        doubtful = any(s.marginal or s.edge or s.stable for s in self.rests.states)
        outcome = "undecided" if doubtful or cause else "irregular"
        if cause is None:
            rest = "" if doubtful else "; no stable state of rest" + ("" if self.rests.complete else " was found")
            cause = Finding("cpg-irregular", values={"time": time, "rest": rest})
        return self._ended(outcome, cause, time, (high - low) / 2)


def _multiplier(network: Network, monodromy: Array) -> float:
    """Return the largest Floquet multiplier in magnitude, without one for the motion along the cycle itself.

    Taken component by component, like the eigenvalues of a state of rest; of the components that move on their own one
    multiplier is the trivial one.
    """
    n = network.size
    values = []
    for component in strong_components(network.matrix):
        both = [*component, *(n + k for k in component)]
        values.append(np.linalg.eigvals(monodromy[np.ix_(both, both)]))
    multipliers = np.concatenate(values)
    trivial = int(np.argmin(np.abs(multipliers - 1)))
    return float(np.abs(np.delete(multipliers, trivial)).max(initial=0.0))
