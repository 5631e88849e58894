"""EC Figures 9-11: the strip under its 4 V step by ngspice, beside the paper's curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array
from ..report.axes import BLUE, GREY, ORANGE, new_figure
from ..simulation import closed_forms as formulas
from ..strip.actuator import PAPER
from ..strip.elements import lumped_elements
from .ec_tables import spread
from .items import Check, Claim, Reproduction, largest_difference, rows
from .paper_runs import VOLTAGE, PaperRuns, coefficient, printed_current, printed_displacement
from .published import published

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Reading error of the coordinate paper [m].
_READING = 0.1e-3
#: Limit of agreement between ngspice and a closed form.
EXACT = 1e-6


def settled_from(time: Array, values: Array, margin: float) -> float:
    """Return the time [s] from which on ``values`` stay within ``margin`` of their last."""
    outside = np.flatnonzero(np.abs(values - values[-1]) > margin)
    return float(time[outside[-1] + 1]) if len(outside) else float(time[0])


def _point(item: str) -> float:
    return float(published("ec_points", item).printed)


def closed_displacement(runs: PaperRuns, t: Array) -> Array:
    """(34) [m] with Table 3 in SI units."""
    k, ratio = runs.coupling, lumped_elements(PAPER).bending_ratio
    return VOLTAGE * formulas.displacement_step(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency, ratio)


def table_3_allows(t: Array) -> float:
    """Return the largest error of (34) due to the rounding of Table 3, relative to its maximum."""
    names = ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency")
    ratio = lumped_elements(PAPER).bending_ratio

    def curve(gain: float, zero: float, damping_ratio: float, natural_frequency: float) -> list[float]:
        values = formulas.displacement_step(t, gain, zero, damping_ratio, natural_frequency, ratio)
        return [float(v) for v in VOLTAGE * values]

    off = spread(curve, [published("ec_table3", name).recomputed for name in names], [1.0] * 4)
    return float(off.max() / printed_displacement(t).max())


def displacement_checks(runs: PaperRuns) -> tuple[Check, Check]:
    t, y = runs.free.time, runs.free.displacement
    return (
        Check("displacement by ngspice", "(34)", largest_difference(y, closed_displacement(runs, t)), EXACT),
        Check(
            "displacement by ngspice",
            "(35) as printed (limit: the digits of Table 3)",
            largest_difference(y, printed_displacement(t)),
            table_3_allows(t[::20]),
        ),
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
    return Reproduction(
        rows=rows("ec_points", values),
        checks=displacement_checks(runs),
        claims=(
            Claim(
                "the displacement is basically stable after 80 s",
                values["displacement_steady_from"] <= _point("displacement_steady_from"),
                f"(35) stays within 0.1 mm of its end from {values['displacement_steady_from']:.1f} s on",
            ),
        ),
        unknown=("The measured curve: the text states two of its points, which are drawn as they are stated.",),
        figure=_figure_9(runs),
    )


def _figure_9(runs: PaperRuns) -> Figure:
    figure, (panel,) = new_figure(1, [3.2])
    t, y = runs.free.time, runs.free.displacement
    panel.plot(t, 1e3 * y, color=BLUE, linewidth=2.6, label="ngspice, free tip")
    panel.plot(t, 1e3 * printed_displacement(t), color=ORANGE, linestyle="--", linewidth=1.2, label="(35) as printed")
    peak, at = _point("displacement_maximum"), _point("displacement_maximum_time")
    panel.errorbar(
        at, peak, 1e3 * _READING, fmt="o", color="black", markersize=4, capsize=3, label="stated: the maximum"
    )
    steady, start = _point("displacement_steady"), _point("displacement_steady_from")
    low, high = steady - 1e3 * _READING, steady + 1e3 * _READING
    panel.fill_between(
        [start, t[-1]],
        low,
        high,
        color=GREY,
        alpha=0.25,
        linewidth=0,
        label=f"stated: {steady:g} ± {1e3 * _READING:g} mm after {start:g} s",
    )
    panel.set_ylabel("displacement towards the anode [mm]")
    panel.set_xlabel("time [s]")
    panel.set_ylim(0, 5)
    panel.legend(frameon=False, loc="lower right")
    return figure


def current_settled(runs: PaperRuns) -> float:
    """Return the time [s] from which on our current is within 1 % of a0."""
    return settled_from(runs.free.time, runs.free.current, 0.01 * coefficient("step_current_steady"))


def figure_10(runs: PaperRuns) -> Reproduction:
    t, i = runs.free.time, runs.free.current
    steady = current_settled(runs)
    figure, (panel,) = new_figure(1, [3.0])
    panel.plot(t, 1e3 * i, color=BLUE, linewidth=2.6, label="ngspice")
    panel.axvline(steady, color=ORANGE, linestyle="--", linewidth=1.2, label=f"within 1 % of its end: {steady:.1f} s")
    panel.axvline(
        _point("current_steady_from"),
        color="black",
        linestyle=":",
        linewidth=1.6,
        label="stated: steady at about 300 s",
    )
    panel.set_ylabel("current [mA]")
    panel.set_xlabel("time [s]")
    panel.set_ylim(bottom=0)
    panel.set_xlim(-3, 309)
    panel.legend(frameon=False)
    return Reproduction(
        rows=rows("ec_points", {"current_steady_from": steady}),
        checks=_current_checks(runs),
        unknown=("The measured curve: the text states of it only that it is steady from about 300 s on.",),
        figure=figure,
    )


def _current_checks(runs: PaperRuns) -> tuple[Check, ...]:
    t, i = runs.free.time, runs.free.current
    return (Check("current by ngspice", "(30) as printed", largest_difference(i, printed_current(t)), 1e-5),)


def figure_11(runs: PaperRuns) -> Reproduction:
    t, i = runs.free.time, runs.free.current
    fitted, steady = runs.from_run.derived, current_settled(runs)
    values = {
        "step_current_steady": VOLTAGE * fitted["steady_conductance"].value,
        "step_current_decaying": VOLTAGE * fitted["transient_conductance"].value,
        "step_current_rate": fitted["rate"].value,
    }
    figure, (panel, below) = new_figure(2, [2.6, 1.3])
    panel.semilogy(t, 1e3 * i, color=BLUE, linewidth=2.6, label="ngspice")
    panel.semilogy(t, 1e3 * printed_current(t), color=ORANGE, linestyle="--", linewidth=1.2, label="(30) as printed")
    panel.axvspan(50, 150, color=GREY, alpha=0.2, linewidth=0, label="stated: measured and fitted curve part here")
    panel.set_ylabel("current [mA]")
    panel.legend(frameon=False)
    below.plot(t, 1e12 * (i - printed_current(t)), color=BLUE, linewidth=1.2)
    below.set_ylabel("ngspice − (30) [pA]")
    below.set_xlabel("time [s]")
    figure.align_ylabels([panel, below])
    return Reproduction(
        rows=rows("ec_curves", values, **dict.fromkeys(values, "identified from our own run")),
        checks=_current_checks(runs),
        claims=(
            Claim(
                "the fitting accuracy J₁ is 0.0362",
                None,
                "neither its unit nor the sampling of the measured curve is said",
            ),
            Claim(
                "measured and simulated current differ most from 50 to 150 s",
                None,
                f"the measured curve is not given; (30) is within 1 % of its end from {steady:.0f} s on, the measured "
                f"current steady from about {_point('current_steady_from'):g} s",
            ),
        ),
        unknown=("The measured curve, and with it J₁.",),
        figure=figure,
    )
