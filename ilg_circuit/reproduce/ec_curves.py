"""EC Figures 9-11 and equations (35)-(39): the strip under its 4 V step by ngspice, beside the paper's curves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .. import formulas
from ..actuator import PAPER
from ..elements import lumped_elements
from ..plots import BLUE, GREY, ORANGE, new_figure
from ..published import published
from .ec_tables import spread
from .items import Check, Claim, Item, Made, largest_difference, rows
from .runs import VOLTAGE, Runs, coefficient, printed_current, printed_displacement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: Reading error of the coordinate paper [m].
_READING = 0.1e-3
_FREE = "ilg-circuit simulate paper --drive step:4V --duration 300s --beam static --check --out run.csv --plot run.png"
_CLAMPED = _FREE.replace("--check", "--tip clamped --check")
#: Limit of agreement between ngspice and a closed form.
_EXACT = 1e-6


def settled_from(time: Array, values: Array, margin: float) -> float:
    """Time [s] from which on ``values`` stay within ``margin`` of their last."""
    outside = np.flatnonzero(np.abs(values - values[-1]) > margin)
    return float(time[outside[-1] + 1]) if len(outside) else float(time[0])


def _point(item: str) -> float:
    return float(published("ec_points", item).printed)


def closed_displacement(runs: Runs, t: Array) -> Array:
    """(34) [m] with Table 3 in SI units."""
    k, ratio = runs.coupling, lumped_elements(PAPER).bending_ratio
    return VOLTAGE * formulas.displacement_step(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency, ratio)


def table_3_allows(t: Array) -> float:
    """How far (34) may be off at its worst, relative to its maximum, by the rounding of Table 3."""
    names = ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency")
    ratio = lumped_elements(PAPER).bending_ratio

    def curve(gain: float, zero: float, damping_ratio: float, natural_frequency: float) -> list[float]:
        values = formulas.displacement_step(t, gain, zero, damping_ratio, natural_frequency, ratio)
        return [float(v) for v in VOLTAGE * values]

    off = spread(curve, [published("ec_table3", name).recomputed for name in names], [1.0] * 4)
    return float(off.max() / printed_displacement(t).max())


def _displacement_checks(runs: Runs) -> tuple[Check, Check]:
    t, y = runs.free.time, runs.free.displacement
    return (
        Check("displacement by ngspice", "(34)", largest_difference(y, closed_displacement(runs, t)), _EXACT),
        Check(
            "displacement by ngspice",
            "(35) as printed (limit: the digits of Table 3)",
            largest_difference(y, printed_displacement(t)),
            table_3_allows(t[::20]),
        ),
    )


def figure_9(runs: Runs) -> Made:
    t, y = runs.free.time, runs.free.displacement
    peak = int(y.argmax())
    values = {
        "displacement_maximum": float(y[peak]),
        "displacement_maximum_time": float(t[peak]),
        "displacement_steady": float(y[-1]),
        "displacement_steady_from": settled_from(t, y, _READING),
    }
    return Made(
        rows=rows("ec_points", values),
        checks=_displacement_checks(runs),
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


def _figure_9(runs: Runs) -> Figure:
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
        [start, t[-1]], low, high, color=GREY, alpha=0.25, linewidth=0, label="stated: 4.2 ± 0.1 mm after 80 s"
    )
    panel.set_ylabel("displacement towards the anode [mm]")
    panel.set_xlabel("time [s]")
    panel.set_ylim(0, 5)
    panel.legend(frameon=False, loc="lower right")
    return figure


def figure_10(runs: Runs) -> Made:
    t, i = runs.free.time, runs.free.current
    steady = settled_from(t, i, 0.01 * coefficient("step_current_steady"))
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
    return Made(
        rows=rows("ec_points", {"current_steady_from": steady}),
        checks=_current_checks(runs),
        unknown=("The measured curve: the text states of it only that it is steady from about 300 s on.",),
        figure=figure,
    )


def _current_checks(runs: Runs) -> tuple[Check, ...]:
    t, i = runs.free.time, runs.free.current
    return (Check("current by ngspice", "(30) as printed", largest_difference(i, printed_current(t)), 1e-5),)


def figure_11(runs: Runs) -> Made:
    t, i = runs.free.time, runs.free.current
    fitted = runs.from_run.derived
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
    return Made(
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
                "the measured curve is not given; from 55 s on (30) is within 1 % of its end, while the text has the "
                "measured current steady at 300 s",
            ),
        ),
        unknown=("The measured curve, and with it J₁.",),
        figure=figure,
    )


def equation_35(runs: Runs) -> Made:
    k, ratio = runs.fitted_coupling, VOLTAGE * lumped_elements(PAPER).bending_ratio
    values = {
        "displacement_steady": float(runs.free.displacement[-1]),
        "displacement_cosine": ratio * k.static,
        "displacement_sine": ratio * k.gain * _bracket_sine(runs),
        "displacement_decay": k.damping_ratio * k.natural_frequency,
        "displacement_frequency": _damped_frequency(runs),
    }
    return Made(rows=rows("ec_curves", values), checks=_displacement_checks(runs))


def _damped_frequency(runs: Runs) -> float:
    k = runs.fitted_coupling
    return k.natural_frequency * math.sqrt(1 - k.damping_ratio**2)


def _bracket_sine(runs: Runs) -> float:
    """Coefficient of the sine in the bracket of (36), (38) [s]."""
    k = runs.fitted_coupling
    return (k.zero * k.damping_ratio - k.natural_frequency) / (k.natural_frequency * _damped_frequency(runs))


def _bracket(runs: Runs, t: Array) -> tuple[Array, Array]:
    """The bracket of (36), (38) without its sine, and the sine [s], from our own displacement."""
    k = runs.fitted_coupling
    decay, frequency = np.exp(-k.damping_ratio * k.natural_frequency * t), _damped_frequency(runs)
    steady = k.zero / k.natural_frequency**2
    return steady - steady * decay * np.cos(frequency * t), -_bracket_sine(runs) * decay * np.sin(frequency * t)


def equation_36(runs: Runs) -> Made:
    t, y, g = runs.free.time, runs.free.displacement, PAPER.geometry
    k = runs.fitted_coupling
    rest, sine = _bracket(runs, t)
    factor = VOLTAGE * g.load_distance**2 / g.thickness**2 * 3 * k.gain
    # the bracket closed before the sine: the product is in mm, as the printed constants are, and the sine comes on top
    literal = 1e3 * factor * rest + sine
    figure, (panel,) = new_figure(1, [3.0])
    panel.plot(t, 1e3 * y, color=BLUE, linewidth=2.6, label="ngspice")
    panel.plot(t, 1e3 * factor * (rest + sine), color=ORANGE, linestyle="--", linewidth=1.2, label="(36), sine inside")
    panel.plot(t, literal, color=GREY, linewidth=1.2, label="(36) as printed, the minus in front left out")
    panel.set_ylabel("displacement [mm]")
    panel.set_xlabel("time [s]")
    panel.legend(frameon=False)
    return Made(
        rows=rows(
            "ec_curves",
            {
                "displacement_prefactor": 3 * k.gain,
                "bracket_steady": k.zero / k.natural_frequency**2,
                "bracket_sine": _bracket_sine(runs),
            },
        ),
        checks=(
            Check(
                "displacement by ngspice", "(36), sine inside", largest_difference(y, factor * (rest + sine)), _EXACT
            ),
        ),
        claims=(
            Claim(
                "(36) as printed: the bracket closes before the sine",
                False,
                f"read like that the displacement swings from {literal.min():.1f} to {literal.max():.1f} mm",
            ),
        ),
        figure=figure,
    )


def equation_37(runs: Runs) -> Made:
    g, y = PAPER.geometry, float(runs.free.displacement[-1])
    factor = y * g.thickness**2 / (VOLTAGE * g.load_distance**2)
    closed = formulas.steady_displacement(VOLTAGE, runs.coupling.static, g.load_distance, g.thickness)
    return Made(
        rows=rows("ec_curves", {"displacement_steady_factor": factor}),
        checks=(Check("displacement after 300 s", "(37) from Table 3", abs(y / closed - 1), 1e-5),),
    )


def equation_38(runs: Runs) -> Made:
    t, force, g = runs.clamped.time, runs.clamped.force, PAPER.geometry
    rest, sine = _bracket(runs, t)
    size = VOLTAGE * g.thickness * g.width / g.load_distance
    bracket = rest + sine
    prefactor = float(force @ bracket / (bracket @ bracket)) / size
    closed = closed_displacement(runs, t) * lumped_elements(PAPER).stiffness
    printed = 1e-3 * coefficient("force_prefactor") * size * bracket
    figure, (panel,) = new_figure(1, [3.0])
    panel.plot(t, 1e6 * force, color=BLUE, linewidth=2.6, label="ngspice, clamped tip")
    panel.plot(t, 1e6 * closed, color=ORANGE, linestyle="--", linewidth=1.2, label="(38) with ¾ E K$_d$, sine inside")
    panel.plot(t, 1e6 * printed, color=GREY, linewidth=1.2, label="(38) with the printed constant, in mm")
    panel.set_ylabel("force on the clamp [µN]")
    panel.set_xlabel("time [s]")
    panel.set_ylim(bottom=0)
    panel.legend(frameon=False, loc="lower right")
    swing = float(np.abs(sine).max())
    return Made(
        rows=rows("ec_curves", {"force_prefactor": prefactor}),
        checks=(Check("clamped force by ngspice", "(26), (34)", largest_difference(force, closed), _EXACT),),
        claims=(
            Claim(
                "(38) as printed: the bracket closes before the sine",
                False,
                f"read like that the sine alone makes a force of {swing:.1f} N",
            ),
        ),
        figure=figure,
    )


def equation_39(runs: Runs) -> Made:
    g, force = PAPER.geometry, float(runs.clamped.force[-1])
    factor = force * g.load_distance / (VOLTAGE * g.thickness * g.width)
    closed = formulas.steady_force(
        VOLTAGE, runs.coupling.static, PAPER.material.youngs_modulus, g.width, g.thickness, g.load_distance
    )
    return Made(
        rows=rows("ec_curves", {"force_steady_factor": factor, "force_steady": force}),
        checks=(Check("force after 300 s", "¾ E d(0) U b w/L₀", abs(force / closed - 1), 1e-5),),
    )


_STEP_34 = (
    "y(t) = (3 U L<sub>F</sub>² K<sub>d</sub>/b²) (Z<sub>d</sub>/ω′²) [1 − e<sup>−σt</sup> (cos ω<sub>d</sub>t + "
    "((Z<sub>d</sub>ζ′ − ω′)/(Z<sub>d</sub>√(1 − ζ′²))) sin ω<sub>d</sub>t)], &nbsp; σ = ζ′ω′, "
    "ω<sub>d</sub> = ω′√(1 − ζ′²) &nbsp; [(34)]"
)
_STEP_30 = "i(t) = a₀ + a₁ e<sup>−λt</sup> = 0.006 + 0.2058 e<sup>−0.147 t</sup> &nbsp; [(4), (30)]"

ITEMS = (
    Item(
        "EC-F9", "Figure 9: displacement under 4 V", "Step response of the soft actuator.", _STEP_34, (_FREE,), figure_9
    ),
    Item(
        "EC-F10",
        "Figure 10: current under 4 V",
        "Step response curve for the soft actuator.",
        _STEP_30,
        (_FREE,),
        figure_10,
    ),
    Item(
        "EC-F11",
        "Figure 11: the fitted current",
        "Comparison of soft actuator current response curves.",
        _STEP_30,
        (_FREE, "ilg-circuit identify run.csv --actuator paper --model rc --json fit.json"),
        figure_11,
    ),
    Item(
        "EC-E35",
        "Equation (35): the fitted displacement",
        "",
        "y(t) = 3.9805 − 3.9805 e<sup>−0.0461 t</sup> cos 0.0581 t − 1.3392 e<sup>−0.0461 t</sup> sin 0.0581 t "
        "&nbsp; [mm]",
        (_FREE,),
        equation_35,
    ),
    Item(
        "EC-E36",
        "Equation (36): displacement for any size",
        "",
        "y(t) = (U L₀²/b²) · 3K<sub>d</sub> · [Z<sub>d</sub>/ω′² (1 − e<sup>−σt</sup> cos ω<sub>d</sub>t) − "
        "((Z<sub>d</sub>ζ′ − ω′)/(ω′² √(1 − ζ′²))) e<sup>−σt</sup> sin ω<sub>d</sub>t]",
        (_FREE,),
        equation_36,
    ),
    Item(
        "EC-E37",
        "Equation (37): displacement at rest",
        "",
        "y(∞) = 3 d(0) U L₀²/b², &nbsp; d(0) = K<sub>d</sub>Z<sub>d</sub>/ω′²",
        (_FREE,),
        equation_37,
    ),
    Item(
        "EC-E38",
        "Equation (38): clamped force for any size",
        "",
        "F(t) = (U b w/L₀) · ¾ E K<sub>d</sub> · [the bracket of (36)] &nbsp; [(26)]",
        (_CLAMPED,),
        equation_38,
    ),
    Item(
        "EC-E39",
        "Equation (39): clamped force at rest",
        "",
        "F(∞) = ¾ E d(0) U b w/L₀",
        (_CLAMPED,),
        equation_39,
    ),
)
