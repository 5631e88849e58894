"""Presents a tuned controller: its gains and margins, the step response, Nyquist and Bode plots with the cloud."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.laws import kind_of
from ..control.loop import BAND
from ..control.margins import MARGINS
from ..units import format_quantity
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, blank, curve, heading, plain
from .look import narrow
from .page import Grid, Page, Section, picture
from .response import over_time

if TYPE_CHECKING:
    from ..control.tune import Tuned

_UNITS = {"delay": "s", "bandwidth": "Hz"}
_COLUMNS = ("nominal", "5 %", "worst")


def headline(tuned: Tuned) -> str:
    """Return one line: the controller, the strip, the step."""
    wish = tuned.wish
    step, limit = format_quantity(wish.step, "m", 4), format_quantity(wish.limit, "V", 4)
    late = f", measured {format_quantity(wish.delay, 's', 3)} late" if wish.delay else ""
    return f"{tuned.law.kind.upper()} for {tuned.actuator.name}, {tuned.beam} beam: {step} within {limit}{late}"


def gains(tuned: Tuned) -> str:
    """Return the gains in a line."""
    units = kind_of(tuned.law.kind).units
    said = []
    for name, value in tuned.law.gains.items():
        unit = units.get(name, "s" if name == "tracking_time" else "")
        shown = f"{1e-3 * value:.4g} V/mm" if unit == "V/m" else format_quantity(float(value), unit, 4)
        said.append(f"{name} {shown}" if unit or name not in ("b0",) else f"{name} {value:.4g}")
    return ", ".join(said)


def facts(tuned: Tuned) -> list[tuple[str, str]]:
    """Return what the controller does: settling, overshoot, sensitivity, delay."""
    settling, worst = tuned.settling, float(tuned.margins.sensitivity.max())
    bound = f"no voltage would do it sooner than {format_quantity(tuned.wish.bound, 's', 4)}"
    samples = len(tuned.margins.gain) - 1
    return [
        ("gains", gains(tuned)),
        ("settles", f"in {settling:.4g} s; {bound}" if np.isfinite(settling) else f"not within the run; {bound}"),
        ("overshoot", f"{tuned.overshoot:.2%}"),
        (
            "largest abs(S)",
            f"{tuned.margins.sensitivity[0]:.4g}" + (f", worst of {samples} samples {worst:.4g}" if samples else ""),
        ),
        ("largest delay", f"{_shown('delay', tuned.delay)} keeps abs(S) below {tuned.wish.most:g}"),
        ("bandwidth", _bandwidth(tuned)),
    ]


def _bandwidth(tuned: Tuned) -> str:
    """Return the bandwidth, beside the beam's first mode."""
    found = float(tuned.margins.bandwidth[0])
    shown = _shown("bandwidth", found)
    if tuned.resonance is None:
        return f"{shown}; the static beam has no mode"
    return f"{shown}, {found / tuned.resonance:.0%} of the first mode {format_quantity(tuned.resonance, 'Hz', 3)}"


def summary(tuned: Tuned) -> str:
    """Return the facts and the table of margins."""
    lines = [headline(tuned), *(f"{name:<15} {value}" for name, value in facts(tuned))]
    return "\n".join([*lines, "", *_table(tuned).lines("<>>>"[: len(_table(tuned).header)])])


def _table(tuned: Tuned) -> Grid:
    """Return the margins: nominal, those that 95 % of samples exceed, the worst."""
    columns = _COLUMNS if len(tuned.margins.gain) > 1 else _COLUMNS[:1]
    of = {what: tuned.margins.of(what) for what in columns}
    rows = [(_name(name), *(_shown(name, of[what][name]) for what in columns)) for name in MARGINS]
    return Grid(("margin", *columns), rows)


def _name(margin: str) -> str:
    return {"sensitivity": "largest abs(S)", "bandwidth": "bandwidth"}.get(margin, f"{margin} margin")


