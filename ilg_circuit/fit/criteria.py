"""Criteria computed from residuals: autocorrelation, effective sample size, likelihood, information criteria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays import Array

#: Correlation of neighbouring residuals above which they are a structure, not noise.
_CORRELATED = 0.3

#: Share of a signal's variance, and number of readings' variances, that chance explains.
_NOTHING, _BY_CHANCE = 0.05, 25.0

#: Least number of independent samples.
_FEWEST = 5.0

#: Windows per decade of time, and number of decades, in a table of residuals.
_WINDOWS_A_DECADE, _DECADES = 2, 3


@dataclass(frozen=True)
class ResidualWindow:
    """``rms`` of the ``count`` residuals from ``start`` to ``end`` [s] since the onset."""

    start: float
    end: float
    count: int
    rms: float

    def to_dict(self) -> dict[str, float]:
        return {"from_s": self.start, "to_s": self.end, "n": self.count, "rms": self.rms}


def _edges(last: float) -> list[float]:
    """Return the edges [s] of windows evenly spaced in log time, from the onset to ``last`` [s]."""
    powers = np.arange(_WINDOWS_A_DECADE * _DECADES, 0, -1) / _WINDOWS_A_DECADE
    return [0.0, *(last / 10**powers).tolist(), last]


def residual_windows(time: Array, residuals: Array, last: float) -> tuple[ResidualWindow, ...]:
    """Return the residuals in windows evenly spaced in log time to ``last`` [s], so that the fast part has weight."""
    after = time >= 0
    t, rest = time[after], residuals[after]
    rows = []
    for low, high in pairwise(_edges(last)):
        inside = (t >= low) & ((t < high) | (high == last))
        if inside.any():
            rows.append(ResidualWindow(low, high, int(inside.sum()), float(np.sqrt(np.mean(rest[inside] ** 2)))))
    return tuple(rows)


def parts_by_time(time: Array, residuals: Array) -> list[Array]:
    """Return the residuals before the onset, and those since in the windows of `residual_windows`, without empty ones.

    Residuals from model errors vary with the logarithm of time: fast at first, slowly at the end.
    """
    inner = _edges(float(time[-1]))[1:-1]
    parts = np.split(residuals, np.searchsorted(time, [0.0, *inner]) if time[-1] > 0 else [])
    return [part for part in parts if len(part)]


def autocorrelation(residuals: Array) -> float:
    """Return the correlation of neighbouring residuals (lag 1), 0 for white noise."""
    power = float(residuals @ residuals)
    return float(residuals[1:] @ residuals[:-1] / power) if power else 0.0


def autocorrelations(residuals: Array, most: int = 60) -> Array:
    """Return the autocorrelation of ``residuals`` about their mean at lags 0, 1, ... up to ``most``."""
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    lags = range(min(most, len(residuals) - 1) + 1)
    return np.array([centred[k:] @ centred[: len(centred) - k] / power if power else float(k == 0) for k in lags])


def structured(residuals: Array) -> bool:
    """Return True if residuals are autocorrelated: beyond chance, and by more than a little."""
    return bool(autocorrelation(residuals) > max(_CORRELATED, 4 / np.sqrt(len(residuals))))


def effective_samples(residuals: Array) -> float:
    """Return the effective number of independent samples of autocorrelated residuals (AR(1))."""
    correlation = min(max(autocorrelation(residuals), 0.0), 0.999)
    return max(len(residuals) * (1 - correlation) / (1 + correlation), 5.0)


def independent_samples(residuals: Array, channels: int = 1) -> float:
    """Return the number of independent samples: all if white, the `effective_samples` if autocorrelated.

    ``channels`` is the number of equal parts of the residuals, such as real and imaginary ones, one after the other.
    """
    parts = np.split(residuals, channels)
    if not any(structured(part) for part in parts):
        return float(len(residuals))
    return max(sum(effective_samples(part) for part in parts), 5.0)


def share_explained(residuals: Array, readings: Array) -> tuple[float, bool]:
    """Return the share of the variance of ``readings`` (n,) that ``residuals`` (n,) leave out, and whether it is small.

    It is where chance explains as much of so many readings, or where it is next to nothing.
    """
    power = float(readings @ readings)
    share = 1 - float(residuals @ residuals) / power if power else 0.0
    return share, share < max(_NOTHING, _BY_CHANCE / len(readings))


def integrated_time(residuals: Array) -> float:
    """Return the integrated autocorrelation time in samples, 1 + 2 sum of the autocorrelations, at least 1.

    Autocorrelations are taken about zero, since an offset of residuals is a structure. The sum is truncated by Geyer's
    initial monotone sequence (Geyer 1992): sums of two lags while they are positive, limited by the previous one.
    """
    samples = len(residuals)
    size = 1 << (2 * samples - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(residuals, size)) ** 2
    products = np.fft.irfft(spectrum, size)[:samples]
    if not products[0] > 0:
        return 1.0
    pairs = (products[: samples // 2 * 2] / products[0]).reshape(-1, 2).sum(axis=1)
    positive = len(pairs) if (pairs > 0).all() else int(np.argmin(pairs > 0))
    return max(2 * float(np.minimum.accumulate(pairs[:positive]).sum()) - 1, 1.0)


def samples_for_bic(parts: Sequence[Array]) -> float:
    """Return the number of independent samples, n over the `integrated_time`, of stationary ``parts`` of residuals.

    Parts are real and imaginary ones, or `parts_by_time`. All samples count in a part whose autocorrelation is within
    three standard errors of zero. The number is at least `_FEWEST`, so that a criterion keeps a penalty.
    """
    samples = sum(map(len, parts))
    power = sum(float(part @ part) for part in parts)
    together = sum(float(part[1:] @ part[:-1]) for part in parts)
    if together <= 3 / np.sqrt(samples) * power:
        return float(max(samples, _FEWEST))
    return max(sum(len(part) / integrated_time(part) for part in parts), _FEWEST)


def likelihood(residuals: Array) -> float:
    """Return -2 log(likelihood) of normal residuals with the variance maximised, up to a constant: m log(squares/m)."""
    samples = len(residuals)
    return float(samples * np.log(max(float(residuals @ residuals), np.finfo(float).tiny) / samples))


def information_criterion(residuals: Array, unknowns: int, samples: float) -> float:
    """Return the BIC for ``samples`` independent samples out of all residuals."""
    variance = max(float(np.mean(residuals**2)), np.finfo(float).tiny)
    return float(samples * np.log(variance) + np.log(samples) * unknowns)
