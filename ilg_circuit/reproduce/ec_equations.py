"""Tests EC's equations: (5) and (28), which are misprinted, and (35)-(39) with their constants."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..report.axes import Figure, new_figure
from ..simulation import closed_forms as formulas
from ..simulation.response import simulate
from ..solve.spectrum import spectrum
from ..strip.actuator import PAPER, Actuator, Coupling
from ..strip.elements import lumped_elements, lumped_port
from ..strip.file import dumps
from .ec_curves import EXACT, closed_displacement, displacement_checks, overlay
from .items import Check, Reproduction, largest_difference, largest_ratio, rows
from .paper_runs import VOLTAGE, PaperRuns, coefficient, coupling_of

#: Electrode resistance [ohm] for the test of (5); any value but zero exposes the wrong unit of the misprint.
_ELECTRODES = 5.0


def equation_5(runs: PaperRuns) -> Reproduction:
    port = replace(lumped_port(PAPER), electrode_resistance=_ELECTRODES)
    strip = Actuator.from_port(PAPER.geometry, port, base=PAPER.material, coupling=PAPER.coupling, name="electrodes")
    port = lumped_port(strip)
    r1, r2, electrode = port.dc_resistance, port.dynamic_resistance, port.electrode_resistance
    times = np.linspace(0.0, 300.0, 301)
    response = simulate(strip, PiecewiseLinear.step(VOLTAGE), times, beam="static")
    a0, a1, rate = formulas.current_constants(r1, r2, port.capacitance, electrode)
    curve = VOLTAGE * formulas.current_step(times, a0, a1, rate)
    d = r1 * r2 + electrode * (r1 + r2)
    printed = VOLTAGE * (r1 * r2 + r1 * electrode + r2 * r2) / (d * (r1 + electrode))
    apart = largest_difference(response.current, curve)
    return Reproduction(
        checks=(Check(f"current, R_e = {_ELECTRODES:g} Ω", "(4) with (5) corrected", apart, 1e-6),),
        holds=(False,),
        numbers={"off": printed / float(response.current[-1]) - 1},
        files={"EC-E5-strip.toml": dumps(strip)},
    )


def equation_28(runs: PaperRuns) -> Reproduction:
    frequencies = np.geomspace(1e-3, 1.0, 31)
    lumped, netlist = lumped_elements(PAPER), strip_netlist(PAPER)
    s = 2j * np.pi * frequencies
    moved = spectrum(netlist, frequencies, engine="ngspice").output("displacement")
    ours = -1 / (s * moved)  # u/v, v along EC's axis
    compliance, inertia = lumped.stiffness / s, lumped.mass * s + lumped.damping
    n = np.array([lumped.coupling_factor(x) for x in s])
    ion = np.array([lumped.ion_impedance(x) for x in s])
    corrected = -(n * inertia + ion * (compliance + inertia) / (n * compliance))
    apart = float(np.abs(ours / corrected - 1).max())
    return Reproduction(
        checks=(Check("u/v of the free tip, 1 mHz to 1 Hz", "(28) corrected", apart, 1e-6),),
        holds=(False,),
        numbers={"first": float(np.abs(n * compliance / corrected).max())},
    )


def equation_35(runs: PaperRuns) -> Reproduction:
    k, ratio = runs.fitted_coupling, VOLTAGE * lumped_elements(PAPER).bending_ratio
    frequency, sine = _damped(k)
    values = {
        "displacement_steady": float(runs.free.displacement[-1]),
        "displacement_cosine": ratio * k.static,
        "displacement_sine": ratio * k.gain * sine,
        "displacement_decay": k.damping_ratio * k.natural_frequency,
        "displacement_frequency": frequency,
    }
    return Reproduction(rows=rows("ec_curves", values), checks=displacement_checks(runs))


def _damped(k: Coupling) -> tuple[float, float]:
    """Frequency [rad/s] of the decaying oscillation, and coefficient [s] of its sine in the bracket of (36), (38)."""
    frequency = k.natural_frequency * math.sqrt(1 - k.damping_ratio**2)
    return frequency, (k.zero * k.damping_ratio - k.natural_frequency) / (k.natural_frequency * frequency)


def _bracket(k: Coupling, t: Array) -> tuple[Array, Array]:
    """Return the bracket of (36), (38) without its sine term, and the sine term [s]."""
    (frequency, sine), steady = _damped(k), k.zero / k.natural_frequency**2
    decay = np.exp(-k.damping_ratio * k.natural_frequency * t)
    return steady - steady * decay * np.cos(frequency * t), -sine * decay * np.sin(frequency * t)


def _three(t: Array, curves: dict[str, Array], name: str) -> Figure:
    """Return a figure: our run, the corrected equation and the printed one over time."""
    figure, (panel,) = new_figure(1, [3.0])
    overlay(panel, t, curves, name)
    panel.legend(frameon=False, loc="lower right")
    return figure


def equation_36(runs: PaperRuns) -> Reproduction:
    t, y, g = runs.free.time, runs.free.displacement, PAPER.geometry
    k = runs.fitted_coupling
    rest, sine = _bracket(k, t)
    values = {
        "displacement_prefactor": 3 * k.gain,
        "bracket_steady": k.zero / k.natural_frequency**2,
        "bracket_sine": _damped(k)[1],
    }
    factor = VOLTAGE * g.load_distance**2 / g.thickness**2 * 3 * k.gain
    # with the bracket closed before the sine, the product is in mm (as the printed constants) and the sine is added
    literal = 1e3 * factor * rest + sine
    inside = factor * (rest + sine)
    curves = {
        "ngspice": 1e3 * y,
        "(36), sine inside": 1e3 * inside,
        "(36) as printed, the minus in front left out": literal,
    }
    return Reproduction(
        rows=rows("ec_curves", values),
        checks=(Check("displacement by ngspice", "(36), sine inside", largest_difference(y, inside), EXACT),),
        holds=(False,),
        numbers={"low": literal.min(), "high": literal.max()},
        figure=_three(t, curves, "displacement [mm]"),
    )


def equation_37(runs: PaperRuns) -> Reproduction:
    g, y = PAPER.geometry, float(runs.free.displacement[-1])
    factor = y * g.thickness**2 / (VOLTAGE * g.load_distance**2)
    closed = formulas.steady_displacement(VOLTAGE, coupling_of(PAPER).static, g.load_distance, g.thickness)
    return Reproduction(
        rows=rows("ec_curves", {"displacement_steady_factor": factor}),
        checks=(Check("displacement after 300 s", "(37) from Table 3", largest_ratio(y, closed), 1e-5),),
    )


def equation_38(runs: PaperRuns) -> Reproduction:
    t, force, g = runs.clamped.time, runs.clamped.force, PAPER.geometry
    rest, sine = _bracket(runs.fitted_coupling, t)
    size = VOLTAGE * g.thickness * g.width / g.load_distance
    bracket = rest + sine
    prefactor = float(force @ bracket / (bracket @ bracket)) / size
    closed = closed_displacement(t) * lumped_elements(PAPER).stiffness
    printed = 1e-3 * coefficient("force_prefactor") * size * bracket
    curves = {
        "ngspice, clamped tip": 1e6 * force,
        "(38) with ¾ E K$_d$, sine inside": 1e6 * closed,
        "(38) with the printed constant, in mm": 1e6 * printed,
    }
    return Reproduction(
        rows=rows("ec_curves", {"force_prefactor": prefactor}),
        checks=(Check("clamped force by ngspice", "(26), (34)", largest_difference(force, closed), EXACT),),
        holds=(False,),
        numbers={"swing": float(np.abs(sine).max())},
        figure=_three(t, curves, "force on the clamp [µN]"),
    )


def equation_39(runs: PaperRuns) -> Reproduction:
    g, force = PAPER.geometry, float(runs.clamped.force[-1])
    factor = force * g.load_distance / (VOLTAGE * g.thickness * g.width)
    closed = formulas.steady_force(
        VOLTAGE, coupling_of(PAPER).static, PAPER.material.youngs_modulus, g.width, g.thickness, g.load_distance
    )
    return Reproduction(
        rows=rows("ec_curves", {"force_steady_factor": factor, "force_steady": force}),
        checks=(Check("force after 300 s", "¾ E d(0) U b w/L₀", largest_ratio(force, closed), 1e-5),),
    )
