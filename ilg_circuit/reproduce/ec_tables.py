"""Remakes EC Tables 1-3 by identification from the paper's fitted curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..simulation import closed_forms as formulas
from ..strip.actuator import PAPER
from ..strip.elements import lumped_elements, lumped_port
from .items import Check, Reproduction, Row, largest_ratio, rows
from .paper_runs import VOLTAGE, PaperRuns, coefficient, coupling_of
from .published import half_a_digit, published


def _elements(runs: PaperRuns) -> dict[str, float]:
    return {name: p.value for name, p in runs.from_curves.parameters.items()}


def table_1(runs: PaperRuns) -> Reproduction:
    found, g = _elements(runs), PAPER.geometry
    names = ("dc_resistance", "dynamic_resistance", "capacitance")
    sizes = {name: getattr(g, name) for name in ("length", "free_length", "width", "thickness")}
    # EC (5) inverted, from the printed (30) with R_e = 0
    a0, a1, rate = (coefficient(f"step_current_{name}") for name in ("steady", "decaying", "rate"))
    inverted = formulas.resistances_from_step(a0, a1, rate, VOLTAGE)
    off = largest_ratio([found[name] for name in names], inverted)
    own = [runs.from_run.parameters[name].value for name in names]
    recovered = largest_ratio(own, [getattr(lumped_port(PAPER), name) for name in names])
    return Reproduction(
        rows=rows("ec_table1", {name: found[name] for name in (*names, "electrode_resistance")} | sizes),
        checks=(
            Check("identified R_dc, R_d, C", "EC (5) inverted", off, 1e-6),
            Check("the same from our own ngspice run", "what went into it", recovered, 1e-6),
        ),
        files=runs.files,
    )


def table_2(runs: PaperRuns) -> Reproduction:
    found, g = _elements(runs), PAPER.geometry
    area = g.length * g.width
    values = {
        "dc_resistivity": found["dc_resistance"] * area / g.thickness,
        "dynamic_resistivity": found["dynamic_resistance"] * area / g.thickness,
        "permittivity": found["capacitance"] * g.thickness / area,
    }
    printed = [float(published("ec_table2", name).printed) for name in values]
    # R L w/b and C b/(L w) with b = 5 mm: what Table 2 has
    dc, dynamic, capacitance = (
        float(published("ec_table1", name).printed) for name in ("dc_resistance", "dynamic_resistance", "capacitance")
    )
    slip = largest_ratio([dc * area / 5e-3, dynamic * area / 5e-3, capacitance * 5e-3 / area], printed)
    return Reproduction(
        rows=rows("ec_table2", values),
        checks=(Check("Table 1 with b = 5 mm", "Table 2 as printed", slip, 1e-4),),
        files=runs.files,
    )


#: Constants of d(s) in `Coupling`, which are Table 3's.
COUPLING = ("gain", "zero", "damping_ratio", "natural_frequency")


def coupling_of_curve(steady: float, sine: float, decay: float, frequency: float) -> tuple[float, float, float, float]:
    """(Kd [m/(V s)], Zd [1/s], zeta', wn' [rad/s]) of (35): y = A - e^(-decay t)(A cos + B sin); A, B [m]."""
    natural = math.hypot(decay, frequency)
    slope = steady * decay - sine * frequency
    ratio = VOLTAGE * lumped_elements(PAPER).bending_ratio
    return slope / ratio, steady * natural**2 / slope, decay / natural, natural


def spread(function: Callable[..., ArrayLike], texts: Sequence[str], factors: Sequence[float]) -> np.ndarray:
    """Return the largest errors of ``function`` due to rounded arguments, over all ends of their roundings."""
    pairs = list(zip(texts, factors, strict=True))
    centre = np.asarray(function(*(float(t) * f for t, f in pairs)))
    ranges = [[(float(t) + sign * half_a_digit(t)) * f for sign in (-1, 1)] for t, f in pairs]
    off = [np.abs(np.asarray(function(*end)) - centre) for end in itertools.product(*ranges)]
    return np.asarray(np.max(off, axis=0))


def table_3(runs: PaperRuns) -> Reproduction:
    own, curve = runs.fitted_coupling, coupling_of(runs.from_curves.actuator)
    names = ("displacement_steady", "displacement_sine", "displacement_decay", "displacement_frequency")
    texts, factors = [published("ec_curves", name).printed for name in names], [1e-3, 1e-3, 1.0, 1.0]
    open_by = spread(coupling_of_curve, texts, factors)
    inverse = coupling_of_curve(*(float(t) * f for t, f in zip(texts, factors, strict=True)))
    from_curve = []
    for name, allowed in zip(COUPLING, open_by, strict=True):
        paper = published("ec_table3", f"coupling_{name}")
        allowed = float(allowed) / paper.si_factor + paper.rounding
        note = f"identified from (35), whose digits leave ±{allowed:.2g} open"
        from_curve.append(Row(paper, getattr(curve, name) / paper.si_factor, allowed, note))
    ours = {f"coupling_{name}": getattr(own, name) for name in COUPLING}
    from_run = rows("ec_table3", ours, "identified from our own run with the table's values")
    read_off = largest_ratio([getattr(curve, name) for name in COUPLING], inverse)
    return Reproduction(
        rows=(*from_run, *from_curve),
        checks=(Check("K_d, Z_d, ζ′, ω′ identified from (35)", "(34) inverted", read_off, 1e-6),),
        files=runs.files,
    )
