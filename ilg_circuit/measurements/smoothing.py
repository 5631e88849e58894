"""Estimates the noise of a measured curve, and smooths it by local parabolas of adaptive width.

The width at each sample comes from the intersection of confidence intervals (Goldenshluger and Nemirovski 1997;
Katkovnik 1999): it grows as long as the estimates of all narrower windows agree with the wider one's within their
noise. A fast rise is therefore not smoothed, and a slow tail is averaged over many samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array

#: Windows [samples] that are tried, the sample alone first.
WIDTHS = (1, 5, 9, 17, 33, 65, 129)
#: Half the length of the intervals that must intersect, in standard errors.
_CONFIDENCE = 2.0
#: Largest digit of an instrument, as a fraction of the range of the readings.
_DIGIT = 0.01
#: Largest number of significant digits that are attributed to a file.
_DIGITS = 12
#: Median of the magnitude of a normal variable, in standard deviations.
_MEDIAN = 0.6745
#: Number of values that are processed at once, which limits the memory.
_CHUNK = 1_000_000


@dataclass(frozen=True)
class Smoothed:
    """``values`` (n,), their standard errors ``stderr`` (n,) by the white ``noise``, windows ``widths`` [samples]."""

    values: Array
    stderr: Array
    widths: NDArray[np.intp]
    noise: float


def noise_level(values: Array) -> float:
    """Return the standard deviation of the white noise on a smooth signal, from its sixth differences.

    The estimate is robust against a few jumps. It is 0 for fewer than 16 ``values``, which are evenly spaced and in any
    unit.
    """
    if len(values) < 16:
        return 0.0
    sixth = np.abs(np.diff(values, 6))
    # white noise of unit size has sixth differences of size sqrt(924)
    robust = float(np.median(sixth) / _MEDIAN / np.sqrt(924))
    # with a coarse resolution more than half of them are zero; a few jumps must not count as noise
    return robust or float(np.sqrt(np.mean(np.sort(sixth)[: int(0.95 * len(sixth))] ** 2) / 924))


def noise_beside_kinks(values: Array, last_digit: float) -> float:
    """Return the standard deviation of the white noise on a signal that varies and may have kinks, in its unit.

    Kinks look like noise in the sixth differences of a smooth curve, curves in the second ones of straight lines: it is
    the smaller of both. Noise below the ``last_digit`` of the ``values`` (n,) is that of the sixth differences.
    """
    smooth = noise_level(values)
    if smooth <= last_digit:
        return smooth
    return min(smooth, float(np.median(np.abs(np.diff(values, 2)))) / _MEDIAN / np.sqrt(6))


def resolution(values: Array) -> float:
    """Return the smallest nonzero difference of any two readings: the instrument's resolution, if it is visible."""
    differences = np.diff(np.unique(values))
    return float(differences.min()) if len(differences) else 0.0


def digit(values: Array) -> float:
    """Return the instrument's `resolution`, 0 if the smallest difference belongs to the signal."""
    step = resolution(values)
    return step if step < _DIGIT * float(np.ptp(values)) else 0.0


def last_place(values: Array) -> Array:
    """Return the unit of the last digit that each of the ``values`` (n,) of a column was written with.

    All are assumed to have the digits, significant or decimal, of the longest number.
    """
    size = np.abs(values)
    shown = [f"{v:.{_DIGITS - 1}e}".split("e") for v in size[size > 0]]
    if not shown:
        return np.zeros_like(values)
    digits = np.array([len(mantissa.replace(".", "").rstrip("0")) for mantissa, _ in shown])
    powers = np.array([float(power) for _, power in shown])
    power = np.floor(np.log10(np.where(size > 0, size, 1.0)))
    by_digits = np.where(size > 0, 10.0 ** (power - digits.max() + 1), 0.0)
    return np.maximum(by_digits, 10.0 ** -float((digits - 1 - powers).max()))


def smoothed(t: Array, y: Array, noise: float | None = None) -> Smoothed:
    """Return the smooth ``y`` (n,) at ascending ``t`` (n,), even or not; without white noise it stays unchanged.

    ``noise`` is the noise's standard deviation, by default its `noise_level`.
    """
    noise = noise_level(y) if noise is None else noise
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
        better = growing & (error < stderr)  # at an end the narrowest parabolas have a larger error than the sample
        values[better], stderr[better], chosen[better] = estimate[better], error[better], width
    return Smoothed(values, stderr, chosen, noise)


def _local_parabolas(t: Array, y: Array, width: int) -> tuple[Array, Array]:
    """Fit a parabola through ``width`` samples about every sample; return its value there and its error per unit noise.

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
        square = x * x
        powers = np.stack([term.sum(axis=1) for term in (np.ones_like(x), x, square, square * x, square * square)])
        matrix = powers[np.add.outer(np.arange(3), np.arange(3))].transpose(2, 0, 1)
        unit = np.broadcast_to(np.array([[1.0], [0.0], [0.0]]), (len(x), 3, 1))
        # the estimate at x = 0 is weights @ y, and the sum of their squares is the first element of the inverse
        first_column = np.linalg.solve(matrix, unit)[:, :, 0]
        weights = first_column[:, :1] + first_column[:, 1:2] * x + first_column[:, 2:] * square
        estimate[rows] = (weights * y[inside]).sum(axis=1)
        factor[rows] = np.sqrt(np.maximum(first_column[:, 0], 0.0))
    return estimate, factor


def summit(t: Array, y: Array, curve: Smoothed) -> tuple[float, float] | None:
    """Return time and height of the top of ``curve``, by a cubic through the samples of its window there.

    A top is not symmetric, so that a parabola of the same width would shift it. None if the window is a single sample,
    or the cubic has no top in it.
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
