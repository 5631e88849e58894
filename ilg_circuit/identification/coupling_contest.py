"""Chooses the law of bending of a displacement, as the model of a current is chosen: by BIC on independent samples."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ..errors import IlgError, SolveError
from ..findings import Finding
from ..fit.criteria import effective_samples, integrated_time, structured
from ..fit.identifiability import diagnose
from ..fit.problem import Progress
from ..fit.selection import bic_on_independent, simplest_of_best
from ..strip.actuator import Actuator
from .displacement import Attempt, WindowSearch
from .film import Moving
from .motion_laws import EC31, LAWS, MotionLaw

#: Tolerance of the fits that are compared.
_TRIAL = 1e-6
#: Autocorrelation time, in samples, below which residuals are noise only.
_WHITE = 1.3


def chosen_law(
    record: Moving, actuator: Actuator, progress: Progress = None, delay: float = 0.0
) -> tuple[MotionLaw, list[Finding]]:
    """Return the law for a record's displacement, with the signs of its gains, and a finding with all laws' residuals.

    All are fitted on a static beam over the whole record or, where none describes that, the longest stretch that the
    best of them describes, the simplest first, until one leaves noise only. The simplest within strong evidence of the
    least BIC is chosen, of those whose parameters the data determine.
    """
    searches: dict[str, WindowSearch] = {}
    for name, law in sorted(LAWS.items(), key=lambda item: len(item[1].parameters)):
        with suppress(IlgError):
            searches[name] = WindowSearch(record, actuator, progress, delay, law=law)
    end = max((float(search.base.channel.time[-1]) for search in searches.values()), default=0.0)
    fits = _attempts(searches, end)
    if fits and not any(found.described for found in fits.values()):
        best = min(fits, key=lambda name: fits[name].fit.rmse)
        with suppress(IlgError):
            end = searches[best].longest().data.window
            fits = _attempts(searches, end) or fits
    if not fits:
        return EC31, []
    misfits = {name: found.fit.rmse for name, found in fits.items()}
    residuals = fits[min(misfits, key=misfits.__getitem__)].fit.residuals
    samples = np.array([effective_samples(residuals)])
    unknowns = {name: len(found.fit.values) for name, found in fits.items()}
    bics = {name: bic_on_independent(np.array([misfits[name]]), samples, unknowns[name]) for name in fits}
    admitted = [name for name, found in fits.items() if _determined(found)]
    size = {name: misfit / next(iter(fits.values())).data.size for name, misfit in misfits.items()}
    winner = (
        simplest_of_best(bics, unknowns, admitted, size)
        if admitted
        else next(n for n in (EC31.name, *fits) if n in fits)
    )
    rows = "; ".join(
        f"{name} {1e6 * misfits[name]:.3g} um, BIC {bics[name] - min(bics.values()):+.0f}"
        + ("" if name in admitted else ", not determined")
        for name in fits
    )
    values = {"law": searches[winner].law.text, "window": end, "rows": rows}
    return searches[winner].law, [Finding("coupling-chosen", record.source, values)]


def _attempts(searches: dict[str, WindowSearch], end: float) -> dict[str, Attempt]:
    """Return the fits of the laws up to ``end`` [s], on a static beam; the others end where one leaves noise only."""
    fits: dict[str, Attempt] = {}
    for name, search in searches.items():
        found = search.attempt("static", end, tolerance=_TRIAL)
        if found is None:
            continue
        fits[name] = found
        residuals = found.fit.residuals
        if not structured(residuals) and integrated_time(residuals) < _WHITE:
            break
    return fits


def _determined(found: Attempt) -> bool:
    """Return whether the data determine all parameters of a fit."""
    try:
        return diagnose(found.fit).determined
    except SolveError:
        return False
