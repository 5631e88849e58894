"""What residuals tell: whether they are noise, or hold a structure that the model misses."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Neighbouring residuals that correlate by more than this are a structure, not noise.
_CORRELATED = 0.3

#: Windows a decade of time, and decades, in a table of residuals.
_WINDOWS_A_DECADE, _DECADES = 2, 3


@dataclass(frozen=True)
class ResidualWindow:
    """``rms`` of the ``count`` residuals from ``start`` to ``end`` [s] since the onset."""

    start: float
    end: float
    count: int
    rms: float

    def to_json(self) -> dict[str, float]:
        return {"from_s": self.start, "to_s": self.end, "n": self.count, "rms": self.rms}


def residual_windows(time: Array, residuals: Array, last: float) -> tuple[ResidualWindow, ...]:
    """Residuals from the onset to ``last`` [s] in windows even by the logarithm of time: the fast part counts."""
    after = time >= 0
    t, rest = time[after], residuals[after]
    powers = np.arange(_WINDOWS_A_DECADE * _DECADES, 0, -1) / _WINDOWS_A_DECADE
    edges = [0.0, *(last / 10**powers).tolist(), last]
    rows = []
    for low, high in pairwise(edges):
        inside = (t >= low) & ((t < high) | (high == last))
        if inside.any():
            rows.append(ResidualWindow(low, high, int(inside.sum()), float(np.sqrt(np.mean(rest[inside] ** 2)))))
    return tuple(rows)


def autocorrelation(residuals: Array) -> float:
    """Correlation of neighbouring residuals (lag 1), 0 for white noise."""
    power = float(residuals @ residuals)
    return float(residuals[1:] @ residuals[:-1] / power) if power else 0.0


def autocorrelations(residuals: Array, most: int = 60) -> Array:
    """Correlation of ``residuals`` with themselves, their mean taken off, at lags 0, 1, ... up to ``most``."""
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    lags = range(min(most, len(residuals) - 1) + 1)
    return np.array([centred[k:] @ centred[: len(centred) - k] / power if power else float(k == 0) for k in lags])


def structured(residuals: Array) -> bool:
    """Whether neighbouring residuals are alike: beyond chance, and by more than a little."""
    return bool(autocorrelation(residuals) > max(_CORRELATED, 4 / np.sqrt(len(residuals))))


def effective_samples(residuals: Array) -> float:
    """Number of independent samples that residuals with this autocorrelation amount to (AR(1))."""
    correlation = min(max(autocorrelation(residuals), 0.0), 0.999)
    return max(len(residuals) * (1 - correlation) / (1 + correlation), 5.0)


def independent_samples(residuals: Array) -> float:
    """All samples of white residuals, the `effective_samples` of those whose neighbours are alike."""
    return effective_samples(residuals) if structured(residuals) else float(len(residuals))


def information_criterion(residuals: Array, unknowns: int, samples: float) -> float:
    """BIC for ``samples`` independent samples out of all residuals."""
    variance = max(float(np.mean(residuals**2)), np.finfo(float).tiny)
    return float(samples * np.log(variance) + np.log(samples) * unknowns)
