"""Whether data determine the parameters of a fit: rank, condition, standard errors, and open profiles, by name.

The sensitivities, by the logarithms and in units of the residuals' standard deviation, say how far every direction of
the parameters is felt: a singular value s has the standard error 1/s. Their rank counts the directions known to better
than a factor of e; the condition number, columns of equal length, tells how nearly alike parameters act.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError
from .bootstrap import widening
from .least_squares import Fit, fit_problem

Array = NDArray[np.float64]

#: A parameter whose standard error exceeds this part of it is not determined by the data.
DETERMINED = 0.5
#: One whose error is smaller than this has a closed profile without a look.
_SURE = 0.2
#: Parameters of this correlation act alike.
_ALIKE = 0.98
#: Branches whose time constants differ by less than this factor are one.
_DISTINCT = 1.5
#: A profile is open where a change by this factor is not objected to.
_FAR = 1e3


@dataclass(frozen=True)
class Identifiability:
    """Of a fit of ``parameters``: ``rank`` and ``condition`` (see the module), and what is not determined.

    ``loose`` have a standard error over `DETERMINED`; ``alike`` pairs act alike, (name, name, correlation), and
    ``merged`` are branches that are one; ``open`` says which parameter has no upper or lower limit.
    """

    parameters: int
    rank: int
    condition: float
    loose: tuple[str, ...]
    alike: tuple[tuple[str, str, float], ...]
    merged: tuple[str, ...]
    open: tuple[str, ...]

    @property
    def determined(self) -> bool:
        return not self.reason

    @property
    def reason(self) -> str:
        """Why the data do not determine every parameter; empty where they do."""
        told = []
        if self.loose:
            told.append(f"standard error over {DETERMINED:.0%}: {', '.join(self.loose)}")
            told += [f"{a} and {b} act alike (correlation {value:+.3f})" for a, b, value in self.alike]
        if self.rank < self.parameters:
            told.append(f"rank {self.rank} of {self.parameters}")
        if self.merged:
            told.append(f"branches with one time constant: {', '.join(self.merged)}")
        if self.open:
            told.append(f"profile open: {', '.join(self.open)}")
        return "; ".join(told)

    def to_json(self) -> dict[str, Any]:
        return {
            "parameters": self.parameters,
            "rank": self.rank,
            "condition": self.condition,
            "determined": self.determined,
            "loose": list(self.loose),
            "alike": [{"parameters": [a, b], "correlation": value} for a, b, value in self.alike],
            "merged_branches": list(self.merged),
            "open": list(self.open),
        }


def diagnose(fit: Fit, branches: Sequence[tuple[float, float]] = ()) -> Identifiability:
    """What the data of ``fit`` determine; ``branches`` ((R [ohm], C [F]), ...) by ascending time constant."""
    wider = widening(fit)
    errors = wider * fit.errors
    n = len(fit.values)
    felt = fit.problem.projected((fit.slopes[:, :n] * fit.units).T)
    deviation = float(np.sqrt(fit.residuals @ fit.residuals / fit.freedom)) or np.finfo(float).tiny
    with np.errstate(over="ignore"):  # of data without noise
        strengths = np.linalg.svd(felt / wider[:, None] / deviation, compute_uv=False)
    lengths = np.linalg.norm(felt, axis=1, keepdims=True)
    constants = [r * c for r, c in branches]
    merged = [f"{k} and {k + 1}" for k, (a, b) in enumerate(pairwise(constants), 1) if not b > _DISTINCT * a]
    matrix = fit.correlations()
    alike = [(i, j) for i, j in combinations(range(n), 2) if abs(matrix[i, j]) > _ALIKE]
    return Identifiability(
        parameters=n,
        rank=int((strengths > 1).sum()),
        condition=float(np.linalg.cond(felt / lengths)),
        loose=tuple(fit.names[k] for k in range(n) if not errors[k] <= DETERMINED * fit.values[k]),
        alike=tuple((fit.names[i], fit.names[j], float(matrix[i, j])) for i, j in alike),
        merged=tuple(merged),
        open=tuple(
            side for k in range(n) if not errors[k] <= _SURE * fit.values[k] for side in _open_sides(fit, k, wider[k])
        ),
    )


def _open_sides(fit: Fit, k: int, widening: float) -> list[str]:
    """Sides on which the data do not object to parameter ``k`` far away, all others fitted anew."""
    from scipy.stats import f as fisher

    limit = 1 + float(fisher.ppf(0.95, 1, fit.freedom)) * widening**2 / fit.freedom
    rest = np.delete(fit.values, k)
    found = []
    for sign, name in ((-1.0, "lower"), (1.0, "upper")):
        moved = float(fit.coordinates[k]) + sign * np.log(_FAR)
        try:
            squares = fit_problem(fit.problem.holding(k, moved), rest, tolerance=1e-6).residuals
        except IlgError:
            continue  # no fit can live with it
        if float(squares @ squares) <= limit * float(fit.residuals @ fit.residuals):
            found.append(f"{fit.names[k]} has no {name} limit")
    return found
