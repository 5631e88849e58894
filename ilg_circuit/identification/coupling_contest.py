"""Chooses the law of bending of displacements: by BIC on independent samples, and of several files by prediction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..errors import IlgError
from ..fit.criteria import effective_samples
from ..fit.problem import Progress
from ..fit.selection import EVIDENCE, bic_on_independent, simplest_of_best
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements, lumped_port
from .clock import in_step
from .coupling_together import Together
from .coupling_trials import Strand, Trial, begun
from .displacement import fit_displacement
from .displacement_result import DisplacementFit
from .film import Moving
from .motion_laws import EC31, LAWS, MotionLaw
from .window_search import FEWEST_SAMPLES, WINDOW_RATIO, Begin, WindowSearch, describes

#: Readings of a file in the search for its window, and the relative change of sums of squares that ends its descents.
_FEW, _ROUGH = 500, 1e-3
#: Difference of BIC that tells one law from another: below it the evidence is worth no more than a bare mention.
_MENTIONED = 2.0
#: Ratio of errors of prediction below which two laws predict alike.
_ALIKE = 1.05


@dataclass(frozen=True)
class LawRow:
    """A law that was tried: number of ``parameters``, rms [m] and the same over the span (geometric mean of files).

    ``bic`` is above the least; ``prediction`` is the error in predicting a file from all others, with a gain of its
    own, over its span. ``against`` is the reason why it is not chosen; empty if there is none. ``alike`` says that the
    data do not tell it from the chosen one.
    """

    law: str
    parameters: int
    rms: float
    relative_rms: float
    bic: float
    prediction: float | None = None
    against: str = ""
    chosen: bool = False
    alike: bool = False

    @property
    def text(self) -> str:
        """The row in words."""
        said = f"{self.law} {1e6 * self.rms:.3g} um, BIC {self.bic:+.0f}"
        if self.prediction is not None:
            said += f", predicts to {self.prediction:.1%}"
        return f"{said} ({self.against})" if self.against else said

    def to_dict(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


@dataclass(frozen=True)
class Contest:
    """The ``law`` that was chosen, by source where its fits begin, and the rows of all laws.

    ``gains`` (files,) are the gains of several files relative to their geometric mean, where they differ.
    """

    law: MotionLaw
    begins: Mapping[str, Begin]
    rows: tuple[LawRow, ...]
    gains: tuple[float, ...] = ()


def strands_of(
    records: Sequence[Moving], actuator: Actuator, delays: Sequence[float | Literal["fit"]], at: Contest
) -> tuple[list[Strand], dict[str, DisplacementFit]]:
    """Return what the laws are fitted to, of records whose clocks are behind by ``delays`` [s], or are fitted.

    These are fitted with the law that the contest ``at`` chose; the fits come by source. A record that cannot be fitted
    is left out.
    """
    strands, fits = [], {}
    for record, delay in zip(records, delays, strict=True):
        with suppress(IlgError):  # the fit of this file says why
            if delay == "fit":
                fitted = fit_displacement(record, actuator, None, delay, at.law, at.begins.get(record.source))
                fits[record.source] = fitted
                data, rest = replace(fitted.data, loose=None), fitted.at_rest
            else:
                own = record.record.own_clock
                moved = in_step(record, delay) if own else record
                search = WindowSearch(moved, actuator, None, 0.0 if own else delay)
                data, rest = search.base, search.rest
            strands.append(Strand(data, rest, actuator, lumped_elements(actuator).bending_ratio))
    return strands, fits


def chosen_law(fitted: Sequence[Strand], actuator: Actuator, progress: Progress = None) -> Contest:
    """Return the law for displacements, each ``fitted`` with a clock that is known.

    All laws are fitted on a static beam over the longest stretch of each file that any of them describes, if the data
    determine it. The simplest within 2 of the least BIC is chosen; of several files, among those within strong evidence
    of it, the one that predicts a file best from the others, and none that predicts worse than d(s).
    """
    linear = lumped_port(actuator).linear
    laws = [law for law in LAWS.values() if linear or not law.follows_charge]
    strands, tried = [], []
    for strand in fitted:
        with suppress(IlgError):
            strand, found = _of_longest(strand, laws, progress)
            if found:
                strands.append(strand)
                tried.append(found)
    if not tried:
        return Contest(EC31, {}, ())
    if len(tried) == 1:
        return _of_one(strands[0], tried[0])
    if any(strand.beam == "dynamic" for strand in strands):  # one strip is on one beam
        for k, strand in enumerate(strands):
            if strand.beam == "static":
                strands[k] = strand.like(beam="dynamic")
                tried[k] = _all(strands[k], laws, next(iter(tried[k].values())).end)
    return _of_several(strands, tried, progress)


def _of_longest(strand: Strand, laws: Sequence[MotionLaw], progress: Progress) -> tuple[Strand, dict[str, Trial]]:
    """Return the fits of all laws to the longest stretch that one of them describes and the data determine.

    Of the whole record where there is no such stretch. The beam is static; dynamic where only that describes the whole
    record.
    """
    end = last = float(strand.t[-1])
    few = strand.like(_FEW)
    for beam in ("static", "dynamic"):
        if _describe(few.like(beam=beam), laws, last, progress):
            whole = strand.like(beam=beam)
            return whole, _all(whole, laws, last)
    while True:
        end /= WINDOW_RATIO
        if (strand.t[strand.t >= 0] <= end).sum() < FEWEST_SAMPLES:
            return strand, _all(strand, laws, last)
        if _describe(few, laws, end, progress):
            return strand, _all(strand, laws, end)


def _describe(few: Strand, laws: Sequence[MotionLaw], end: float, progress: Progress) -> bool:
    """Return whether any law describes a file up to ``end`` [s], whose parameters the data determine."""
    for law in laws:
        trial = few.trial(law, end, starts=1, tolerance=_ROUGH)
        if trial is not None and trial.determined and described(few, trial):
            return True
        if progress:
            progress()
    return False


def _all(strand: Strand, laws: Sequence[MotionLaw], end: float) -> dict[str, Trial]:
    return {law.name: trial for law in laws if (trial := strand.trial(law, end))}


def described(strand: Strand, trial: Trial) -> bool:
    """Return whether a law describes a file up to the end of the trial."""
    data = strand.data
    return describes(trial.residuals, trial.t, trial.end, data.channel.until(trial.end).values)


def _samples(trials: Iterable[Trial]) -> float:
    """Return the number of independent samples, by the best fit."""
    return effective_samples(min(trials, key=lambda trial: trial.rmse).residuals)


def _of_one(strand: Strand, tried: Mapping[str, Trial]) -> Contest:
    samples = np.array([_samples(tried.values())])
    bics = {n: bic_on_independent(np.array([t.rmse]), samples, t.unknowns) for n, t in tried.items()}
    unknowns = {n: t.unknowns for n, t in tried.items()}
    misfits = {n: t.rmse / t.size for n, t in tried.items()}
    admitted = [n for n, t in tried.items() if t.determined]
    told = [n for n in admitted if described(strand, tried[n])]
    winner = simplest_of_best(bics, unknowns, told or admitted, misfits, _MENTIONED) if admitted else EC31.name
    rms, against = {n: t.rmse for n, t in tried.items()}, {n: t.against for n, t in tried.items()}
    rows = _rows(tried, bics, winner, rms, misfits, against, told)
    if winner not in tried:
        return Contest(EC31, {}, rows)
    best = _on_likelier_beam(strand, tried[winner], float(samples[0]))
    if best.law == EC31:
        return Contest(EC31, {}, rows)
    law, values, sign = begun(best, strand.like(beam=best.beam))
    return Contest(law, {strand.data.source: Begin(values, sign, best.end, best.beam)}, rows)


def _on_likelier_beam(strand: Strand, static: Trial, samples: float) -> Trial:
    """Return the trial, the same on the dynamic beam on strong evidence, or d(s) on that if it is not less likely.

    Inertia looks like one more relaxation.
    """
    if static.beam == "dynamic" or static.law == EC31:
        return static
    slow = strand.like(beam="dynamic")

    def bic(trial: Trial) -> float:
        return bic_on_independent(np.array([trial.rmse]), np.array([samples]), trial.unknowns)

    simple = slow.trial(EC31, static.end)
    if simple is not None and simple.determined and bic(simple) <= bic(static):
        return simple
    same = slow.trial(static.law, static.end, [static.shape])
    if same is not None and same.determined and bic(same) < bic(static) - EVIDENCE:
        return same
    return static


def _rows(
    tried: Mapping[str, Trial],
    bics: Mapping[str, float],
    winner: str,
    rms: Mapping[str, float],
    misfits: Mapping[str, float],
    against: Mapping[str, str],
    told: Sequence[str],
    predictions: Mapping[str, float] | None = None,
) -> tuple[LawRow, ...]:
    """Return the rows of all laws; those of ``told`` whose BIC is near the winner's are alike."""
    least = min(bics.values())

    def row(n: str, unknowns: int) -> LawRow:
        alike = n != winner and n in told and winner in told and abs(bics[n] - bics[winner]) <= EVIDENCE
        predicted = (predictions or {}).get(n)
        return LawRow(
            n, unknowns, rms[n], misfits[n], bics[n] - least, predicted, against[n], chosen=n == winner, alike=alike
        )

    return tuple(row(n, t.unknowns) for n, t in tried.items() if n in bics)


