"""A pulse-width modulated stage between a controller and a strip: an H-bridge that switches, solved exactly.

Each cycle the bridge gives its supply, with the sign of what is asked for, for the duty's part of the cycle, and zero
for the rest. A timer takes a new duty at the next cycle, in steps. A whole cycle is one matrix, many are its power.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..arrays import Array
from .plant import Plant

#: Parts of a cycle that count as none.
_ROUNDING = 1e-7
#: Harmonics of the switching that are summed up.
_HARMONICS = 100


@dataclass(frozen=True)
class Pwm:
    """A stage with a ``frequency`` [Hz], a ``supply`` [V] and a duty in parts of 1/``steps``."""

    frequency: float
    supply: float
    steps: int

    def mean(self, voltage: float) -> float:
        """Return the mean [V] over a cycle that stands for a voltage: that of the duty's next lower step."""
        count = min(int(abs(voltage) / self.supply * self.steps * (1 + _ROUNDING)), self.steps)
        return float(np.sign(voltage)) * self.supply * count / self.steps

    def ripple(self, plant: Plant) -> float:
        """Return the largest displacement [m] about the mean within a cycle, at half duty: the sum of its harmonics."""
        odd = np.arange(1.0, _HARMONICS, 2.0)
        answers = np.abs(plant.response(2 * np.pi * self.frequency * odd))
        return float(2 * self.supply / np.pi * (answers / odd).sum())


class Switched:
    """The states of a linear strip under a stage; ``whole`` (s + 1, s + 1) is [[A, b], [0, 0]]."""

    def __init__(self, stage: Pwm, whole: Array) -> None:
        self.stage, self.whole, self.cycle = stage, whole, 1 / stage.frequency
        self.mean = 0.0
        self._known: dict[tuple[float, int], Array] = {}

    def moved(self, state: Array, start: float, end: float, mean: float) -> Array:
        """Return the state (s,) at ``end`` [s] from that at ``start``; ``mean`` [V] is taken at the next cycle."""
        x = np.append(state, 1.0)
        k = int(np.ceil(start / self.cycle - _ROUNDING))  # the cycle that begins next
        if k * self.cycle > end:
            return self._part(x, start, end)
        x = np.append(self._part(x, start, k * self.cycle), 1.0)
        self.mean = mean
        last = int(np.floor(end / self.cycle + _ROUNDING))
        if last > k:
            key = (self.mean, last - k)
            if key not in self._known:
                one = self._pulse(0.0, self.cycle)
                self._known[key] = np.linalg.matrix_power(one, last - k)
            x = self._known[key] @ x
        return self._part(x, last * self.cycle, end)

    def _part(self, x: Array, start: float, end: float) -> Array:
        """Return the state within one cycle, which holds both times."""
        if end - start <= _ROUNDING * self.cycle:
            return np.asarray(x[:-1])
        begin = np.floor(start / self.cycle + _ROUNDING) * self.cycle
        return np.asarray((self._pulse(max(start - begin, 0.0), end - begin) @ x)[:-1])

    def _pulse(self, start: float, end: float) -> Array:
        """Return the matrix from ``start`` to ``end`` [s] of a cycle."""
        edge = min(max(abs(self.mean) / self.stage.supply * self.cycle, start), end)
        high, low = self.whole.copy(), self.whole.copy()
        high[:-1, -1] *= self.stage.supply * np.sign(self.mean)
        low[:-1, -1] = 0.0
        return np.asarray(expm(low * (end - edge)) @ expm(high * (edge - start)))
