"""Draws an identification: each measured quantity with its fit and residuals.

One file has a panel of its own below: the drive of a record, the Nyquist plot of a spectrum; several are drawn with the
prediction from the others, and compared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from ..arrays import Array, Mask
from ..drive import Drive, by_current
from ..identification.current import CurrentData
from ..identification.identification import Identification
from ..identification.impedance import ImpedanceData
from ..identification.motion import DisplacementData
from ..identification.observation_fit import ObservationFit
from ..identification.port_model import BY_TIME
from ..units import format_quantity
from .axes import (
    BLUE,
    COLOURS,
    FIT,
    GREY,
    ORANGE,
    STYLES,
    Axes,
    Figure,
    Panels,
    blank,
    caption,
    distinct,
    drive_points,
    engineering,
    heading,
    jumps_of,
    legend_below,
    new_figure,
    plain,
    scaled,
    with_jumps,
)
from .look import beside
from .spectrum_figure import nyquist, phase, size, spectrum_figure

#: How the fit of several files together is drawn.
_JOINT: dict[str, Any] = FIT | {"label": "joint fit"}
#: More files than this are drawn in two columns.
_ONE_COLUMN = 3
#: Ratio of largest to smallest value above which an axis is logarithmic: of time, of other quantities.
_LOG_SPAN, _DECADE = 30.0, 10.0


def figure(result: Identification) -> Figure:
    """Return the picture of a record, a spectrum, or several files."""
    if not result.single:
        return _several(result)
    first = result.data[0]
    return spectrum_figure(result, first) if isinstance(first, ImpedanceData) else _record(result)


def _record(result: Identification) -> Figure:
    """Return data, fit and residuals of current and displacement, and the drive; time is logarithmic for a step."""
    names = [name for name in (*BY_TIME, "displacement") if name in _drawn_over_time(result)]
    drawn, axes = new_figure(2 * len(names) + 1, [2.0, 1.1] * len(names) + [1.1])
    for name, upper, lower in zip(names, axes[::2], axes[1::2], strict=False):
        _fit(result, name, upper)
        _fit_residuals(result, name, lower)
    title = f"{result.sources[0]}: model {result.model}"
    if "displacement" in names:
        _annotate(axes[2 * names.index("displacement")], result)
    caption(axes[0], title)
    _drive(result, axes[-1])
    _since_onset(result, axes[-1])
    for panel in axes[:-1]:
        _without_minor_ticks(panel)
    for panel in axes[: 2 * len(names) : 2]:
        if (inside := panel.get_legend()) is not None:
            inside.remove()
    legend_below(drawn, axes, columns=4)
    drawn.align_ylabels(axes)
    return drawn


def panels(result: Identification) -> Panels:
    """Return the panels: each measured quantity with its fit; for a spectrum the Nyquist plot first."""
    first = result.data[0]
    if not result.single:
        quantities = dict.fromkeys(o.quantity for o in result.observations)
        every = {name: partial(_together, result, name) for name in quantities}
        return {**every, "comparison": partial(_comparison, result.observations)}
    if isinstance(first, ImpedanceData):
        halves = {"size": partial(size, result), "phase": partial(phase, result)}
        return {"nyquist": partial(nyquist, result), **halves}

    def over_time(draw: Callable[..., None], panel: Axes, **style: Any) -> Axes:
        draw(panel, **style)
        _since_onset(result, panel)
        return panel

    waves = {name: partial(_fit, result, name) for name in _drawn_over_time(result)}
    source = "current" if first.quantity == "voltage" else "voltage"
    return {name: partial(over_time, draw) for name, draw in {**waves, source: partial(_drive, result)}.items()}


def _drawn_over_time(result: Identification) -> dict[str, tuple[Array, Array, Array, str, float]]:
    """Return quantity -> (time, data, fit, unit, end [s] of the fit) for a single record."""
    current = result.data[0]
    waves = {}
    if isinstance(current, CurrentData):
        fitted = result.observations[0].fitted
        waves[current.quantity] = (current.abscissa, current.data, fitted, current.unit, np.inf)
    if result.coupling is not None:
        moved = result.coupling.individual[0]
        channel = moved.data.channel
        waves["displacement"] = (channel.time, channel.values, moved.fitted, "m", moved.data.window)
    return waves


def _fit(result: Identification, name: str, panel: Axes, **style: Any) -> None:
    """Draw data and fit over time; dashed where the data were not fitted."""
    t, data, fitted, unit, window = _drawn_over_time(result)[name]
    factor, label = scaled(panel.yaxis, data, unit)
    look: dict[str, Any] = FIT | style
    shown = distinct(t, data, logarithmic=_of_step(result))
    panel.plot(t[shown], factor * data[shown], ".", color=GREY, markersize=2.5, label="measured")
    shown = distinct(t, fitted, logarithmic=_of_step(result))
    t, fitted = t[shown], fitted[shown]
    inside = t <= window
    jumps = _onset_and_jumps(result, t) if name in BY_TIME else np.empty(0)
    panel.plot(*with_jumps(t[inside], factor * fitted[inside], jumps), **look)
    if not inside.all():
        beyond: dict[str, Any] = {"linestyle": "--", "linewidth": 1.0, "label": "beyond the fit"}
        panel.plot(t[~inside], factor * fitted[~inside], **(look | beyond))
    panel.set_ylabel(f"{name} [{label}]")
    panel.legend(frameon=False, fontsize="small")


def _fit_residuals(result: Identification, name: str, panel: Axes) -> None:
    t, data, fitted, unit, window = _drawn_over_time(result)[name]
    inside = t <= window
    residuals = (data - fitted)[inside]
    factor, label = engineering(residuals, unit)
    shown = distinct(t[inside], residuals, logarithmic=_of_step(result))
    panel.plot(t[inside][shown], factor * residuals[shown], ".", color=GREY, markersize=2)
    panel.axhline(0.0, color=BLUE, linewidth=0.8)
    panel.set_ylabel(f"residual [{label}]")


def _drive(result: Identification, panel: Axes, **style: Any) -> None:
    first, drive = _drive_of(result)
    after = first.abscissa[first.abscissa >= 0]
    after = after[distinct(after, after)]
    look: dict[str, Any] = {"color": ORANGE, "linewidth": 1.2} | style
    panel.plot(*drive_points(drive, after), **look)
    panel.set_ylabel("current [A]" if by_current(drive) else "voltage [V]")
    low, high = panel.get_ylim()
    panel.set_ylim(min(low, 0.0), max(high, 0.0) * 1.05)


def _drive_of(result: Identification) -> tuple[CurrentData | DisplacementData, Drive]:
    """Return the first data of a fit and the drive that they were measured under."""
    first = result.data[0]
    assert isinstance(first, CurrentData | DisplacementData)
    return first, first.measured.drive if isinstance(first, CurrentData) else first.drive


def _onset_and_jumps(result: Identification, time: Array) -> Array:
    """Return the times [s] since the onset at which the voltage jumps."""
    drive = _drive_of(result)[1]
    onset = [0.0] if time[0] < 0 < time[-1] and float(drive.value(0.0)) != drive.rest else []
    later = jumps_of(drive, time)
    return np.concatenate([onset, later[later > 0]])


def _since_onset(result: Identification, panel: Axes) -> None:
    """Label the time axis; make it logarithmic for a step."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    first = result.data[0]
    if _of_step(result):
        after = first.abscissa[first.abscissa > 0]
        panel.set_xscale("log")
        plain_numbers = FuncFormatter(lambda value, _: f"{value:g}")
        panel.xaxis.set_major_formatter(plain_numbers)
        panel.xaxis.set_minor_formatter(plain_numbers if after[-1] < _DECADE * after[0] else NullFormatter())
        panel.set_xlim(after[0], after[-1])
    panel.set_xlabel("time since the onset [s]")


