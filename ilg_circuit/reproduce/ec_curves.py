"""Remakes EC Figures 9-11: the strip under a 4 V step by ngspice, beside the paper's curves."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from ..arrays import Array
from ..report.axes import BLUE, GREY, ORANGE, Axes, new_figure
from ..simulation import closed_forms as formulas
from ..strip.actuator import PAPER
from ..strip.elements import lumped_elements
from .ec_tables import COUPLING, spread
from .items import Check, Reproduction, largest_difference, rows
from .paper_runs import VOLTAGE, PaperRuns, coefficient, coupling_of, printed_current, printed_displacement
from .published import published

#: Reading error of the coordinate paper [m].
_READING = 0.1e-3
#: Limit of agreement between ngspice and a closed form.
EXACT = 1e-6
#: Colour, width and style of our curve and of those drawn on top of it.
_LOOKS = ((BLUE, 2.6, "-"), (ORANGE, 1.2, "--"), (GREY, 1.2, "-"))


def overlay(panel: Axes, t: Array, curves: Mapping[str, Array], name: str) -> None:
    """Draw ``curves`` (label -> values (t,)) over time, ours first."""
    for (label, values), (colour, width, style) in zip(curves.items(), _LOOKS, strict=False):
        panel.plot(t, values, label=label, color=colour, linewidth=width, linestyle=style)
    panel.set(xlabel="time [s]", ylabel=name)


def settled_from(time: Array, values: Array, margin: float) -> float:
    """Return the time [s] from which on ``values`` stay within ``margin`` of their last."""
    outside = np.flatnonzero(np.abs(values - values[-1]) > margin)
    return float(time[outside[-1] + 1]) if len(outside) else float(time[0])


def _point(item: str) -> float:
    return float(published("ec_points", item).printed)


def _closed(t: Array, gain: float, zero: float, damping_ratio: float, natural_frequency: float) -> Array:
    """(34) [m] in SI units."""
    ratio = lumped_elements(PAPER).bending_ratio
    return VOLTAGE * formulas.displacement_step(t, gain, zero, damping_ratio, natural_frequency, ratio)


def closed_displacement(t: Array) -> Array:
    """(34) [m] with Table 3 in SI units."""
    k = coupling_of(PAPER)
    return _closed(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency)


def table_3_allows(t: Array) -> float:
    """Return the largest error of (34) due to the rounding of Table 3, relative to its maximum."""
    table = [published("ec_table3", f"coupling_{name}").recomputed for name in COUPLING]
    off = spread(partial(_closed, t), table, [1.0] * 4)
    return float(off.max() / printed_displacement(t).max())


def displacement_checks(runs: PaperRuns) -> tuple[Check, Check]:
    t, y = runs.free.time, runs.free.displacement
    ours, off = "displacement by ngspice", largest_difference(y, printed_displacement(t))
    return (
        Check(ours, "(34)", largest_difference(y, closed_displacement(t)), EXACT),
        Check(ours, "(35) as printed (limit: the digits of Table 3)", off, table_3_allows(t[::20])),
    )


def figure_9(runs: PaperRuns) -> Reproduction:
    t, y = runs.free.time, runs.free.displacement
    peak = int(y.argmax())
    values = {
        "displacement_maximum": float(y[peak]),
        "displacement_maximum_time": float(t[peak]),
        "displacement_steady": float(y[-1]),
        "displacement_steady_from": settled_from(t, y, _READING),
    }
    highest, at, steady, start = (_point(name) for name in values)
    off = 1e3 * _READING
    figure, (panel,) = new_figure(1, [3.2])
    curves = {"ngspice, free tip": 1e3 * y, "(35) as printed": 1e3 * printed_displacement(t)}
    overlay(panel, t, curves, "displacement towards the anode [mm]")
    panel.errorbar(at, highest, off, fmt="o", color="black", markersize=4, capsize=3, label="stated: the maximum")
    label = f"stated: {steady:g} ± {off:g} mm after {start:g} s"
    panel.fill_between([start, t[-1]], steady - off, steady + off, color=GREY, alpha=0.25, linewidth=0, label=label)
    panel.set_ylim(0, 5)
    panel.legend(frameon=False, loc="lower right")
    return Reproduction(
        rows=rows("ec_points", values),
        checks=displacement_checks(runs),
        holds=(values["displacement_steady_from"] <= start,),
        numbers=values,
        figure=figure,
    )


def current_settled(runs: PaperRuns) -> float:
    """Return the time [s] from which on our current is within 1 % of a0."""
    return settled_from(runs.free.time, runs.free.current, 0.01 * coefficient("step_current_steady"))


def figure_10(runs: PaperRuns) -> Reproduction:
    steady, stated = current_settled(runs), _point("current_steady_from")
    figure, (panel,) = new_figure(1, [3.0])
    overlay(panel, runs.free.time, {"ngspice": 1e3 * runs.free.current}, "current [mA]")
    panel.axvline(steady, color=ORANGE, linestyle="--", linewidth=1.2, label=f"within 1 % of its end: {steady:.1f} s")
    panel.axvline(stated, color="black", linestyle=":", linewidth=1.6, label="stated: steady at about 300 s")
    panel.set(xlim=(-3, 309), ylim=(0, None))
    panel.legend(frameon=False)
    return Reproduction(
        rows=rows("ec_points", {"current_steady_from": steady}), checks=_current_checks(runs), figure=figure
    )


def _current_checks(runs: PaperRuns) -> tuple[Check, ...]:
    t, i = runs.free.time, runs.free.current
    return (Check("current by ngspice", "(30) as printed", largest_difference(i, printed_current(t)), 1e-5),)


def figure_11(runs: PaperRuns) -> Reproduction:
    t, i, printed = runs.free.time, runs.free.current, printed_current(runs.free.time)
    fitted = runs.from_run.derived
    values = {
        "step_current_steady": VOLTAGE * fitted["steady_conductance"].value,
        "step_current_decaying": VOLTAGE * fitted["transient_conductance"].value,
        "step_current_rate": fitted["rate"].value,
    }
    figure, (panel, below) = new_figure(2, [2.6, 1.3])
    overlay(panel, t, {"ngspice": 1e3 * i, "(30) as printed": 1e3 * printed}, "current [mA]")
    panel.axvspan(50, 150, color=GREY, alpha=0.2, linewidth=0, label="stated: measured and fitted curve part here")
    panel.set(xlabel="", yscale="log")
    panel.legend(frameon=False)
    below.plot(t, 1e12 * (i - printed), color=BLUE, linewidth=1.2)
    below.set(xlabel="time [s]", ylabel="ngspice − (30) [pA]")
    figure.align_ylabels([panel, below])
    return Reproduction(
        rows=rows("ec_curves", values, "identified from our own run"),
        checks=_current_checks(runs),
        holds=(None, None),
        numbers={"steady": current_settled(runs), "stated": _point("current_steady_from")},
        figure=figure,
    )
