"""Remakes EC Figures 12, 13: displacement and force at rest over the strip's sizes, each by an ngspice transient."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..report.axes import ORANGE, Axes, grid, heading, round_levels
from ..simulation import closed_forms as formulas
from ..solve.transient import transient
from ..strip.actuator import PAPER, Actuator
from ..strip.file import dumps
from .items import Check, Reproduction, largest_ratio
from .paper_runs import VOLTAGE, PaperRuns, coefficient, coupling_of

#: Time [s] after a step at which the strip is at rest: transients of d(s) have decayed to 1e-8.
_AT_REST = 400.0
#: The part of the strip held in the clamp [m], kept for every free length.
_CLAMPED = PAPER.geometry.length - PAPER.geometry.free_length
#: Size -> values of the grids [m] (the paper's ranges are not in its text), and the name of their axis.
_SIZES = {
    "free_length": (np.linspace(10e-3, 50e-3, 17), "free length L$_0$ [mm]"),
    "thickness": (np.linspace(0.2e-3, 1.0e-3, 17), "thickness b [mm]"),
    "width": (np.linspace(2e-3, 10e-3, 17), "width w [mm]"),
}
_LIMIT = 1e-5


def sized(**sizes: float) -> Actuator:
    """Return the paper's strip with other ``sizes`` [m] (free_length, width, thickness) and the same clamped part."""
    length = sizes.get("free_length", PAPER.geometry.free_length) + _CLAMPED
    return replace(PAPER, geometry=replace(PAPER.geometry, length=length, **sizes))


#: One design of the grids as a file, to simulate alone or to change.
_DESIGN = {"EC-F12-strip.toml": dumps(replace(sized(free_length=40e-3, thickness=0.3e-3), name="another size"))}


def at_rest(strips: Iterable[Actuator], *, tip: str = "free") -> Array:
    """Return displacements [m] of free or forces [N] of clamped strips (n,) at rest under 4 V, from one netlist."""
    netlists = [strip_netlist(strip, tip=tip, beam="static") for strip in strips]
    waves = transient(netlists, PiecewiseLinear.step(VOLTAGE), [0.0, _AT_REST])
    output = "displacement" if tip == "free" else "force"
    return waves.values[:, waves.names.index(output), -1]


def _map(panel: Axes, x: str, y: str, tip: str = "free") -> tuple[Array, dict[str, Array], tuple[float, float]]:
    """Draw `at_rest` over two sizes; return it (x, y) [SI], all three sizes [m], and p, q of its law x^p y^q.

    The filled contours are spaced evenly in the logarithm, each line has its number. The third size is the paper's.
    """
    sizes = {name: np.array(getattr(PAPER.geometry, name)) for name in _SIZES}
    sizes[x], sizes[y] = np.meshgrid(_SIZES[x][0], _SIZES[y][0], indexing="ij")
    pairs = np.column_stack([sizes[x].ravel(), sizes[y].ravel()])
    values = at_rest([sized(**{x: a, y: b}) for a, b in pairs.tolist()], tip=tip)
    p, q, _ = np.linalg.lstsq(np.column_stack([np.log(pairs), np.ones(len(pairs))]), np.log(values), rcond=None)[0]
    values = values.reshape(sizes[x].shape)
    factor, unit = (1e3, "mm") if tip == "free" else (1e6, "µN")
    shown = factor * values
    low, high = np.log10(shown.min()), np.log10(shown.max())
    surface = (1e3 * sizes[x].T, 1e3 * sizes[y].T, shown.T)
    panel.grid(visible=False)
    panel.contourf(*surface, levels=np.logspace(low, high, 25), norm="log", cmap="Blues")
    lines = panel.contour(*surface, levels=round_levels(shown), colors="black", linewidths=0.8)
    panel.clabel(lines, fmt=lambda v: f"{v:g} {unit}", fontsize="small")
    panel.plot(*(1e3 * getattr(PAPER.geometry, name) for name in (x, y)), "o", color=ORANGE, markersize=6)
    panel.set(xlabel=_SIZES[x][1], ylabel=_SIZES[y][1])
    return values, sizes, (float(p), float(q))


def figure_12(runs: PaperRuns) -> Reproduction:
    figure, ((panel,),) = grid(1, 1, (5.6, 4.2))
    y, sizes, powers = _map(panel, "free_length", "thickness")
    slenderness = sizes["free_length"] / sizes["thickness"]
    closed = formulas.steady_displacement(VOLTAGE, coupling_of(PAPER).static, 1.0, 1.0) * slenderness**2
    widths = _SIZES["width"][0]
    of_width = at_rest([sized(width=w) for w in widths.tolist()])
    width_effect = float(np.ptp(of_width) / of_width.mean())
    heading(figure, "displacement at rest, 4 V; the dot is the paper's sample")
    return Reproduction(
        checks=(
            Check(f"displacement of {y.size} designs by ngspice", "(37)", largest_ratio(y, closed), _LIMIT),
            Check(f"displacement of {len(widths)} widths", "one another", width_effect, _LIMIT),
        ),
        holds=(bool(np.allclose(powers, (2, -2), atol=_LIMIT)), width_effect < _LIMIT),
        numbers={
            "powers": powers,
            "steep": float((y / sizes["free_length"]).max()),
            "narrowest": 1e3 * widths[0],
            "widest": 1e3 * widths[-1],
            "width_effect": width_effect,
        },
        figure=figure,
        files=_DESIGN,
    )


#: The maps of Figure 13: their axes, and their titles.
_PANELS = {
    ("width", "thickness"): "(a) L$_0$ = 30 mm",
    ("free_length", "thickness"): "(b) w = 5 mm",
    ("free_length", "width"): "(c) b = 0.5 mm",
}


def figure_13(runs: PaperRuns) -> Reproduction:
    constant = 3 / 4 * coupling_of(PAPER).static * PAPER.material.youngs_modulus
    figure, (panels,) = grid(1, 3, (11.5, 4.2))
    powers: list[float] = []
    count, worst = 0, 0.0
    for panel, ((x, y), title) in zip(panels, _PANELS.items(), strict=True):
        force, sizes, law = _map(panel, x, y, "clamped")
        closed = constant * VOLTAGE * sizes["thickness"] * sizes["width"] / sizes["free_length"]
        worst = max(worst, largest_ratio(force, closed))
        powers += law
        count += force.size
        panel.set_title(title, fontsize="medium")
    heading(figure, "clamped force at rest, 4 V; the dot is the paper's sample")
    return Reproduction(
        checks=(Check(f"force of {count} designs by ngspice", "(39), constant corrected", worst, _LIMIT),),
        holds=(bool(np.allclose(powers, (1, 1, -1, 1, -1, 1), atol=_LIMIT)), False),
        numbers={"powers": powers, "times": coefficient("force_steady_factor") / constant},
        figure=figure,
        files=_DESIGN,
    )
