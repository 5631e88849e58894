"""Selects a model by BIC: the simplest model that the data determine, within strong evidence of the best.

A model whose residuals are much smaller than another's is preferred to it, regardless of the BIC.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..arrays import Array
from ..findings import Finding
from .identifiability import Identifiability

Status = Literal["fitted", "failed", "not tried"]

#: Decrease of the BIC required for more parameters (very strong evidence, Kass and Raftery 1995).
EVIDENCE = 10.0
#: Ratio of misfits above which a model with the smaller one does not lose; misfits below `_EXACT` count as equal.
CLEAR = 1.5
_EXACT = 1e-6


@dataclass(frozen=True)
class Candidate:
    """A model that was tried, for tables and files.

    ``parameters`` is the number of fitted parameters; ``rmse`` [unit of the data] is given for a single observation,
    ``relative_rms`` the same over its size, ``misfit`` the geometric mean of all observations' relative rms. ``bic`` is
    on ``independent`` samples, the same for all candidates; ``identifiability`` has open profiles only where they
    decide. ``against`` is the reason why the model should not be chosen, or could not be fitted; ``reason`` is the
    outcome as code and numbers, ``verdict`` in words. ``status`` is "fitted", "failed" or "not tried".
    """

    model: str
    parameters: int | None = None
    rmse: float | None = None
    relative_rms: float | None = None
    misfit: float | None = None
    bic: float | None = None
    independent: float | None = None
    identifiability: Identifiability | None = None
    starts: int | None = None
    starts_agreeing: int | None = None
    against: str = ""
    reason: Finding | None = None
    status: Status = "fitted"
    chosen: bool = False

    @property
    def verdict(self) -> str:
        """The reason as a sentence."""
        return str(self.reason) if self.reason else ""

    def to_dict(self) -> dict[str, Any]:
        fields: dict[str, Any] = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return fields | {
            "identifiability": self.identifiability and self.identifiability.to_dict(),
            "verdict": self.verdict,
            "reason": self.reason and {"code": self.reason.code, "values": dict(self.reason.values)},
        }


def bic_on_independent(rms: Array, samples: Array, unknowns: int) -> float:
    """Return the BIC with a separate variance for each observation.

    ``rms`` (observations,) of residuals, ``samples`` (observations,) of them independent. The variances do not depend
    on the weights of the fit, so that fits of different weights can be compared.
    """
    least = np.finfo(float).tiny  # the squares of readings below 1e-154 are zero
    return 2 * float(samples @ np.log(np.maximum(rms, least))) + unknowns * float(np.log(samples.sum()))


def clearly_better(misfit: float, other: float) -> bool:
    """Return True if a candidate of ``misfit`` cannot lose to one with the ``other`` misfit."""
    return max(misfit, _EXACT) * CLEAR < max(other, _EXACT)


def simplest_of_best(
    bics: Mapping[str, float],
    unknowns: Mapping[str, int],
    admitted: Collection[str],
    misfits: Mapping[str, float] | None = None,
    evidence: float = EVIDENCE,
) -> str:
    """Return the model with fewest ``unknowns`` within ``evidence`` of the least BIC among the ``admitted``.

    A model is excluded if an admitted one is clearly better by the ``misfits``. If none is admitted, the first and
    simplest model is returned.
    """
    among = [model for model in bics if model in admitted] or list(bics)[:1]
    if misfits is not None:
        least_misfit = min(misfits[model] for model in among)
        among = [model for model in among if not clearly_better(least_misfit, misfits[model])]
    least = min(bics[model] for model in among)
    near = [model for model in among if bics[model] <= least + evidence]
    return min(near, key=lambda model: (unknowns[model], bics[model]))
