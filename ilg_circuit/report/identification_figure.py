"""The picture of an identification: every measured quantity with the fit and its residuals.

One file has a panel of its own below: the drive of a record, the Nyquist plot of a spectrum; several are drawn with the
prediction from the others, and compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..identify.current import CurrentData
from ..identify.identification import Identification
from ..identify.impedance import ImpedanceData
from ..identify.observation_fit import ObservationFit
from ..units import format_quantity
from .axes import BLUE, GREY, ORANGE, Figure, blank, engineering, new_figure, plain

#: Files are drawn in two columns where there are more.
_ONE_COLUMN = 3
#: Axes are logarithmic over more than that, of time and of anything else.
_LOG_SPAN, _DECADE = 30.0, 10.0


def figure(result: Identification) -> Figure:
    """Return the picture of a record, a spectrum, or several files."""
    if not result.single:
        return _several(result)
    first = result.port.data[0]
    return _spectrum(result, first) if isinstance(first, ImpedanceData) else _record(result)


def _record(result: Identification) -> Figure:
    """Data, fit and residuals of current and displacement, the drive beneath; time by logarithm for a step."""
    current = result.port.data[0]
    assert isinstance(current, CurrentData)
    moved = result.coupling.individual[0] if result.coupling is not None else None
    rows = 5 if moved is not None else 3
    drawn, axes = new_figure(rows, [2.0, 0.9] * (rows // 2) + [0.8])
    t = current.abscissa
    _pair(axes[0], axes[1], t, current.data, result.observations[0].fitted, "current", "A")
    axes[0].set_title(f"{current.source}: model {result.model}", fontsize=10, loc="left")
    if moved is not None:
        channel, window = moved.data.channel, moved.data.window
        _pair(axes[2], axes[3], channel.time, channel.values, moved.fitted, "displacement", "m", window)
        _annotate(axes[2], result)
    after, drive = t[t >= 0], current.record.drive
    axes[-1].plot(after, drive.value(after), color=ORANGE, linewidth=1.2)
    axes[-1].set_ylabel("voltage [V]")
    low, high = axes[-1].get_ylim()
    axes[-1].set_ylim(min(low, 0.0), max(high, 0.0) * 1.05)
    if current.level is not None:
        axes[-1].set_xscale("log")
        axes[-1].set_xlim(after[after > 0][0], after[-1])
    axes[-1].set_xlabel("time since the onset [s]")
    drawn.align_ylabels(axes)
    return drawn


def _pair(
    upper: Any, lower: Any, t: Array, data: Array, fitted: Array, name: str, unit: str, window: float = np.inf
) -> None:
    """Draw data and fit over time, residuals beneath; beyond ``window`` [s] the fit does not go."""
    factor, label = engineering(data, unit)
    upper.plot(t, factor * data, ".", color=GREY, markersize=2.5, label="measured")
    inside = t <= window
    upper.plot(t[inside], factor * fitted[inside], color=BLUE, linewidth=1.5, label="fit")
    if not inside.all():
        upper.plot(t[~inside], factor * fitted[~inside], "--", color=BLUE, linewidth=1.0, label="beyond the fit")
    upper.set_ylabel(f"{name} [{label}]")
    upper.legend(frameon=False, fontsize=8)
    residuals = (data - fitted)[inside]
    small, small_label = engineering(residuals, unit)
    lower.plot(t[inside], small * residuals, ".", color=GREY, markersize=2)
    lower.axhline(0.0, color=BLUE, linewidth=0.8)
    lower.set_ylabel(f"residual [{small_label}]")


def _annotate(panel: Any, result: Identification) -> None:
    """Mark the displacement's measured peak and say what the model makes of it."""
    from .identification import metric_text

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
    part = f"first {format_quantity(metrics.until, 's', 3)}: " if metrics.record is not None else ""
    panel.set_title(f"{part}{what} {words(metrics.measured)}; model {words(metrics.model)}", fontsize=8, loc="left")
    if metrics.peak is not None:
        (moved,) = result.coupling.individual
        at, height = metrics.peak
        factor, _ = engineering(moved.data.channel.values, "m")
        position = metrics.rest + moved.data.sign * height
        marker = "v" if moved.data.sign > 0 else "^"
        panel.plot(at, factor * position, marker, color=ORANGE, markersize=5, label="peak")
        panel.legend(frameon=False, fontsize=8)


