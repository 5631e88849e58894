"""Selects the electrical model of a strip: candidates are fitted and compared by BIC, each with a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError, SolveError
from ..findings import Finding
from ..fit.criteria import parts_by_time, samples_for_bic
from ..fit.identifiability import Identifiability
from ..fit.misfit import WARN
from ..fit.problem import Progress
from ..fit.reported import correlated
from ..fit.selection import CLEAR, EVIDENCE, Candidate, Status, bic_on_independent, clearly_better, simplest_of_best
from ..strip.models import candidates, electrical_model, model_names
from .current import CurrentData
from .impedance import ImpedanceData
from .jump_start import placing_models
from .jumps import placed_as, unknown
from .lack_of_fit import Lack
from .port_fit import NEGLIGIBLE, SIMPLEST, PortFit, fit_port, levels_differ
from .port_model import BY_TIME, PortData

#: Model that is tried even if a simpler model's residuals are only noise, to check that one pole is enough.
_CHECK = "rc2"
#: Rms of the residuals of one file, relative to its size, above which nonlinear models are tried; the same of the part
#: that follows the drive.
_LARGE, _FOLLOWING = 0.005, 0.0025
#: Ratio of misfits of linear models above which nonlinear laws are tried with the better one alone.
_FAR = 3.0


def fit_named(
    data: Sequence[PortData], model: str, held: float | None, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit, tuple[Candidate, ...]]:
    """Return the fit of the requested model, and the model as the only candidate."""
    found = fit_port(data, model, held, per_record, progress)
    identifiability = found.identifiability()
    row = _row(found, _samples(found), identifiability)
    return found, (replace(row, reason=Finding("candidate-asked-for"), chosen=True),)


def fit_best(
    data: Sequence[PortData], held: float, per_record: frozenset[str], progress: Progress
) -> tuple[PortFit, tuple[Candidate, ...]]:
    """Return the joint fit of the best model, by BIC on independent samples, and all candidates.

    The number of independent samples is the same for all candidates, from the residuals of the candidate of smallest
    rms; a candidate whose rms is smaller by a factor of `CLEAR` does not lose. A model with a parameter that is not
    determined, or whose best fit was reached from one start only, is not chosen. A sinh electron path or a growing
    capacitance is tried if voltages differ and the best linear model's residuals exceed the individual fits', or, of
    one file, are large; a saturating charge only where no linear model can be fitted, or where what is left is more
    than noise and more than relaxations explain. Laws are tried with the best linear model and with the simplest, with
    more relaxations where these are missing, and with two branches that cannot be fitted without. Where no linear one
    can be fitted, another is taken only if the data determine it. Raises SolveError if there is none.
    """
    contest = _Contest(data, held, per_record, progress)
    tried = {m for d in data for m in candidates("spectrum" if d.quantity == "impedance" else "record")}
    first, *others = (m for m in model_names() if m in tried)
    contest.enter(first)
    if len(data) > 1:
        contest.enter_nonlinear(first)
    for model in others:
        contest.enter(model)
    linear = [m for m in contest.fits if electrical_model(m).linear]
    ions = contest.best(linear) if linear else first
    bases = [ions] if ions == first or not contest.worth_a_law(first, ions) else [ions, first]
    for base in bases:
        contest.enter_nonlinear(base)
    contest.enter_richer(others)
    if first in bases and (not linear or not contest.well_described):
        contest.enter_nonlinear(first, contested=False)
        contest.enter_richer(others)
    contest.enter_beside(others[0])
    winner = contest.best(list(contest.fits) if linear else contest.determined)
    rows = contest.rows(winner)
    return contest.fits[winner], rows


class _Contest:
    """The fits of all models so far, or the reasons why they failed."""

    def __init__(self, data: Sequence[PortData], held: float, per_record: frozenset[str], progress: Progress) -> None:
        self._data, self._held, self._per_record, self._progress = data, held, per_record, progress
        self.fits: dict[str, PortFit] = {}
        self.failures: dict[str, tuple[Status, Finding]] = {}
        self._errors: list[IlgError] = []
        self._identifiability: dict[str, Identifiability] = {}
        self._profiled: set[str] = set()

    def enter(self, model: str, *, always: bool = False) -> None:
        """Fit a model, unless it needs transients and a simpler one's residuals leave it nothing; or ``always``."""
        kind, by_time = electrical_model(model), [d.quantity in BY_TIME for d in self._data]
        for other, found in self.fits.items() if any(by_time) and not always else ():
            more, lack = len(kind.parameters) - len(found.kind.parameters), found.lack
            if model != _CHECK and found.only_noise and more >= 0:
                self._skip(model, "candidate-not-tried-noise", other=other)
                return
            missing = lack and (lack.branches if found.kind.linear else lack.relaxations)
            hopeless = lack is not None and not missing and not found.only_noise
            if kind.linear and all(by_time) and more > 0 and hopeless:
                self._skip(model, "candidate-not-tried-relaxations", other=other)
                return
        try:
            self.fits[model] = self._fitted(model)
        except IlgError as error:
            self._errors.append(error)
            self.failures[model] = ("failed", Finding("candidate-failed", values={"error": str(error)}))

    def enter_nonlinear(self, ions: str, *, contested: bool = True) -> None:
        """Fit ``ions`` with each nonlinear addition that is ``contested`` or is not, if the data can support one."""
        for model in model_names():
            kind = electrical_model(model)
            other = kind.linear or kind.plain != ions or all(a.contested for a in kind.additions) != contested
            if other or model in self.fits or (not contested and len(kind.additions) > 1):
                continue
            alone = self._data[0] if len(self._data) == 1 else None
            if not levels_differ(self._data):
                if alone is None:
                    self._skip(model, "candidate-not-tried-voltages")
            elif alone is not None and not alone.holds(kind):
                self._skip(model, "candidate-not-tried-sizes")
            elif ions in self.fits and alone is not None and not self.fits[ions].misfit > _LARGE:
                self._skip(model, "candidate-not-tried-alone", other=ions)
            elif ions in self.fits and alone is not None and not self._following(ions) > _FOLLOWING:
                self._skip(model, "candidate-not-tried-little", other=ions)
            elif ions in self.fits and alone is None and not self._worse_together(ions):
                self._skip(model, "candidate-not-tried-gain", other=ions)
            else:
                self.enter(model, always=not contested)  # laws of a charge that saturates leave much the same

    def enter_richer(self, linear: Sequence[str]) -> None:
        """Fit the laws that lack relaxations with the ``linear`` models that have more, the closest one with all."""
        laws = sorted((m for m, f in self.fits.items() if not f.kind.linear), key=lambda m: self.fits[m].misfit)
        for k, law in enumerate(laws):
            best, found = self.fits[self.best(list(self.fits))], self.fits[law]
            costly = not all(a.contested for a in found.kind.additions)
            if best.only_noise or not self._following(law) > (_LARGE if costly else _FOLLOWING):
                return
            if not (found.lack and found.lack.relaxations):
                continue
            enough = np.inf  # number of parameters from which on relaxations explain nothing
            for ions in linear[:1] if costly or k else linear:
                model, count = "+".join((ions, *(a.name for a in found.kind.additions))), _parameters(ions)
                if not _parameters(found.kind.plain) < count < enough or model not in model_names():
                    continue
                if model not in self.fits:
                    self.enter(model)
                lack = self.fits[model].lack if model in self.fits else Lack()
                if lack is not None and not lack.relaxations:
                    enough = min(enough, count + 1)

    def enter_beside(self, linear: str) -> None:
        """Fit a ``linear`` model that could not be fitted with each law, if one is missing: it may be the reason."""
        best = self.fits[self.best(list(self.fits))] if self.fits else None
        failed = self.failures.get(linear, ("",))[0] == "failed"
        if failed and best is not None and not best.only_noise and best.lack is not None and best.lack.law:
            self.enter_nonlinear(linear)

    def worth_a_law(self, model: str, other: str) -> bool:
        """Return False if another model leaves only noise, or so much less that no law makes up for it."""
        if self.fits[other].only_noise:
            return False
        return model not in self.fits or self.fits[model].misfit <= _FAR * self.fits[other].misfit

    def _following(self, model: str) -> float:
        """Return the rms of residuals that follow the drive, relative to the size; all of correlated ones."""
        found = self.fits[model]
        known = found.lack is not None and (found.lack.coloured or not correlated(found.fit))
        return found.misfit * (found.lack.share if found.lack and known else 1.0) ** 0.5

    def _worse_together(self, model: str) -> bool:
        """Return whether the files leave more residuals together than each by itself."""
        return self.fits[model].beyond_individual(self.samples) >= EVIDENCE

    def _fitted(self, model: str) -> PortFit:
        """Return the fit of a model that begins with the jumps where a simpler model's fit has them.

        If that is of one relaxation and a linear fit fails, it begins with those where the current alone places them.
        """
        how = (model, self._held, self._per_record, self._progress)
        data = [self._beside_rival(k) for k in range(len(self._data))]
        simpler = next((self.fits[m] for m in placing_models(electrical_model(model)) if m in self.fits), None)
        if simpler is not None and simpler.model.opened:
            data = [replace(d, opened=True) if isinstance(d, CurrentData) else d for d in data]
        if simpler is not None and any(map(_unplaced, data)):
            try:
                return fit_port(list(map(_placed_as, data, simpler.data)), *how)
            except SolveError:
                if simpler.kind.name != SIMPLEST or not electrical_model(model).linear:
                    raise
        return fit_port([d.roughly_placed() if isinstance(d, CurrentData) else d for d in data], *how)

    def _beside_rival(self, k: int) -> PortData:
        """Return the data of file ``k``, with the residuals of the closest fit that has no reason against it."""
        data = self._data[k]
        admitted = [found for model, found in self.fits.items() if self._admitted(model)]
        if not (admitted and isinstance(data, CurrentData) and unknown(data)):
            return data
        return replace(data, rival=float(min(admitted, key=lambda found: found.misfit).rms[k]))

    def _skip(self, model: str, code: str, **values: str) -> None:
        self.failures[model] = ("not tried", Finding(code, values=values))

    @property
    def well_described(self) -> bool:
        """True if the best model leaves only noise, or little that relaxations may explain."""
        best = self.fits[self.best(list(self.fits))]
        relaxing = best.lack is not None and best.lack.relaxations and not best.lack.law
        return best.only_noise or (best.misfit <= WARN and relaxing)

    @property
    def determined(self) -> list[str]:
        """The models that have no reason against them."""
        return [m for m in self.fits if self._determined(m)]

    @property
    def richest(self) -> str:
        """The model of smallest rms."""
        return min(self.fits, key=lambda model: self.fits[model].misfit)

    @property
    def samples(self) -> Array:
        """Independent samples of each file (files,), from the residuals of the model of smallest rms."""
        return _samples(self.fits[self.richest])

    @property
    def bics(self) -> dict[str, float]:
        samples = self.samples
        return {m: _bic(found, samples) for m, found in self.fits.items()}

    def identifiability(self, model: str) -> Identifiability:
        """Return which parameters of a fitted model the data determine, as far as that was asked for."""
        if model not in self._identifiability:
            self._identifiability[model] = self.fits[model].identifiability(profiles=False)
        return self._identifiability[model]

    def _profile(self, model: str) -> None:
        """Follow the profiles of a model, which may be open."""
        if model not in self._profiled:
            self._identifiability[model] = self.fits[model].identifiability()
            self._profiled.add(model)

    def _determined(self, model: str) -> bool:
        """Return True if there is no reason against a model; its profiles are followed if there is no other."""
        if self._admitted(model):
            self._profile(model)
        return self._admitted(model)

    def best(self, among: list[str]) -> str:
        """Return the simplest of the best models without a reason against them.

        Profiles are not followed of a model that loses to an admitted one by BIC and misfit.
        """
        if not among:
            if len(set(map(str, self._errors))) == 1:  # the error concerns the data, not the model
                raise self._errors[0]
            simplest = next(m for m, (status, _) in self.failures.items() if status == "failed")
            raise SolveError(
                f"no model can be fitted; the simplest, {simplest}: {self._errors[0]}; a longer record, or one of a "
                "step, determines more"
            )
        bics = {m: bic for m, bic in self.bics.items() if m in among}
        unknowns = {m: self.fits[m].fit.count for m in among}
        misfits = {m: self.fits[m].misfit for m in among}
        admitted: list[str] = []
        for model in sorted(among, key=lambda m: bics[m]):
            beaten = any(bics[m] + EVIDENCE < bics[model] and misfits[m] < misfits[model] for m in admitted)
            if not beaten and self._determined(model):
                admitted.append(model)
        return simplest_of_best(bics, unknowns, admitted, misfits)

    def rows(self, winner: str) -> tuple[Candidate, ...]:
        """Return all candidates in the order of the models' names, each with its reason."""
        self._profile(winner)
        rows = []
        for model in (m for m in model_names() if m in self.fits or m in self.failures):
            if model not in self.fits:
                status, why = self.failures[model]
                rows.append(Candidate(model, against=str(why), reason=why, status=status))
                continue
            row = _row(self.fits[model], self.samples, self.identifiability(model))
            rows.append(replace(row, reason=self._reason(model, winner), chosen=model == winner))
        return tuple(rows)

    def _reason(self, model: str, winner: str) -> Finding:
        """Return why a fitted model was chosen or not."""
        found, best, bics = self.fits[model], self.fits[winner], self.bics
        against = _against(found, self.identifiability(model))
        if model == winner:
            return Finding("candidate-chosen-although", values={"reason": str(against)}) if against else _CHOSEN
        if against:
            return against
        less, more = bics[winner] - bics[model], found.fit.count - best.fit.count
        rival = min((m for m in self.fits if self._admitted(m)), key=lambda m: self.fits[m].misfit)
        if less >= -EVIDENCE and clearly_better(self.fits[rival].misfit, found.misfit):
            ratio = found.misfit / self.fits[rival].misfit
            return Finding(
                "candidate-clearly-worse", values={"than": rival, "ratio": ratio, "limit": CLEAR, "less": less}
            )
        if less >= 0 and more > 0:
            needs = {"than": winner, "less": less, "more": more, "needed": EVIDENCE}
            return Finding("candidate-not-enough", values=needs)
        return Finding("candidate-worse", values={"than": winner, "bic": -less, "ratio": found.misfit / best.misfit})

    def _admitted(self, model: str) -> bool:
        return _against(self.fits[model], self.identifiability(model)) is None


