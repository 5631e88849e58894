"""Detects loss of contact in a record: stretches where the current is an open circuit's and not a strip's.

A strip's current jumps when the voltage jumps, and at no other time. Contact is lost if the current drops to zero,
returns from zero, or stays at zero during a jump of the voltage, and a passive port fitted to the record does not. The
strip's state when contact returns is not known.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..arrays import Array, Mask
from .jumps import voltage_jumps
from .onset import Beginning, Onset
from .passive import Passive, PassivePort
from .smoothing import digit, noise_level, resolution

#: Half-width of the band about an open clamp's level, in noise levels: readings within it may be the open clamp's.
_BAND = 5.0
#: Least height of an edge of the current, in standard errors and as a fraction of the largest current.
_SURE, _LEAST = 8.0, 0.002
#: Fraction of an edge that a passive port explains if the edge is the strip's; tolerance of its place, in readings.
_EXPLAINED, _SKEW = 0.5, 1
#: Least number of readings of a break: fewer are outliers.
_FEWEST = 3
#: Readings within this number of noise levels of the extreme may be at the instrument's limit, if the extreme of that
#: sign exceeds this fraction of the largest current.
_TOP, _LIMIT = 4.0, 0.2
#: Window lengths, in readings on either side of an edge, for distinguishing it from noise.
_WINDOWS = (1, 3, 8, 20, 50, 120)
#: Least window length for a straight line extrapolated to the edge; for shorter windows the mean is taken.
_LINE = 8
#: Tolerance of an open clamp's mean beside an edge, in standard errors and as a fraction of the edge.
_LEVEL, _OF_EDGE = 4.0, 0.05
#: Least expected change of the current at a jump of the voltage, as a fraction of the largest current.
_ANSWER = 0.1
#: Number of consecutive exact zeros that are not a strip's readings, if resolution over noise is below this value.
_ZEROS, _FINE = 6, 0.3
#: Decrease of twice the log-likelihood within which an earlier beginning of a break is plausible.
_PLAUSIBLE = 6.0
_ROUNDS = 4
#: Conditions for a break without an edge: residuals of a port in noise levels; readings before it that a second port
#: is fitted to; current predicted by that port, as a fraction of the largest; ratio of the sums of squares of a port
#: for all readings and of the separate one.
_STRANGE, _ENOUGH, _WOULD, _WORSE = 3.0, 30, 0.2, 3.0
#: A voltage at rest below this fraction of the largest counts as zero: the current is then the instrument's offset.
_NO_VOLTAGE = 0.02


@dataclass(frozen=True)
class Break:
    """A loss of contact: readings from ``first`` to before ``back`` are an open clamp's (None: to the end).

    Readings from ``earliest`` on may be the open clamp's too: they cannot be distinguished from the strip's.
    """

    first: int
    back: int | None
    earliest: int


@dataclass(frozen=True)
class Seen:
    """Readings with both voltage and current: times [s], voltage [V] and current [A], all (n,); ``onset`` is a row.

    ``levels`` [A] are the possible readings of an open clamp, ``noise`` [A] is the current's noise.
    """

    t: Array
    u: Array
    i: Array
    onset: int
    levels: tuple[float, ...]
    noise: float
    beginning: Beginning

    @cached_property
    def sound(self) -> Mask:
        """Mask (n,) of readings that may be fitted: readings of a flat top may be at the instrument's limit."""
        flat = np.zeros(len(self.i), dtype=bool)
        for v in (self.i, -self.i):
            if v.max() <= _LIMIT * self.largest:
                continue
            for a, b in runs(v >= float(v.max()) - max(_TOP * self.noise, 1e-9 * self.largest)):
                flat[a:b] |= b - a >= _FEWEST
        return ~flat if flat.mean() < 0.5 else ~np.zeros_like(flat)

    @property
    def largest(self) -> float:
        return float(np.abs(self.i).max())

    def near(self, level: float) -> Mask:
        """Return the readings (n,) that may be an open clamp's at ``level`` [A]."""
        return np.abs(self.i - level) <= max(_BAND * self.noise, 1e-9 * self.largest)

    def since(self, row: int) -> Seen:
        """Return the readings from a row on, as a record that begins within a run."""
        return Seen(self.t[row:], self.u[row:], self.i[row:], 0, self.levels, self.noise, "run")

    def port(self) -> PassivePort:
        """Return the passive ports under this voltage."""
        return PassivePort(self.t, self.u, self.beginning, self.onset > 0)


