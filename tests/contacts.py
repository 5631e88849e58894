"""Strips whose clamp loses contact: what they carry while it is closed, and what goes on in them while it is open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ilg_circuit.measurements.table import Table

Array = NDArray[np.float64]

#: The strip of most tests: two branches (R [ohm], C [F]), and Rdc [ohm].
BRANCHES, DC = ((80.0, 1.2e-3), (350.0, 3e-3)), 8e3


def carried(
    t: Array,
    u: Array,
    closed: NDArray[np.bool_],
    branches: Sequence[tuple[float, float]] = BRANCHES,
    dc: float = DC,
) -> Array:
    """Currents [A] of a strip of ``branches`` beside ``dc`` [ohm] under a voltage, zero where the clamp is not closed.

    The voltage goes straight from reading to reading; a jump is at the later one.
    """
    r, c = np.array(branches).T
    g, count = 1 / r, len(r)
    shut = np.zeros((count + 2, count + 2))
    shut[:count, :count] = -np.diag(1 / (r * c))
    shut[:count, count], shut[count, count + 1] = g, 1.0
    opened = np.zeros_like(shut)
    opened[:count, :count] = shut[:count, :count] + np.outer(g, g / c) / (g.sum() + 1 / dc)
    jump = 0.2 * float(np.ptp(u))
    q, i = u[0] * c, np.zeros(len(t))
    done: dict[tuple[float, bool], Array] = {}
    for k, now in enumerate(closed.tolist()):
        if k:
            h, change, was = float(t[k] - t[k - 1]), float(u[k] - u[k - 1]), bool(closed[k - 1])
            key = (round(h, 9), was)
            if key not in done:
                done[key] = expm((shut if was else opened) * h)
            q = (done[key] @ np.r_[q, u[k - 1], change / h if abs(change) < jump else 0.0])[:count]
        i[k] = float(g @ (u[k] - q / c)) + u[k] / dc if now else 0.0
    return i


@dataclass(frozen=True)
class Measured:
    """Readings of a strip, and when its clamp was closed."""

    t: Array
    u: Array
    i: Array
    closed: NDArray[np.bool_]

    def table(self, **columns: Array) -> Table:
        return Table({"time": self.t, "voltage": self.u, "current": self.i, **columns}, "record.csv")

    def noisy(self, noise: float, offset: float = 0.0, seed: int = 0) -> Measured:
        """With white ``noise`` in parts of the largest current, and an ``offset`` [A]."""
        size = noise * float(np.abs(self.i).max())
        random = np.random.default_rng(seed)
        return replace(self, i=self.i + size * random.standard_normal(len(self.t)) + offset)

    def rounded(self, step: float) -> Measured:
        """With a current rounded to a part of its largest."""
        step *= float(np.abs(self.i).max())
        return replace(self, i=np.round(self.i / step) * step)


def measured(
    t: Array,
    u: Array,
    breaks: Sequence[tuple[float, float]] = (),
    branches: Sequence[tuple[float, float]] = BRANCHES,
    dc: float = DC,
) -> Measured:
    """Readings at ``t`` [s] of a strip whose contact is lost in ``breaks`` from one time to before another."""
    closed = np.ones(len(t), dtype=bool)
    for a, b in breaks:
        closed &= (t < a - 1e-9) | (t >= b - 1e-9)
    return Measured(t, u, carried(t, u, closed, branches, dc), closed)


def waveforms(t: Array, volts: float = 1.0, period: float = 4.0) -> dict[str, Array]:
    """Voltages [V] at ``t`` [s] that begin after a second of rest."""
    x = np.maximum(t - 1.0, 0.0)
    after, phase = t >= 1.0 - 1e-9, (x / period) % 1
    sharp = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * x / period))
    blunt = np.convolve(np.pad(sharp, 4, mode="edge"), np.full(9, 1 / 9), "valid")
    shapes = {
        "step": after * 1.0,
        "pulses": after * (phase < 0.5),
        "square": after * np.where(phase < 0.5, 1.0, -1.0),
        "sine": np.sin(2 * np.pi * x / period),
        "triangle": sharp,
        "blunt triangle": blunt,
        "quantised triangle": np.round(64 * sharp) / 64,
        "sweep": 1 - np.abs(2 * phase - 1),
        "trapezoid": np.clip(1.7 * sharp, -1.0, 1.0),
        "trapezoid at rest": np.interp(phase, [0, 0.15, 0.5, 0.65, 1], [0, 1, 1, 0, 0]),
        "staircase": after * np.floor(5 * phase) / 5,
    }
    return {name: volts * shape for name, shape in shapes.items()}
