"""The closed loop over time: a linear law with a limited output around a linear strip.

The loop is linear between the times at which its output meets or leaves a limit. There it is carried on by matrix
exponentials, and these times are found on it. Only a delayed measurement is a cubic between points of the past.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from ..arrays import Array
from ..errors import SolveError
from .laws import Law
from .plant import Plant

#: Points of the run where no event is; parts of a step in which no second event is looked for.
_POINTS, _DWELL = 3000, 50
#: Displacement or voltage beyond which a loop counts as unstable, in parts of the reference or the limit.
_FAR = 1e6
_POWERS = 4  # of time in the inputs of a step: reference and delayed measurement
#: Band about the reference within which a step has settled, and how late its entry is found, of the run.
BAND, _FOUND = 0.02, 1e-12


@dataclass(frozen=True, eq=False)
class Run:
    """A loop over ``time`` [s] (n,): displacement [m] and its rate, the voltage applied and the one asked for [V]."""

    time: Array
    reference: Array
    displacement: Array
    rate: Array
    voltage: Array
    asked: Array

    def settled(self, band: float = BAND) -> float:
        """Return when the displacement enters the band about the last reference for the last time [s]; inf if never."""
        goal = float(self.reference[-1])
        off = np.abs(self.displacement - goal) - band * abs(goal)
        outside = np.flatnonzero(off > 0)
        if not len(outside):
            return 0.0
        k = int(outside[-1])
        if k == len(off) - 1:
            return float("inf")
        start, end = self.time[k], self.time[k + 1]
        side = np.sign(self.displacement[k] - goal) * band * abs(goal) + goal
        piece = _hermite(self, k)
        return float(brentq(lambda t: piece(t) - side, start, end, xtol=_FOUND * max(1.0, float(self.time[-1]))))

    @property
    def overshoot(self) -> float:
        """The part of the last reference by which the displacement goes beyond it."""
        goal = float(self.reference[-1])
        k = int(np.argmax(self.displacement * np.sign(goal)))
        peak = float(self.displacement[k])
        for j in (k - 1, k):
            if 0 <= j < len(self.time) - 1 and self.time[j + 1] > self.time[j]:
                fine = np.linspace(self.time[j], self.time[j + 1], 33)
                values = _hermite(self, j)(fine) * np.sign(goal)
                peak = max(peak * np.sign(goal), float(np.max(values))) * float(np.sign(goal))
        return max(0.0, peak / goal - 1)

    def at_limit(self) -> float:
        """Return the share of time at which the voltage is limited."""
        limited = np.abs(self.asked - self.voltage) > 1e-9 * np.abs(self.voltage).max(initial=1e-300)
        return float((np.diff(self.time) * limited[1:]).sum() / self.time[-1])


def _hermite(run: Run, k: int) -> Callable[[Any], Any]:
    """Return the cubic of interval ``k``."""
    ends = slice(k, k + 2)
    t, y, rate = (part[ends].tolist() for part in (run.time, run.displacement, run.rate))
    return lambda at: _cubic(at, t, y, rate)


def _cubic(at: Any, t: Sequence[float], y: Sequence[float], rate: Sequence[float]) -> Any:
    """Return the cubic through two values with two slopes, at times ``at``."""
    h = t[1] - t[0]
    s = (at - t[0]) / h
    before, after = y[0] * (1 + 2 * s) + h * rate[0] * s, y[1] * (3 - 2 * s) + h * rate[1] * (s - 1)
    return before * (1 - s) ** 2 + after * s**2


class Loop:
    """A plant with its law, the ``limit`` [V] of the voltage and the ``delay`` [s] of the measurement."""

    def __init__(self, plant: Plant, law: Law, limit: float, delay: float = 0.0) -> None:
        self.plant, self.law, self.limit, self.delay = plant, law, limit, delay
        s, n = len(plant.b), len(law.out)
        self._plant_states = s
        self._size = s + n
        # v = wanted z + d_r r (+ d_y y delayed)
        self._wanted = np.concatenate([np.zeros(s), law.out])
        if not delay:
            self._wanted[:s] += law.measured * plant.c
        self._seen = np.concatenate([plant.c, np.zeros(n)])
        self._known: dict[tuple[str, float], tuple[Array, Array]] = {}

    def _system(self, mode: str) -> tuple[Array, Array, Array, Array]:
        """Return matrix and the inputs of 1, the reference and the delayed measurement in a mode."""
        plant, law, s = self.plant, self.law, self._plant_states
        a = np.zeros((self._size, self._size))
        one, reference, delayed = np.zeros((3, self._size))
        a[:s, :s], a[s:, s:] = plant.a, law.a
        reference[s:] = law.into_reference
        if self.delay:
            delayed[s:] = law.into_measured
        else:
            a[s:, :s] = np.outer(law.into_measured, plant.c)
        if mode[0] == "0":
            a[:s] += np.outer(plant.b, self._wanted)
            reference[:s] = plant.b * law.reference
            delayed[:s] = plant.b * law.measured if self.delay else 0.0
        else:
            level = self.limit if mode[0] == "+" else -self.limit
            one[:s] = plant.b * level
            one[s:] = law.into_excess * level
            a[s:] -= np.outer(law.into_excess, self._wanted)
            reference[s:] -= law.into_excess * law.reference
            if self.delay:
                delayed[s:] -= law.into_excess * law.measured
        if mode[1:] == "held":
            for part in (a, one, reference, delayed):
                part[s] = 0.0
        return a, one, reference, delayed

    def _step(self, mode: str, width: float, keep: bool) -> tuple[Array, Array]:
        """Return the exponential of a step, and what the inputs' powers of time add (size, 3 inputs, powers)."""
        key = mode, round(width, 15)
        if key in self._known:
            return self._known[key]
        a, *inputs = self._system(mode)
        m = self._size
        whole = np.zeros((m + 3 * _POWERS, m + 3 * _POWERS))
        whole[:m, :m] = a
        for k, column in enumerate(inputs):  # a chain: constant, t, t^2/2, ...
            first = m + k * _POWERS
            whole[:m, first] = column
            for j in range(_POWERS - 1):
                whole[first + j, first + j + 1] = 1.0
        moved = expm(whole * width)
        weights = np.array([factorial(j) for j in range(_POWERS)], dtype=float)
        answer = moved[:m, :m], moved[:m, m:].reshape(m, 3, _POWERS) * weights
        if keep:
            self._known[key] = answer
        return answer

    def run(self, times: Array, values: Array, duration: float, points: int = _POINTS) -> Run:
        """Return the loop from rest under the reference through (times, values), held after, for ``duration`` [s].

        Raises SolveError for a loop that runs away.
        """
        grid = np.linspace(0.0, duration, points + 1)
        inner = times[(times > 0) & (times < duration)]
        grid = np.union1d(grid, inner)
        grid = grid[np.append(True, np.diff(grid) > 1e-12 * duration)]
        state = np.zeros(self._size)
        largest = max(float(np.abs(values).max(initial=0.0)), 1e-300)
        history = _History()
        record: list[tuple[float, ...]] = []
        lines = _Lines(times, values)
        mode = self._mode(state, lines.at(0.0), self._late(history, 0.0))
        self._note(record, history, 0.0, state, mode, lines.at(0.0))
        for start, end in zip(grid[:-1].tolist(), grid[1:].tolist(), strict=True):
            t, quiet = start, 0.0
            while t < end:
                width = end - t
                inputs = self._inputs(t, width, lines, history)
                after = self._moved(mode, width, state, inputs, keep=t == start)
                crossed = self._broken(mode, after, inputs, width)
                if crossed is None or width <= quiet:
                    state, t = after, end
                    if crossed is not None:
                        mode = self._mode(state, lines.at(t), self._late(history, t), mode)
                else:
                    found = self._event(mode, state, inputs, width, crossed)
                    found = min(max(found, (end - start) / _DWELL), width)
                    state, t = self._moved(mode, found, state, inputs), t + found
                    t = end if end - t < 1e-12 * duration else t
                    mode = _switched(mode, crossed)
                    self._note(record, history, t, state, mode, lines.at(t))
                    if t == end:
                        record.pop()
                    quiet = (end - start) / _DWELL
            self._note(record, history, t, state, mode, lines.at(t))
            if not abs(record[-1][2]) < _FAR * largest:
                raise SolveError("the loop is unstable: its displacement grows without end")
        return Run(*np.array(record).T)

    def _note(
        self, record: list[tuple[float, ...]], history: _History, t: float, state: Array, mode: str, reference: float
    ) -> None:
        late = self._late(history, t)
        asked = self._asked(state, reference, late)
        applied = min(max(asked, -self.limit), self.limit)
        x = state[: self._plant_states]
        y, rate = float(self.plant.c @ x), float(self.plant.c @ (self.plant.a @ x + self.plant.b * applied))
        history.add(t, y, rate)
        record.append((t, reference, y, rate, applied, asked))

    def _late(self, history: _History, t: float) -> float:
        return history.at(t - self.delay) if self.delay else 0.0

    def _asked(self, state: Array, reference: float, late: float) -> float:
        more = self.law.measured * late if self.delay else 0.0
        return float(self._wanted @ state) + self.law.reference * reference + more

    def _inputs(self, t: float, width: float, lines: _Lines, history: _History) -> Array:
        """Return the coefficients of 1, reference and delayed measurement in powers of time from ``t`` (3, powers)."""
        found = np.zeros((3, _POWERS))
        found[0, 0] = 1.0
        found[1, :2] = lines.line(t)
        if self.delay:
            at = t - self.delay + width * _NODES
            found[2] = _TO_POWERS @ np.array([history.at(x) for x in at.tolist()]) / width ** np.arange(_POWERS)
        return found

    def _moved(self, mode: str, width: float, state: Array, inputs: Array, keep: bool = False) -> Array:
        moved, added = self._step(mode, width, keep)
        return np.asarray(moved @ state + np.einsum("mip,ip->m", added, inputs))

    def _margin(self, mode: str, crossed: str, state: Array, inputs: Array, width: float) -> float:
        """Return how far a mode is from its end; negative beyond it."""
        powers = width ** np.arange(_POWERS)
        reference, late = float(inputs[1] @ powers), float(inputs[2] @ powers)
        asked = self._asked(state, reference, late)
        integral = float(state[self._plant_states]) if self.law.clamps else 0.0
        if crossed == "high":
            return self.limit - asked
        if crossed == "low":
            return self.limit + asked
        if crossed == "back":
            return asked - self.limit if mode[0] == "+" else -asked - self.limit
        if crossed == "full":
            return self.limit - abs(integral)
        seen = late if self.delay else float(self._seen @ state)
        return (reference - seen) * float(np.sign(integral))

    def _broken(self, mode: str, state: Array, inputs: Array, width: float) -> str | None:
        """Return what ends a mode before the end of a step."""
        ends = ["high", "low"] if mode[0] == "0" else ["back"]
        if self.law.clamps:
            ends.append("free" if mode[1:] else "full")
        return next((end for end in ends if self._margin(mode, end, state, inputs, width) < 0), None)

    def _event(self, mode: str, state: Array, inputs: Array, width: float, crossed: str) -> float:
        """Return the time into a step at which a mode ends."""

        def margin(part: float) -> float:
            return self._margin(mode, crossed, self._moved(mode, part, state, inputs), inputs, part)

        if margin(0.0) <= 0:
            return 0.0
        return float(brentq(margin, 0.0, width, xtol=1e-13 * max(width, 1e-3)))

    def _mode(self, state: Array, reference: float, late: float, before: str = "0") -> str:
        """Return the mode of a state by itself."""
        asked = self._asked(state, reference, late)
        return ("0" if abs(asked) <= self.limit else "+" if asked > 0 else "-") + before[1:]


