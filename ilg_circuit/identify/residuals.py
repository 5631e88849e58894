"""What residuals tell: whether they are noise, or hold a structure that the model misses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Neighbouring residuals that correlate by more than this are a structure, not noise.
_CORRELATED = 0.3


def autocorrelation(residuals: Array) -> float:
    """Correlation of neighbouring residuals (lag 1), 0 for white noise."""
    power = float(residuals @ residuals)
    return float(residuals[1:] @ residuals[:-1] / power) if power else 0.0


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
