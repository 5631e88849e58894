"""Long-term behaviour of neurons with a reflex: a cycle with the strips' angles in it, or rest.

A rest is proven as for a network alone: the motion is in the piece of a stable state of rest, and its decaying modes
(or an ellipsoid, where they are no basis) keep it there. Without feedback the neurons have the rhythm of the network
alone, and the strips follow it: their motion is the solution of linear equations. With feedback a cycle is found by
Newton's method where the motion has returned close to itself, is stable, and the motion must then have come nearer to
it by half: a slow strip drifts for long, maybe past a cycle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..findings import Finding, Warned
from .flow import Flow, Stretch
from .network import checked_start, default_start
from .orbits import NEAR, Orbit, closed_orbit, propagated
from .outcome import MARGINAL, extremes, fundamentals, wrapped
from .reflex import Loop, LoopFlow
from .rest import Ellipsoid
from .rhythm import rhythm

#: Steps of the flow after which a motion that neither rests nor repeats is left undecided.
MOST_STEPS = 60_000
#: Steps between two looks for a rest, returns compared with each, and growth of the steps between two Newton searches.
_CHUNK, _MOST_RETURNS, _PATIENCE = 16, 8, 1.2
_BASIS = 1e7
_STOPPED, _THERE = 1e-10, 1e-8


@dataclass(frozen=True)
class LoopRhythm(Warned):
    """Long-term behaviour of a ``loop``, whose neurons start as ``start`` (2 n,) and whose strips start at rest.

    ``outcome`` is "cycle", "rest" or "undecided"; ``state`` (m,) is one of the cycle, or the rest; ``settled`` [s] is
    when the motion was found to be there; ``multiplier`` what a period leaves of a disturbance.
    """

    loop: Loop
    start: Array
    outcome: str
    settled: float
    state: Array | None = None
    period: float | None = None
    multiplier: float | None = None

    @cached_property
    def flow(self) -> LoopFlow:
        """The flow of the loop."""
        return LoopFlow(self.loop)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """A finding where the outcome is undecided."""
        return (Finding("reflex-undecided", values={"time": self.settled}),) if self.outcome == "undecided" else ()

    @cached_property
    def _cycle(self) -> list[Stretch]:
        assert self.state is not None
        assert self.period is not None
        return list(self.flow.stretches(self.state, self.period))

    @cached_property
    def _swings(self) -> tuple[Array, Array]:
        """Smallest and largest outputs and angles (2, units)."""
        units = self.loop.units
        if self.period is None:
            return np.zeros((2, units)), np.zeros((2, units))
        low, high = extremes(self._cycle, self.flow.curves)
        return low.reshape(2, units), high.reshape(2, units)

    @property
    def amplitudes(self) -> Array:
        """Half the peak-to-peak (units,) of the outputs."""
        return np.asarray((self._swings[1] - self._swings[0])[0] / 2)

    @property
    def angle_amplitudes(self) -> Array:
        """Half the peak-to-peak (units,) of the angles [rad]."""
        return np.asarray((self._swings[1] - self._swings[0])[1] / 2)

    @property
    def rest_angles(self) -> Array | None:
        """Angles (units,) of a rest [rad]."""
        if self.outcome != "rest" or self.state is None:
            return None
        return self.flow.angles(self.state[None])[0]

    @cached_property
    def fundamentals(self) -> ComplexArray:
        """The first harmonics (2, units) of outputs and angles over the cycle."""
        assert self.period is not None
        return fundamentals(self._cycle, self.flow.curves, self.period).reshape(2, -1)

    @property
    def lags(self) -> Array:
        """Degrees (units,) by which each angle lags its unit's output; NaN without a cycle."""
        if self.period is None:
            return np.full(self.loop.units, np.nan)
        outputs, angles = self.fundamentals
        with np.errstate(invalid="ignore", divide="ignore"):
            return wrapped(-np.degrees(np.angle(angles / outputs)))


def loop_rhythm(loop: Loop, start: Array | None = None, begun: LoopRhythm | None = None) -> LoopRhythm:
    """Return the long-term behaviour of ``loop`` from ``start`` (2 n,), or from where another rhythm ended.

    The loop must not be forced. Raises InputError for a nonlinear strip.
    """
    neurons = checked_start(loop.network, start)
    flow = LoopFlow(loop)
    state = flow.start(neurons) if begun is None or begun.state is None else begun.state
    found = None if loop.gain else _unfelt(flow, neurons, state[: len(neurons)])
    return found or _Follower(flow, neurons).run(state)


def _unfelt(flow: LoopFlow, start: Array, now: Array) -> LoopRhythm | None:
    """Return the rhythm of neurons ``now`` (2 n,) without feedback, and of the strips that follow; None if not known.

    It is there when the neurons are and the slowest mode of a strip has decayed to what counts as near.
    """
    loop, strips = flow.loop, slice(len(now), None)
    free = loop.free if (now == default_start(loop.network)).all() else rhythm(loop.network, now)
    settled = free.settled + np.log(NEAR) / np.linalg.eigvals(loop.plant.a).real.max()
    if free.rest is not None and not free.findings:
        state = flow.start(free.rest)
        a, b = flow.linear_piece(flow.values(np.append(state, 1.0)) > 0)
        state[strips] = -np.linalg.solve(a[strips, strips], a[strips, : len(now)] @ free.rest + b[strips])
        return LoopRhythm(loop, start, "rest", float(settled), state)
    if free.cycle is not None and free.cycle.multiplier <= 1 + MARGINAL:
        state, period = flow.start(free.cycle.state), free.cycle.period
        monodromy, end, _ = propagated(flow, state, period)
        own = monodromy[strips, strips]
        state[strips] = np.linalg.solve(np.eye(len(own)) - own, end[strips])
        multiplier = max(free.cycle.multiplier, float(np.abs(np.linalg.eigvals(own)).max()))
        return LoopRhythm(loop, start, "cycle", float(settled), state, period, multiplier)
    return None


