"""Which model several data sets support: linear ones first, then what is not ohmic where the voltages could show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError, SolveError
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
        try:
            self.fits[model] = fit_port(self._datasets, model, self._held, self._own, self._progress)
        except IlgError as error:
            self.failures[model] = f"could not be fitted: {error}"

    @property
    def samples(self) -> Array:
        """Independent samples of each data set: by the model that leaves most."""
        return np.asarray(np.max([found.independent() for found in self.fits.values()], axis=0))

    @property
    def winner(self) -> str:
        """Of the models that the data determine the one with fewest parameters within `EVIDENCE` of the least BIC."""
        if not self.fits:
            raise SolveError("no model could be fitted: " + "; ".join(f"{m}: {w}" for m, w in self.failures.items()))
        admitted = [m for m, found in self.fits.items() if found.determined[0]] or list(self.fits)[:1]
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
    for model in CANDIDATES + (_WITH_SPECTRUM if spectra else ()):
        contest.enter(model)
    linear = contest.winner
    nonlinear = list(
        dict.fromkeys(
            f"{ions}+{addition}"
            for ions in (linear, "rc")
            for addition in ("sinh", "growing")
            if addition == "sinh" or ions in _BRANCHES
        )
    )
    against = _against_nonlinear(contest.fits[linear], contest.samples)
    for model in nonlinear:
        if against:
            contest.failures[model] = f"not tried: {against}"
        else:
            contest.enter(model)
    winner = contest.winner
    bics = contest.bics
    rows = [_row(contest, m, winner, bics) for m in dict.fromkeys([*CANDIDATES, *_WITH_SPECTRUM, *nonlinear])
            if m in contest.fits or m in contest.failures]  # fmt: skip
    return contest.fits[winner], tuple(rows)


def _against_nonlinear(linear: JointCurrent, samples: Array) -> str:
    """Why no nonlinear model need be tried; empty where one should be."""
    if not levels_differ(linear.datasets):
        return "a nonlinear model needs several voltages, and these are alike"
    own = np.array([o.rms for o in linear.own])
    if 2 * float(samples @ np.log(np.maximum(linear.rms, 1e-300) / np.maximum(own, 1e-300))) < EVIDENCE:
        return "one linear port leaves no more than the data sets' own fits do"
    return ""


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