_CHOSEN = Finding("candidate-chosen")


def _unplaced(data: PortData) -> bool:
    """Return True for a record whose later jumps are in unknown places."""
    return isinstance(data, CurrentData) and unknown(data)


def _placed_as(data: PortData, other: PortData) -> PortData:
    """Return data with unknown jumps where ``other`` data of the same file have them."""
    if isinstance(data, CurrentData) and isinstance(other, CurrentData) and unknown(data):
        return placed_as(data, other)
    return data


def _parameters(model: str) -> int:
    """Return the number of parameters of a model."""
    return len(electrical_model(model).parameters)


def _samples(found: PortFit) -> Array:
    """Return the independent samples of each file (files,), by the residuals of a fit."""
    count = []
    for k, (d, o) in enumerate(zip(found.data, found.fit.problem.observations, strict=False)):
        residuals = found.fit.residuals_of(k)
        by_time = d.quantity in BY_TIME
        count.append(
            samples_for_bic(parts_by_time(d.abscissa, residuals) if by_time else np.split(residuals, o.channels))
        )
    return np.array(count)


def _bic(found: PortFit, samples: Array) -> float:
    floor = np.array([NEGLIGIBLE * d.size for d in found.data])
    return bic_on_independent(np.maximum(found.rms, floor), samples, found.fit.count)


def _against(found: PortFit, identifiability: Identifiability) -> Finding | None:
    """Return the reason against choosing a fitted model, or None."""
    if not identifiability.determined:
        return Finding("candidate-not-determined", values={"reason": identifiability.reason})
    starts = found.fit.starts
    return None if starts.confirmed else Finding("candidate-not-confirmed", values={"starts": starts.starts})


def _row(found: PortFit, samples: Array, identifiability: Identifiability) -> Candidate:
    first, single = found.data[0], len(found.data) == 1
    relative = found.rms[0] / first.size if first.quantity in BY_TIME else None
    if isinstance(first, ImpedanceData):
        relative = first.relative_rms(found.fit.residuals_of(0))
    against = _against(found, identifiability)
    return Candidate(
        model=found.kind.name,
        parameters=len(found.fit.values),
        rmse=float(found.rms[0]) if single else None,
        relative_rms=relative if single else None,
        misfit=found.misfit,
        bic=_bic(found, samples),
        independent=float(samples.sum()),
        identifiability=identifiability,
        starts=found.fit.starts.starts,
        starts_agreeing=found.fit.starts.agreeing,
        against=str(against) if against else "",
    )