@dataclass(frozen=True)
class _Found:
    """A stable cycle, the neuron where motions are compared, and the states (k, m) of the cycle as that turns off."""

    orbit: Orbit
    multiplier: float
    neuron: int
    passages: Array
    distance: float

    def from_there(self, state: Array) -> float:
        return float(np.abs(self.passages - state).max(axis=1).min())


class _Follower:
    """One motion, followed until its outcome is known."""

    def __init__(self, flow: LoopFlow, neurons: Array) -> None:
        self.flow, self.neurons = flow, neurons
        self.rests: dict[bytes, _Rest | None] = {}
        self.returns: list[list[tuple[float, Array]]] = [[] for _ in range(flow.network.size)]
        self.next_search = 0.0
        self.found: _Found | None = None

    def run(self, state: Array) -> LoopRhythm:
        for count, stretch in enumerate(self.flow.stretches(state, np.inf)):
            if count % _CHUNK == 0:
                rest = self._resting(stretch)
                if rest is not None:
                    return self._ended("rest", stretch.begin, rest)
            if count >= MOST_STEPS:
                break
            if 0 <= stretch.switched < len(self.returns) and not stretch.active[stretch.switched]:
                self.returns[stretch.switched].append((stretch.end, stretch.states(stretch.length)[0]))
                found = self._cycling(count, stretch.switched)
                if found is not None:
                    orbit = found.orbit
                    return self._ended("cycle", stretch.end, orbit.state, orbit.period, found.multiplier)
        return self._ended("undecided", stretch.begin)

    def _ended(
        self,
        outcome: str,
        time: float,
        state: Array | None = None,
        period: float | None = None,
        left: float | None = None,
    ) -> LoopRhythm:
        return LoopRhythm(self.flow.loop, self.neurons, outcome, time, state, period, left)

    def _resting(self, stretch: Stretch) -> Array | None:
        """Return the state of rest that the motion provably goes to, or at which it stands still."""
        key = stretch.active.tobytes()
        if key not in self.rests:
            self.rests[key] = _rest_of(self.flow, stretch.active)
        rest, state = self.rests[key], stretch.terms[0]
        if rest is None:
            return None
        still = np.abs(state - rest.state).max() <= _STOPPED * np.abs(rest.state).max()
        return rest.state if still or rest.holds(state - rest.state) else None

    def _cycling(self, count: int, neuron: int) -> _Found | None:
        """Return the cycle that the motion goes to, after a passage of ``neuron``, if it is known by now."""
        returns = self.returns[neuron][-_MOST_RETURNS:]
        end, state = returns[-1]
        size = max(float(np.abs(s).max()) for _, s in returns)
        if self.found is not None:
            if neuron != self.found.neuron:
                return None
            now = self.found.from_there(state)
            if now <= max(self.found.distance / 2, _THERE * size):
                return self.found
            if now > 2 * self.found.distance:
                self.found = None
            return None
        if count < self.next_search:
            return None
        for begin, earlier in returns[-2::-1]:
            if np.abs(state - earlier).max() <= NEAR * size:
                self.next_search = _PATIENCE * count
                self.found = self._closed(neuron, state, end - begin, size)
                break
        return self.found if self.found is not None and self.found.distance <= _THERE * size else None

    def _closed(self, neuron: int, state: Array, period: float, size: float) -> _Found | None:
        orbit, _ = closed_orbit(self.flow, state, period, size, 4 * NEAR)
        if orbit is None:
            return None
        multipliers = np.linalg.eigvals(orbit.monodromy)
        trivial = int(np.argmin(np.abs(multipliers - 1)))
        multiplier = float(np.abs(np.delete(multipliers, trivial)).max())
        passages = [
            s.states(s.length)[0]
            for s in self.flow.stretches(orbit.state, 1.01 * orbit.period)
            if s.switched == neuron and not s.active[neuron]
        ]
        if multiplier > 1 + MARGINAL or not passages:
            return None
        found = _Found(orbit, multiplier, neuron, np.array(passages), np.inf)
        return _Found(orbit, multiplier, neuron, found.passages, found.from_there(state))


@dataclass(frozen=True)
class _Rest:
    """A stable rest ``state`` (m,) of a piece; ``holds`` tells whether a motion away from it provably stays there."""

    state: Array
    holds: Callable[[Array], bool]


def _rest_of(flow: Flow, active: Mask) -> _Rest | None:
    a, b = flow.linear_piece(active)
    try:
        state = np.asarray(-np.linalg.solve(a, b), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    rows = np.vstack([np.append(state, 1.0), np.eye(len(state), len(state) + 1)])
    gates = flow.gates(rows, active)
    if ((gates[0] > 0) != active).any():
        return None
    rates, vectors = np.linalg.eig(a)
    if rates.real.max() >= 0:
        return None
    room = np.abs(gates[0]) * (1 - 1e-9)
    if np.linalg.cond(vectors) > _BASIS:
        ellipsoid = Ellipsoid(a, gates[1:].T, room)
        return _Rest(state, ellipsoid.holds) if ellipsoid.proven else None
    inverse, seen = np.linalg.inv(vectors), np.abs(gates[1:].T @ vectors)
    return _Rest(state, lambda away: bool((seen @ np.abs(inverse @ away) < room).all()))
