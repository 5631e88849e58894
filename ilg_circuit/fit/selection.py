"""Selection of a model by BIC: the simplest of those that the data determine, within strong evidence of the best."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..arrays import Array
from .identifiability import Identifiability

Status = Literal["fitted", "failed", "not tried"]

#: A model with more parameters must be better by this much BIC (very strong evidence, Kass and Raftery 1995).
EVIDENCE = 10.0


@dataclass(frozen=True)
class Candidate:
    """A model that was tried, for tables and files.

    ``parameters`` counts those that were fitted; ``rmse`` [unit of the data] is that of a single observation,
    ``relative_rms`` the same over its size, ``misfit`` the geometric mean of all observations' relative rms. ``bic`` is
    on independent samples; ``against`` says why the model is not to be chosen, or could not be fitted; ``verdict`` is
    the outcome in words. ``status`` says whether it was fitted, failed, or was not tried.
    """

    model: str
    parameters: int | None = None
    rmse: float | None = None
    relative_rms: float | None = None
    misfit: float | None = None
    bic: float | None = None
    identifiability: Identifiability | None = None
    starts: int | None = None
    starts_agreeing: int | None = None
    against: str = ""
    verdict: str = ""
    status: Status = "fitted"
    chosen: bool = False

    def to_dict(self) -> dict[str, Any]:
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return fields | {"identifiability": self.identifiability and self.identifiability.to_dict()}


def bic_on_independent(rms: Array, samples: Array, unknowns: int) -> float:
    """Return the BIC with a variance of its own for each observation.

    ``rms`` (observations,) of residuals, ``samples`` (observations,) of them independent. The variances do not depend
    on the weights of the fit, so that fits of different weights can be compared.
    """
    return 2 * float(samples @ np.log(rms)) + unknowns * float(np.log(samples.sum()))


def simplest_of_best(
    bics: Mapping[str, float], unknowns: Mapping[str, int], admitted: Collection[str], evidence: float = EVIDENCE
) -> str:
    """Return the model with fewest ``unknowns`` within ``evidence`` of the least BIC among the ``admitted``.

    Where none is admitted, the first of all is returned: nothing simpler exists.
    """
    among = [model for model in bics if model in admitted] or list(bics)[:1]
    least = min(bics[model] for model in among)
    near = [model for model in among if bics[model] <= least + evidence]
    return min(near, key=lambda model: (unknowns[model], bics[model]))
