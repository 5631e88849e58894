"""Tests whether residuals of a current are only noise, or follow the drive in a way that the model lacks.

Relaxations of the drive, of its square and of its cube are fitted to the residuals: time constants that are missing
show in the first, nonlinear laws, to the order that matters first, in all. If they explain no more than chance does
(F-test with the number of independent samples that they leave), what is left is noise, however it is correlated.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..fit.criteria import autocorrelation, parts_by_time, samples_for_bic
from ..fit.quantiles import fisher
from ..fit.selection import EVIDENCE
from ..measurements.passive import relaxed

#: Rates per decade; the slowest relative to the record's length, and the fastest to its shortest interval.
_PER_DECADE, _SLOWEST, _FASTEST = 3, 0.5, 1.0
#: Powers of the drive.
_POWERS = (1, 2, 3)
#: Level of the test.
_LEVEL = 0.999
#: Rounds in which the correlation of noise is corrected.
_ROUNDS = 10
#: Fewest readings at rest whose correlation is known.
_AT_REST = 8
#: Part of a wave that must be left beside all others.
_LEFT = 1e-4
#: Most readings that are tested, and most of them and points of the drive together.
_MOST_READINGS, _MOST_POINTS = 4000, 20_000
#: Largest correlation of neighbours that is corrected.
_MOST_CORRELATED = 0.999


@dataclass(frozen=True)
class Lack:
    """What a fit lacks: ``relaxations``, for which there is strong evidence, or a ``law`` that is not linear.

    ``branches`` are relaxations of positive R and C. Since sums of these are a convex set, linear strips with more
    relaxations than a fit of free branches are hardly closer where it lacks none. ``anything`` is that the residuals
    follow the drive at all; ``share`` is the part of their squares that does. ``coloured`` is that the test could tell,
    and the rest is no more autocorrelated than the readings at rest are.
    """

    anything: bool = False
    relaxations: bool = False
    law: bool = False
    share: float = 0.0
    coloured: bool = False
    branches: bool = False

    @classmethod
    def of_any(cls, parts: Iterable[Lack | None]) -> Lack | None:
        """Return what the fit of several files lacks; None if that of one is not known."""
        every = list(parts)
        known = [p for p in every if p is not None]
        if len(known) < len(every):
            return None
        return cls(
            anything=any(p.anything for p in known),
            relaxations=any(p.relaxations for p in known),
            law=any(p.law for p in known),
            share=max((p.share for p in known), default=0.0),
            coloured=bool(known) and all(p.coloured for p in known),
            branches=any(p.branches for p in known),
        )


def lack_of_fit(
    since: Array, drive: PiecewiseLinear, residuals: Array, slopes: Array, *, by_current: bool = False
) -> Lack | None:
    """Return what a fit lacks by its ``residuals`` (n,) at times ``since`` [s] (n,) the begin of its ``drive``.

    ``slopes`` (n, p) are those of the fit's parameters and linear terms, which have explained what they can. The drive
    is a voltage, or a current if ``by_current``. Of a long record some readings are tested. None where the drive has
    too many points, or the record too few readings.
    """
    some = slice(None, None, -(-len(since) // _MOST_READINGS))
    since, residuals, slopes = since[some], residuals[some], slopes[some]
    waves = _waves(since, drive.from_rest())
    if waves is None or len(residuals) <= slopes.shape[1] + waves.shape[1]:
        return None
    size = np.linalg.norm(slopes, axis=0)
    tangent, _ = np.linalg.qr(slopes[:, size > 0] / size[size > 0])
    first = waves.shape[1] // len(_POWERS)
    linear = _beside(waves[:, :first], tangent)
    others = _beside(waves[:, first:], np.hstack([tangent, linear]))
    along, across = linear.T @ residuals, others.T @ residuals
    left = residuals - linear @ along
    rest = left - others @ across
    taken = len(along) + len(across)
    freedom = _independent(since, rest, taken) - tangent.shape[1] - taken

    def significant(explained: Array) -> bool:
        """Return True if waves explain more than chance, by the samples that all leave."""
        count = len(explained)
        if not count or freedom < 1:
            return False
        ratio = float(explained @ explained) / count / max(float(rest @ rest), np.finfo(float).tiny) * freedom
        return bool(ratio > float(fisher(_LEVEL, count, freedom)))

    least = np.finfo(float).tiny
    kept = _passive(waves[:, :first], -1.0 if by_current else 1.0, tangent, residuals)
    before, after, last, bare = (max(float(r @ r), least) for r in (residuals, left, rest, kept))
    fewer = _independent(since, left, len(along))
    needed = (EVIDENCE + 2 * np.log(fewer)) / fewer  # of one more R-C branch
    relaxations = bool(np.log(before / after) > needed)
    law = significant(across)
    return Lack(
        anything=relaxations or law or significant(np.append(along, across)),
        relaxations=relaxations,
        law=law,
        share=1 - last / before,
        coloured=freedom >= taken and _as_at_rest(since, rest),
        branches=relaxations and bool(np.log(before / bare) > needed),
    )


def _as_at_rest(since: Array, left: Array) -> bool:
    """Return True if noise that is ``left`` after the onset is no more autocorrelated than before, within 3 errors.

    Readings at rest that show no autocorrelation are no sign that it is noise.
    """
    before, after = left[since < 0], left[since >= 0]
    if len(before) < _AT_REST:
        return False
    correlation, at_rest = autocorrelation(after), autocorrelation(before - before.mean())
    if at_rest <= 2 / np.sqrt(len(before)) and correlation > 2 / np.sqrt(len(after)):
        return False
    at_rest += (1 + 3 * at_rest) / len(before)  # its bias
    return correlation <= at_rest + 3 * float(np.sqrt(max(1 - correlation**2, 0.0) / len(before)))


def _independent(since: Array, left: Array, taken: int) -> float:
    """Return the number of independent samples of noise, of which smooth waves, so many, were ``taken`` out.

    What is left of autocorrelated noise is less autocorrelated: smooth waves take out more than their number.
    """
    count, correlation = len(left), autocorrelation(left)
    samples = samples_for_bic(parts_by_time(since, left))
    if correlation <= 3 / np.sqrt(count):
        return samples
    time = 1.0
    for _ in range(_ROUNDS):
        share = min(taken * time / count, 1.0)
        whole = min((correlation + share) / (1 + share), _MOST_CORRELATED)
        time = (1 + whole) / (1 - whole)
    return min(samples, count / time)


def _beside(waves: Array, tangent: Array) -> Array:
    """Return an orthonormal basis (n, k) of what ``waves`` (n, m) hold beside the ``tangent`` (n, p)."""
    size = np.linalg.norm(waves, axis=0)
    waves = waves[:, size > 0] / size[size > 0]
    left, strengths, _ = np.linalg.svd(waves - tangent @ (tangent.T @ waves), full_matrices=False)
    return np.asarray(left[:, strengths > _LEFT])


def _passive(waves: Array, sign: float, tangent: Array, residuals: Array) -> Array:
    """Return residuals (n,) beside the ``tangent`` (n, p) that high-passes ``waves`` (n, m) of one ``sign`` leave.

    The last wave is the drive itself, of either sign.
    """
    from scipy.optimize import nnls

    columns = np.hstack([sign * waves, -sign * waves[:, -1:], residuals[:, None]])
    whole = np.linalg.norm(columns, axis=0)
    columns -= tangent @ (tangent.T @ columns)
    size = np.linalg.norm(columns, axis=0)
    beside = size > _LEFT * whole  # others are rounding
    beside[-1] = True
    columns, size = columns[:, beside], np.where(size > 0, size, 1.0)[beside]
    triangle: Array = np.asarray(np.linalg.qr(columns / size, mode="r"))
    amounts = nnls(triangle[:, :-1], triangle[:, -1], maxiter=100 * len(size))[0]
    return np.asarray(columns[:, -1] - (columns[:, :-1] * (size[-1] / size[:-1])) @ amounts)


def _waves(since: Array, drive: PiecewiseLinear) -> Array | None:
    """Return a drive's powers through relaxations, and without, at times (n, waves); None with too many points."""
    after = since >= 0
    t = since[after]
    inside = (drive.times >= 0) & (drive.times <= t[-1]) if len(t) else np.zeros(0, dtype=bool)
    if len(t) < 3 or len(t) + int(inside.sum()) > _MOST_POINTS:
        return None
    times = np.concatenate([[0.0], drive.times[inside], t])
    order = np.argsort(times, kind="stable")  # of several at one time, the last is the reading
    at = np.empty(len(times), dtype=np.intp)
    at[order] = np.arange(len(times))
    u = np.concatenate([[0.0], drive.values[inside], drive.value(t)])[order] / (drive.largest() or 1.0)
    step = np.diff(t)
    low, high = _SLOWEST / float(t[-1]), _FASTEST / float(np.median(step[step > 0]))
    rates = np.geomspace(low, high, max(int(_PER_DECADE * np.log10(high / low)) + 1, 2))
    made = [np.vstack([relaxed(times[order], u**n, rates, np.zeros(len(rates))), u**n]) for n in _POWERS]
    found = np.zeros((len(since), len(_POWERS) * (len(rates) + 1)))
    found[after] = np.vstack(made)[:, at[-len(t) :]].T
    return found
