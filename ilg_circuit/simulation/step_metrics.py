"""Computes the metrics of a step response: final value, peak, overshoot, settling time, back-relaxation, rms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError

#: Half-width of the band about the final value that counts as settled, as a fraction of the final value.
SETTLING_BAND = 0.02
#: Latest settling, as a fraction of the record: a curve that enters the band later has not settled.
_LATEST = 0.8


@dataclass(frozen=True)
class StepMetrics:
    """Metrics of one or many curves, each () or (m,), in the curves' unit and s; NaN where one does not exist.

    ``final``: at the end; ``peak``: the largest excursion, with its sign; ``peak_time``: when, NaN for a curve that
    is largest at its end; ``overshoot``: how far the peak exceeds the final value, as a part of that, 0 without a peak
    before the end, NaN for a final value of zero or of the other sign; ``settling_time``: from when on the curve stays
    within 2 % of its final value, NaN where it comes to that only in the last fifth, because then its final value is
    not known; ``back_relaxation``: the fall from the peak to the final value, a size; ``rms``: over time.
    """

    final: Array
    peak: Array
    peak_time: Array
    overshoot: Array
    settling_time: Array
    back_relaxation: Array
    rms: Array


def step_metrics(
    time: ArrayLike, values: ArrayLike, *, tail: float = 0.0, resolution: float = 0.0, band: float = SETTLING_BAND
) -> StepMetrics:
    """Return the metrics of ``values`` (n,) or (m, n) at ``time`` [s] (n,), ascending.

    Time counts from the step, and values from rest. The final value is the mean over the last part ``tail`` of the time
    (0: the last sample). A peak must exceed it by more than ``resolution`` and lie before the tail. Peaks and crossings
    between samples are interpolated: a parabola through the three highest samples, a straight line. Raises InputError
    for shapes that do not fit, times that do not ascend, fewer than three samples.
    """
    t, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if t.ndim != 1 or y.ndim not in (1, 2) or y.shape[-1:] != t.shape:
        raise InputError(f"times of shape {t.shape} and values of shape {y.shape} are no curves")
    if len(t) < 3 or not (np.diff(t) > 0).all():
        raise InputError("the metrics of a step need three samples or more, at times that ascend")
    rows = np.atleast_2d(y)
    ends = t >= t[-1] - tail * (t[-1] - t[0])
    final = rows[:, ends].mean(axis=1)
    at, peak = _peaks(t, rows)
    side = np.sign(peak)
    fall = side * (peak - final)
    relaxed = (fall > resolution) & (at < t[ends][0])
    fall = np.where(relaxed, fall, np.where(np.isnan(fall), np.nan, 0.0))
    ahead = side * final
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        overshoot = np.where(ahead > 0, fall / ahead, np.nan)
        squares = (rows[:, 1:] ** 2 + rows[:, :-1] ** 2) / 2
        rms = np.sqrt(squares @ np.diff(t) / (t[-1] - t[0]))
    found = StepMetrics(
        final, peak, np.where(relaxed, at, np.nan), overshoot, _settling(t, rows, final, band), fall, rms
    )
    if y.ndim == 2:
        return found
    return StepMetrics(**{name: value[0] for name, value in vars(found).items()})


def _peaks(t: Array, rows: Array) -> tuple[Array, Array]:
    """Return the time and value of the largest excursion of each row, between samples by a parabola."""
    size = np.abs(np.where(np.isnan(rows), -np.inf, rows))
    k = np.argmax(np.where(np.isinf(size), -1.0, size), axis=1)
    one = np.arange(len(rows))
    at, peak = t[k].copy(), rows[one, k].copy()
    inside = (k > 0) & (k < len(t) - 1)
    m = np.clip(k, 1, len(t) - 2)
    before, after = t[m - 1] - t[m], t[m + 1] - t[m]
    fall_before, fall_after = rows[one, m - 1] - rows[one, m], rows[one, m + 1] - rows[one, m]
    # y = y_k + b x + a x^2 through the neighbours, x = t - t_k
    span = before * after * (after - before)
    a = (fall_after * before - fall_before * after) / span
    b = (fall_before * after**2 - fall_after * before**2) / span
    curved = inside & (a != 0) & np.isfinite(a)
    x = np.where(curved, -b / (2 * np.where(curved, a, 1.0)), 0.0)
    return at + x, peak + np.where(curved, (b + a * x) * x, 0.0)


def _settling(t: Array, rows: Array, final: Array, band: float) -> Array:
    """Return the time from which each row stays within ``band`` of its final value."""
    limit = band * np.abs(final)
    away = np.abs(rows - final[:, None])
    outside = ~(away <= limit[:, None])
    last = len(t) - 1 - np.argmax(outside[:, ::-1], axis=1)
    k = np.minimum(last, len(t) - 2)
    one = np.arange(len(rows))
    drop = away[one, k] - away[one, k + 1]
    part = np.where(drop > 0, (away[one, k] - limit) / np.where(drop > 0, drop, 1.0), 1.0)
    when = np.where(outside.any(axis=1), t[k] + np.clip(part, 0.0, 1.0) * (t[k + 1] - t[k]), t[0])
    known = (last < len(t) - 1) & (when <= t[0] + _LATEST * (t[-1] - t[0])) & (limit > 0)
    return np.where(known | (~outside.any(axis=1) & (limit > 0)), when, np.nan)