def _without_minor_ticks(panel: Axes) -> None:
    """Leave the minor ticks of a shared time axis to the other panels: each is drawn as slowly as a label."""
    from matplotlib.axis import Ticker
    from matplotlib.ticker import NullFormatter, NullLocator

    panel.xaxis.minor = Ticker()  # the one that it has is shared
    panel.xaxis.set_minor_locator(NullLocator())
    panel.xaxis.set_minor_formatter(NullFormatter())


def _of_step(result: Identification) -> bool:
    """Return True for a record of a step, whose time axis is logarithmic."""
    first = result.data[0]
    return isinstance(first, CurrentData) and first.level is not None


def _annotate(panel: Any, result: Identification) -> None:
    """Mark the measured peak of the displacement, and state it beside that of the model."""
    from .displacement_metrics import metric_text

    metrics = result.metrics
    if metrics is None or result.coupling is None:
        return

    def words(m: Any) -> str:
        if metrics.peak is None:
            return metric_text("final", m)
        if not np.isfinite(m.peak_time):
            return f"no peak, {metric_text('final', m)} at the end"
        over = f"{metric_text('overshoot', m)} overshoot"
        return f"{metric_text('peak', m)} at {metric_text('peak_time', m)}, {over}"

    what = "peak" if metrics.peak is not None else "final value"
    (moved,) = result.coupling.individual
    whole = metrics.record is None and metrics.until == moved.data.channel.time[-1]
    part = "" if whole else f"first {format_quantity(metrics.until, 's', 3)}: "
    caption(panel, f"{part}{what} {words(metrics.measured)}; model {words(metrics.model)}")
    if metrics.peak is not None:
        at, height = metrics.peak
        factor, _ = engineering(moved.data.channel.values, "m")
        position = metrics.rest + moved.data.sign * height
        marker = "v" if moved.data.sign > 0 else "^"
        panel.plot(at, factor * position, marker, color=ORANGE, markersize=5, label="peak")
        panel.legend(frameon=False, fontsize="small")