def _of_several(strands: Sequence[Strand], tried: Sequence[Mapping[str, Trial]], progress: Progress) -> Contest:
    common = [name for name in LAWS if all(name in each for each in tried)]
    fits = {}
    for name in common:
        found = Together.of(LAWS[name], strands, [each[name] for each in tried])
        if found is not None:
            fits[name] = found
        if progress:
            progress()
    if not fits:
        return Contest(EC31, {}, ())
    rms = {n: np.array([float(np.sqrt(np.mean(r**2))) for r in f.residuals]) for n, f in fits.items()}
    best = min(fits, key=lambda n: float(np.log(rms[n]).sum()))
    samples = np.array([effective_samples(r) for r in fits[best].residuals])
    unknowns = {n: f.unknowns for n, f in fits.items()}
    bics = {n: bic_on_independent(rms[n], samples, unknowns[n]) for n in fits}
    sizes = fits[best].sizes
    misfits = {n: float(np.exp(np.mean(np.log(rms[n] / sizes)))) for n in fits}
    against = {n: f.against for n, f in fits.items()}
    admitted = [n for n in fits if not against[n]]
    winner = simplest_of_best(bics, unknowns, admitted, misfits, _MENTIONED) if admitted else EC31.name
    predictions: dict[str, float] = {}
    alike: list[str] = []
    if admitted:
        near = [n for n in admitted if bics[n] <= min(bics[m] for m in admitted) + EVIDENCE or n in (winner, EC31.name)]
        for name in near:
            predictions[name] = fits[name].prediction()
            if progress:
                progress()
        least = min(predictions.values())
        alike = [n for n in near if predictions[n] <= _ALIKE * least]
        winner = min(alike, key=lambda n: (unknowns[n], bics[n]))
    overall = {n: float(np.exp(np.mean(np.log(rms[n])))) for n in fits}
    rows = _rows({n: tried[0][n] for n in fits}, bics, winner, overall, misfits, against, alike, predictions)
    if winner not in fits:
        return Contest(EC31, {}, rows)
    chosen = fits[winner]
    law, starts = chosen.begins()
    ends = zip(strands, chosen.trials, starts, strict=True)
    begins = {strand.data.source: Begin(values, sign, trial.end, trial.beam) for strand, trial, (values, sign) in ends}
    return Contest(law, begins, rows, chosen.relative_gains() if chosen.gains_differ() else ())
