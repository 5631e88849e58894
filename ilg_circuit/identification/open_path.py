"""Replaces an electron path that data do not show by an open circuit, and computes what it adds to others' errors.

Any conductance from zero up to where the data would show it may be there, and moves the other parameters: they are
fitted anew over that range, which also tells its bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..errors import NotDetermined, SolveError
from ..fit.bounded import BoundedProfile, profile_bounded
from ..fit.limits import least_squares
from ..fit.problem import Problem
from ..fit.quantiles import student
from ..fit.reported import reported_errors
from ..fit.result import FitResult
from ..units import format_quantity
from .port_model import DC, INFINITE, Measured

Fitted = TypeVar("Fitted")
#: Relative standard error of a resistance above which its logarithm is no measure: the conductance is next to zero.
_VAGUE = 3.0
#: Resistance of an open electron path in the fitted strip, relative to the largest of the data.
OPEN = 1e6
#: Largest conductance, relative to the largest admittance of the data.
_MOST = 0.95
#: The same beside a current, in standard errors; a small conductance, relative to the largest of the resistances.
_ERRORS, _SMALL = 5.0, 1e-3
#: Parts of it that are tried in turn: far beyond the bound a model may have no fit.
_REACHES = (1.0, 0.1, 0.01, 1e-3, 1e-4)
#: Factor of the next place of a search for the bound; its error relative to it; least share of a bracket by which that
#: shrinks, and the largest number of places.
_FURTHER, _CLOSE, _EDGE, _ROUNDS = 2.0, 5e-3, 0.1, 60
#: Residuals that are rounding, relative to the data.
_EXACT = 1e-9
UNSEEN_PATH = "no electron path is seen beside the ions' (an open circuit fits as well)"
OPEN_PATH = "no electron path is seen: practically an open circuit"


def seen_or_open(
    fitted: Callable[[bool], Fitted],
    fit_of: Callable[[Fitted], FitResult],
    *,
    likely: bool = False,
    hopeless: bool = False,
) -> Fitted:
    """Return the fit with a model's electron path, or with an open circuit in its place if the data do not show it.

    ``fitted`` returns it with the path open or not, ``fit_of`` its least-squares fit. The open circuit is tried
    first if it is ``likely``, and alone if a path is ``hopeless`` where that fails. Raises SolveError if there
    is none.
    """
    if likely:
        try:
            return fitted(True)
        except SolveError:
            if hopeless:
                raise
            return fitted(False)
    try:
        found = fitted(False)
    except NotDetermined as error:
        if DC not in error.labels:
            raise
        return fitted(True)
    fit = fit_of(found)
    at = fit.labels.index(DC)
    if reported_errors(fit)[at] <= _VAGUE * fit.values[at]:
        return found
    try:
        return fitted(True)
    except SolveError:
        return found


def open_path(found: FitResult, data: Sequence[Measured], *, costly: bool = False) -> BoundedProfile | None:
    """Return the profile of the conductance [S] of a path that was fixed as open; None if none was.

    ``data`` are those of its observations. The estimate stays at zero. A ``costly`` problem is solved at the ends only.
    """
    if found.problem.fixed.get(DC) != INFINITE:
        return None
    most = _most(found, data)
    profiles = (_profile(found, reach * most, costly=costly) for reach in _REACHES)
    some = next((profile for profile in profiles if len(profile.places) > 1), None)
    return some or _profile(found, 0.0, costly=costly)


def _profile(found: FitResult, most: float, *, costly: bool = False) -> BoundedProfile:
    """Return the profile of the conductance [S] of an open path up to the largest, with the estimate at zero."""
    problem = found.problem
    telling = [k for k, o in enumerate(problem.observations) if DC in o.names]

    def at(conductance: float) -> Problem:
        return replace(problem, fixed={**problem.fixed, DC: 1 / conductance if conductance else INFINITE})

    return replace(profile_bounded(found, at, (0.0, most), telling, costly=costly), known=0.0)


def _most(found: FitResult, data: Sequence[Measured]) -> float:
    """Return the largest conductance [S] of a path beside the ions' that is reckoned with."""
    spectra = [d for d in data if d.quantity == "impedance"]
    if spectra:
        return _MOST / min(float(np.abs(d.shown(d.data)).min()) for d in spectra)
    return _ERRORS * conductance_error(found)


def conductance_error(found: FitResult) -> float:
    """Return the standard error [S] of the conductance of an open path, all else free, by its small effect."""
    problem = found.problem
    resistances = (found.by_label()[label] for label in found.labels if "resistance" in label)
    small = _SMALL / max(resistances, default=1.0)
    there = replace(problem, fixed={**problem.fixed, DC: 1 / small})
    x = found.coordinates[None]
    effect = problem.projected(there.predictions(x)[0] - problem.predictions(x)[0]) / small
    slopes = problem.projected(found.slopes[:, : len(found.values)].T)
    size = np.linalg.norm(slopes, axis=1)
    basis = np.linalg.qr((slopes[size > 0] / size[size > 0, None]).T)[0]
    effect -= basis @ (basis.T @ effect)
    samples = sum(found.independent_samples(k) for k in range(len(problem.observations)))
    return float(np.sqrt(found.sum_of_squares / samples) / np.linalg.norm(effect))


def largest_conductance(found: FitResult, data: Sequence[Measured]) -> float | None:
    """Return the largest conductance [S] of an open path (95 %, one-sided), at most what is reckoned with.

    That is where the root of the deviance from its least value, nearly a straight line, reaches the quantile: all else
    is descended to anew at each place, which needs no regular minimum. None of an exact record. ``data`` are those of
    the fit's observations.
    """
    level, most = float(student(0.95, max(found.degrees_of_freedom - 1, 1))), _most(found, data)
    samples = sum(found.independent_samples(k) for k in range(len(found.problem.observations)))
    place, inside, k = min(conductance_error(found), most), 0.0, 0
    if not (0 < place < np.inf and found.sum_of_squares > (_EXACT * np.linalg.norm(found.problem.data)) ** 2):
        return None
    known = [(inside, found.sum_of_squares, found.coordinates)]
    for _ in range(_ROUNDS):
        held = replace(found.problem, fixed={**found.problem.fixed, DC: 1 / place})
        x, squares = least_squares(held, known[k][2])
        known = sorted([*known, (place, squares, x)], key=lambda one: one[0])
        growth = np.array([squares for _, squares, _ in known])
        roots = np.sqrt((growth / max(growth.min(), np.finfo(float).tiny) - 1) * samples)
        k = int(np.flatnonzero(roots <= level)[-1])
        inside = known[k][0]
        if inside >= most or level - roots[k] < _CLOSE * level:
            break
        if k + 1 == len(known):
            place = min(_FURTHER * place, most)
            continue
        outside = known[k + 1][0]
        if outside - inside < _CLOSE * outside:
            break
        share = (level - roots[k]) / (roots[k + 1] - roots[k])
        place = inside + float(np.clip(share, _EDGE, 1 - _EDGE)) * (outside - inside)
    return inside or None


def told(found: FitResult, data: Sequence[Measured]) -> str:
    """Return why the path was fixed as open, with the least resistance by the profile (95 %, one-sided)."""
    limit = largest_conductance(found, data)
    if limit is None:
        return UNSEEN_PATH
    sizes = [float(np.abs(d.shown(d.data)).max()) for d in data if d.quantity == "impedance"]
    reason = OPEN_PATH if sizes and limit * max(sizes) < 1 else UNSEEN_PATH
    return f"{reason}, more than {format_quantity(1 / limit, 'ohm', 3)} (95 %)"
