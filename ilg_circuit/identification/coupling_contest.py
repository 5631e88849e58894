"""Chooses the law of bending of a displacement, as the model of a current is chosen: by BIC on independent samples."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ..errors import IlgError, SolveError
from ..findings import Finding
from ..fit.criteria import effective_samples
from ..fit.identifiability import diagnose
from ..fit.problem import Progress
from ..fit.selection import bic_on_independent, simplest_of_best
from ..strip.actuator import Actuator
from .displacement import Attempt, WindowSearch
from .film import Moving
from .motion_laws import EC31, LAWS, MotionLaw


def chosen_law(
    record: Moving, actuator: Actuator, progress: Progress = None, delay: float = 0.0
) -> tuple[MotionLaw, list[Finding]]:
    """Return the law for a record's displacement, with the signs of its gains, and a finding with all laws' residuals.

    All are fitted on a static beam over the longest stretch that one of them describes. The simplest law within
    strong evidence of the least BIC is chosen, of those whose parameters the data determine.
    """
    searches: dict[str, WindowSearch] = {}
    longest: dict[str, Attempt] = {}
    for name, law in LAWS.items():
        with suppress(IlgError):
            searches[name] = WindowSearch(record, actuator, progress, delay, law=law)
            longest[name] = searches[name].longest()
    if not longest:
        return EC31, []
    described = [found.data.window for found in longest.values() if found.described]
    end = max(described, default=float(searches[next(iter(longest))].base.channel.time[-1]))
    fits: dict[str, Attempt] = {}
    for name, found in longest.items():
        again = searches[name].attempt("static", end, found)
        if again is not None:
            fits[name] = again
    if not fits:
        return EC31, []
    misfits = {name: found.fit.rmse for name, found in fits.items()}
    residuals = fits[min(misfits, key=misfits.__getitem__)].fit.residuals
    samples = np.array([effective_samples(residuals)])
    unknowns = {name: len(found.fit.values) for name, found in fits.items()}
    bics = {name: bic_on_independent(np.array([misfits[name]]), samples, unknowns[name]) for name in fits}
    admitted = [name for name, found in fits.items() if _determined(found)]
    size = {name: misfit / next(iter(fits.values())).data.size for name, misfit in misfits.items()}
    winner = simplest_of_best(bics, unknowns, admitted, size)
    rows = "; ".join(
        f"{name} {1e6 * misfits[name]:.3g} um, BIC {bics[name] - min(bics.values()):+.0f}"
        + ("" if name in admitted else ", not determined")
        for name in fits
    )
    values = {"law": searches[winner].law.text, "window": end, "rows": rows}
    return searches[winner].law, [Finding("coupling-chosen", record.source, values)]


def _determined(found: Attempt) -> bool:
    """Return whether the data determine all parameters of a fit."""
    try:
        return diagnose(found.fit).determined
    except SolveError:
        return False
