"""Computes peak, overshoot, settling and back-relaxation of a measured displacement and of its fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..measurements.smoothing import Smoothed, smoothed, summit
from ..simulation.step_metrics import SETTLING_BAND, StepMetrics, step_metrics
from .displacement import DisplacementFit

#: The final value is the mean over this last part of the stretch.
TAIL = 0.05
#: The voltage is constant while it stays within this part of its first value.
_CONSTANT = 0.05
_FEWEST_SAMPLES = 20
#: Least height of a peak above the final value, in standard errors of the smoothed curve.
_SEEN = 4.0


@dataclass(frozen=True)
class DisplacementMetrics:
    """Figures under a constant voltage, positive to the anode: ``measured`` and ``model`` over the first ``until`` [s].

    ``measured`` are figures of the readings minus the position ``rest`` [m], smoothed by local parabolas over
    ``windows`` (least, most) samples; ``error`` [m] is the smoothed curve's standard error at its peak. ``model`` are
    figures of the law of bending alone at the same times. If the fit ends before the constant voltage does, ``record``
    are the measured figures up to ``record_until`` [s]. ``resting`` is the number of readings that determine the rest
    position; if it is 0, the rest position is the first reading.
    """

    until: float
    measured: StepMetrics
    model: StepMetrics
    record: StepMetrics | None
    record_until: float
    rest: float
    resting: int
    windows: tuple[int, int]
    error: float
    time: Array
    smooth: Array

    def to_dict(self) -> dict[str, Any]:
        return {
            "until_s": self.until,
            "tail": TAIL,
            "settling_band": SETTLING_BAND,
            "smoothing_samples": list(self.windows),
            "peak_stderr": self.error,
            "rest_position_m": self.rest,
            "rest_samples": self.resting,
            "measured": _json(self.measured),
            "model": _json(self.model),
            "record_until_s": self.record_until,
            "measured_over_record": _json(self.record or self.measured),
        }

    @property
    def peak(self) -> tuple[float, float] | None:
        """Time [s] and height [m] of the measured peak, if one is seen."""
        at, height = float(self.measured.peak_time), float(self.measured.peak)
        return (at, height) if np.isfinite(at) else None


def displacement_metrics(fit: DisplacementFit) -> DisplacementMetrics | None:
    """Return the metrics over the first stretch of constant voltage, as far as the fit goes, and over all of it.

    A step's stretch is the record, a square wave's its first part. None for a drive that is not constant at first, or
    a stretch of fewer than 20 samples: they are not defined there.
    """
    constant = constant_until(fit.data.drive)
    channel, sign = fit.data.channel, fit.data.sign
    held = (channel.time >= 0) & (channel.time <= constant)
    inside = held & (channel.time <= fit.data.window)
    if inside.sum() < _FEWEST_SAMPLES:
        return None
    t = channel.time[inside]
    measured, curve, error = _measured(t, sign * (channel.values[inside] - fit.rest))
    model = sign * (fit.fitted[inside] - fit.level - (fit.drift or 0.0) * t)
    longer = channel.time[held]
    record = None
    if len(longer) > len(t):
        record, _, _ = _measured(longer, sign * (channel.values[held] - fit.rest))
    return DisplacementMetrics(
        until=float(t[-1]),
        measured=measured,
        model=step_metrics(t, model, tail=TAIL, resolution=1e-6 * float(np.ptp(model))),
        record=record,
        record_until=float(longer[-1]),
        rest=fit.rest,
        resting=fit.at_rest.count,
        windows=(int(curve.widths.min()), int(curve.widths.max())),
        error=error,
        time=t,
        smooth=curve.values,
    )


def _measured(t: Array, data: Array) -> tuple[StepMetrics, Smoothed, float]:
    """Return the metrics of the smoothed curve of ``data`` (n,), the curve, and its standard error at its peak."""
    curve = smoothed(t, data)
    error = float(curve.stderr[np.argmax(np.abs(curve.values))])
    resolution = _SEEN * float(np.hypot(error, float(np.median(curve.stderr))))
    return _with_summit(step_metrics(t, curve.values, tail=TAIL, resolution=resolution), t, data, curve), curve, error


def _with_summit(figures: StepMetrics, t: Array, data: Array, curve: Smoothed) -> StepMetrics:
    """Return the figures with the peak, if any, refined by a cubic through all samples about it."""
    if not np.isfinite(figures.peak_time):
        return figures
    side = float(np.sign(figures.peak))
    found = summit(t, side * data, replace(curve, values=side * curve.values))
    if found is None:
        return figures
    at, height = found
    final = side * float(figures.final)
    fall = max(height - final, 0.0)
    return replace(
        figures,
        peak=np.asarray(side * height),
        peak_time=np.asarray(at),
        overshoot=np.asarray(fall / final if final > 0 else np.nan),
        back_relaxation=np.asarray(fall),
    )


def constant_until(drive: PiecewiseLinear) -> float:
    """Return the end [s] of the drive's constant beginning: inf for a step, 0 without a constant beginning."""
    start = float(drive.values[0])
    if not start:
        return 0.0
    moved = np.flatnonzero(np.abs(drive.values - start) > _CONSTANT * abs(start))
    if not len(moved):
        return float("inf")
    k = int(moved[0])
    return float(drive.times[k]) if drive.times[k] == drive.times[k - 1] else 0.0


def _json(figures: StepMetrics) -> dict[str, float | None]:
    values = {name: float(value) for name, value in vars(figures).items()}
    return {name: value if np.isfinite(value) else None for name, value in values.items()}
