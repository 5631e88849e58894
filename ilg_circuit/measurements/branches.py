"""Finds the branches of a load test, loading, unloading and reloading, from the order of its rows.

Rubbers and gels soften when they are stretched for the first time (Mullins effect): their response afterwards differs,
and no elastic material describes both. A row is loading if the stretch exceeds its earlier extreme on that side of 1,
reloading if the stretch moves away from 1 within earlier extremes, and unloading if it returns towards 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays import Array

LOADING, UNLOADING, RELOADING = "loading", "unloading", "reloading"
KINDS = (LOADING, UNLOADING, RELOADING)

#: Least reversal that begins a new branch, as a fraction of the range of the logarithm of the stretch.
_TURN = 0.05
#: Least reversal in standard deviations of the noise of the stretch; upper limit of that, as a fraction of the range.
_NOISE, _MOST_NOISE = 6.0, 0.3
#: Least mean length of branches, in rows; if shorter, the rows are not in order. Least length with two branches only.
_SHORTEST, _SHORTEST_OF_TWO = 3.0, 2
#: Least overlap of two curves whose areas are compared, as a fraction of the range.
_COMMON = 0.2
_STRIPS = 400


@dataclass(frozen=True, eq=False)
class Leg:
    """Readings of one branch, in order: ``stretch`` and ``stress`` [Pa], both (n,), and their ``kind`` (of `KINDS`)."""

    kind: str
    stretch: Array
    stress: Array

    @property
    def side(self) -> int:
        """1 in tension, -1 in compression, by the reading farthest from stretch 1."""
        logs = np.log(self.stretch)
        return 1 if logs[np.argmax(np.abs(logs))] > 0 else -1


def find_legs(stretch: Array, stress: Array) -> tuple[Leg, ...] | None:
    """Return the branches of rows of ``stretch`` and ``stress`` [Pa], both (n,); None for rows in no order.

    Rows in one direction are one branch. A return without readings, as between specimens listed one after another in a
    table, is not unloading, and the rows after it are loading again.
    """
    logs = np.log(stretch)
    span = float(np.ptp(logs))
    if len(logs) < 2 or span == 0:
        return (Leg(LOADING, stretch, stress),)
    noise = _NOISE * _scatter(logs)
    if noise > span:
        return None
    threshold = max(_TURN * span, min(noise, _MOST_NOISE * span))
    turns = _turns(logs, threshold)
    steps = np.diff(turns)
    shortest = (steps.min(), _SHORTEST_OF_TWO) if len(steps) == 2 else (steps.mean(), _SHORTEST)
    if len(steps) > 1 and shortest[0] < shortest[1]:
        return None
    pieces = _pieces(logs, turns, threshold)
    if len(pieces) == 1:
        away = abs(logs[-1]) >= abs(logs[0]) or logs[0] * logs[-1] < 0
        return (Leg(LOADING if away else UNLOADING, stretch, stress),)
    return tuple(Leg(kind, stretch[rows], stress[rows]) for kind, rows in _kinds(logs, pieces, threshold))


def area_shares(legs: Sequence[Leg]) -> dict[str, float]:
    """Return the decrease in work from loading to unloading and to reloading, as fractions of the work of loading.

    The works are compared over common stretches; the fraction of unloading is the hysteresis. The first branches on the
    side of the first loading are used. A kind is missing if there is no such branch, or if the overlap is too small.
    """
    first = next((leg for leg in legs if leg.kind == LOADING and len(leg.stretch) > 1), None)
    if first is None:
        return {}
    shares = {}
    for kind in (UNLOADING, RELOADING):
        other = next((g for g in legs if g.kind == kind and g.side == first.side and len(g.stretch) > 1), None)
        share = None if other is None else _area_share(first, other)
        if share is not None:
            shares[kind] = share
    return shares


def _scatter(logs: Array) -> float:
    """Return the standard deviation of the noise, from second differences."""
    return float(np.median(np.abs(np.diff(logs, 2)))) / (0.6745 * np.sqrt(6)) if len(logs) > 4 else 0.0


def _turns(logs: Array, threshold: float) -> list[int]:
    """Return the first row, the rows where the stretch turns back by more than ``threshold``, and the last row."""
    turns, direction, far, near = [0], 0, 0, 0
    values = logs.tolist()
    for k, value in enumerate(values):
        if direction == 0:  # ``far`` is the highest row so far, ``near`` the lowest
            far, near = (k if value > values[far] else far), (k if value < values[near] else near)
            if values[far] - values[near] > threshold:
                direction = 1 if far > near else -1
                far = k
        elif direction * (value - values[far]) > 0:
            far = k
        elif direction * (values[far] - value) > threshold:
            turns.append(far)
            direction, far = -direction, k
    return [*turns, len(values) - 1]


def _pieces(logs: Array, turns: list[int], threshold: float) -> list[tuple[slice, bool]]:
    """Return the rows between turns, cut where they pass through stretch 1, and whether they follow a jump.

    A way between two turns without a row on it is a jump.
    """
    pieces, jumped, start = [], False, 0
    for k, (begin, end) in enumerate(pairwise(turns)):
        last = k == len(turns) - 2
        if end - begin == 1 and k and not last:
            jumped, start = True, end
            continue
        part = logs[start : end + 1]
        cut = len(part)
        if len(turns) > 2 and min(part.max(), -part.min()) > threshold:  # it goes well through 1
            cut = int(np.argmax(np.sign(part) == np.sign(part[-1])))
        for rows in (slice(start, start + cut), slice(start + cut, end + 1)):
            if rows.stop > rows.start:
                pieces.append((rows, jumped))
                jumped = False
        start = end + 1
    return pieces


def _kinds(logs: Array, pieces: list[tuple[slice, bool]], threshold: float) -> list[tuple[str, slice]]:
    """Return pieces with their kinds; the part of a reloading beyond the earlier extreme is loading."""
    found: list[tuple[str, slice]] = []
    farthest: dict[int, float] = {}
    came_back: set[int] = set()
    sides = [1 if part[np.argmax(np.abs(part))] > 0 else -1 for part in (logs[rows] for rows, _ in pieces)]
    for (rows, jumped), side in zip(pieces, sides, strict=True):
        distance = side * logs[rows]
        reach, before = float(distance.max()), farthest.get(side, 0.0)
        back = distance[-1] < distance[0] or (len(distance) == 1 and reach < before and not jumped)
        if back and not (jumped and sides.count(side) == 1):  # that would be a table in order of the stretch
            found.append((UNLOADING, rows))
            came_back.add(side)
        elif side not in came_back:
            found.append((LOADING, rows))
        else:
            beyond = int(np.argmax(distance > before)) if reach > before + threshold else len(distance)
            kinds = ((RELOADING, rows.start, rows.start + beyond), (LOADING, rows.start + beyond, rows.stop))
            found += [(kind, slice(start, stop)) for kind, start, stop in kinds if stop > start]
        farthest[side] = max(before, reach)
    return found


def _area_share(first: Leg, other: Leg) -> float | None:
    curves = [(g.stretch[order], g.stress[order]) for g in (first, other) for order in [np.argsort(g.stretch)]]
    low, high = max(float(x[0]) for x, _ in curves), min(float(x[-1]) for x, _ in curves)
    span = max(float(np.ptp(first.stretch)), float(np.ptp(other.stretch)))
    if high - low < _COMMON * span:
        return None
    at = low + (high - low) * (np.arange(_STRIPS) + 0.5) / _STRIPS
    work, less = (abs(float(np.interp(at, x, y).mean())) for x, y in curves)
    return (work - less) / work if work else None
