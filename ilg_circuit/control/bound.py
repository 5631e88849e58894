"""The shortest time in which any voltage within its limit brings tip, force or shape to rest in a band.

A linear programme for each time. Of several voltages and outputs all hold at once.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, linprog

from ..arrays import Array
from ..errors import InputError
from ..units import format_quantity
from .loop import BAND
from .plant import Plant, speeds

#: Pieces of constant voltage before the entry into the band and after it, and where the band is looked at, per piece.
_BEFORE, _AFTER, _LOOKS = 80, 40, 2
#: How closely the time is found, relative, and the largest one that is tried in time constants of the slowest pole.
_FOUND, _LONGEST = 2e-5, 100.0
#: A time that counts as at once, in time constants of the slowest pole.
_SOONEST = 1e-6


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


def fastest_shape(a: Array, b: Array, c: Array, steps: Array, band: float = BAND) -> float | None:
    """Return the shortest time [s] after which inputs within +-1 can hold all outputs within ``band`` of ``steps``.

    b is (s, inputs), c is (outputs, s), ``steps`` are (outputs,). None where no inputs do. The inputs are piecewise
    constant in half as many pieces as those of `fastest_settling`.
    """
    slow = 1 / float(speeds(a).min())
    low, high = 0.0, slow / 8

    def error(time: float) -> float:
        before, after = _BEFORE // 2, _AFTER // 2
        moved = held_answers(a, b, c, time / before, before + after, _LOOKS)[:, :, before * _LOOKS - 1 :]
        rows = moved.transpose(0, 2, 1, 3).reshape(-1, b.shape[1] * (before + after))
        return _least_largest(rows, np.repeat(steps, moved.shape[2]))

    while error(high) > band:
        low, high = high, 2 * high
        if high > _LONGEST * slow:
            return None
    while low == 0.0:
        sooner = high / 8
        low, high = (sooner, high) if error(sooner) > band else (0.0, sooner)
        if high < _SOONEST * slow:
            return high
    return float(brentq(lambda time: error(time) - band, low, high, rtol=_FOUND))


def least_at_rest(gains: Array, steps: Array) -> float:
    """Return the least largest error with which inputs within +-1 hold outputs, ``gains`` (outputs, inputs) each."""
    return _least_largest(gains, steps)


def _least_largest(matrix: Array, wanted: Array) -> float:
    """Return the least largest value of abs(``matrix`` x - ``wanted``) for x within +-1."""
    one = np.ones((len(matrix), 1))
    sides, right = np.block([[matrix, -one], [-matrix, -one]]), np.concatenate([wanted, -wanted])
    cost = np.append(np.zeros(matrix.shape[1]), 1.0)
    bounds = [(-1, 1)] * matrix.shape[1] + [(0, None)]
    # where many inputs do as well, the simplex method may go round without end
    found = linprog(cost, A_ub=sides, b_ub=right, bounds=bounds, method="highs-ipm")
    return float(found.x[-1]) if found.status == 0 else np.inf


def _least_error(plant: Plant, step: float, limit: float, time: float) -> float:
    """Return the least largest error after ``time`` [s], in parts of the step."""
    pieces = _BEFORE + _AFTER
    answer = held_answer(plant, time / _BEFORE, pieces, _LOOKS)[_BEFORE * _LOOKS - 1 :] * (limit / step)
    return _least_largest(answer, np.ones(len(answer)))


def held_answer(plant: Plant, width: float, pieces: int, looks: int = 1) -> Array:
    """Return the output per volt (pieces looks, pieces) at the ends of parts of pieces of a voltage that is held."""
    return np.asarray(held_answers(plant.a, plant.b[:, None], plant.c[None], width, pieces, looks)[0, 0])


def held_answers(a: Array, b: Array, c: Array, width: float, pieces: int, looks: int = 1) -> Array:
    """Return `held_answer` of each output to each input, (outputs, inputs, pieces looks, pieces)."""
    n, inputs = b.shape
    whole = np.zeros((n + inputs, n + inputs))
    whole[:n, :n], whole[:n, n:] = a, b
    moved = expm(whole * width / looks)
    state, rows = np.zeros((n, inputs)), []
    for k in range(pieces * looks):
        state = moved[:n, :n] @ state + (moved[:n, n:] if k < looks else 0.0)
        rows.append(c @ state)
    pulse = np.stack(rows, axis=-1)
    result = np.zeros((len(c), inputs, pieces * looks, pieces))
    for k in range(pieces):
        result[..., k * looks :, k] = pulse[..., : (pieces - k) * looks]
    return result
