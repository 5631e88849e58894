"""An identification as text, files and a picture."""

from __future__ import annotations

import json
from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..files import write_text
from ..fit.estimate import Method, Parameter
from ..report.axes import BLUE, GREY, ORANGE, engineering, new_figure, save
from ..strip.file import dumps
from ..units import format_quantity
from .identification import Identification
from .selection import table as candidate_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: What the table says of the intervals of each method.
_METHODS: dict[Method, str] = {
    "covariance": "intervals from the covariance",
    "bootstrap": "standard errors and intervals from a block bootstrap",
    "profile": "intervals from the profile likelihood",
    "mcmc": "intervals from the posterior, by Markov chain",
}


def table(result: Identification) -> str:
    """The result for a terminal: parameters with standard errors and intervals, what follows from them, statistics."""
    lines = [headline(result)]
    if len(result.candidates) > 1:
        lines += ["", *candidate_table(result.candidates)]
    lines += ["", f"{'parameter':<28}{'value':>16}{'standard error':>18}   95 % interval"]
    lines += [_row(name, p) for name, p in result.parameters.items()]
    lines += method_lines(result.parameters)
    lines += ["", *(f"{name:<28}{_text(p.value, p.unit):>16}" for name, p in result.derived.items())]
    s = result.statistics
    lines += ["", _statistics("current", s, "A", f" ({s['rmse_over_peak']:.2%} of the peak)")]
    if "displacement" in s:
        moved = s["displacement"]
        lines.append(
            _statistics("displacement", moved, "m", f", {moved['beam']} beam, first {moved['window_s']:.4g} s")
        )
    strong = [f"{pair}: {value:+.3f}" for pair, value in result.correlations.items() if abs(value) > 0.9]
    if strong:
        lines.append(f"correlations beyond 0.9: {'; '.join(strong)}")
    lines += ["", *_windows(result)]
    figures = result.figures
    if figures is not None:
        lines += ["", *figures.lines()]
    return "\n".join(lines)


def _windows(result: Identification) -> list[str]:
    """The residuals' rms by windows of time."""
    windows = result.residual_windows
    sizes = residual_sizes(result)
    lines = [
        f"{'residuals since the onset':<28}"
        + "".join(f"{name + ', rms':>20}{'of ' + of:>11}{'n':>7}" for name, (_, of, _) in sizes.items())
    ]
    moved = {w.start: w for w in windows.get("displacement", ())}
    for w in windows["current"]:
        row = f"{format_quantity(w.start, 's', 3) + ' to ' + format_quantity(w.end, 's', 3):<28}"
        for name, (size, _, unit) in sizes.items():
            part = w if name == "current" else moved.get(w.start)
            row += f"{_text(part.rms, unit, 3):>20}{part.rms / size:>11.2%}{part.count:>7}" if part else ""
        lines.append(row)
    return lines


def residual_sizes(result: Identification) -> dict[str, tuple[float, str, str]]:
    """What residuals are compared with: the size, its name, the unit, of each quantity that was fitted."""
    sizes = {"current": (float(np.abs(result.current.data).max()), "peak", "A")}
    if result.displacement is not None:
        sizes["displacement"] = (float(np.ptp(result.displacement.fitted)), "span", "m")
    return sizes


def headline(result: Identification) -> str:
    """What was measured, and the model."""
    m = result.measurement
    onset = f"step of {format_quantity(m.step, 'V', 5)} at" if m.step is not None else "waveform from"
    when = format_quantity(m.onset, "s", 6)
    return f"{m.source}: {onset} {when}; model {result.model}, {result.engine} in the loop"


def write_json(result: Identification, path: str | Path) -> None:
    """Write fit.json, whole or not at all."""
    write_text(Path(path), json.dumps(result.to_json(), indent=2) + "\n")


def write_actuator(result: Identification, path: str | Path) -> None:
    """Write the fitted actuator as TOML; its comment says where it comes from."""
    comment = "\n".join(
        [
            f"fitted by ilg_circuit {__version__} to {result.measurement.source}, model {result.model}",
            *(f"{n} = {_text(p.value, p.unit)}{_plus_minus(p)}" for n, p in result.parameters.items()),
            *(f"warning: {line}" for line in result.warnings),
        ]
    )
    write_text(Path(path), dumps(result.actuator, comment))


def plot_identification(result: Identification, path: str | Path) -> None:
    """Write `identification_figure` as a picture."""
    save(identification_figure(result), path)


