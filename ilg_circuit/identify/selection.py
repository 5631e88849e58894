"""Which electrical model the data of a strip support: candidates fitted, compared by BIC, and the verdict on each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError, SolveError
from ..fit.identifiability import Identifiability
from ..fit.problem import Progress
from ..fit.selection import EVIDENCE, Candidate, Status, bic_on_independent, simplest_of_best
from ..strip.models import candidates, electrical_model, model_names
from .impedance import ImpedanceData
from .port_fit import NEGLIGIBLE, PortFit, fit_port, levels_differ
from .port_model import PortData

#: Tried even where a simpler model's residuals are only noise: the check that one pole is enough.
_CHECK = "rc2"


def fit_named(
    data: Sequence[PortData], model: str, held: float | None, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit, tuple[Candidate, ...]]:
    """Return the fit of the model asked for, as the only candidate."""
    found = fit_port(data, model, held, per_record, progress)
    identifiability = found.identifiability()
    row = _row(found, _bic(found, found.independent()), identifiability, _against(found, identifiability))
    return found, (_judged(row, "asked for", chosen=True),)


def fit_best(
    data: Sequence[PortData], held: float, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit, tuple[Candidate, ...]]:
    """Return the fit of the best model of all data together, by BIC on independent samples, and all candidates.

    A model with a parameter that is not determined, or whose best fit was reached from one start only, is not chosen.
    A sinh electron path or a growing capacitance is tried where voltages differ and the best linear model's residuals
    are larger than those of the individual fits. Raises SolveError where no model can be fitted.
    """
    contest = _Contest(data, held, per_record, progress)
    tried = {m for d in data for m in candidates("spectrum" if d.quantity == "impedance" else "record")}
    first, *others = (m for m in model_names() if m in tried)
    contest.enter(first)
    contest.enter_nonlinear(first)
    for model in others:
        contest.enter(model)
    linear = [m for m in contest.fits if electrical_model(m).linear]
    contest.enter_nonlinear(contest.best(linear) if linear else first)
    winner = contest.best(list(contest.fits))
    rows = contest.rows(winner)
    return contest.fits[winner], rows


class _Contest:
    """All fits so far, each model's or why there is none."""

    def __init__(self, data: Sequence[PortData], held: float, per_record: frozenset[str], progress: Progress) -> None:
        self._data, self._held, self._per_record, self._progress = data, held, per_record, progress
        self.fits: dict[str, PortFit] = {}
        self.failures: dict[str, tuple[Status, str]] = {}
        self._errors: list[IlgError] = []
        self._identifiability: dict[str, Identifiability] = {}

    def enter(self, model: str) -> None:
        """Fit a model, unless that takes transients and a simpler one's residuals are only noise."""
        count, costly = len(electrical_model(model).parameters), any(d.quantity == "current" for d in self._data)
        for other, found in self.fits.items():
            if costly and model != _CHECK and found.only_noise and count >= len(found.kind.parameters):
                self._skip(model, f"the residuals of {other} are only noise")
                return
        try:
            self.fits[model] = fit_port(self._data, model, self._held, self._per_record, self._progress)
        except IlgError as error:
            self._errors.append(error)
            self.failures[model] = ("failed", f"could not be fitted: {error}")

    def enter_nonlinear(self, ions: str) -> None:
        """Fit ``ions`` with each addition that is not linear, where anything can speak for it."""
        for model in model_names():
            kind = electrical_model(model)
            if model in self.fits or kind.linear or kind.plain != ions:
                continue
            if not levels_differ(self._data):
                if len(self._data) > 1:
                    self._skip(model, "it needs several voltages, and these are the same")
            elif ions in self.fits and self.fits[ions].beyond_individual(self.samples) < EVIDENCE:
                self._skip(model, f"the residuals of {ions} are no larger than those of individual fits")
            else:
                self.enter(model)

    def _skip(self, model: str, why: str) -> None:
        self.failures[model] = ("not tried", f"not tried: {why}")

    @property
    def samples(self) -> Array:
        """Independent samples of each file: by the model with most of them."""
        return np.max([found.independent() for found in self.fits.values()], axis=0)

    @property
    def bics(self) -> dict[str, float]:
        samples = self.samples
        return {m: _bic(found, samples) for m, found in self.fits.items()}

    def against(self, model: str) -> str:
        """Return why a model that was fitted is not to be chosen; empty where nothing speaks against it."""
        if model not in self._identifiability:
            self._identifiability[model] = self.fits[model].identifiability()
        return _against(self.fits[model], self._identifiability[model])

    def best(self, among: list[str]) -> str:
        """Return the simplest of the best models that nothing speaks against."""
        if not among:
            if len(set(map(str, self._errors))) == 1:  # it is about the data, whatever the model
                raise self._errors[0]
            raise SolveError(
                "no model could be fitted: " + "; ".join(f"{m}: {w}" for m, (_, w) in self.failures.items())
            )
        bics = {m: bic for m, bic in self.bics.items() if m in among}
        unknowns = {m: self.fits[m].fit.count for m in among}
        return simplest_of_best(bics, unknowns, [m for m in among if not self.against(m)])

    def rows(self, winner: str) -> tuple[Candidate, ...]:
        """Return all candidates in the order of the models' names."""
        bics = self.bics
        rows = []
        for model in (m for m in model_names() if m in self.fits or m in self.failures):
            if model not in self.fits:
                status, why = self.failures[model]
                rows.append(Candidate(model, against=why, verdict=why, status=status))
                continue
            against = self.against(model)
            row = _row(self.fits[model], bics[model], self._identifiability[model], against)
            if model == winner:
                verdict = "chosen"
            elif against:
                verdict = against
            else:
                worse = bics[model] > bics[winner]
                verdict = "worse" if worse else "better by less than the evidence that more parameters need"
            rows.append(_judged(row, verdict, chosen=model == winner))
        return tuple(rows)


def _bic(found: PortFit, samples: Array) -> float:
    floor = np.array([NEGLIGIBLE * d.size for d in found.data])
    return bic_on_independent(np.maximum(found.rms, floor), samples, found.fit.count)


def _against(found: PortFit, identifiability: Identifiability) -> str:
    if not identifiability.determined:
        return f"not determined by these data ({identifiability.reason})"
    starts = found.fit.starts
    return "" if starts.confirmed else f"the best of {starts.starts} fits was not reached a second time"


def _row(found: PortFit, bic: float, identifiability: Identifiability, against: str) -> Candidate:
    first, single = found.data[0], len(found.data) == 1
    relative = found.rms[0] / first.size if first.quantity == "current" else None
    if isinstance(first, ImpedanceData):
        relative = first.relative_rms(found.fit.residuals_of(0))
    return Candidate(
        model=found.kind.name,
        parameters=len(found.fit.values),
        rmse=float(found.rms[0]) if single else None,
        relative_rms=relative if single else None,
        misfit=found.misfit,
        bic=bic,
        identifiability=identifiability,
        starts=found.fit.starts.starts,
        starts_agreeing=found.fit.starts.agreeing,
        against=against,
    )


def _judged(row: Candidate, verdict: str, *, chosen: bool) -> Candidate:
    return replace(row, verdict=verdict, chosen=chosen)