def _spectrum(result: Identification, data: ImpedanceData) -> Figure:
    """Bode plot, residuals of the fit and of the Kramers-Kronig check over frequency; Nyquist plots beside them."""
    drawn = blank((11.0, 8.2))
    columns = drawn.add_gridspec(1, 2, width_ratios=[1.25, 1.0])
    left = columns[0].subgridspec(4, 1, height_ratios=[1.3, 1.1, 1.0, 1.0])
    size = drawn.add_subplot(left[0])
    phase, misfit, check = (drawn.add_subplot(left[k], sharex=size) for k in (1, 2, 3))
    z, f = data.measured.impedance, data.measured.frequency
    bad = data.check.bad
    # where the lowest frequencies dwarf the others, these have a plot of their own
    within = _corner(z)
    twice = within < 0.4 * float(np.abs(z).max())
    right = columns[1].subgridspec(2 if twice else 1, 1)
    planes = [drawn.add_subplot(right[k]) for k in range(2 if twice else 1)]
    dense = np.geomspace(f[0], f[-1], 400)
    fit = result.port.port.impedance(2j * np.pi * dense, ideal=True)
    _bode(size, phase, f, z, bad, dense, fit)
    (o,) = result.observations
    relative = np.asarray(o.residuals / np.abs(o.data), dtype=complex)
    _parts(misfit, o.abscissa, relative, "fit residual\n[% of abs(Z)]")
    _parts(check, f[~bad], data.check.residuals[~bad], "Kramers-Kronig\nresidual [% of abs(Z)]")
    check.set_xlabel("frequency [Hz]")
    for panel in (size, phase, misfit):
        panel.tick_params(labelbottom=False)
    for panel, largest in zip(planes, (None, within), strict=False):
        _nyquist(panel, z, bad, fit, largest)
    for panel in (size, phase, misfit, check, *planes):
        plain(panel)
    drawn.align_ylabels([size, phase, misfit, check])
    share = data.relative_rms(result.fit.residuals_of(0))
    drawn.suptitle(f"{data.source}: model {result.model}, {share:.2%} rms", fontsize=10)
    return drawn


def _bode(size: Any, phase: Any, f: Array, z: ComplexArray, bad: Mask, dense: Array, fit: ComplexArray) -> None:
    factor, label = engineering(np.abs(z), "\N{OHM SIGN}")
    size.loglog(f[~bad], factor * np.abs(z[~bad]), "o", color=GREY, markersize=3.5, label="measured")
    phase.semilogx(f[~bad], np.degrees(np.angle(z[~bad])), "o", color=GREY, markersize=3.5)
    if bad.any():
        size.loglog(f[bad], factor * np.abs(z[bad]), "x", color=ORANGE, markersize=6, label="left out")
        phase.semilogx(f[bad], np.degrees(np.angle(z[bad])), "x", color=ORANGE, markersize=6)
    size.loglog(dense, factor * np.abs(fit), color=BLUE, linewidth=1.5, label="fit")
    phase.semilogx(dense, np.degrees(np.angle(fit)), color=BLUE, linewidth=1.5)
    size.set_ylabel(f"abs(Z) [{label}]")
    phase.set_ylabel("phase [deg]")
    size.legend(frameon=False, fontsize=8)


def _parts(panel: Any, f: Array, relative: ComplexArray, name: str) -> None:
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.semilogx(f, 100 * relative.real, "o-", color=BLUE, markersize=2.5, linewidth=0.8, label="real part")
    panel.semilogx(f, 100 * relative.imag, "s-", color=ORANGE, markersize=2.5, linewidth=0.8, label="imaginary part")
    panel.set_ylabel(name)
    panel.legend(frameon=False, fontsize=7, ncols=2)


def _nyquist(panel: Any, z: ComplexArray, bad: Mask, fit: ComplexArray, largest: float | None = None) -> None:
    """Draw -Im Z over Re Z; ``largest`` [ohm]: only what lies within it."""
    factor, label = engineering(np.abs(z) if largest is None else np.array([largest]), "\N{OHM SIGN}")
    for points, style, name in (
        (z[~bad], {"marker": "o", "color": GREY, "markersize": 3.5, "linestyle": ""}, "measured"),
        (z[bad], {"marker": "x", "color": ORANGE, "markersize": 6, "linestyle": ""}, "left out"),
        (fit, {"color": BLUE, "linewidth": 1.5}, "fit"),
    ):
        if len(points):
            panel.plot(factor * points.real, -factor * points.imag, **style, label=name)
    panel.set_xlabel(f"Re Z [{label}]")
    panel.set_ylabel(f"-Im Z [{label}]")
    panel.set_aspect("equal", adjustable="box" if largest else "datalim")
    if largest is None:
        panel.set_title("Nyquist", fontsize=9, loc="left")
        return
    inside = factor * z[np.abs(z) <= largest]
    room = 0.05 * float(np.ptp(inside.real) + np.ptp(inside.imag))
    panel.set_xlim(float(inside.real.min()) - room, float(inside.real.max()) + room)
    panel.set_ylim(-float(inside.imag.max()) - room, -float(inside.imag.min()) + room)
    panel.set_title("Nyquist, upper frequencies", fontsize=9, loc="left")


