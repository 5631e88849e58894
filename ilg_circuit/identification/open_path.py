"""Computes what an electron path that a spectrum does not show adds to the errors of the other parameters.

Its resistance is then fixed as an open circuit. Any conductance from zero up to where the spectrum would show it may be
there, and moves the other parameters: they are fitted anew over that range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..fit.bounded import BoundedProfile, profile_bounded
from ..fit.problem import Problem
from ..fit.result import FitResult
from .impedance import DC, INFINITE, ImpedanceData
from .port_model import Measured

#: Largest conductance, relative to the largest admittance of the data.
_MOST = 0.95


def open_path(found: FitResult, data: Sequence[Measured], *, costly: bool = False) -> BoundedProfile | None:
    """Return the profile of the conductance [S] of a path that was fixed as open; None if none was.

    ``data`` are those of its observations. The estimate stays at zero. A ``costly`` problem is solved at the ends only.
    """
    problem = found.problem
    if problem.fixed.get(DC) != INFINITE:
        return None
    telling = [k for k, o in enumerate(problem.observations) if DC in o.names]
    least = min(float(d.spectrum.modulus.min()) for d in data if isinstance(d, ImpedanceData))

    def at(conductance: float) -> Problem:
        return replace(problem, fixed={**problem.fixed, DC: 1 / conductance if conductance else INFINITE})

    high = _MOST / least
    return replace(profile_bounded(found, at, (0.0, high), telling, costly=costly), known=0.0)
