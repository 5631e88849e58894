"""RC ladders that stand for diffusion: the finite-length Warburg element and the constant phase element (CPE).

Both impedances are sums or integrals of relaxations w/(s + lambda) with positive weights,

    reflecting Warburg   Rw coth(sqrt(s tau))/sqrt(s tau) = (Rw/tau) [1/s + sum over k >= 1 of 2/(s + (k pi)^2/tau)]
    CPE                  1/(Q s^a) = sin(pi a)/(pi Q) integral of lambda^-a/(s + lambda) dlambda,  0 < a < 1

so they are realised by R parallel C sections in series (Foster's first form) with one capacitor, which alone has the
whole charge, and one resistor for what relaxes faster than the band. Relaxations between the band's ends are gathered
in few sections; the largest error over the band is measured against the closed form and stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Band [Hz] of a ladder where nothing else is said.
LADDER_BAND = (1e-4, 1e4)
#: Error that an automatic number of sections stays below, relative to the ideal impedance, anywhere in the band.
LADDER_ERROR = 1e-4
_MOST_SECTIONS = 200
#: Modes of the Warburg element up to this one are taken as they are, those above as a continuum.
_DISCRETE_MODES = 1000
_PER_DECADE = 60
#: Nodes of the quadrature that gathers relaxations, a block: four need the fewest sections.
_ORDER = 4


@dataclass(frozen=True)
class Ladder:
    """Z(s) = ``resistance`` + 1/(``capacitance`` s) + sum of R/(1 + R C s) over ``sections`` (R [ohm], C [F]).

    ``law`` is "warburg" with ``constants`` Rw [ohm], tau [s], or "cpe" with Q [F s^(a-1)], a. ``band`` [Hz] is where
    ``error`` bounds the difference from it, relative to it.
    """

    law: Literal["warburg", "cpe"]
    constants: tuple[float, float]
    resistance: float
    capacitance: float
    sections: tuple[tuple[float, float], ...]
    band: tuple[float, float]
    error: float

    def impedance(self, s: ArrayLike) -> ComplexArray:
        """Of the ladder [ohm] at complex frequencies ``s`` [rad/s], any shape."""
        points = np.asarray(s, dtype=complex)
        total = self.resistance + 1 / (self.capacitance * points)
        for r, c in self.sections:
            total = total + r / (1 + r * c * points)
        return np.asarray(total)

    def ideal(self, s: ArrayLike) -> ComplexArray:
        """Of the element that the ladder stands for [ohm]."""
        law = warburg_impedance if self.law == "warburg" else cpe_impedance
        return law(s, *self.constants)

    def measured_error(self, per_decade: int = _PER_DECADE) -> float:
        """Largest difference over the band, relative to the ideal impedance."""
        low, high = self.band
        s = 2j * np.pi * np.geomspace(low, high, max(int(per_decade * math.log10(high / low)), 2) + 1)
        ideal = self.ideal(s)
        return float((np.abs(self.impedance(s) - ideal) / np.abs(ideal)).max())


def warburg_impedance(s: ArrayLike, resistance: float, time_constant: float) -> ComplexArray:
    """Finite length, reflecting: Rw coth(sqrt(s tau))/sqrt(s tau) [ohm]."""
    x = np.sqrt(np.asarray(s, dtype=complex) * time_constant)
    # coth by exponentials that cannot overflow; Re x >= 0
    decay = np.exp(-2 * x)
    return np.asarray(resistance * (1 + decay) / (-np.expm1(-2 * x)) / x)


def cpe_impedance(s: ArrayLike, coefficient: float, exponent: float) -> ComplexArray:
    """Constant phase element: 1/(Q s^a) [ohm]."""
    return np.asarray(1 / (coefficient * np.asarray(s, dtype=complex) ** exponent))


def warburg_ladder(
    resistance: float,
    time_constant: float,
    band: tuple[float, float],
    sections: int | None = None,
    reach: float | None = None,
) -> Ladder:
    """The ladder of a finite Warburg element over ``band`` [Hz], by as many ``sections`` as `LADDER_ERROR` needs.

    ``reach`` sets the fastest relaxation, as a number of 1/tau, in place of the band's upper end: ladders of equal
    reach and sections are scaled copies of one another, so a fit sees a smooth function. Raises InputError for no
    sections, or more than 200.
    """
    _require_band(band)
    _require_sections(sections)
    product = 2 * np.pi * band[1] * time_constant if reach is None else reach
    # rounded up to a decade: strips that differ little share one ladder
    decade = max(math.ceil(math.log10(product) - 1e-9), 1)
    lowest = 10.0 ** min(math.floor(math.log10(2 * np.pi * band[0] * time_constant)), decade - 1)
    unit = _unit_warburg(decade, lowest, sections)
    scaled = tuple((resistance * r, time_constant / resistance * c) for r, c in unit.sections)
    ladder = Ladder(
        "warburg",
        (resistance, time_constant),
        resistance * unit.resistance,
        time_constant / resistance * unit.capacitance,
        scaled,
        band,
        0.0,
    )
    return _with_error(ladder)


def cpe_ladder(coefficient: float, exponent: float, band: tuple[float, float], sections: int | None = None) -> Ladder:
    """The ladder of a CPE over ``band`` [Hz]. Raises InputError for an exponent outside (0, 1), sections as above."""
    _require_band(band)
    _require_sections(sections)
    if not 0 < exponent < 1:
        raise InputError(f"CPE exponent {exponent:g} must lie between 0 and 1")
    count = sections or 4
    while True:
        ladder = _with_error(_cpe(coefficient, exponent, band, count))
        if sections or ladder.error <= LADDER_ERROR or count >= _MOST_SECTIONS:
            return ladder
        count = min(count + max(count // 8, 1), _MOST_SECTIONS)


def _with_error(ladder: Ladder) -> Ladder:
    # between the points of the scan the error can be a little larger
    fields = {name: getattr(ladder, name) for name in Ladder.__dataclass_fields__}
    return Ladder(**(fields | {"error": 1.02 * ladder.measured_error() + 1e-12}))


@lru_cache(maxsize=64)
def _unit_warburg(decade: int, lowest: float, sections: int | None) -> Ladder:
    """The ladder for Rw = 1 ohm, tau = 1 s and angular frequencies from ``lowest`` to 10^decade rad/s."""
    highest = 10.0**decade
    band = (lowest / (2 * np.pi), highest / (2 * np.pi))
    rates, weights, rest = _warburg_modes(highest * LADDER_ERROR ** (-2 / 3))
    count = sections or 4
    while True:
        nodes, masses = _gathered(rates, weights, count)
        pairs = tuple((float(w / x), float(1 / w)) for x, w in zip(nodes, masses, strict=True))
        ladder = _with_error(Ladder("warburg", (1.0, 1.0), rest, 1.0, pairs, band, 0.0))
        if sections or ladder.error <= LADDER_ERROR or count >= _MOST_SECTIONS:
            return ladder
        count += 1


def _warburg_modes(highest: float) -> tuple[Array, Array, float]:
    """Rates and weights of the unit element's relaxations up to ``highest`` [rad/s], resistance of those above."""
    last = math.sqrt(highest) / math.pi
    k = np.arange(1, min(_DISCRETE_MODES, max(int(last), 1)) + 1, dtype=float)
    rates, weights = (k * np.pi) ** 2, np.full(len(k), 2.0)
    start = k[-1] + 0.5
    if last > start:  # midpoints of a fine logarithmic grid stand for the continuum of mode numbers
        edges = np.geomspace(start, last, int(200 * math.log10(last / start)) + 2)
        rates = np.concatenate([rates, np.pi**2 * edges[:-1] * edges[1:]])
        weights = np.concatenate([weights, 2 * np.diff(edges)])
        start = last
    return rates, weights, 2 / (np.pi**2 * start)


