"""Records whose current was controlled, by a galvanostat: the current is then the drive, and the voltage its answer."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from .jumps import voltage_jumps
from .record import Channel
from .smoothing import noise_level
from .table import Table
from .voltage import is_level

#: Fewest readings by which a piece is judged, and of a whole record.
_LEAST_PIECE, _LEAST = 8, 20
#: A level is that many times its noise; a curve is that many standard errors from a straight line.
_CLEAR, _BENDS = 10.0, 6.0
#: Largest reading [V, A] that is one.
_MOST = 1e6
#: Standard errors by which the halves of a level may differ, and its neighbours may correlate.
_ALIKE = 5.0
#: Part of its range by which a curve bends, beyond rounding and the last digit.
_CURVED = 1e-3


def forces_current(table: Table) -> bool:
    """Return True if the current of a record was controlled: levels with jumps, and a voltage that is a curve.

    A voltage of levels or of straight lines counts as controlled, whatever the current does.
    """
    voltage, current = table.get("voltage"), table.get("current")
    if voltage is None or current is None:
        return False
    known = np.isfinite(voltage) & np.isfinite(current)
    if known.sum() < _LEAST:
        return False
    t, u, i = table.time[known], voltage[known], current[known]
    if max(np.abs(u).max(), np.abs(i).max()) > _MOST or not np.ptp(i) or not np.ptp(u):
        return False
    with np.errstate(all="ignore"):  # squares of tiny readings
        return _forces(t, u, i)


def _forces(t: Array, u: Array, i: Array) -> bool:
    edges = [0, *(voltage_jumps(i) + 1).tolist(), len(i)]
    pieces = [slice(a, b) for a, b in pairwise(edges) if b - a >= _LEAST_PIECE]
    if sum(piece.stop - piece.start for piece in pieces) < 0.9 * len(i):
        return False
    if not all(is_level(i[piece]) or _scatters(i[piece]) for piece in pieces):
        return False
    levels = np.array([abs(float(i[piece].mean())) for piece in pieces])
    if levels.max() < _CLEAR * max(float(i[piece].std()) for piece in pieces):
        return False
    return any(_bends(t[piece], u[piece]) for piece in pieces)


def _scatters(i: Array) -> bool:
    """Return True if readings are a level whose noise is white, as `is_level` says, less strictly for many pieces."""
    half, deviation = len(i) // 2, i - i.mean()
    variance = float(deviation @ deviation)
    if not variance:
        return True
    correlation = float(deviation[1:] @ deviation[:-1]) / variance
    shift = abs(float(i[:half].mean() - i[half:].mean())) / np.sqrt(4 * variance) * len(i)
    return bool(abs(correlation) < _ALIKE / np.sqrt(len(i)) and shift < _ALIKE)


def _bends(t: Array, u: Array) -> bool:
    """Return True if readings ``u`` at ``t`` are a curve: neither a level, nor jumps, nor a straight line."""
    if len(voltage_jumps(u)):
        return False
    if not np.ptp(t):
        return False
    x, noise = (t - t.mean()) / (np.ptp(t) or 1.0), noise_level(u)
    fits = [np.polynomial.Polynomial.fit(x, u, degree) for degree in (1, 2)]
    line, parabola = (float(((u - fit(x)) ** 2).sum()) for fit in fits)
    spread = float(np.ptp(u))
    better = line - parabola
    return bool(
        spread > _CLEAR * noise and better > (_BENDS * noise) ** 2 and better > len(u) * (_CURVED * spread) ** 2
    )


def as_set(forced: PiecewiseLinear, noise: float) -> PiecewiseLinear:
    """Return a ``forced`` current whose levels of one size, apart from the readings' ``noise`` [A], are alike.

    Means of noisy readings differ by chance, and a difference of two polarities would charge the strip.
    """
    sizes = np.abs(forced.values)
    order = np.argsort(sizes, kind="stable")
    apart = np.diff(sizes[order]) > 4 * noise / np.sqrt(_LEAST_PIECE)
    group = np.empty(len(sizes), dtype=int)
    group[order] = np.append(0, np.cumsum(apart))
    means = np.array([sizes[group == k].mean() for k in range(group.max() + 1)])
    values = np.sign(forced.values) * means[group]
    return replace(forced, values=values, unit="A", text="measured current")


def answered(voltage: Channel, forced: PiecewiseLinear) -> PiecewiseLinear:
    """Return the ``voltage`` that answered a ``forced`` current as straight lines, with jumps where that jumps."""
    after = voltage.time >= 0
    t, v = voltage.time[after], voltage.values[after]
    edges = [0.0, *forced.jumps(float(t[-1])).tolist(), np.inf]
    times: list[float] = []
    values: list[float] = []
    for begin, end in pairwise(edges):
        inside = (t >= begin) & (t < end)
        if not inside.any():
            continue
        if times:
            times.append(begin)
            values.append(values[-1])
        if t[inside][0] > begin:
            times.append(begin)
            values.append(float(v[inside][0]))
        times += t[inside].tolist()
        values += v[inside].tolist()
    rest = float(np.median(voltage.values[~after])) if (~after).any() else 0.0
    return PiecewiseLinear(np.array(times), np.array(values), "measured voltage", rest if forced.rest else 0.0)
