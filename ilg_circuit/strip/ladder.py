"""RC ladders: approximations, for netlists, of impedances that are sums or integrals of relaxations.

Diffusion, constant phase elements and flattened arcs are of the form

    Z(s) = integral of w(lambda)/(s + lambda) dlambda,   w >= 0,   w(lambda) = -Im Z(-lambda + i0)/pi

so they are realised by R parallel C sections in series (Foster's first form) with one capacitor, which alone has the
whole charge, and one resistor for what relaxes faster than the band. The largest error over the band is measured
against the closed form and stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray
from ..errors import InputError

if TYPE_CHECKING:
    from .models.ladder_path import LadderPath

#: Default band [Hz] of a ladder.
LADDER_BAND = (1e-4, 1e4)
#: Largest error of a ladder with an automatic number of sections, relative to the ideal impedance in the band.
LADDER_ERROR = 1e-4
MOST_SECTIONS = 200
_PER_DECADE = 60
#: Nodes per block of the quadrature that combines relaxations: four need the fewest sections.
ORDER = 4
#: Factor beyond both ends of the band up to which relaxations are combined in sections.
_BEYOND = 1000.0
#: Density of relaxations, relative to the impedance, below which it is zero.
_NEGLIGIBLE = 1e-5
#: Least impedance of a section, and of the capacitor at the lower end of the band, relative to the total there.
_LEAST = 1e-6
#: Widest step of the logarithmic grid on which a density of relaxations is sampled.
_STEP = 0.0125
#: Finest step at a peak of the density, in units of log(lambda).
_NARROWEST = 1e-3


@dataclass(frozen=True)
class Ladders:
    """The design of ladders: ``band`` [Hz], number of ``sections`` (None: enough for `LADDER_ERROR`), ``reach``.

    ``reach`` sets the fastest relaxation of a Warburg ladder, as a number of 1/tau, in place of the band's upper end.
    """

    band: tuple[float, float] = LADDER_BAND
    sections: int | None = None
    reach: float | None = None


@dataclass(frozen=True)
class Ladder:
    """Z(s) = ``resistance`` + 1/(``capacitance`` s) + sum of R/(1 + R C s) over ``sections`` (R [ohm], C [F]).

    It stands for the element of the ion path ``ions`` with ``constants``, the values of the path's parameters after the
    series resistance. ``band`` [Hz] is where ``error`` bounds the difference from it, relative to it.
    """

    ions: LadderPath
    constants: tuple[float, ...]
    resistance: float
    capacitance: float
    sections: tuple[tuple[float, float], ...]
    band: tuple[float, float]

    def impedance(self, s: ArrayLike) -> ComplexArray:
        """Return the impedance [ohm] of the ladder at complex frequencies ``s`` [rad/s], any shape."""
        points = np.asarray(s, dtype=complex)
        total = self.resistance + 1 / (self.capacitance * points)
        for r, c in self.sections:
            total = total + r / (1 + r * c * points)
        return np.asarray(total)

    def ideal(self, s: ArrayLike) -> ComplexArray:
        """Return the impedance [ohm] of the element that the ladder approximates."""
        points = np.asarray(s, dtype=complex)
        found = self.ions.element(np.array([self.constants]), points.reshape(-1))
        return np.asarray(found.reshape(points.shape))

    @cached_property
    def error(self) -> float:
        """Its measured error, computed where it is asked for; between the points of the scan it can be a bit larger."""
        low, high = self.band
        s = 2j * np.pi * np.geomspace(low, high, max(int(_PER_DECADE * math.log10(high / low)), 2) + 1)
        ideal = self.ideal(s)
        return 1.02 * float((np.abs(self.impedance(s) - ideal) / np.abs(ideal)).max()) + 1e-12


@dataclass(frozen=True)
class Relaxations:
    """The ideal element that a ladder approximates: its closed form, and the fineness of its density of relaxations.

    ``impedance`` [ohm] of complex ``s`` (n,) [rad/s] off the negative real axis; ``width`` is the half-width of the
    narrowest peak of the density, in units of log(lambda). ``density`` is -Im Z(-lambda + i0) of log(lambda), where
    that is known in real numbers, which take a fifth of the time.
    """

    impedance: Callable[[ComplexArray], ComplexArray]
    width: float = 1.0
    density: Callable[[Array], Array] | None = None

    def at(self, logs: Array) -> Array:
        """Return -Im Z(-lambda + i0) [ohm] at ``logs`` of lambda."""
        if self.density is not None:
            return self.density(logs)
        return np.asarray(-self.impedance(-np.exp(logs) + 0j).imag)


def gathered(
    relaxations: Relaxations, band: tuple[float, float], sections: int
) -> tuple[float, float, tuple[tuple[float, float], ...]]:
    """Return the resistance [ohm], capacitance [F] and ``sections`` (R [ohm], C [F]) of a ladder over ``band`` [Hz].

    It stands for any sum of relaxations, gathered in sections by Gauss quadrature of their density. The density w
    lambda dlog(lambda) is sampled on a grid that depends on the band alone, so the sections are smooth functions of the
    constants. What lies beyond the grid is one resistor and one capacitor, which match the impedance at the ends of the
    band.
    """
    low, high = 2 * np.pi * band[0], 2 * np.pi * band[1]
    blocks = -(-sections // ORDER)
    # some decades below the band, as far as the density extends: huge capacitors would cause rounding errors
    first = low / _BEYOND * 10.0 ** np.arange(4)
    decaying, turning = (relaxations.impedance(np.asarray(s, dtype=complex)) for s in (-first, 1j * first))
    there = -decaying.imag > _NEGLIGIBLE * np.abs(turning)
    start = float(first[int(np.argmax(there))]) if there.any() else low
    length = math.log(high * _BEYOND / start)
    coarse = math.ceil(length / _STEP / blocks)
    fine = 4 ** math.ceil(max(math.log(3 * _STEP / max(relaxations.width, _NARROWEST), 4), 0.0))
    count = blocks * coarse * fine
    logs = math.log(start) + length / count * (np.arange(count) + 0.5)
    # multiplied by sqrt(lambda), which makes the density of diffusion more uniform
    weights = np.maximum(relaxations.at(logs), 0.0) * np.exp(logs / 2) * (length / count / np.pi)
    nodes, masses = np.zeros(0), np.zeros(0)
    for x, w, order in zip(np.split(logs, blocks), np.split(weights, blocks), shares(sections, blocks), strict=True):
        if w.sum() > 0:
            middle = float(x.mean())
            found, mass = gauss(x - middle, w, order)
            nodes = np.append(nodes, np.exp(middle + found))
            masses = np.append(masses, mass * np.exp((middle + found) / 2))
    # resistances far below the impedance would cause rounding errors in the others
    masses = np.maximum(masses, _LEAST * nodes * np.abs(relaxations.impedance(np.asarray(1j * nodes, dtype=complex))))
    ends = 1j * np.array([low, high])
    rest = relaxations.impedance(ends) - (masses / (ends[:, None] + nodes)).sum(axis=1)
    elastance = max(-low * float(rest[0].imag), _LEAST * low * abs(relaxations.impedance(ends)[0]))
    pairs = tuple((float(w / x), float(1 / w)) for x, w in zip(nodes, masses, strict=True))
    return max(float(rest[1].real), 0.0), 1 / elastance, pairs


def shares(sections: int, parts: int) -> list[int]:
    """Return the sections of each of several parts, as equal as can be."""
    return [len(piece) for piece in np.array_split(np.arange(sections), parts)]


def enough(made: Callable[[int], Ladder], sections: int | None, first: int, step: int | None = None) -> Ladder:
    """Return the ladder of ``sections``, or where None the first one whose error is below `LADDER_ERROR`.

    The number of sections starts from ``first`` and grows by ``step``, by an eighth where that is None.
    """
    count = sections or first
    while True:
        ladder = made(count)
        if sections or ladder.error <= LADDER_ERROR or count >= MOST_SECTIONS:
            return ladder
        count = min(count + (step or max(count // 8, 1)), MOST_SECTIONS)


def gauss(x: Array, weights: Array, order: int) -> tuple[Array, Array]:
    """Return nodes and weights (order,) of the Gauss quadrature of a discrete measure at ``x`` (n,).

    By Lanczos' recurrence (Golub and Welsch 1969).
    """
    if len(x) <= order:
        return x, weights
    scale = float(np.abs(x).max())
    points = x / scale
    total = weights.sum()
    basis = np.zeros((order + 1, len(x)))
    basis[0] = np.sqrt(weights / total)
    jacobi = np.zeros((order, order))
    for j in range(order):
        vector = points * basis[j]
        for _ in range(2):  # twice, so that they are orthogonal in spite of rounding
            vector -= basis[: j + 1].T @ (basis[: j + 1] @ vector)
        jacobi[j, j] = basis[j] @ (points * basis[j])
        norm = float(np.linalg.norm(vector))
        if j + 1 < order:
            jacobi[j, j + 1] = jacobi[j + 1, j] = norm
            basis[j + 1] = vector / norm
    nodes, vectors = np.linalg.eigh(jacobi)
    return nodes * scale, total * vectors[0] ** 2


def require_ladders(ladders: Ladders) -> None:
    """Raise InputError for a band that is none, or no sections, or more than 200."""
    low, high = ladders.band
    if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high):
        raise InputError(f"ladder band {low:g} Hz to {high:g} Hz: give two positive frequencies, the lower first")
    if ladders.sections is not None and not 1 <= ladders.sections <= MOST_SECTIONS:
        raise InputError(f"a ladder of {ladders.sections} sections: give 1 to {MOST_SECTIONS}")
