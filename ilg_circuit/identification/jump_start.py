"""Computes starting places of a drive's jumps from a current: without a model's parameters, for a grid of relaxations.

Under a square wave of few readings a cycle, jumps in the middle of their intervals are so far off that a fit from there
ends in another minimum.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..strip.models import ElectricalModel
from .start import linear_basis

#: Models that place jumps for others, the richer first.
_SIMPLER = ("rc2", "rc")
#: Rounds for the conductance that relaxes, on which the effect of a jump's place depends.
_ROUNDS = 2
#: Noise of the current, relative to its largest, beside which places are unknown: a starting value needs no better one.
_NOISE = 1e-3


def placing_models(kind: ElectricalModel) -> tuple[str, ...]:
    """Return the models by whose fits the jumps of another may begin, the closest first."""
    if kind.plain not in _SIMPLER:
        return _SIMPLER
    return _SIMPLER[_SIMPLER.index(kind.plain) + (kind.name == kind.plain) :]


def places_by_relaxation(t: Array, current: Array, drive: PiecewiseLinear, widths: Array, nuisance: Array) -> Array:
    """Return distances [s] (j,) of jumps from where the ``drive`` has them, zero where the current shows none.

    The current is a resistor's and that of one relaxation, of the rate that fits best. A jump of dU that is ``late`` by
    d changes it by g rate dU d exp(-rate t) from there on, g the conductance that relaxes: with a normal prior, places
    are linear.

    Parameters
    ----------
    t, current
        Times since the onset [s] from 0 on, and current [A] (n,).
    drive
        The voltage since the onset, its jumps in the middle of their intervals.
    widths
        Widths [s] (j,) of the intervals of the jumps, the onset's first.
    nuisance
        Linear terms (n, q) beside.
    """
    at = np.append(0, 1 + np.flatnonzero(np.diff(drive.times) == 0))[: len(widths)]
    sizes = drive.values[at] - np.append(drive.rest, drive.values[at[1:] - 1])
    deviation = widths[: len(at)] / np.sqrt(12)
    noise = _NOISE * float(np.abs(current).max())
    rates, basis = linear_basis(t, drive)
    since = t[:, None] - drive.times[at]
    least, best = np.inf, np.zeros(len(widths))
    for rate, relaxing in zip(rates, basis[1:], strict=True):
        fading = np.where(since >= 0, np.exp(-rate * np.maximum(since, 0.0)), 0.0) * (rate * sizes * deviation)
        known = np.column_stack([basis[0], relaxing, nuisance])
        conductance = float(np.linalg.lstsq(known, current, rcond=None)[0][1])
        for _ in range(_ROUNDS):
            columns = np.hstack([known, conductance * fading])
            prior = np.append(np.zeros(known.shape[1]), np.full(len(at), noise**2))
            found = np.linalg.lstsq(columns.T @ columns + np.diag(prior), columns.T @ current, rcond=None)[0]
            conductance = float(found[1])
        cost = float(((current - columns @ found) ** 2).sum() + prior @ found**2)
        if min(found[0], conductance) > 0 and cost < least:
            least = cost
            best[: len(at)] = np.clip(found[known.shape[1] :], -np.sqrt(3), np.sqrt(3)) * deviation
    return best
