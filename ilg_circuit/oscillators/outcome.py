"""Outcomes of a network: a cycle with its amplitudes and phases, or rest. Found by `ilg_circuit.oscillators.rhythm`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, ComplexArray
from ..findings import Finding, Warned
from .flow import ORDER, Flow, Stretch, sign_changes
from .network import Network
from .rest import RestStates

#: A multiplier of a cycle may exceed one by this: rounding, or a cycle that is one of many.
MARGINAL = 1e-6

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Cycle:
    """A periodic motion of ``network`` through ``state`` (2 n,), of ``period`` [s].

    ``multiplier`` is the largest Floquet multiplier in magnitude, apart from the trivial one of the motion itself: the
    factor by which a disturbance changes over a period; above 1 the cycle is unstable.
    """

    network: Network
    state: Array
    period: float
    multiplier: float

    @property
    def stable(self) -> bool:
        """True if disturbances decay (or, for a multiplier of one, at least do not grow)."""
        return self.multiplier <= 1 + MARGINAL

    def stretches(self) -> list[Stretch]:
        """Return one period of the motion."""
        return list(Flow(self.network).stretches(self.state, self.period))

    def amplitudes(self) -> Array:
        """Return half the peak-to-peak (units,) of the units' outputs y_extensor - y_flexor."""
        low, high = extremes(self.stretches(), lambda stretch: stretch.outputs(self.network.readout))
        return np.asarray((high - low) / 2)

    def fundamentals(self, readout: Array) -> ComplexArray:
        """Return (2/T) int f exp(-2 pi i t/T) dt of f = ``readout`` (rows, n) times y over one period: (rows,)."""
        return fundamentals(self.stretches(), lambda stretch: stretch.outputs(readout), self.period)


def extremes(stretches: Iterable[Stretch], curves: Callable[[Stretch], Array]) -> tuple[Array, Array]:
    """Return the smallest and the largest values (rows,) of ``curves``, polynomials (rows, ORDER + 1) of a stretch."""
    found = []
    for stretch in stretches:
        for k, polynomial in enumerate(curves(stretch)):
            slope = np.append(polynomial[1:] * np.arange(1, ORDER + 1), 0.0)
            at = np.array([0.0, stretch.length, *sign_changes(slope, stretch.length)])
            values = np.vander(at, ORDER + 1, increasing=True) @ polynomial
            found.append((k, values.min(), values.max()))
    rows = 1 + max(k for k, _, _ in found)
    low, high = np.full(rows, np.inf), np.full(rows, -np.inf)
    for k, least, most in found:
        low[k], high[k] = min(low[k], least), max(high[k], most)
    return low, high


def fundamentals(stretches: Iterable[Stretch], curves: Callable[[Stretch], Array], period: float) -> ComplexArray:
    """Return (2/T) int f exp(-2 pi i t/T) dt (rows,) of ``curves``, as for `extremes`, over one ``period`` T [s]."""
    parts = []
    for stretch in stretches:
        s = stretch.length * (_GAUSS_NODES + 1) / 2
        values = curves(stretch) @ np.vander(s, ORDER + 1, increasing=True).T
        turned = np.exp(-2j * np.pi * (stretch.begin + s * stretch.step) / period)
        parts.append(values @ (_GAUSS_WEIGHTS * turned) * stretch.length * stretch.step / period)
    return np.asarray(sum(parts))


@dataclass(frozen=True)
class Rhythm(Warned):
    """Long-term behaviour of ``network`` from ``start`` (2 n,).

    ``outcome`` is "cycle", "rest", "irregular" (bounded, neither at rest nor periodic as long as it was followed) or
    "undecided" (the same, but there are states of rest or cycles without growth or decay); ``cause`` says why.
    ``cycle`` or ``rest`` is the attractor, None for the other; ``settled`` [s] is when the motion was found to be
    there. ``swing`` (units,) is half the final peak-to-peak of the units' outputs.
    """

    network: Network
    start: Array
    outcome: str
    cause: Finding
    rest_states: RestStates
    settled: float
    swing: Array
    cycle: Cycle | None = None
    rest: Array | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def reason(self) -> str:
        """The cause as a sentence."""
        return str(self.cause)

    @property
    def oscillates(self) -> bool | None:
        """None where it could not be decided."""
        return None if self.outcome == "undecided" else self.outcome in ("cycle", "irregular")

    @property
    def period(self) -> float | None:
        """[s]; None without a cycle."""
        return self.cycle.period if self.cycle else None

    @property
    def amplitude(self) -> float:
        """Half the peak-to-peak of the (first) output y_1 - y_2."""
        return float(self.swing[0])

    @property
    def phase_lags(self) -> Array:
        """Degrees (n,) from -180 to 180 by which each neuron's fundamental lags that of the first active one; NaN for
        a neuron that is silent or does not vary, and without a cycle."""
        return self._lags(np.eye(self.network.size))

    @property
    def unit_lags(self) -> Array:
        """Degrees (units,) by which each unit's output lags the one before it, the first 0; NaN as `phase_lags`."""
        lags = self._lags(self.network.readout)
        return np.concatenate([[0.0 * lags[0]], wrapped(np.diff(lags))])

    def _lags(self, readout: Array) -> Array:
        if self.cycle is None:
            return np.full(len(readout), np.nan)
        c = self.cycle.fundamentals(readout)
        size = np.abs(c)
        heard = size > 1e-9 * max(size.max(), 1e-300)
        if not heard.any():
            return np.full(len(readout), np.nan)
        first = c[np.flatnonzero(heard)[0]]
        return np.where(heard, wrapped(-np.degrees(np.angle(c / first))), np.nan)


def wrapped(degrees: Array) -> Array:
    """Return angles wrapped to -180 (not included, to a billionth) to 180."""
    turned = (degrees + 180) % 360 - 180
    return np.where(turned <= -180 + 1e-9, turned + 360, turned)