def _gathered(rates: Array, weights: Array, sections: int) -> tuple[Array, Array]:
    """At most ``sections`` relaxations for many: Gauss quadrature on blocks of equal ratio."""
    blocks = -(-sections // _ORDER)
    edges = np.geomspace(rates[0] * 0.999, rates[-1] * 1.001, blocks + 1)
    orders = [len(part) for part in np.array_split(np.arange(sections), blocks)]
    nodes, masses = [], []
    for k, order in enumerate(orders):
        inside = (rates >= edges[k]) & (rates < edges[k + 1])
        if inside.any():
            x, w = _gauss(rates[inside], weights[inside], order)
            nodes.append(x)
            masses.append(w)
    return np.concatenate(nodes), np.concatenate(masses)


def _gauss(rates: Array, weights: Array, order: int) -> tuple[Array, Array]:
    """Gauss quadrature of ``order`` nodes for a discrete measure, by Lanczos' recurrence (Golub and Welsch 1969)."""
    if len(rates) <= order:
        return rates, weights
    scale = rates[-1]
    total = weights.sum()
    basis = np.zeros((order + 1, len(rates)))
    basis[0] = np.sqrt(weights / total)
    jacobi = np.zeros((order, order))
    for j in range(order):
        vector = rates / scale * basis[j]
        for _ in range(2):  # twice, so that rounding leaves them orthogonal
            vector -= basis[: j + 1].T @ (basis[: j + 1] @ vector)
        jacobi[j, j] = basis[j] @ (rates / scale * basis[j])
        norm = float(np.linalg.norm(vector))
        if j + 1 < order:
            jacobi[j, j + 1] = jacobi[j + 1, j] = norm
            basis[j + 1] = vector / norm
    x, vectors = np.linalg.eigh(jacobi)
    return x * scale, total * vectors[0] ** 2


def _cpe(coefficient: float, exponent: float, band: tuple[float, float], sections: int) -> Ladder:
    """Trapezoidal rule over ln(lambda), which converges exponentially; beyond both ends the sums are closed.

    The ends reach so far beyond the band that capacitor and resistor are right to half the error allowed there.
    """
    below = (LADDER_ERROR / 2) ** (1 / (2 - exponent))
    above = (LADDER_ERROR / 2) ** (-1 / (1 + exponent))
    low, high = 2 * np.pi * band[0] * below, 2 * np.pi * band[1] * above
    step = math.log(high / low) / sections
    rates = low * np.exp(step * (np.arange(sections) + 0.5))
    scale = math.sin(math.pi * exponent) / (math.pi * coefficient) * step
    weights = scale * rates ** (1 - exponent)
    ratio = math.exp(-step * (1 - exponent))
    elastance = weights[0] * ratio / (1 - ratio)
    ratio = math.exp(-step * exponent)
    rest = weights[-1] / rates[-1] * ratio / (1 - ratio)
    pairs = tuple((float(w / x), float(1 / w)) for x, w in zip(rates, weights, strict=True))
    return Ladder("cpe", (coefficient, exponent), float(rest), float(1 / elastance), pairs, band, 0.0)


def _require_band(band: tuple[float, float]) -> None:
    if not (all(map(math.isfinite, band)) and 0 < band[0] < band[1]):
        raise InputError(
            f"ladder band {band[0]:g} Hz to {band[1]:g} Hz: give two positive frequencies, the lower first"
        )


def _require_sections(sections: int | None) -> None:
    if sections is not None and not 1 <= sections <= _MOST_SECTIONS:
        raise InputError(f"a ladder of {sections} sections: give 1 to {_MOST_SECTIONS}")
