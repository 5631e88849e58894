"""Noise off a measured curve, its shape kept: local parabolas, at each sample as wide as the noise allows.

The width comes from the intersection of confidence intervals (Goldenshluger and Nemirovski 1997; Katkovnik 1999): it
grows as long as the estimates of all narrower windows agree with the wider one's within their noise. So a fast rise is
left alone, a slow tail is averaged over many samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .prepare import noise_level

Array = NDArray[np.float64]

#: Windows [samples] that are tried, the sample alone first.
WIDTHS = (1, 5, 9, 17, 33, 65, 129)
#: Half the length of the intervals that must intersect, in standard errors.
_CONFIDENCE = 2.0
#: So many numbers are worked on at once, which bounds the memory.
_CHUNK = 1_000_000


@dataclass(frozen=True)
class Smoothed:
    """``values`` (n,), their standard errors ``stderr`` (n,) by the white ``noise``, windows ``widths`` [samples]."""

    values: Array
    stderr: Array
    widths: NDArray[np.intp]
    noise: float


def smoothed(t: Array, y: Array) -> Smoothed:
    """Smooth ``y`` (n,) at ascending ``t`` (n,), even or not; unchanged where no white noise is seen."""
    noise = noise_level(y)
    values, stderr = y.copy(), np.full(len(y), noise)
    chosen = np.ones(len(y), dtype=np.intp)
    if not noise:
        return Smoothed(values, stderr, chosen, noise)
    low, high = y - _CONFIDENCE * noise, y + _CONFIDENCE * noise
    growing = np.ones(len(y), dtype=bool)
    for width in (w for w in WIDTHS[1:] if w <= len(y)):
        estimate, factor = _local_parabolas(t, y, width)
        error = noise * factor
        low, high = np.maximum(low, estimate - _CONFIDENCE * error), np.minimum(high, estimate + _CONFIDENCE * error)
        growing &= low <= high
        if not growing.any():
            break
        better = growing & (error < stderr)  # at an end the narrowest parabolas know less than the sample itself
        values[better], stderr[better], chosen[better] = estimate[better], error[better], width
    return Smoothed(values, stderr, chosen, noise)


def _local_parabolas(t: Array, y: Array, width: int) -> tuple[Array, Array]:
    """At every sample the least-squares parabola through ``width`` samples about it, and its error per unit of noise.

    Towards the ends the window stays within the record and the sample moves out of its middle.
    """
    first = np.clip(np.arange(len(t)) - width // 2, 0, len(t) - width)
    estimate, factor = np.empty(len(t)), np.empty(len(t))
    step = max(_CHUNK // width, 1)
    for start in range(0, len(t), step):
        rows = slice(start, start + step)
        inside = first[rows, None] + np.arange(width)
        x = t[inside] - t[rows, None]
        x = x / np.abs(x).max(axis=1, keepdims=True)
        powers = np.stack([(x**k).sum(axis=1) for k in range(5)])
        matrix = powers[np.add.outer(np.arange(3), np.arange(3))].transpose(2, 0, 1)
        unit = np.broadcast_to(np.array([[1.0], [0.0], [0.0]]), (len(x), 3, 1))
        # the estimate at x = 0 is weights @ y, and the sum of their squares is the first element of the inverse
        first_column = np.linalg.solve(matrix, unit)[:, :, 0]
        weights = first_column[:, :1] + first_column[:, 1:2] * x + first_column[:, 2:] * x**2
        estimate[rows] = (weights * y[inside]).sum(axis=1)
        factor[rows] = np.sqrt(np.maximum(first_column[:, 0], 0.0))
    return estimate, factor


def summit(t: Array, y: Array, curve: Smoothed) -> tuple[float, float] | None:
    """Time and height of the top of ``curve``, by one cubic through the samples that its window there holds.

    A top leans, so that a parabola as wide would shift it. None where the window is the sample alone, or the cubic has
    no top in it.
    """
    k = int(np.argmax(curve.values))
    width = int(curve.widths[k])
    if width < WIDTHS[1]:
        return None
    first = min(max(k - width // 2, 0), len(t) - width)
    scale = float(t[first + width - 1] - t[first])
    x = (t[first : first + width] - t[k]) / scale
    cubic = np.polynomial.Polynomial.fit(x, y[first : first + width], 3).convert()
    slope = cubic.deriv()
    tops = [float(r.real) for r in slope.roots() if abs(r.imag) < 1e-12 and slope.deriv()(r.real) < 0]
    within = [r for r in tops if x[0] < r < x[-1]]
    return (float(t[k]) + scale * within[0], float(cubic(within[0]))) if within else None
