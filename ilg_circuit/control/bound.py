"""The shortest time in which any voltage within its limit brings tip or force to rest in a band: a linear programme."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, linprog

from ..arrays import Array
from ..errors import InputError
from ..units import format_quantity
from .loop import BAND
from .plant import Plant

#: Pieces of constant voltage before the entry into the band and after it, and where the band is looked at, per piece.
_BEFORE, _AFTER, _LOOKS = 80, 40, 2
#: How closely the time is found, relative, and the largest one that is tried in time constants of the slowest pole.
_FOUND, _LONGEST = 2e-5, 100.0


def fastest_settling(plant: Plant, step: float, limit: float, band: float = BAND) -> float:
    """Return the shortest time [s] after which +-``limit`` [V] can hold the plant's output within ``band`` of ``step``.

    The voltage is piecewise constant, so that a better one could be faster by at most a piece. Raises InputError where
    the step is beyond what the limit holds.
    """
    most, said = abs(plant.gain) * limit, format_quantity(step, plant.unit, 6)
    if abs(step) * (1 - band) > most:
        raise InputError(
            f"a step of {said} is out of reach: {limit:g} V holds at most {format_quantity(most, plant.unit, 4)}; "
            "allow more voltage or ask for less"
        )
    slow = 1 / float(np.abs(plant.poles.real).min())
    low, high = 0.0, slow / 8
    while _least_error(plant, abs(step), limit, high) > band:
        low, high = high, 2 * high
        if high > _LONGEST * slow:
            raise InputError(f"a step of {said} cannot be held within {100 * band:g} % at {limit:g} V")
    low = max(low, high / 8)
    while _least_error(plant, abs(step), limit, low) <= band:
        low, high = low / 8, low
    return float(brentq(lambda time: _least_error(plant, abs(step), limit, time) - band, low, high, rtol=_FOUND))


def _least_error(plant: Plant, step: float, limit: float, time: float) -> float:
    """Return the least largest error after ``time`` [s], in parts of the step."""
    pieces = _BEFORE + _AFTER
    answer = held_answer(plant, time / _BEFORE, pieces, _LOOKS)[_BEFORE * _LOOKS - 1 :] * (limit / step)
    one = np.ones((len(answer), 1))
    matrix = np.block([[answer, -one], [-answer, -one]])
    right = np.concatenate([one[:, 0], -one[:, 0]])
    cost = np.append(np.zeros(pieces), 1.0)
    found = linprog(cost, A_ub=matrix, b_ub=right, bounds=[(-1, 1)] * pieces + [(0, None)], method="highs")
    return float(found.x[-1]) if found.status == 0 else np.inf


def held_answer(plant: Plant, width: float, pieces: int, looks: int = 1) -> Array:
    """Return the output per volt (pieces looks, pieces) at the ends of parts of pieces of a voltage that is held."""
    n = len(plant.b)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = plant.a, plant.b
    moved = expm(whole * width / looks)
    state, rows = np.zeros(n), []
    for k in range(pieces * looks):
        state = moved[:n, :n] @ state + (moved[:n, n] if k < looks else 0.0)
        rows.append(float(plant.c @ state))
    pulse = np.array(rows)
    result = np.zeros((pieces * looks, pieces))
    for k in range(pieces):
        result[k * looks :, k] = pulse[: (pieces - k) * looks]
    return result