def _corner(z: ComplexArray) -> float:
    """Return a size [ohm] within which the upper two thirds of the frequencies lie."""
    return 1.1 * float(np.max(np.abs(z)[len(z) // 3 :]))


def _several(result: Identification) -> Figure:
    """Every file with the joint fit and the prediction from the others, residuals beneath, the comparison last."""
    from .identification import files

    rows_of = result.observations
    columns = 1 if len(rows_of) <= _ONE_COLUMN else 2
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
        _residuals(lower, o)
        upper.tick_params(labelbottom=False)
        for panel in (upper, lower):
            plain(panel)
        if not k:
            upper.legend(frameon=False, fontsize=7)
    _comparison(drawn.add_subplot(grid[rows, :]), rows_of)
    drawn.suptitle(f"{files(result)} together: model {result.model}", fontsize=10)
    return drawn


def _waveforms(panel: Any, o: ObservationFit) -> None:
    spectrum = o.quantity == "impedance"
    curves: list[tuple[Any, dict[str, Any], str]] = [
        (o.data, {"linestyle": "", "marker": ".", "color": GREY, "markersize": 3}, "measured"),
        (o.fitted, {"color": BLUE, "linewidth": 1.5}, "joint fit"),
    ]
    if o.predicted is not None:
        curves.append((o.predicted, {"color": ORANGE, "linewidth": 1.1, "linestyle": "--"}, "from the others"))
    factor, label = engineering(np.abs(o.data), "\N{OHM SIGN}" if spectrum else o.unit)
    x, shown = _abscissa(panel, o)
    for values, style, name in curves:
        sizes = np.abs(values) if spectrum else values
        panel.plot(x, factor * sizes[shown], **style, label=name)
    if spectrum and np.ptp(np.log(np.abs(o.data))) > np.log(_DECADE):
        panel.set_yscale("log")
    panel.set_ylabel(f"{'abs(Z)' if spectrum else o.quantity}\n[{label}]", fontsize=8)
    voltage = format_quantity(o.voltage, "V", 3)
    panel.set_title(f"{o.source}: {o.quantity}, {'about ' * spectrum}{voltage}", fontsize=8, loc="left")
    panel.tick_params(labelsize=7)


def _residuals(panel: Any, o: ObservationFit) -> None:
    """Draw residuals of the joint fit and of the prediction, in percent of the observation's size."""
    spectrum = o.quantity == "impedance"
    x, shown = _abscissa(panel, o)
    size = np.abs(o.data) if spectrum else o.size
    for fitted, colour in ((o.predicted, ORANGE), (o.fitted, BLUE)):
        if fitted is None:
            continue
        share = (100 * (o.data - fitted) / size)[shown]
        if spectrum:
            panel.plot(x, share.real, ".-", color=colour, markersize=3, linewidth=0.6)
            panel.plot(x, share.imag, "x-", color=colour, markersize=3, linewidth=0.6)
        else:
            panel.plot(x, share, ".", color=colour, markersize=2)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set_ylabel("residual\n[%]", fontsize=8)
    panel.set_xlabel("frequency [Hz]" if spectrum else "time since the onset [s]", fontsize=8)
    panel.tick_params(labelsize=7)


def _abscissa(panel: Any, o: ObservationFit) -> tuple[Array, Mask]:
    """Return what is shown, by logarithm for a spectrum, and for a record whose samples are that close together."""
    positive = o.abscissa[o.abscissa > 0]
    logarithmic = o.quantity == "impedance" or positive[-1] > _LOG_SPAN * positive[0]
    if logarithmic:
        panel.set_xscale("log")
    shown = o.abscissa > 0 if logarithmic else np.ones(len(o.abscissa), dtype=bool)
    return o.abscissa[shown], shown


def _comparison(panel: Any, rows: tuple[ObservationFit, ...]) -> None:
    """Draw the comparison: three marks an observation, by logarithm."""
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
    panel.set_yticks(places, [f"{o.source}, {o.quantity}" for o in rows], fontsize=7)
    panel.set_ylim(-0.6, len(rows) - 0.4)
    panel.set_xlabel("rms of the residuals [% of peak current, abs(Z), span of the displacement]", fontsize=8)
    panel.tick_params(labelsize=7)
    panel.grid(alpha=0.25, linewidth=0.6, which="both")
    panel.spines[["top", "right"]].set_visible(False)
    panel.legend(frameon=False, fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
