"""Estimates a frequency response from readings: by periods of sines, or by local polynomials of a sweep or of noise.

Both are a regression of the output on the input at a frequency. Sines are fitted to blocks of whole periods, by least
squares, so that samples need not be evenly spaced; a spline over all blocks takes up drift. The scatter of the blocks
is the noise. Of a sweep the discrete Fourier transform of the whole record is taken: over a few lines around a
frequency the response is a parabola, and so is the transient that the record's ends cut off (Pintelon and Schoukens,
System Identification, 2012, section 7.2); what these leave is the noise.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..errors import InputError
from ..fit.quantiles import fisher, student
from .wave_faults import gaps

#: Largest number of blocks of periods.
_MOST_BLOCKS = 20
#: Quantile of the F distribution above which an early block shows the transient.
_TRANSIENT = 0.999
#: Degree of polynomials; lines on each side of a frequency: at least, and as a fraction of the frequency.
_DEGREE, _LINES, _WIDTH = 2, 3, 0.12
#: Fewest cycles of a frequency in a record that begins at rest, and in another one.
CYCLES_FROM_REST, CYCLES = 4, 6
#: Part of the record at its end over which it is faded out, where no transient is fitted.
_FADED = 0.1
#: Level of Student's distribution from which on a drift is shown.
_DRIFTS = 0.9999
#: Drift over a record, relative to the span, that curved responses may feign, and from which on it is taken off.
_CURVED, _WORTH = 0.03, 0.08
#: Longest part of a period without readings in a block of sines.
MISSING = 0.25
#: Condition of the regressors above which response and transient are not told apart.
_CONDITION = 30.0


@dataclass(frozen=True)
class Lines:
    """Responses of m outputs at frequencies [Hz] (f,) of a record.

    ``response`` (m, f) has a complex error of the ``variance`` (m, f), which is known with ``freedom`` (f,) complex
    degrees of freedom; ``coherence`` (m, f) is between 0 and 1; ``amplitude`` (f,) is that of the input.
    """

    frequency: Array
    response: ComplexArray
    variance: Array
    coherence: Array
    freedom: Array
    amplitude: Array

    def at(self, chosen: Any) -> Lines:
        """Return the lines at ``chosen`` frequencies, an index or a mask."""
        return Lines(*(getattr(self, f.name)[..., chosen] for f in fields(self)))


def joined(parts: list[Lines]) -> Lines:
    """Return the lines of all ``parts``, by frequency."""
    whole = Lines(*(np.concatenate([getattr(p, f.name) for p in parts], axis=-1) for f in fields(Lines)))
    return whole.at(np.argsort(whole.frequency, kind="stable"))


def _stacked(rows: list[tuple[Any, ...]], count: int) -> Lines:
    """Return the lines of rows: frequency, response, variance, coherence (m,), freedom, amplitude."""
    if not rows:
        none = np.zeros((count, 0))
        return Lines(np.zeros(0), none.astype(complex), none, none, np.zeros(0), np.zeros(0))
    return Lines(*(np.array(column).T for column in zip(*rows, strict=True)))


def _regression(x: ComplexArray, y: ComplexArray) -> tuple[ComplexArray, Array, Array, int] | None:
    """Return the first coefficients (m,) of ``y`` (k, m) on ``x`` (k, q), variances, coherences, degrees of freedom.

    None where they are not determined.
    """
    size, freedom = np.linalg.norm(x, axis=0), len(x) - x.shape[1]
    if freedom < 1 or not (size > 0).all():
        return None
    basis, upper = np.linalg.qr(x / size)
    if np.linalg.cond(upper) > _CONDITION:
        return None
    found = basis.conj().T @ y
    squares = (np.abs(y - basis @ found) ** 2).sum(axis=0)
    total = (np.abs(y) ** 2).sum(axis=0)
    back = np.linalg.inv(upper)[0] / size[0]
    coherence = 1 - np.divide(squares, total, out=np.ones_like(squares), where=total > 0)
    return back @ found, squares / freedom * float((np.abs(back) ** 2).sum()), np.clip(coherence, 0.0, 1.0), freedom


@dataclass(frozen=True)
class Drift:
    """A drift of the outputs (m,), a line that is zero at ``since`` [s]: ``rate`` and its standard ``error`` [unit/s].

    The rate of an output without drift is zero, and so is its error.
    """

    rate: Array
    error: Array
    since: float

    def at(self, t: Array) -> Array:
        """Return the drift (m, n) at times ``t`` [s] (n,)."""
        return np.asarray(self.rate[:, None] * (t - self.since))


@dataclass(frozen=True)
class _Transforms:
    """Fourier transforms of the voltage ``u``, outputs ``y``, one unit (``shift``) and one unit a second (``ramp``).

    A record that begins at rest (``at_rest`` readings) has its end faded out, and no transient.
    """

    u: ComplexArray
    y: ComplexArray
    shift: ComplexArray
    ramp: ComplexArray
    at_rest: int

    @classmethod
    def of(cls, step: float, voltage: Array, outputs: Array, at_rest: int, since: float) -> _Transforms:
        count = len(voltage)
        fade = np.ones(count)
        if at_rest and (last := int(_FADED * count)):
            fade[-last:] = (1 + np.cos(np.pi * np.arange(1, last + 1) / last)) / 2
        line = np.arange(count) * step - since
        u, y, shift, ramp = (
            np.fft.rfft(x * fade, axis=-1) * 2 / count for x in (voltage, outputs, np.ones(count), line)
        )
        return cls(u, y, shift, ramp, at_rest)

    def window(self, k: int) -> tuple[slice, ComplexArray]:
        """Return the lines around line ``k``, and the regressors there (lines, q), the response first."""
        least = _LINES if self.at_rest else _LINES + _DEGREE
        half = max(least, int(_WIDTH * k))
        first = max(k - half, 1)
        at = slice(first, first + 2 * half + 1)
        place = (np.arange(len(self.u))[at] - k) / half
        powers = place[:, None] ** np.arange(_DEGREE + 1)
        terms = powers[:, :0] if self.at_rest else powers
        return at, np.column_stack([self.u[at, None] * powers, terms])


def drift_of(step: float, voltage: Array, outputs: Array, frequency: Array, at_rest: int, since: float) -> Drift:
    """Return the drift of ``outputs`` (m, n) that all frequencies together show; arguments as of `polynomials`.

    It is what a line explains of what the responses leave, above all at the lines below the lowest frequency.
    """
    f = _Transforms.of(step, voltage, outputs, at_rest, since)
    lines = np.maximum(np.rint(frequency * len(voltage) * step), 1).astype(int).tolist()
    products, powers, squares, freedom, end = np.zeros(len(outputs)), 0.0, np.zeros(len(outputs)), 0, 0
    parts = []
    for k in [_LINES + 1, *dict.fromkeys(lines)]:
        at, x = f.window(k)
        size = np.linalg.norm(x, axis=0)
        if at.start < end or len(x) <= x.shape[1] or not (size > 0).all():
            continue
        end = at.stop
        basis = np.linalg.qr(x / size)[0]
        rows = np.vstack([f.y[:, at], f.ramp[at]]).T
        rows = rows - basis @ (basis.conj().T @ rows)
        parts.append(rows)
        products += (rows[:, -1:].conj() * rows[:, :-1]).real.sum(axis=0)
        powers += float((np.abs(rows[:, -1]) ** 2).sum())
        freedom += len(x) - x.shape[1]
    none = Drift(np.zeros(len(outputs)), np.zeros(len(outputs)), since)
    if freedom < 2 or not powers:
        return none
    rate = products / powers
    for rows in parts:
        squares += (np.abs(rows[:, :-1] - rows[:, -1:] * rate) ** 2).sum(axis=0)
    error = np.sqrt(squares / (2 * freedom - 1) / powers)
    # responses that are no parabolas leave a line, too
    t = np.arange(len(voltage)) * step
    a_part = np.ptp(outputs - rate[:, None] * t, axis=1) / t[-1]
    shown = np.abs(rate) > np.maximum(student(_DRIFTS, 2 * freedom - 1) * error, _WORTH * a_part)
    error = np.hypot(error, _CURVED * a_part)
    return Drift(np.where(shown, rate, 0.0), np.where(shown, error, 0.0), since)


def polynomials(
    step: float, voltage: Array, outputs: Array, frequency: Array, at_rest: int = 0, drift: Drift | None = None
) -> Lines:
    """Return responses near ``frequency`` [Hz]; ``voltage`` (n,) and ``outputs`` (m, n) are sampled every ``step`` [s].

    A record that begins at rest, where both are zero by the mean of ``at_rest`` readings, has its end faded out; of
    another one (0) transients of both ends are fitted. Frequencies at which these cannot be told from the response are
    left out. Of the ``drift``, which was removed, the variance has what is not known of its rate.
    """
    count = len(voltage)
    duration = count * step
    drift = drift or Drift(np.zeros(len(outputs)), np.zeros(len(outputs)), 0.0)
    transforms = _Transforms.of(step, voltage, outputs, at_rest, drift.since)
    rows = []
    for k in dict.fromkeys(np.maximum(np.rint(frequency * duration), 1).astype(int).tolist()):
        at, x = transforms.window(k)
        known = (transforms.y[:, at].T, transforms.shift[at], transforms.ramp[at])
        found = _regression(x, np.column_stack(known))
        if found is not None:
            g, variance, coherence, freedom = found
            g, moved, sloped, variance = g[:-2], g[-2], g[-1], variance[:-2]
            if at_rest:  # the rest is as uncertain as the mean of its readings, which have the same noise
                inverse = np.linalg.pinv(x)[0]
                variance = variance * (1 + abs(moved) ** 2 / float(np.linalg.norm(inverse) ** 2) * count / 4 / at_rest)
            variance = variance + abs(sloped) ** 2 * drift.error**2
            strength = float(np.abs(transforms.u[at]).max())
            rows.append((k / duration, g, variance, coherence[:-2], float(freedom), strength))
    return _stacked(rows, len(outputs))


def periods(
    t: Array, voltage: Array, outputs: Array, frequency: Array, period: float, skip: float | None = None
) -> tuple[Lines, float]:
    """Return responses at the frequencies of sines, and the time [s] from which on periods were taken.

    ``t`` (n,) are times [s] from the begin of the sines on, which have one common ``period`` [s]; the first ``skip``
    [s] is left out, by default the periods that differ from the later ones by more than their scatter. Raises
    InputError for fewer than two periods.
    """
    begin, end = float(t[0]) + (skip or 0.0), float(t[-1] + np.median(np.diff(t)))
    whole = int(np.floor((end - begin) / period * (1 + 1e-3)))
    if whole < 2:
        raise InputError(
            f"{max((end - begin) / period, 0.0):.2g} periods of {period:.4g} s; two are needed to tell the noise"
        )
    of_block = -(-whole // _MOST_BLOCKS)
    blocks = whole // of_block
    edges: Array = end - of_block * period * np.arange(blocks, -1, -1, dtype=np.float64)
    whole_blocks = _without_gaps(t, edges, MISSING * period)
    if whole_blocks.sum() < 2:
        raise InputError(f"readings without gaps in fewer than two of {blocks} blocks of {of_block * period:.4g} s")
    amplitudes = _amplitudes(t, np.vstack([voltage, outputs]), frequency, edges, whole_blocks)
    u, y = amplitudes[0], amplitudes[1:]
    first = 0 if skip is not None else _after_transient(u, y)
    rows = []
    for k, f in enumerate(frequency.tolist()):
        found = _regression(u[first:, k, None], y[:, first:, k].T)
        if found is not None:
            g, variance, coherence, freedom = found
            rows.append((f, g, variance, coherence, float(freedom), float(np.abs(u[first:, k]).mean())))
    return _stacked(rows, len(outputs)), float(edges[:-1][whole_blocks][first])


def _without_gaps(t: Array, edges: Array, longest: float) -> Mask:
    """Return the blocks between ``edges`` (b + 1,) without missing readings for over ``longest`` [s]."""
    begins, ends = np.array([gap for gap in gaps(t) if gap[1] - gap[0] > longest]).reshape(-1, 2).T
    touched = (edges[:-1, None] < ends) & (edges[1:, None] > begins)
    return np.asarray(~touched.any(axis=1))


def _amplitudes(t: Array, signals: Array, frequency: Array, edges: Array, chosen: Mask) -> ComplexArray:
    """Return amplitudes (s, c, f) of ``signals`` (s, n) in the ``chosen`` blocks between ``edges`` (b + 1,).

    A drift is taken up by a spline.
    """
    from scipy.interpolate import BSpline

    inside = (t >= edges[0]) & (t <= edges[-1])
    t, signals = t[inside], signals[:, inside]
    block = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(edges) - 2)
    t, signals, block = t[chosen[block]], signals[:, chosen[block]], block[chosen[block]]
    knots = np.r_[[edges[0]] * 3, edges, [edges[-1]] * 3]
    drift = BSpline.design_matrix(t, knots, 3).toarray()
    turns = np.exp(2j * np.pi * frequency * t[:, None])
    sines = np.column_stack([turns.real, turns.imag])
    sets = []
    left, right = np.empty_like(drift), np.empty((len(t), len(signals)))
    for b in np.flatnonzero(chosen).tolist():
        here = block == b
        basis, upper = np.linalg.qr(sines[here])
        left[here] = drift[here] - basis @ (basis.T @ drift[here])
        right[here] = signals[:, here].T - basis @ (basis.T @ signals[:, here].T)
        sets.append((here, basis, upper))
    slow = drift @ np.linalg.lstsq(left, right, rcond=1e-9)[0]
    pairs = np.array(
        [np.linalg.solve(upper, basis.T @ (signals[:, here].T - slow[here])) for here, basis, upper in sets]
    )
    count = len(frequency)
    # a cos + b sin is the real part of (a - i b) exp(i omega t)
    return np.asarray(np.moveaxis(pairs[:, :count] - 1j * pairs[:, count:], 2, 0))


def _after_transient(u: ComplexArray, y: ComplexArray) -> int:
    """Return the first block from which on all agree with the later half, within its scatter."""
    blocks, count = u.shape
    half = blocks // 2
    if blocks - half < 2:
        return 0
    first = 0
    for rows in y:
        g = (rows[half:] * u[half:].conj()).sum(axis=0) / (np.abs(u[half:]) ** 2).sum(axis=0)
        squares = np.abs(rows - g * u) ** 2
        freedom = blocks - half - 1
        noise = squares[half:].sum(axis=0) / freedom * (1 + 1 / (blocks - half))
        ratio = (squares[:half] / np.maximum(noise, np.finfo(float).tiny)).mean(axis=1)
        beyond = np.flatnonzero(ratio > fisher(_TRANSIENT, 2 * count, 2 * count * freedom))
        first = max(first, int(beyond[-1]) + 1 if len(beyond) else 0)
    return first
