"""Quantiles of Student's and Fisher's distributions.

They are those of `scipy.stats`, whose import takes longer than many a fit.
"""

from __future__ import annotations

from typing import Any

from ..extras import whole


def student(level: float, freedom: Any) -> Any:
    """Return the quantile of Student's distribution at ``level``; NaN where ``freedom`` is not positive."""
    with whole():
        from scipy.special import stdtrit

    return stdtrit(freedom, level)


def fisher(level: float, above: Any, below: Any) -> Any:
    """Return the quantile at ``level`` of a ratio of variances with ``above`` and ``below`` degrees of freedom."""
    with whole():
        from scipy.special import fdtri

    return fdtri(above, below, level)
