"""Tests identifiability: whether data determine a fit's parameters, by rank, condition, errors and open profiles.

The singular values s of the sensitivities, with respect to logarithms and in units of the residuals' standard
deviation, correspond to standard errors 1/s of directions of the parameters. The rank is the number of directions
determined to better than a factor of e; the condition number, with columns of equal length, measures collinearity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from ..errors import IlgError
from .fitting import fit
from .quantiles import fisher
from .reported import reported_errors
from .result import FitResult

#: Relative standard error above which the data do not determine a parameter.
DETERMINED = 0.5
#: Relative standard error below which a profile is closed, without computing it.
_SURE = 0.2
#: Correlation above which two parameters are collinear.
_ALIKE = 0.98
#: Ratio of time constants below which two branches are the same.
_DISTINCT = 1.5
#: Factor by which a parameter of an open profile can be changed without a significant misfit.
_FAR = 1e3
#: Relative change of the sum of squares, and evaluations, that end a descent with a parameter there.
_ROUGH, _MOST = 1e-6, 25


@dataclass(frozen=True)
class Identifiability:
    """Diagnostics of a fit of ``parameters``: ``rank``, ``condition`` (see the module), undetermined parameters.

    ``loose`` have a standard error over `DETERMINED`; ``alike`` are collinear pairs (name, name, correlation);
    ``merged`` are branches with the same time constant; ``open`` are parameters without an upper or lower limit;
    ``unfelt`` are parameters that were fixed because they have no effect on the data.
    """

    parameters: int
    rank: int
    condition: float
    loose: tuple[str, ...]
    alike: tuple[tuple[str, str, float], ...]
    merged: tuple[str, ...]
    open: tuple[str, ...]
    unfelt: tuple[str, ...] = ()

    @property
    def determined(self) -> bool:
        """True if the data determine every parameter."""
        return not (self.loose or self.merged or self.open or self.unfelt or self.rank < self.parameters)

    @property
    def reason(self) -> str:
        """The reasons why the data do not determine every parameter, in words; empty if they do."""
        reasons = []
        if self.unfelt:
            reasons.append(f"no effect on the data: {', '.join(self.unfelt)}")
        if self.loose:
            reasons.append(f"standard error over {DETERMINED:.0%}: {', '.join(self.loose)}")
            reasons += [f"{a} and {b} have the same effect (correlation {value:+.3f})" for a, b, value in self.alike]
        if self.rank < self.parameters:
            reasons.append(f"rank {self.rank} of {self.parameters}")
        if self.merged:
            reasons.append(f"branches with one time constant: {', '.join(self.merged)}")
        if self.open:
            reasons.append(f"profile open: {', '.join(self.open)}")
        return "; ".join(reasons)

    def to_dict(self) -> dict[str, Any]:
        return {
            "parameters": self.parameters,
            "rank": self.rank,
            "condition": self.condition,
            "determined": self.determined,
            "loose": list(self.loose),
            "alike": [{"parameters": [a, b], "correlation": value} for a, b, value in self.alike],
            "merged_branches": list(self.merged),
            "open": list(self.open),
            "unfelt": list(self.unfelt),
        }


def diagnose(
    found: FitResult,
    branches: Sequence[tuple[float, float]] = (),
    unfelt: Sequence[str] = (),
    *,
    profiles: bool = True,
    spared: str = "",
) -> Identifiability:
    """Return the diagnostics of a fit.

    ``branches`` ((R [ohm], C [F]), ...) are by ascending time constant; ``unfelt`` are parameters that were fixed
    because they have no effect on the data. Without ``profiles``, which cost two fits each, none is open. The parameter
    ``spared`` may be undetermined: the others are diagnosed with it free.
    """
    errors, labels = reported_errors(found), found.labels
    wider = errors / found.pooled_errors
    felt = found.problem.projected((found.slopes[:, : len(labels)] * found.units).T)
    kept = [k for k, x in enumerate(labels) if x != spared or errors[k] <= DETERMINED * found.values[k]]
    if len(kept) < len(labels):
        free = felt[labels.index(spared)] / np.linalg.norm(felt[labels.index(spared)])
        felt = felt[kept] - np.outer(felt[kept] @ free, free)
        wider = wider[kept]
    with np.errstate(over="ignore"):  # for data without noise
        strengths = np.linalg.svd(felt / wider[:, None] / (found.deviation or np.finfo(float).tiny), compute_uv=False)
    lengths = np.linalg.norm(felt, axis=1, keepdims=True)
    constants = [r * c for r, c in branches]
    merged = [f"{k} and {k + 1}" for k, (a, b) in enumerate(pairwise(constants), 1) if not b > _DISTINCT * a]
    matrix = found.correlations
    alike = [(i, j) for i, j in combinations(kept, 2) if abs(matrix[i, j]) > _ALIKE]
    vague = [k for k in kept if labels[k] != spared and not errors[k] <= _SURE * found.values[k]] if profiles else []
    return Identifiability(
        parameters=len(kept),
        rank=int((strengths > 1).sum()),
        condition=float(np.linalg.cond(felt / lengths)),
        loose=tuple(labels[k] for k in kept if not errors[k] <= DETERMINED * found.values[k]),
        alike=tuple((labels[i], labels[j], float(matrix[i, j])) for i, j in alike),
        merged=tuple(merged),
        open=tuple(side for k in vague for side in _open_sides(found, k, float(errors[k] / found.pooled_errors[k]))),
        unfelt=tuple(unfelt),
    )


def _open_sides(found: FitResult, k: int, widening: float) -> list[str]:
    """Return the sides on which parameter ``k`` has no limit, with all others refitted."""
    freedom, label = found.degrees_of_freedom, found.labels[k]
    limit = 1 + float(fisher(0.95, 1, freedom)) * widening**2 / freedom
    rest = np.delete(found.values, k)
    sides = []
    for sign, name in ((-1.0, "lower"), (1.0, "upper")):
        x = found.coordinates.copy()
        x[k] += sign * np.log(_FAR)
        held = found.problem.holding(label, float(found.problem.scales.values(x)[k]))
        try:
            if len(rest):
                squares = fit(held, rest, tolerance=_ROUGH, most=_MOST).sum_of_squares
            else:
                squares = float(held.sum_of_squares(np.empty((1, 0)))[0])
        except IlgError:
            continue  # no fit is possible with it
        if squares <= limit * found.sum_of_squares:
            sides.append(f"{label} has no {name} limit")
    return sides