def identification_figure(result: Identification) -> Figure:
    """Data, fit and residuals of current and displacement, the drive beneath; time by logarithm for a step."""
    m, current, moved = result.measurement, result.current, result.displacement
    rows = 5 if moved is not None else 3
    figure, axes = new_figure(rows, [2.0, 0.9] * (rows // 2) + [0.8])
    logarithmic = m.step is not None
    _panels(axes[0], axes[1], current.time, current.data, current.fitted, "current", "A")
    axes[0].set_title(f"{m.source}: model {result.model}", fontsize=10, loc="left")
    if moved is not None:
        channel = moved.channel
        _panels(axes[2], axes[3], channel.time, channel.values, moved.fitted, "displacement", "m", moved.window)
        _annotate(axes[2], result)
    t = current.time[current.time >= 0]
    axes[-1].plot(t, m.drive.value(t), color=ORANGE, linewidth=1.2)
    axes[-1].set_ylabel("voltage [V]")
    low, high = axes[-1].get_ylim()
    axes[-1].set_ylim(min(low, 0.0), max(high, 0.0) * 1.05)
    if logarithmic:
        axes[-1].set_xscale("log")
        axes[-1].set_xlim(t[t > 0][0], t[-1])
    axes[-1].set_xlabel("time since the onset [s]")
    figure.align_ylabels(axes)
    return figure


def _panels(
    upper: Any, lower: Any, t: Array, data: Array, fitted: Array, name: str, unit: str, window: float = np.inf
) -> None:
    factor, label = engineering(data, unit)
    upper.plot(t, factor * data, ".", color=GREY, markersize=2.5, label="measured")
    inside = t <= window
    upper.plot(t[inside], factor * fitted[inside], color=BLUE, linewidth=1.5, label="fit")
    if not inside.all():
        upper.plot(t[~inside], factor * fitted[~inside], "--", color=BLUE, linewidth=1.0, label="beyond the fit: drift")
    upper.set_ylabel(f"{name} [{label}]")
    upper.legend(frameon=False, fontsize=8)
    residuals = (data - fitted)[inside]
    small, small_label = engineering(residuals, unit)
    lower.plot(t[inside], small * residuals, ".", color=GREY, markersize=2)
    lower.axhline(0.0, color=BLUE, linewidth=0.8)
    lower.set_ylabel(f"residual [{small_label}]")


def _annotate(panel: Any, result: Identification) -> None:
    """Mark the displacement's measured peak and say what the model makes of it."""
    figures, moved = result.figures, result.displacement
    if figures is None or moved is None:
        return
    measured, model = ({row[0]: row[k] for row in figures.rows()} for k in (1, 2))

    def told(text: dict[str, str]) -> str:
        if figures.peak is None:
            return text["final value"]
        return f"{text['peak']} at {text['time of the peak']}, {text['overshoot']} over the final value"

    what = "peak" if figures.peak is not None else "final value"
    panel.set_title(f"{what} {told(measured)}; model {told(model)}", fontsize=8, loc="left")
    if figures.peak is not None:
        at, height = figures.peak
        factor, _ = engineering(moved.channel.values, "m")
        position = moved.rest + (moved.drift or 0.0) * at + moved.sign * height
        panel.plot(at, factor * position, "v" if moved.sign > 0 else "^", color=ORANGE, markersize=5, label="peak")
        panel.legend(frameon=False, fontsize=8)


def _row(name: str, p: Parameter) -> str:
    if p.stderr is None or p.ci95 is None:
        return f"{name:<28}{_text(p.value, p.unit):>16}{'held':>18}   {p.held}"
    error = p.honest[0]
    return f"{name:<28}{_text(p.value, p.unit):>16}{_text(error, p.unit, 2):>18}   {interval_text(p)}"


def interval_text(p: Parameter) -> str:
    """The interval to be believed, its open sides in words."""
    low, high = p.honest[1]
    if low == 0 and isinf(high):
        return "no limits"
    if isinf(high):
        return f"{_text(low, p.unit)} or more"
    return f"{_text(low, p.unit)} to {_text(high, p.unit)}" if low else f"{_text(high, p.unit)} or less"


def method_lines(parameters: dict[str, Parameter]) -> list[str]:
    """By what method the intervals were made, where it was not the covariance; one line a method."""
    groups: dict[str, list[str]] = {}
    fitted = {name: p for name, p in parameters.items() if p.stderr is not None}
    for name, p in fitted.items():
        groups.setdefault(_METHODS[p.method], []).append(name)
    groups.pop(_METHODS["covariance"], None)
    return [
        f"({words}{'' if len(names) == len(fitted) else ': ' + ', '.join(names)})" for words, names in groups.items()
    ]


def _plus_minus(p: Parameter) -> str:
    return f" +- {_text(p.honest[0], p.unit, 2)}" if p.stderr is not None else " (held)"


def _statistics(name: str, s: dict[str, Any], unit: str, more: str) -> str:
    return f"{name}: rmse {_text(s['rmse'], unit, 3)}{more}, AIC {s['aic']:.1f}, BIC {s['bic']:.1f}, n {s['n']}"


def _text(value: float, unit: str, digits: int = 5) -> str:
    return format_quantity(value, unit, digits)
