"""The differential equations of a nonlinear port: rates of its charges, and what it answers a drive."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..strip.charge_laws import ChargeLaw
from ..strip.port import Port

#: Iterations of Newton's method for the voltage across a sinh path, which converges from one side.
_MOST_INNER = 60


@dataclass(frozen=True)
class PortEquations:
    """The equations of a port: states x (..., m, points) are its charges over their capacitances [V].

    With w the voltages of the charges and v the voltage across the ion path, x' = (v - w)/(R C), and the ions' current
    is the sum of (v - w)/R. By ``by_current`` the source is a current and the answer a voltage.
    """

    port: Port
    by_current: bool = False

    @cached_property
    def law(self) -> ChargeLaw | None:
        """The law of charge of the branches, None for a linear one."""
        return self.port.charge_law

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
        law, inner = self.law, 0.0 if self.by_current else self.port.inner_voltage(level)
        return np.full(len(self.port.branches), inner if law is None else float(law.charge(inner)))

    def bound(self, most: float) -> float:
        """Return the largest size of a state [V] under voltages up to ``most`` [V]; by current there is none."""
        law = self.law
        if law is None or self.by_current:
            return np.inf
        return float(law.charge(most)) * (1 + 1e-12)

    def voltages(self, x: Array) -> tuple[Array, Array]:
        """Return the voltages w [V] of states and their derivatives, of any shape."""
        law = self.law
        if law is None:
            return x, np.ones_like(x)
        return law.inverse(x)

    def _across(self, driven: Array, conductance: float) -> tuple[Array, Array]:
        """Return v [V] with i(v) + (conductance + leads) v = ``driven`` [A], i the electrons', and that slope [S]."""
        total, port = conductance + self.leads, self.port
        if port.emission_voltage is None:
            slope = total + 1 / port.dc_resistance
            return driven / slope, np.full(driven.shape, slope)
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
        """Return the voltage v (..., points) across the ion path, and its derivatives (..., m, points) by w."""
        if np.isinf(self.leads):
            return source, np.zeros_like(w)
        g = self.conductances
        v, slope = self._across(source * (self.leads or 1.0) + g @ w, float(g.sum()))
        return v, g[:, None] / slope[..., None, :]

    def rates(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return x' (..., m, points) [V/s] and its derivatives (..., m, m, points) [1/s] by x.

        Of branches straight across the source each state's derivative by itself alone (..., m, points).
        """
        w, bent = self.voltages(x)
        v, moved = self.inner(source, w)
        own = self.own[:, None]
        rates = (v[..., None, :] - w) * own
        if np.isinf(self.leads):
            return rates, -own * bent
        slopes = moved[..., None, :, :] - np.eye(len(own))[..., None]
        return rates, own[..., None] * slopes * bent[..., None, :, :]

    def moving(self, source: Array, w: Array) -> Array:
        """Return x' (..., m, points) [V/s] at voltages ``w`` of the charges."""
        return (self.inner(source, w)[0][..., None, :] - w) * self.own[:, None]

    def read(self, source: Array, w: Array) -> Array:
        """Return the current [A] (points,), or by current the voltage [V], at voltages ``w`` (m, points) of charges."""
        v = self.inner(source, w)[0]
        if self.by_current:
            return v + self.port.electrode_resistance * source
        return np.asarray(self.port.electron_current(v) + self.conductances @ (v - w))

    def answer(self, source: Array, x: Array) -> tuple[Array, Array]:
        """Return what `read` does (points,), and its derivatives (m, points) by x (m, points)."""
        w, bent = self.voltages(x)
        moved = self.inner(source, w)[1]
        if not self.by_current:  # behind leads the current is (source - v) leads
            moved = -self.conductances[:, None] if np.isinf(self.leads) else -self.leads * moved
        return self.read(source, w), moved * bent