def seen(t: Array, u: Array, current: Array, onset: Onset) -> Seen:
    """Return readings at ``t`` [s] of ``u`` [V] and ``current`` [A], all (n,) without blanks, ready for the search."""
    step = resolution(current) if len(np.unique(current)) < len(current) / 2 else digit(current)
    changing = current[np.append(True, np.diff(current) != 0)]  # a limit or exact zeros have no noise
    noise = max(noise_level(current), noise_level(changing), step / 2)
    begins = int(np.searchsorted(t, onset.between[1])) if onset.first else 0
    rest = current[:begins]
    levels = [0.0]
    if len(rest) and abs(onset.rest) <= _NO_VOLTAGE * float(np.abs(u).max()):
        offset = float(np.median(rest))
        if abs(offset) > noise / 4:
            levels.append(offset)
    return Seen(t, u, current, begins, tuple(levels), noise, onset.beginning)


def breaks(s: Seen) -> list[Break]:
    """Return the losses of contact in order; the first may begin at the onset, if contact was made late."""
    found: list[Break] = []
    start = 0
    while True:
        rest = s if not start else s.since(start)
        first = _first_break(rest) if len(rest.t) > 2 * _ENOUGH or not start else None
        if first is None or (start and not first.first):
            return found
        back = None if first.back is None else first.back + start
        found.append(Break(first.first + start, back, first.earliest + start))
        if back is None:
            return found
        start = back


def _first_break(s: Seen) -> Break | None:
    """Return the earliest break found with any of the levels."""
    found: list[Break] = []
    port: PassivePort | None = None
    for level in s.levels:
        near = s.near(level)
        places = [*_edges(s, near, level), *_silent(s, near)]
        exact = list(_exact(s, level))
        idle = [run for run in runs(near) if run[1] > s.onset + _ZEROS and run[1] - run[0] >= _ZEROS]
        if not places and not exact and not idle:
            continue
        port = port or s.port()
        every = port.fit(s.i, s.sound)
        sure = [*_confirmed(s, port, every, places), *exact]
        before = len(s.t)
        for low, lost, back, is_exact in _spans(near, sorted(sure, key=lambda p: p.gap)):
            end = len(s.t) if back is None else back
            first, earliest = (lost, lost) if is_exact else _beginning(s, port, level, low, lost, end)
            if end - first >= _FEWEST:
                found.append(Break(first, back, earliest))
                before = low
                break
        rests = (_idle(s, port, every, level, a, b) for a, b in idle if b <= before)
        found += [b for b in [next((b for b in rests if b is not None), None)] if b is not None]
    return min(found, key=lambda b: b.first, default=None)


def _idle(s: Seen, port: PassivePort, every: Passive, level: float, low: int, end: int) -> Break | None:
    """Return the break from ``low`` to before ``end`` if the current is an open clamp's throughout, else None.

    A port fitted to the readings before must predict a much larger current, and no single port describe both.
    """
    inside = slice(max(low, s.onset), end)
    if float(np.sqrt(np.mean((every.current[inside] - s.i[inside]) ** 2))) <= _STRANGE * s.noise:
        return None
    rows, back = np.arange(len(s.t)), None if end >= len(s.t) else end
    first, earliest = _beginning(s, port, level, low, low, end)
    floor = max(s.noise, 1e-6 * s.largest) ** 2
    if first - s.onset <= _FEWEST:
        until = s.sound & (rows < min(end + max(2 * (end - s.onset), _ENOUGH), len(s.t)))
        at_rest = np.where(rows < end, float(s.u[0]) if s.onset else 0.0, s.u)
        late = PassivePort(s.t, at_rest).fit(s.i, until)
        moved = float(np.abs(s.u - at_rest)[: end - _FEWEST].max(initial=0.0)) > _ANSWER * float(np.abs(s.u).max())
        worse = port.fit(s.i, until).rms ** 2 > _WORSE * max(late.rms**2, floor)
        return Break(first, back, earliest) if moved and worse and back else None
    if first - s.onset < _ENOUGH:
        return None
    live = port.fit(s.i, s.sound & (rows < first))
    would = float(np.abs(live.current[first:end] - level).max(initial=0.0))
    if would <= max(_WOULD * s.largest, 2 * _BAND * s.noise, 2 * _BAND * live.rms):
        return None
    both = port.fit(s.i, s.sound & (rows < end))
    squares = np.where(rows < first, live.current - s.i, level - s.i)[both.used] ** 2
    return Break(first, back, earliest) if both.rms**2 > _WORSE * max(float(squares.mean()), floor) else None