def _shown(name: str, value: float) -> str:
    if not np.isfinite(value):
        return "unlimited" if name != "sensitivity" else "unstable"
    if name == "phase":
        return f"{np.degrees(value):.1f} deg"
    if name in _UNITS:
        return format_quantity(value, _UNITS[name], 3)
    return f"{value:.3g}"


def panels(tuned: Tuned) -> Panels:
    """Return the panels: the displacement, the voltage, the error, Nyquist and Bode plots."""
    over = {"displacement": _displacement, "voltage": _voltage, "error": _error}
    drawn: dict[str, Any] = {name: partial(over_time, partial(draw, tuned)) for name, draw in over.items()}
    return drawn | {"nyquist": partial(nyquist, tuned), "bode": partial(bode, tuned), "size": partial(size, tuned)}


def figure(tuned: Tuned) -> Figure:
    """Return the step response, the voltage and the error; beside them the Nyquist and the Bode plot."""
    figure = blank((11.0, 6.0), stacked=13.0)
    if narrow():
        stacked = list(figure.subplots(5, 1, height_ratios=[1.4, 1, 1, 2.2, 1.2]))
        shown, places = stacked[:3], stacked[3:]
    else:
        halves = figure.add_gridspec(1, 2, width_ratios=[1.15, 1.0])
        left, right = halves[0].subgridspec(3, 1), halves[1].subgridspec(2, 1, height_ratios=[1.7, 1.0])
        shown = [figure.add_subplot(left[k]) for k in range(3)]
        places = [figure.add_subplot(right[k]) for k in range(2)]
    for panel, draw in zip(shown, (_displacement, _voltage, _error), strict=True):
        plain(panel)
        draw(tuned, panel)
        panel.margins(x=0.01)
    for panel in shown[:-1]:
        panel.sharex(shown[-1])
        panel.tick_params(labelbottom=False)
    shown[-1].set_xlabel("time [s]")
    for panel in places:
        plain(panel)
    nyquist(tuned, places[0])
    size(tuned, places[1])
    figure.align_ylabels(shown)
    heading(figure, headline(tuned))
    return figure


def _displacement(tuned: Tuned, panel: Axes, **style: Any) -> None:
    run = tuned.run
    factor = curve(panel, run.time, run.displacement, "displacement", "m", **{"label": "displacement"} | style)
    panel.plot(run.time, factor * run.reference, color=GREY, linestyle="--", linewidth=1.0, label="reference")
    goal = factor * float(run.reference[-1])
    panel.axhspan(goal * (1 - BAND), goal * (1 + BAND), color=GREY, alpha=0.15, label=f"within {100 * BAND:g} %")
    panel.axvline(tuned.wish.bound, color=ORANGE, linestyle=":", linewidth=1.2, label="no voltage settles sooner")
    panel.legend(frameon=False, fontsize="small", loc="lower right")


def _voltage(tuned: Tuned, panel: Axes, **style: Any) -> None:
    run = tuned.run
    curve(panel, run.time, run.voltage, "voltage", "V", **{"color": ORANGE} | style)
    low = min(0.0, float(run.voltage.min()))
    panel.set_ylim(*(1.12 * x for x in (low or -0.1 * tuned.wish.limit, max(tuned.wish.limit, 0.0))))
    for level in (-tuned.wish.limit, tuned.wish.limit):
        panel.axhline(level, color=GREY, linestyle=":", linewidth=1.0)


def _error(tuned: Tuned, panel: Axes, **style: Any) -> None:
    """Draw abs(error) on a logarithmic scale, where both the approach and the end can be seen."""
    run = tuned.run
    size = np.abs(run.reference - run.displacement)
    factor = curve(panel, run.time, size, "abs(error)", "m", **style)
    panel.set_yscale("log")
    panel.set_ylim(factor * size.max() * 1e-5, factor * size.max() * 2)


