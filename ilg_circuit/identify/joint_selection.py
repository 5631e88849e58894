"""Which model several data sets support: linear ones first, then what is not ohmic where the voltages could show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError, SolveError
from ..strip.models import electrical_model, model_names
from .datasets import Dataset, Progress
from .joint_current import JointCurrent, fit_port, levels_differ
from .selection import CANDIDATES, EVIDENCE

Array = NDArray[np.float64]

#: Tried too where there is a spectrum.
_WITH_SPECTRUM = ("cpe",)
_BRANCHES = ("rc", "rc2", "rc3")


@dataclass(frozen=True)
class JointCandidate:
    """A model that was tried: ``count`` of parameters, ``misfit`` of `JointCurrent`, BIC, verdict."""

    model: str
    count: int | None
    misfit: float | None
    bic: float | None
    verdict: str
    chosen: bool = False

    def to_json(self) -> dict[str, object]:
        return {
            "model": self.model,
            "parameters": self.count,
            "misfit": self.misfit,
            "bic": self.bic,
            "chosen": self.chosen,
            "verdict": self.verdict,
        }


class _Contest:
    """All fits so far, each model's or why there is none."""

    def __init__(
        self, datasets: Sequence[Dataset], held: float | None, own: frozenset[str], progress: Progress
    ) -> None:
        self._datasets, self._held, self._own, self._progress = datasets, held, own, progress
        self.fits: dict[str, JointCurrent] = {}
        self.failures: dict[str, str] = {}

    def enter(self, model: str) -> None:
        count = len(electrical_model(model).parameters)
        for other, found in self.fits.items():
            if found.only_noise and count >= len(found.model.kind.parameters):
                self.failures[model] = f"not tried: {other} leaves nothing but noise"
                return
        try:
            self.fits[model] = fit_port(self._datasets, model, self._held, self._own, self._progress)
        except IlgError as error:
            self.failures[model] = f"could not be fitted: {error}"

    @property
    def samples(self) -> Array:
        """Independent samples of each data set: by the model that leaves most."""
        return np.asarray(np.max([found.independent() for found in self.fits.values()], axis=0))

    def enter_nonlinear(self, ions: str) -> None:
        """``ions`` with a sinh electron path, or a capacitance that grows, where anything can speak for these."""
        for addition in ("sinh", "growing"):
            model = f"{ions}+{addition}"
            if model in self.fits or (addition == "growing" and ions not in _BRANCHES):
                continue
            if not levels_differ(self._datasets):
                self.failures[model] = "not tried: it needs several voltages, and these are alike"
            elif ions in self.fits and self.fits[ions].beyond_own(self.samples) < EVIDENCE:
                self.failures[model] = f"not tried: {ions} leaves no more than the data sets' own fits do"
            else:
                self.enter(model)

    def best(self, among: list[str]) -> str:
        """Of the models that the data determine the one with fewest parameters within `EVIDENCE` of the least BIC."""
        if not among:
            raise SolveError("no model could be fitted: " + "; ".join(f"{m}: {w}" for m, w in self.failures.items()))
        admitted = [m for m in among if self.fits[m].determined[0]] or among[:1]
        bics = self.bics
        least = min(bics[m] for m in admitted)
        near = [m for m in admitted if bics[m] <= least + EVIDENCE]
        return min(near, key=lambda m: (self.fits[m].together.fit.count, bics[m]))

    @property
    def bics(self) -> dict[str, float]:
        samples = self.samples
        return {m: found.bic(samples) for m, found in self.fits.items()}


def choose(
    datasets: Sequence[Dataset], held: float | None, own: frozenset[str], progress: Progress
) -> tuple[JointCurrent, tuple[JointCandidate, ...]]:
    """The best model of all data sets together, by BIC on independent samples; see `JointCurrent.bic`.

    A model with a sinh electron path or a growing capacitance is tried where voltages differ, and where the best linear
    one leaves more than the data sets' own fits do. Raises SolveError where no model can be fitted.
    """
    contest = _Contest(datasets, held, own, progress)
    spectra = any(d.quantity == "impedance" for d in datasets)
    contest.enter("rc")
    contest.enter_nonlinear("rc")
    for model in CANDIDATES[1:] + (_WITH_SPECTRUM if spectra else ()):
        contest.enter(model)
    linear = [m for m in contest.fits if electrical_model(m).linear]
    contest.enter_nonlinear(contest.best(linear) if linear else "rc")
    winner = contest.best(list(contest.fits))
    bics = contest.bics
    tried = sorted(contest.fits.keys() | contest.failures.keys(), key=list(model_names()).index)
    return contest.fits[winner], tuple(_row(contest, m, winner, bics) for m in tried)


def _row(contest: _Contest, model: str, winner: str, bics: dict[str, float]) -> JointCandidate:
    found = contest.fits.get(model)
    if found is None:
        return JointCandidate(model, None, None, None, contest.failures[model])
    sure, why = found.determined
    if model == winner:
        verdict = "chosen"
    elif not sure:
        verdict = f"not determined by these data ({why})"
    else:
        worse = bics[model] > bics[winner]
        verdict = "worse" if worse else "better by less than the evidence that more parameters need"
    fit = found.together.fit
    return JointCandidate(model, len(fit.values), found.misfit, bics[model], verdict, model == winner)