def _confirmed(s: Seen, port: PassivePort, every: Passive, places: list[_Place]) -> list[_Place]:
    """Return the places where no passive port describes the change of the current.

    A port is fitted to ``every`` reading, and where it does not describe a place, another to the readings up to it,
    since the strip's state after a break is unknown.
    """
    rows = np.arange(len(s.t))
    doubtful = [p for p in places if _unexplained(s, every, p)]
    kept: list[_Place] = []
    for p in sorted(doubtful, key=lambda p: (p.window, p.gap)):
        told = any(p.open == q.open and abs(p.gap - q.gap) <= max(p.window, q.window) for q in kept)
        if not told and _unexplained(s, port.fit(s.i, s.sound & (rows < p.gap + max(p.window, _FEWEST))), p):
            kept.append(p)
    return kept


@dataclass(frozen=True)
class _Place:
    """A gap between readings ``gap`` - 1 and ``gap``, most significant in windows of ``window`` readings.

    ``open`` is -1 where an open clamp was read before it, 1 after it, 0 on both sides. No ``window`` is needed where
    the readings are exact.
    """

    gap: int
    window: int
    open: int


def _spans(near: Mask, places: list[_Place]) -> Iterator[tuple[int, int, int | None, bool]]:
    """Yield for each break its first possible reading, its first certain one, the reading of contact again, and a flag.

    The first two are equal where they cannot be distinguished; the third is None if contact does not return; the flag
    is True if the beginning of the break is exact.
    """
    n, done = len(near), 0
    near = near.copy()
    near[1:-1] |= near[:-2] & near[2:]  # a single reading is noise
    far = np.append(~near, True)
    for k, place in enumerate(places):
        if place.gap < done:
            continue
        inside = place.gap - 1 if place.open < 0 else place.gap
        before = np.flatnonzero(~near[:inside])
        low = max(int(before[-1]) + 1 if len(before) else 0, done)
        back = place.gap if place.open < 0 else place.gap + int(np.argmax(far[place.gap :]))
        if place.open >= 0:
            back = min([back, *(p.gap for p in places[k + 1 :] if p.open < 0)])
        done = back
        yield (
            low,
            place.gap if place.open > 0 else low,
            None if back >= n else back,
            place.open > 0 and not place.window,
        )


def _beginning(s: Seen, port: PassivePort, level: float, low: int, lost: int, end: int) -> tuple[int, int]:
    """Return the most likely first reading of a break that ends before ``end``, and the earliest plausible one.

    It lies at ``low`` or later; ``lost`` is the initial guess. Before it the current is predicted by a passive port
    fitted to the readings before; after it the clamp is open.
    """
    if lost - s.onset <= _FEWEST:
        return low, low
    opened = (s.i[low:end] - level) ** 2
    as_open = np.append(np.cumsum(opened[::-1])[::-1], 0.0)
    first, tried = lost, set[int]()
    cost = as_open
    while first not in tried and len(tried) < _ROUNDS and first - s.onset > _FEWEST:
        tried.add(first)
        live = port.fit(s.i, s.sound & (np.arange(len(s.t)) < first)).current[low:end]
        cost = np.append(0.0, np.cumsum((s.i[low:end] - live) ** 2)) + as_open
        first = low + int(np.argmin(cost))
    allowed = float(cost.min()) + _PLAUSIBLE * max(s.noise, 1e-6 * s.largest) ** 2
    return first, low + int(np.argmax(cost <= allowed))


def _estimates(values: Array, window: int) -> tuple[Array, Array]:
    """Return estimates from the readings before and after each gap k (between k - 1 and k), (n + 1,), NaN at ends."""
    n = len(values)
    before, after = np.full(n + 1, np.nan), np.full(n + 1, np.nan)
    if n >= window:
        x = np.arange(window) - (window - 1) / 2
        weights = np.full(window, 1 / window)
        if window >= _LINE:
            weights = weights + x * (window / 2) / float(x @ x)
        before[window:] = np.convolve(values, weights[::-1], mode="valid")
        after[: n - window + 1] = np.convolve(values, weights, mode="valid")
    return before, after


