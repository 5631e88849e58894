"""The metrics of a displacement as text: peak, settling, back-relaxation, measured and modelled."""

from __future__ import annotations

import numpy as np

from ..identification.displacement_metrics import TAIL, DisplacementMetrics
from ..simulation.step_metrics import SETTLING_BAND, StepMetrics
from ..units import format_quantity

#: Metrics of a displacement: name -> (unit, "" for a ratio; description)
_METRICS = {
    "final": ("m", "final value"),
    "peak": ("m", "peak"),
    "peak_time": ("s", "time of the peak"),
    "overshoot": ("", "overshoot"),
    "settling_time": ("s", f"settling time ({SETTLING_BAND:.0%})"),
    "back_relaxation": ("m", "back-relaxation"),
}
_OF_A_PEAK = ("peak_time", "overshoot", "back_relaxation")


def metrics_rows(metrics: DisplacementMetrics) -> list[tuple[str, ...]]:
    """Return name, measured and modelled value of each metric, and the measured one over the longer record, as text."""
    columns = [metrics.measured, metrics.model, *([metrics.record] if metrics.record else [])]
    return [(title, *(metric_text(name, column) for column in columns)) for name, (_, title) in _METRICS.items()]


def metrics_header(metrics: DisplacementMetrics) -> tuple[str, ...]:
    longer = f"measured to {format_quantity(metrics.record_until, 's', 4)}"
    return ("measured", "model", *([longer] if metrics.record else []))


def metric_text(name: str, metrics: StepMetrics) -> str:
    """Return one metric with its unit; "none seen" for a peak that does not exist."""
    number, unit = float(getattr(metrics, name)), _METRICS[name][0]
    if not np.isfinite(number) or (name in _OF_A_PEAK and not np.isfinite(metrics.peak_time)):
        return "none seen"
    return format_quantity(number, unit, 4) if unit else f"{number:.1%}"


def metrics_lines(metrics: DisplacementMetrics) -> list[str]:
    """Return the metrics as a table for a terminal."""

    def row(name: str, measured: str, model: str, *record: str) -> str:
        return f"{name:<28}{measured:>16}{model:>18}" + "".join(f"{text:>22}" for text in record)

    rows = [row("figures of the displacement", *metrics_header(metrics)), *(row(*r) for r in metrics_rows(metrics))]
    where, *how = metrics_notes(metrics)
    return [*rows, f"({where};", *(f"{line};" for line in how[:-1]), f"{how[-1]})"]


def metrics_notes(metrics: DisplacementMetrics) -> tuple[str, ...]:
    """Return notes on the metrics: the part of the record, the reference level, the smoothing of the data."""
    until = format_quantity(metrics.until, "s", 4)
    where = f"over the first {until} under constant voltage, positive towards the anode"
    count = metrics.resting
    known = f"by {count} reading{'' if count == 1 else 's'} before the onset" if count else "the first reading"
    rest = f"measured: readings less the rest position of {format_quantity(metrics.rest, 'm', 5)} ({known})"
    low, high = metrics.windows
    smoothing = f"smoothed by parabolas over {low} to {high} samples" if high > 1 else "not smoothed"
    return where, rest, f"{smoothing}; final value: mean of the last {TAIL:.0%}; model: without the drift"
