"""EC Figures 12 and 13: displacement and force at rest over the strip's sizes, every design an ngspice transient."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..report.axes import ORANGE, Axes, grid
from ..simulation import closed_forms as formulas
from ..solve.transient import transient
from ..strip.actuator import PAPER, Actuator
from ..strip.file import dumps
from .items import Check, Reproduction, largest_ratio
from .paper_runs import VOLTAGE, PaperRuns, coefficient

#: Time [s] at which a step counts as at rest: d(s) has decayed to 1e-8.
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


def sized(*, free_length: float = 30e-3, width: float = 5e-3, thickness: float = 0.5e-3) -> Actuator:
    """The paper's strip in another size [m]."""
    geometry = replace(
        PAPER.geometry, length=free_length + _CLAMPED, free_length=free_length, width=width, thickness=thickness
    )
    return replace(PAPER, geometry=geometry)


#: One design of the grids as a file, to simulate alone or to change.
_DESIGN = {"EC-F12-strip.toml": dumps(replace(sized(free_length=40e-3, thickness=0.3e-3), name="another size"))}


def at_rest(strips: Iterable[Actuator], *, tip: str = "free") -> Array:
    """Displacement [m] of free, force [N] of clamped strips (n,), at rest under 4 V; all in one ngspice netlist."""
    netlists = [strip_netlist(strip, tip=tip, beam="static") for strip in strips]
    waves = transient(netlists, PiecewiseLinear.step(VOLTAGE), [0.0, _AT_REST])
    output = "displacement" if tip == "free" else "force"
    return waves.values[:, waves.names.index(output), -1]


def _map_at_rest(x: str, y: str, tip: str) -> Array:
    """`at_rest` over the grid of two sizes (x, y)."""
    values, others = _SIZES[x][0], _SIZES[y][0]
    strips = [sized(**{x: a, y: b}) for a in values.tolist() for b in others.tolist()]
    return at_rest(strips, tip=tip).reshape(len(values), len(others))


def _grids(x: str, y: str) -> dict[str, Array]:
    """All three sizes [m], two of them over their grid (x, y), the third the paper's."""
    own = {name: np.array(getattr(PAPER.geometry, name)) for name in _SIZES}
    return own | {x: _SIZES[x][0][:, None], y: _SIZES[y][0]}


def figure_12(runs: PaperRuns) -> Reproduction:
    y = _map_at_rest("free_length", "thickness", "free")
    sizes = _grids("free_length", "thickness")
    slenderness = sizes["free_length"] / sizes["thickness"]
    closed = formulas.steady_displacement(VOLTAGE, runs.coupling.static, 1.0, 1.0) * slenderness**2
    widths = _SIZES["width"][0]
    of_width = at_rest([sized(width=w) for w in widths.tolist()])
    width_effect = float(np.ptp(of_width) / of_width.mean())
    figure, ((panel,),) = grid(1, 1, (5.6, 4.2))
    _map(panel, "free_length", "thickness", 1e3 * y, "mm")
    figure.suptitle("displacement at rest, 4 V; the dot is the paper's sample", fontsize=10)
    powers = _powers("free_length", "thickness", y)
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
    constant = 3 / 4 * runs.coupling.static * PAPER.material.youngs_modulus
    figure, (panels,) = grid(1, 3, (11.5, 4.2))
    powers: list[float] = []
    count, worst = 0, 0.0
    for panel, ((x, y), title) in zip(panels, _PANELS.items(), strict=True):
        force, sizes = _map_at_rest(x, y, "clamped"), _grids(x, y)
        closed = constant * VOLTAGE * sizes["thickness"] * sizes["width"] / sizes["free_length"]
        worst = max(worst, largest_ratio(force, closed))
        powers += _powers(x, y, force)
        count += force.size
        _map(panel, x, y, 1e6 * force, "µN")
        panel.set_title(title, fontsize=10)
    figure.suptitle("clamped force at rest, 4 V; the dot is the paper's sample", fontsize=10)
    return Reproduction(
        checks=(Check(f"force of {count} designs by ngspice", "(39), constant corrected", worst, _LIMIT),),
        holds=(bool(np.allclose(powers, (1, 1, -1, 1, -1, 1), atol=_LIMIT)), False),
        numbers={"powers": powers, "times": coefficient("force_steady_factor") / constant},
        figure=figure,
        files=_DESIGN,
    )


def _powers(x: str, y: str, values: Array) -> tuple[float, float]:
    """Return the powers p, q of the least-squares law values ~ x^p y^q."""
    a, b = np.meshgrid(np.log(_SIZES[x][0]), np.log(_SIZES[y][0]), indexing="ij")
    design = np.column_stack([a.ravel(), b.ravel(), np.ones(a.size)])
    p, q, _ = np.linalg.lstsq(design, np.log(values).ravel(), rcond=None)[0]
    return float(p), float(q)


def _map(panel: Axes, x: str, y: str, values: Array, unit: str) -> None:
    """Draw filled contours of ``values`` (x, y), spaced evenly in the logarithm, each line with its number."""
    panel.grid(visible=False)
    axes = [1e3 * _SIZES[name][0] for name in (x, y)]
    low, high = np.log10(values.min()), np.log10(values.max())
    panel.contourf(*axes, values.T, levels=np.logspace(low, high, 25), norm="log", cmap="Blues")
    lines = panel.contour(*axes, values.T, levels=_round_levels(values), colors="black", linewidths=0.8)
    panel.clabel(lines, fmt=lambda v: f"{v:g} {unit}", fontsize=8)
    panel.plot(*(1e3 * getattr(PAPER.geometry, name) for name in (x, y)), "o", color=ORANGE, markersize=6)
    panel.set(xlabel=_SIZES[x][1], ylabel=_SIZES[y][1])


def _round_levels(values: Array) -> list[float]:
    """1, 2, 5 times powers of ten within ``values``."""
    decades = range(int(np.floor(np.log10(values.min()))), int(np.ceil(np.log10(values.max()))) + 1)
    return [k * 10.0**d for d in decades for k in (1, 2, 5) if values.min() < k * 10.0**d < values.max()]