def _spread(window: int) -> float:
    """Return the standard error of a difference of both estimates in units of the noise."""
    return float(np.sqrt((8 if window >= _LINE else 2) / window))


def _edges(s: Seen, near: Mask, level: float) -> Iterator[_Place]:
    """Yield the places where the current leaves an open clamp's level or falls to it.

    The readings on one side are an open clamp's; the readings on the other side are not, and do not tend to it.
    """
    values, n = s.i - level, len(s.t)
    counts, sums = np.append(0, np.cumsum(near)), np.append(0.0, np.cumsum(values))
    for side, window in product((-1, 1), (w for w in _WINDOWS if w <= n // 3)):
        many = max(window, _FEWEST)
        gaps = np.arange(many, n - many + 1)
        limit = max(_SURE * s.noise * _spread(window), _LEAST * s.largest)
        opened = (gaps - many, gaps) if side < 0 else (gaps, gaps + many)
        live = (gaps, gaps + window) if side < 0 else (gaps - window, gaps)
        extrapolated = _estimates(values, window)[1 if side < 0 else 0][gaps]
        apart = np.abs(extrapolated)
        zero = np.abs(sums[opened[1]] - sums[opened[0]]) / many
        good = counts[opened[1]] - counts[opened[0]] == many
        good &= zero <= np.maximum(_LEVEL * s.noise / np.sqrt(many), _OF_EDGE * apart)
        good &= (apart > limit) & (extrapolated * (sums[live[1]] - sums[live[0]]) > 0) & (gaps > s.onset)
        size = np.zeros(n + 1)
        size[gaps] = np.where(good, apart, 0.0)
        for a, b in runs(size > 0):
            yield _Place(a + int(np.argmax(size[a:b])), window, side)


def _silent(s: Seen, near: Mask) -> Iterator[_Place]:
    """Yield jumps of the voltage before and after which the current reads as an open clamp's does."""
    for k in (voltage_jumps(s.u) + 1).tolist():
        around = near[max(k - _FEWEST, 0) : k + _FEWEST]
        if k >= s.onset and k + _FEWEST <= len(near) and around.all():
            yield _Place(k, 1, 0)


def _exact(s: Seen, level: float) -> Iterator[_Place]:
    """Yield the ends of every run of readings that equal ``level`` exactly, if noise makes that impossible."""
    same = s.i == level
    same[: s.onset] = False
    if same.sum() < _ZEROS or (~same).sum() < 2 * _ZEROS:
        return
    others = s.i[~same]
    repeats = max((b - a for a, b in runs(np.diff(others) == 0)), default=0)
    if repeats or resolution(others) > _FINE * noise_level(others):
        return
    for a, b in runs(same):
        if b - a >= _ZEROS and float(np.abs(s.u[a:b]).max()) > _NO_VOLTAGE * float(np.abs(s.u).max()):
            yield _Place(a, 0, 1)
            if b < len(same):
                yield _Place(b, 0, -1)


def _unexplained(s: Seen, fitted: Passive, place: _Place) -> bool:
    """Return True if the change of the current at a place differs from all changes of the ``fitted`` port near it."""
    before, after = _estimates(s.i, place.window)
    low, high = _estimates(fitted.current, place.window)
    jumps, answers = after - before, high - low
    misfits = np.abs(jumps - answers)[:-1][fitted.used]
    typical = float(np.nanmedian(misfits)) / 0.6745  # standard deviation of coloured noise and model error
    noise = max(s.noise * _spread(place.window), typical)
    if not place.open:
        return bool(abs(float(answers[place.gap])) > max(_ANSWER * s.largest, 2 * _SURE * noise))
    around = answers[max(place.gap - _SKEW, 0) : place.gap + _SKEW + 1]
    jump = float(jumps[place.gap])
    misfit = float(np.abs(jump - np.append(around[np.isfinite(around)], 0.0)).min())
    return bool(misfit > max(_EXPLAINED * abs(jump), _SURE / 2 * noise))


def runs(mask: Mask) -> Iterator[tuple[int, int]]:
    """Yield the first index, and one past the last, of every run of True."""
    edges = np.diff(np.r_[0, mask.astype(int), 0])
    yield from zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)
