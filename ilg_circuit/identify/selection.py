"""Which electrical model a measured current supports: candidates fitted, compared by BIC, and the verdict on each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import InputError, SolveError
from ..fit.residuals import effective_samples, information_criterion
from ..measurements.record import Record
from .current import CurrentFit

#: (measurement, electrode resistance [ohm], model) -> fit
Fitter = Callable[[Record, float, str], CurrentFit]

#: Tried by ``auto`` in this order; the last two only where one pole leaves more than noise.
CANDIDATES = ("rc", "rc2", "rc3", "warburg")
#: ngspice needs a fine grid after every jump; the exact engine an exponential for every width of an interval.
_MANY_JUMPS, _FEW_WIDTHS = 12, 40
#: A model with more parameters must be better by this much BIC (very strong evidence).
EVIDENCE = 10.0


@dataclass(frozen=True)
class Candidate:
    """A model that was tried: its ``fit`` (None if there is none), ``bic`` on independent samples, and the verdict."""

    model: str
    fit: CurrentFit | None
    bic: float | None
    verdict: str
    chosen: bool = False

    def to_json(self) -> dict[str, object]:
        fit = self.fit
        return {
            "model": self.model,
            "parameters": len(fit.fit.values) if fit else None,
            "rmse": fit.fit.rmse if fit else None,
            "bic": self.bic,
            "identifiability": fit.identifiability.to_json() if fit else None,
            "starts": fit.scouting.starts if fit else None,
            "starts_agreeing": fit.scouting.agreeing if fit else None,
            "chosen": self.chosen,
            "verdict": self.verdict,
        }


def scouting_engine(measurement: Record, model: str, engine: str) -> str:
    """The engine that tries ``model``: the exact one for large circuits where many jumps make ngspice slow.

    Its answer is ngspice's to eight digits; the model that is chosen is fitted again with the ``engine`` asked for.
    """
    if model in ("rc", "rc2") or len(measurement.drive.times) < _MANY_JUMPS:
        return engine
    grid = np.union1d(measurement.current.time[measurement.current.time >= 0], measurement.drive.times)
    widths = np.unique(np.round(np.diff(grid) / np.diff(grid).max(), 9))
    return "exact" if len(widths) <= _FEW_WIDTHS else engine


def single(measurement: Record, held: float, model: str, fit: Fitter) -> tuple[CurrentFit, tuple[Candidate, ...]]:
    """The model asked for, as the only candidate."""
    found = fit(measurement, held, model)
    return found, (Candidate(model, found, _bic(found, _independent([found])), "asked for", chosen=True),)


def choose(
    measurement: Record, held: float, fit: Fitter, warnings: list[str]
) -> tuple[CurrentFit, tuple[Candidate, ...]]:
    """The best of `CANDIDATES`: of those that the data determine, the simplest within `EVIDENCE` of the best.

    A model with a parameter that is not determined (see `identifiability`), or whose best fit was reached from one
    start only, is not chosen, and its verdict says why.

    BIC counts independent samples: as many as the whitest residuals amount to. What could not be fitted though one pole
    is not enough is told in ``warnings``.
    """
    fits: dict[str, CurrentFit] = {"rc": fit(measurement, held, "rc")}
    failures: dict[str, str] = {}
    lacking = any("one pole" in line for line in fits["rc"].warnings)
    for model in CANDIDATES[1:]:
        if model != "rc2" and not lacking:
            failures[model] = "not tried: one pole leaves nothing but noise"
            continue
        try:
            fits[model] = fit(measurement, held, model)
        except (InputError, SolveError) as error:
            failures[model] = f"could not be fitted: {error}"
            # a second branch that the data do not hold is the usual answer for clean one-pole data, and no news
            if lacking:
                warnings.append(f"{model} could not be fitted: {error}")
    samples = _independent(list(fits.values()))
    bics = {model: _bic(found, samples) for model, found in fits.items()}
    # rc is always there: undetermined as it may be, nothing simpler exists
    admitted = [m for m, found in fits.items() if m == "rc" or not found.unreliable]
    best = min(bics[m] for m in admitted)
    near = [m for m in admitted if bics[m] <= best + EVIDENCE]
    winner = min(near, key=lambda m: (len(fits[m].fit.values), bics[m]))
    rows = [
        Candidate(
            m, fits.get(m), bics.get(m), failures.get(m) or _verdict(m, fits[m], bics, admitted, winner), m == winner
        )
        for m in CANDIDATES
    ]
    return fits[winner], tuple(rows)


def table(candidates: tuple[Candidate, ...]) -> list[str]:
    """One line a candidate: parameters, rmse over the peak, BIC above the best, verdict."""
    known = [c.bic for c in candidates if c.bic is not None]
    best = min(known, default=0.0)
    lines = [f"{'model':<10}{'parameters':>11}{'rmse/peak':>11}{'BIC - best':>12}   verdict"]
    for c in candidates:
        if c.fit is None or c.bic is None:
            lines.append(f"{c.model:<10}{'':>34}   {c.verdict}")
            continue
        peak = float(np.abs(c.fit.data).max())
        lines.append(
            f"{c.model:<10}{len(c.fit.fit.values):>11}{c.fit.fit.rmse / peak:>11.2%}{c.bic - best:>12.1f}   {c.verdict}"
        )
    return lines


def _independent(fits: list[CurrentFit]) -> float:
    return max(effective_samples(found.fit.residuals) for found in fits)


def _bic(found: CurrentFit, samples: float) -> float:
    return information_criterion(found.fit.residuals, found.fit.count, samples)


def _verdict(model: str, found: CurrentFit, bics: dict[str, float], admitted: list[str], winner: str) -> str:
    if model == winner:
        return "chosen"
    if model not in admitted:
        reason = found.identifiability.reason
        return f"not determined by these data ({reason})" if reason else found.scouting.doubt
    return "worse" if bics[model] > bics[winner] else "better by less than the evidence that more parameters need"