def _switched(mode: str, crossed: str) -> str:
    """Return the mode after one that ended."""
    if crossed in ("full", "free"):
        return mode[0] + ("held" if crossed == "full" else "")
    return {"high": "+", "low": "-", "back": "0"}[crossed] + mode[1:]


#: Four points of a step of 1, and the matrix from values there to coefficients of powers.
_NODES = np.array([0.0, 1 / 3, 2 / 3, 1.0])
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))


class _History:
    """The displacement so far, as cubics."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.points: list[tuple[float, float]] = []

    def add(self, t: float, value: float, rate: float) -> None:
        self.times.append(t)
        self.points.append((value, rate))

    def at(self, t: float) -> float:
        if t <= 0 or not self.times:
            return 0.0
        k = min(bisect_right(self.times, t), len(self.times) - 1)
        t0, t1 = self.times[k - 1], self.times[k]
        (y0, d0), (y1, d1) = self.points[k - 1], self.points[k]
        return y1 if t1 == t0 else float(_cubic(t, (t0, t1), (y0, y1), (d0, d1)))


class _Lines:
    """The reference as straight lines; a time that stands twice is a jump."""

    def __init__(self, times: Array, values: Array) -> None:
        self.times, self.values = times.tolist(), values.tolist()

    def line(self, t: float) -> tuple[float, float]:
        k = bisect_right(self.times, t)
        if k == 0:
            return self.values[0], 0.0
        if k == len(self.times):
            return self.values[-1], 0.0
        slope = (self.values[k] - self.values[k - 1]) / (self.times[k] - self.times[k - 1])
        return self.values[k - 1] + slope * (t - self.times[k - 1]), slope

    def at(self, t: float) -> float:
        return self.line(t)[0]
