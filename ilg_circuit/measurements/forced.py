"""Records whose current was controlled, by a galvanostat: the current is then the drive, and the voltage its answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask
from ..drive import PiecewiseLinear
from .jumps import staircase, voltage_jumps
from .record import Channel
from .smoothing import noise_level
from .table import Table
from .voltage import MeasuredDrive, simplified

#: Fewest readings by which a piece is judged, and of a whole record; the part of it in such pieces.
_LEAST_PIECE, _LEAST, _MOST_OF = 4, 20, 0.8
#: A level is that many times its noise; a jump that many standard errors.
_CLEAR, _BENDS = 10.0, 6.0
#: How much a controlled current's voltage slopes or bends, where 1 could just be chance.
_SURELY = 3.0
#: Least part of its span by which a voltage that goes one way ends from where it began.
_ONE_WAY = 0.8
#: Largest reading [V, A] that is one.
_MOST = 1e6
#: Standard errors by which slopes may differ from those of levels with noise.
_ALIKE = 5.0
#: Part of its range by which a curve slopes or bends, beyond rounding and the last digit.
_CURVED = 1e-3
#: Distance of a straight line from readings in noise levels, and the largest part of a span that is still told.
_LINE, _VAGUE = 8.0, 0.02
#: Least number of bends of the voltage along a ramp of a controlled current; two sines have one of each other's.
_BENDS_ALONG = 3.0
#: Number of readings beside a jump that tell how the voltage goes on up to it.
_NEAREST = 3
#: Number of readings among which lines are looked for.
_MANY = 2000


def forces_current(table: Table) -> bool:
    """Return True if the current of a record was controlled: it is levels with jumps, and the voltage is a curve.

    Or it is ramps along which the voltage bends. Where both are alike, as sines or noise, and where the voltage is
    levels, the voltage was.
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
        return _forces(t, u, i) or _is_ramps(t, i, u)


def _forces(t: Array, u: Array, i: Array) -> bool:
    """Return True if the current ``i`` is levels, and the voltage ``u`` none: it bends between the jumps, or slopes.

    Where it only slopes it must jump where the current does, as over a resistance. Else it may be a controlled ramp, by
    which a capacitor's current is levels. Levels of few readings tell that alone. One level throughout may be the
    offset of an open circuit: it is a controlled current only if the voltage goes one way.
    """
    jumps = voltage_jumps(i)
    if not len(jumps) and abs(float(u[-1] - u[0])) < _ONE_WAY * float(np.ptp(u)):
        return False
    edges = [0, *(np.union1d(jumps, voltage_jumps(u)) + 1).tolist(), len(i)]
    pieces = [slice(a, b) for a, b in pairwise(edges) if b - a >= _LEAST_PIECE]
    if sum(piece.stop - piece.start for piece in pieces) < _MOST_OF * len(i):
        own, within = staircase(i)
        still = ~own & (np.abs(np.diff(i)) <= within)
        levels = bool(own.any() and (own | still).all())
        return levels and _charges(u, i, still) and _over_resistance(u, i, jumps)
    current, voltage = (_course(t, x, pieces) for x in (i, u))
    if current.sloped > 1 or np.abs(i).max() < _CLEAR * current.noise:
        return False
    return voltage.bent > _SURELY or (voltage.sloped > _SURELY and _over_resistance(u, i, jumps))


@dataclass(frozen=True)
class _Course:
    """How readings go on between jumps: how much they slope and bend, 1 where it could just be chance.

    ``noise`` is the standard deviation about parabolas, in the unit of the readings.
    """

    sloped: float
    bent: float
    noise: float


def _course(t: Array, x: Array, pieces: Sequence[slice]) -> _Course:
    """Return how readings ``x`` at ``t`` (n,) go on in ``pieces`` of them."""
    rows = []
    for piece in pieces:
        z = 2 * (t[piece] - t[piece].mean()) / (np.ptp(t[piece]) or 1.0)
        basis, _ = np.linalg.qr(np.vander(z, 3, increasing=True))
        amounts = basis.T @ x[piece]
        left = float(x[piece] @ x[piece] - amounts @ amounts)
        rows.append((amounts[1], amounts[2], max(left, 0.0), len(z)))
    slopes, bends, left, counts = np.array(rows).T
    noise = float(np.sqrt(left.sum() / max((counts - 3).sum(), 1)))
    least = counts * (_CURVED * float(np.ptp(x))) ** 2 + noise**2
    chance = 1 + _ALIKE * np.sqrt(2 / len(rows))
    sloped, bent = (float((amounts**2 / least).mean()) / chance for amounts in (slopes, bends))
    return _Course(sloped, bent, noise)


def _charges(u: Array, i: Array, still: Mask) -> bool:
    """Return True if the voltage rises where the current is high, in the intervals (n - 1,) where that is ``still``."""
    rise, level = np.diff(u)[still], i[:-1][still]
    count = len(rise)
    if count < _LEAST / 2 or not np.ptp(rise) or not np.ptp(level):
        return False
    together = float(np.corrcoef(rise, level)[0, 1])
    return bool(together * np.sqrt(count - 2) > _BENDS * np.sqrt(max(1 - together**2, 0.0)))


