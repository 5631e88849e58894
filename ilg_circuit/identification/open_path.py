"""Computes what an electron path that a spectrum does not show adds to the errors of the other parameters.

Its resistance is then fixed as an open circuit. Any conductance from zero up to where the spectrum would show it may be
there, and moves the other parameters: they are fitted anew over that range, which also tells its bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..fit.bounded import BoundedProfile, profile_bounded
from ..fit.problem import Problem
from ..fit.quantiles import student
from ..fit.result import FitResult
from ..units import format_quantity
from .port_model import Measured

#: The electron path, which a spectrum may not show.
DC = "dc_resistance"
#: Stands for an open circuit in a fit; finite, so that arithmetic stays finite.
INFINITE = 1e200
#: Largest conductance, relative to the largest admittance of the data.
_MOST = 0.95
#: Parts of it that are tried in turn: far beyond the bound a model may have no fit.
_REACHES = (1.0, 0.1, 0.01, 1e-3, 1e-4)
_UNSEEN_PATH = "no electron path is seen beside the ions' (an open circuit fits as well)"
OPEN_PATH = "no electron path is seen: practically an open circuit"


def open_path(
    found: FitResult, data: Sequence[Measured], *, costly: bool = False, reach: float = 1.0
) -> BoundedProfile | None:
    """Return the profile of the conductance [S] of a path that was fixed as open; None if none was.

    ``data`` are those of its observations. The estimate stays at zero. A ``costly`` problem is solved at the ends only.
    Conductances reach up to the part ``reach`` of the largest that is reckoned with.
    """
    problem = found.problem
    if problem.fixed.get(DC) != INFINITE:
        return None
    telling = [k for k, o in enumerate(problem.observations) if DC in o.names]

    def at(conductance: float) -> Problem:
        return replace(problem, fixed={**problem.fixed, DC: 1 / conductance if conductance else INFINITE})

    return replace(profile_bounded(found, at, (0.0, reach * _most(data)), telling, costly=costly), known=0.0)


def _most(data: Sequence[Measured]) -> float:
    """Return the largest conductance [S] of a path beside the ions' that is reckoned with."""
    return _MOST / min(float(np.abs(d.shown(d.data)).min()) for d in data if d.quantity == "impedance")


def told(found: FitResult, data: Measured) -> str:
    """Return why the path was fixed as open, with the least resistance by the profile (95 %, one-sided)."""
    level = float(student(0.95, max(found.degrees_of_freedom - 1, 1)))
    limit = next((x for reach in _REACHES if (x := _limit(found, data, level, reach)) is not None), None)
    if limit is None:
        return _UNSEEN_PATH
    reason = OPEN_PATH if limit * float(np.abs(data.shown(data.data)).max()) < 1 else _UNSEEN_PATH
    return f"{reason}, more than {format_quantity(1 / limit, 'ohm', 3)} (95 %)"


def _limit(found: FitResult, data: Measured, level: float, reach: float) -> float | None:
    """Return the conductance [S] at which the root of the deviance, nearly a straight line, reaches a ``level``.

    It is the largest that is reckoned with if that is not excluded; None if no fit ends the range.
    """
    profile = open_path(found, [data], reach=reach)
    assert profile is not None
    roots, places = np.sqrt(profile.deviance), profile.places
    last = int(np.flatnonzero(roots <= level)[-1])
    if last + 1 < len(places):
        return float(np.interp(level, roots[last : last + 2], places[last : last + 2]))
    most = _most([data])
    return most if places[last] > (1 - 1e-6) * most else None
