"""The fractional element 1/(1 + (s tau)^a) as a sum of first-order relaxations.

    1/(1 + (s tau)^a) = integral of f(x)/(1 + s tau exp(-x)) dx,   f(x) = sin(pi a)/(2 pi (cosh(a x) + cos(pi a)))

The density f is gathered in relaxations by Gauss quadrature; what relaxes far slower or faster than the band is one
more relaxation at each end, so that the sum of the weights is 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...arrays import Array, ComplexArray
from ..ladder import LADDER_BAND, LADDER_ERROR, MOST_SECTIONS, ORDER, gauss, shares

#: Factors beyond both ends of the band up to which relaxations are told apart.
_SLOWER, _FASTER = 1e3, 30.0
#: Part of the density at the ends of the band that may be left out.
_TAIL = 1e-7
#: Largest logarithm of the ratio of a relaxation's time constant and tau.
_LONGEST = 600.0
_SAMPLES = 6000
_A_DECADE = 20


@dataclass(frozen=True)
class FractionalLadder:
    """Weights and time constants, relative to tau, of ``sections`` ((weight, ratio), ...), and their largest error.

    ``error`` is relative to the element's own size, over the band.
    """

    sections: tuple[tuple[float, float], ...]
    error: float


def fractional(s_tau: ComplexArray, exponent: float) -> ComplexArray:
    """Return 1/(1 + (s tau)^a)."""
    return np.asarray(1 / (1 + s_tau**exponent))


def fractional_ladder(
    exponent: float, time: float, band: tuple[float, float] = LADDER_BAND, sections: int | None = None
) -> FractionalLadder:
    """Return the ladder of an element of ``time`` constant [s] over a ``band`` [Hz].

    By default it has as many sections as `LADDER_ERROR` needs.
    """
    return _ladder(float(exponent), 2 * math.pi * band[0] * time, 2 * math.pi * band[1] * time, sections)


@lru_cache(maxsize=256)
def _ladder(exponent: float, low: float, high: float, sections: int | None) -> FractionalLadder:
    most = max(abs(math.log(low / _SLOWER)), abs(math.log(high * _FASTER)))
    tail = min(most + math.log(1 / _TAIL) / exponent, _LONGEST)
    # x = log(tau/tau_k), positive for what is faster than tau; close together at the peak at 0, narrow for a near 1
    width = math.pi * (1 - exponent) / exponent
    edge = math.asinh(tail / width)
    grid = width * np.sinh(np.linspace(-edge, edge, _SAMPLES + 1))
    share = np.diff(_share(grid, exponent))
    share[0] += _share(grid[:1], exponent)[0]
    share[-1] += 1 - _share(grid[-1:], exponent)[0]
    middle = (grid[1:] + grid[:-1]) / 2
    slow, fast = middle < math.log(low / _SLOWER), middle > math.log(high * _FASTER)
    # what lies beyond the band: one relaxation at each end, right to first order in the band
    ends = [(float(share[k].sum()), k) for k in (slow, fast) if share[k].sum() > 0]
    beyond = [
        (m, m / float(share[k] @ np.exp(middle[k])) if k is slow else float(share[k] @ np.exp(-middle[k])) / m)
        for m, k in ends
    ]
    kept = ~(slow | fast)
    middle, share = middle[kept], share[kept]
    omega = np.geomspace(low, high, max(int(_A_DECADE * math.log10(high / low)), 2) + 1)
    ideal = fractional(np.asarray(1j * omega, dtype=complex), exponent)
    count = sections or 2 * ORDER
    while True:
        found = (*_gathered(middle, share, count), *beyond)
        weights, ratios = np.array(found).T
        made = (weights / (1 + 1j * omega[:, None] * ratios)).sum(axis=1)
        error = 1.02 * float((np.abs(made - ideal) / np.abs(ideal)).max()) + 1e-12
        if sections or error <= LADDER_ERROR or count >= MOST_SECTIONS:
            return FractionalLadder(found, error)
        count += ORDER


def _share(x: Array, exponent: float) -> Array:
    """Return the part of the density below x."""
    half = math.pi * exponent / 2
    return np.asarray(0.5 + np.arctan(np.tan(half) * np.tanh(exponent * x / 2)) / (math.pi * exponent))


def _gathered(x: Array, share: Array, count: int) -> tuple[tuple[float, float], ...]:
    """Return about ``count`` weights and ratios of time constants, slowest first."""
    blocks = -(-count // ORDER)
    edges = np.linspace(x[0], x[-1], blocks + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, blocks - 1)
    found: list[tuple[float, float]] = []
    for block, order in enumerate(shares(count, blocks)):
        here = place == block
        weights = share[here]
        if not weights.sum() > 0:
            continue
        middle = float(x[here].mean())
        nodes, masses = gauss(x[here] - middle, weights, order)
        found += [(float(m), math.exp(-middle - float(n))) for n, m in zip(nodes, masses, strict=True) if m > 0]
    return tuple(found)