def _several(result: Identification) -> Figure:
    """Return each file with joint fit, prediction from the other files and residuals; a comparison below."""
    from .identification import files

    rows_of = result.observations
    columns = 1 if len(rows_of) <= _ONE_COLUMN else beside(2)
    rows = -(-len(rows_of) // columns)
    below = 0.6 + 0.22 * len(rows_of)
    drawn = blank((7.5 if columns == 1 else 11.0, 2.6 * rows + below + 0.6), dpi=130)
    layout: Any = drawn.get_layout_engine()
    layout.set(h_pad=0.02, w_pad=0.04, hspace=0.0)
    grid: Any = drawn.add_gridspec(rows + 1, columns, height_ratios=[2.6] * rows + [below])
    for k, o in enumerate(rows_of):
        pair = grid[k // columns, k % columns].subgridspec(2, 1, height_ratios=[2.0, 0.9], hspace=0.05)
        upper = drawn.add_subplot(pair[0])
        lower = drawn.add_subplot(pair[1], sharex=upper)
        _waveforms(upper, o)
        voltage = format_quantity(o.voltage, "V", 3)
        title = f"{o.source}: {o.quantity}, {'about ' * (o.quantity == 'impedance')}{voltage}"
        caption(upper, title)
        _residuals(lower, o)
        upper.tick_params(labelbottom=False)
        for panel in (upper, lower):
            plain(panel)
        if not k:
            upper.legend(frameon=False, fontsize="small")
    _comparison(rows_of, drawn.add_subplot(grid[rows, :]))
    heading(drawn, f"{files(result)} together: model {result.model}")
    return drawn


def _together(result: Identification, quantity: str, panel: Axes, **style: Any) -> Axes:
    """Draw one quantity of all files, each with the joint fit in a colour of its own."""
    rows = [o for o in result.observations if o.quantity == quantity]
    for k, o in enumerate(rows):
        _waveforms(
            panel,
            o,
            {"color": COLOURS[k % len(COLOURS)], "linestyle": STYLES[k % len(STYLES)], "label": o.source} | style,
            alone=False,
        )
    panel.set_xlabel("frequency [Hz]" if quantity == "impedance" else "time since the onset [s]")
    panel.legend(frameon=False, fontsize="small")
    return panel


def _waveforms(panel: Any, o: ObservationFit, style: Mapping[str, Any] = _JOINT, *, alone: bool = True) -> None:
    """Draw data and joint fit of an observation; if ``alone`` in its panel, also the prediction from other files."""
    spectrum = o.quantity == "impedance"
    measured = {"linestyle": "", "marker": ".", "color": GREY, "markersize": 3}
    curves: list[tuple[Any, Mapping[str, Any]]] = [
        (o.data, measured | ({"label": "measured"} if alone else {})),
        (o.fitted, _JOINT | dict(style)),
    ]
    if o.predicted is not None and alone:
        curves.append((o.predicted, {"color": ORANGE, "linewidth": 1.1, "linestyle": "--", "label": "from the others"}))
    factor, label = scaled(panel.yaxis, np.abs(o.data), "\N{OHM SIGN}" if spectrum else o.unit)
    x, shown, logarithmic = _abscissa(panel, o)
    for values, look in curves:
        sizes = (np.abs(values) if spectrum else values)[shown]
        rows = distinct(x, sizes, logarithmic=logarithmic)
        panel.plot(x[rows], factor * sizes[rows], **look)
    if spectrum and np.ptp(np.log(np.abs(o.data))) > np.log(_DECADE):
        panel.set_yscale("log")
    panel.set_ylabel(f"{'abs(Z)' if spectrum else o.quantity}\n[{label}]", fontsize="small")
    panel.tick_params(labelsize="small")


def _residuals(panel: Any, o: ObservationFit) -> None:
    """Draw residuals of the joint fit and of the prediction, in percent of the observation's size."""
    spectrum = o.quantity == "impedance"
    x, shown, logarithmic = _abscissa(panel, o)
    size = np.abs(o.data) if spectrum else o.size
    for fitted, colour in ((o.predicted, ORANGE), (o.fitted, BLUE)):
        if fitted is None:
            continue
        share = (100 * (o.data - fitted) / size)[shown]
        if spectrum:
            panel.plot(x, share.real, ".-", color=colour, markersize=3, linewidth=0.6)
            panel.plot(x, share.imag, "x-", color=colour, markersize=3, linewidth=0.6)
        else:
            rows = distinct(x, share, logarithmic=logarithmic)
            panel.plot(x[rows], share[rows], ".", color=colour, markersize=2)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set_ylabel("residual\n[%]", fontsize="small")
    panel.set_xlabel("frequency [Hz]" if spectrum else "time since the onset [s]", fontsize="small")
    panel.tick_params(labelsize="small")


def _abscissa(panel: Any, o: ObservationFit) -> tuple[Array, Mask, bool]:
    """Return the abscissa, a mask of the samples shown, and True for a wide range, whose axis is logarithmic."""
    positive = o.abscissa[o.abscissa > 0]
    logarithmic = o.quantity == "impedance" or positive[-1] > _LOG_SPAN * positive[0]
    if logarithmic:
        panel.set_xscale("log")
    shown = o.abscissa > 0 if logarithmic else np.ones(len(o.abscissa), dtype=bool)
    return o.abscissa[shown], shown, logarithmic


def _comparison(rows: tuple[ObservationFit, ...], panel: Any) -> Axes:
    """Draw the comparison: up to three marks per observation."""
    places = np.arange(len(rows))[::-1]
    marks = (
        ("own fit", "rms_individual", "o", GREY),
        ("joint fit", "rms_joint", "s", BLUE),
        ("from the others", "rms_predicted", "D", ORANGE),
    )
    shares: list[float] = []
    for name, attribute, marker, colour in marks:
        known = [(getattr(o, attribute), o.size, y) for o, y in zip(rows, places.tolist(), strict=True)]
        pairs = [(100 * rms / size, y) for rms, size, y in known if rms is not None]
        if pairs:
            x, y = zip(*pairs, strict=True)
            shares += x
            panel.plot(x, y, marker, color=colour, markersize=5, alpha=0.8, label=name)
    if min(shares) > 0 and max(shares) > _DECADE * min(shares):
        panel.set_xscale("log")
    else:
        panel.set_xlim(0.0, 1.1 * max(shares) or 1.0)
    panel.set_yticks(places, [f"{o.source}, {o.quantity}" for o in rows], fontsize="small")
    panel.set_ylim(-0.6, len(rows) - 0.4)
    panel.set_xlabel("rms of the residuals [% of peak current, abs(Z), span of the displacement]", fontsize="small")
    panel.tick_params(labelsize="small")
    panel.grid(alpha=0.25, linewidth=0.6, which="both")
    panel.spines[["top", "right"]].set_visible(False)
    panel.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return panel