def nyquist(tuned: Tuned, panel: Axes, **style: Any) -> Axes:
    """Draw the loop gains of all samples near -1, and the circle that abs(S) must leave."""
    for loop in tuned.loops[1:]:
        panel.plot(loop.real, loop.imag, color=GREY, linewidth=0.5, alpha=0.35)
    nominal = tuned.loops[0]
    look: dict[str, Any] = {"color": BLUE, "linewidth": 1.6, "label": "nominal"}
    panel.plot(nominal.real, nominal.imag, **(look | style))
    if len(tuned.loops) > 1:
        panel.plot([], [], color=GREY, linewidth=0.8, label=f"{len(tuned.loops) - 1} samples of the fit")
    angle = np.linspace(0, 2 * np.pi, 200)
    radius = 1 / tuned.wish.most
    panel.fill(radius * np.cos(angle) - 1, radius * np.sin(angle), color=ORANGE, alpha=0.25, linewidth=0,
               label=f"abs(S) above {tuned.wish.most:g}")  # fmt: skip
    panel.plot([-1], [0], "+", color=ORANGE)
    panel.set(xlabel="Re L", ylabel="Im L", xlim=(-2.6, 1.4), ylim=(-2.4, 1.2))
    panel.set_aspect("equal", adjustable="box")
    panel.legend(frameon=False, fontsize="small", loc="upper left")
    return panel


def size(tuned: Tuned, panel: Axes, **style: Any) -> Axes:
    """Draw abs(L) and abs(S) over frequency."""
    hertz = tuned.frequency / (2 * np.pi)
    for k, loop in enumerate(tuned.loops[::-1]):
        last = k == len(tuned.loops) - 1
        for values, colour, dash, label in (
            (np.abs(loop), BLUE, "-", "abs(L)"),
            (1 / np.abs(1 + loop), ORANGE, "--", "abs(S)"),
        ):
            look: dict[str, Any] = {"color": colour if last else GREY, "linewidth": 1.5 if last else 0.4}
            look |= {"linestyle": dash, "alpha": 1.0 if last else 0.35, "label": label if last else "_"}
            panel.loglog(hertz, values, **(look | style if last and colour == BLUE else look))
    panel.axhline(tuned.wish.most, color=GREY, linestyle=":", linewidth=1.0)
    if tuned.resonance is not None:
        panel.axvline(tuned.resonance, color=GREY, linestyle="-.", linewidth=0.9, label="first mode")
    nominal = np.abs(tuned.loops[0])
    about = hertz[(nominal < 1e3) & (nominal > 1e-4)]
    if len(about):
        panel.set_xlim(about[0], about[-1])
    panel.set(xlabel="frequency [Hz]", ylabel="size", ylim=(1e-3, 1e2))
    panel.legend(frameon=False, fontsize="small", loc="upper right")
    return panel


def bode(tuned: Tuned, ax: Any, **style: Any) -> tuple[Axes, Axes]:
    """Draw size and phase of the loop gains on two axes; on a single one the phase is dotted, on a second scale."""
    shared = np.size(ax) == 1
    upper, lower = (ax, ax.twinx()) if shared else np.ravel(ax)
    size(tuned, upper, **style)
    hertz = tuned.frequency / (2 * np.pi)
    for k, loop in enumerate(tuned.loops[::-1]):
        last = k == len(tuned.loops) - 1
        look: dict[str, Any] = {"color": BLUE if last else GREY, "linewidth": 1.4 if last else 0.4}
        look |= {"alpha": 1.0 if last else 0.35, "linestyle": ":" if shared else "-"}
        lower.semilogx(hertz, np.degrees(np.unwrap(np.angle(loop))), **look)
    lower.set(xlabel="frequency [Hz]", ylabel="phase (dotted) [deg]" if shared else "phase [deg]")
    lower.set_xlim(upper.get_xlim())
    lower.set_ylim(-400, 20)
    return upper, lower


def page(tuned: Tuned) -> Page:
    """Return a page: the picture, the margins."""
    drawn = picture(figure(tuned), "step response, voltage and error; Nyquist plot and sizes with samples of the fit")
    sections = [Section("Step and margins", [drawn, _table(tuned)])]
    return Page(f"A controller for {tuned.actuator.name}", headline(tuned), facts(tuned), tuned.warnings, sections)