def _over_resistance(u: Array, i: Array, jumps: NDArray[np.intp]) -> bool:
    """Return True if the voltage jumps in the intervals in which the current does, beyond its changes beside them."""
    apart = np.diff(jumps) > 1
    alone = np.append(True, apart) & np.append(apart, True) if len(jumps) else np.zeros(0, dtype=bool)
    jumps = jumps[alone & (jumps > 0) & (jumps < len(u) - 2)]
    if not len(jumps):
        return False
    change = np.diff(u)
    along = np.sign(np.diff(i)[jumps]) * (change[jumps] - (change[jumps - 1] + change[jumps + 1]) / 2)
    beside = np.sqrt(np.mean(np.r_[change[jumps - 1], change[jumps + 1]] ** 2))
    return bool(along.mean() > _BENDS * max(float(along.std()), float(beside)) / np.sqrt(len(jumps)))


def _is_ramps(t: Array, i: Array, u: Array) -> bool:
    """Return True if ``i`` at ``t`` is ramps along each of which ``u`` bends, within the same part of their spans."""
    every = max(1, len(t) // _MANY)
    t, i, u = t[::every], i[::every], u[::every]
    if not np.ptp(i) or not np.ptp(u):
        return False
    part = max(_CURVED, *(_LINE * noise_level(x) / float(np.ptp(x)) for x in (i, u)))
    if part > _VAGUE:
        return False
    ends, bends = (simplified(t, x, part * float(np.ptp(x))) for x in (i, u))
    ramps = (np.abs(np.diff(i[ends])) > 2 * part * float(np.ptp(i))) & (np.diff(ends) > 1)
    inside = np.searchsorted(bends, ends[1:], side="left") - np.searchsorted(bends, ends[:-1], side="right")
    return bool(ramps.any() and np.diff(ends)[ramps].sum() >= _LEAST and inside[ramps].mean() >= _BENDS_ALONG)


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


@dataclass(frozen=True)
class AnsweredDrive(MeasuredDrive):
    """The ``voltage`` that answered a ``forced`` current as a drive: it jumps where the current is placed to jump."""

    forced: MeasuredDrive | None = None
    voltage: Channel | None = None

    @staticmethod
    def of(forced: MeasuredDrive, voltage: Channel) -> AnsweredDrive:
        """Return the drive with the jumps where ``forced`` has them."""
        drive = answered(voltage, forced.drive)
        return AnsweredDrive(drive, forced.widths, 0.0, forced.places, forced.stated, forced, voltage)

    def moved(self, share: float, width: float) -> PiecewiseLinear:
        """Return the drive since an onset elsewhere in its bracket, see `MeasuredDrive.moved`."""
        assert self.forced is not None
        assert self.voltage is not None
        forced = replace(self.forced, places=self.places).moved(share, width)
        time = np.maximum(self.voltage.time - share * width, np.where(self.voltage.rest, -np.inf, 0.0))
        return answered(replace(self.voltage, time=time), forced)


def answered(voltage: Channel, forced: PiecewiseLinear) -> PiecewiseLinear:
    """Return the ``voltage`` that answered a ``forced`` current as straight lines, with jumps where that jumps.

    On both sides of a jump the readings there are continued up to it.
    """
    after = ~voltage.rest
    t, v = voltage.time[after], voltage.values[after]
    edges = np.concatenate([[0.0], forced.jumps(float(t[-1]))])
    bounds = np.append(np.searchsorted(t, edges), len(t))
    times: list[Array] = []
    values: list[Array] = []
    before = slice(0, 0)
    for begin, (a, b) in zip(edges.tolist(), pairwise(bounds.tolist()), strict=True):
        if a == b:
            continue
        here = slice(a, b)
        if times:
            times.append(np.array([begin]))
            values.append(np.array([_continued(t[before][-_NEAREST:], v[before][-_NEAREST:], begin)]))
        if t[a] > begin:
            times.append(np.array([begin]))
            values.append(np.array([_continued(t[here][:_NEAREST], v[here][:_NEAREST], begin)]))
        times.append(t[here])
        values.append(v[here])
        before = here
    rest = float(np.median(voltage.values[~after])) if (~after).any() else 0.0
    return PiecewiseLinear(
        np.concatenate(times), np.concatenate(values), "measured voltage", rest if forced.rest else 0.0
    )


def _continued(t: Array, v: Array, to: float) -> float:
    """Return what a straight line through readings ``v`` at ``t`` (n,) is at a time beside them."""
    if len(t) < 2 or not np.ptp(t):
        return float(v.mean())
    at = t - t.mean()
    return float(v.mean() + (at @ v) / (at @ at) * (to - t.mean()))
