"""EC Figures 12 and 13: displacement and force at rest over the strip's sizes, every design an ngspice transient."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..report.panels import grid
from ..simulation import closed_forms as formulas
from ..solve.transient import transient
from ..strip.actuator import PAPER, Actuator
from ..strip.file import dumps
from .items import Check, Claim, Reproduction
from .paper_runs import VOLTAGE, PaperRuns, coefficient

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Time [s] at which a step counts as at rest: d(s) has decayed to 1e-8.
_AT_REST = 400.0
#: The part of the strip held in the clamp [m], kept for every free length.
_CLAMPED = PAPER.geometry.length - PAPER.geometry.free_length
#: Ranges of the grids [m]: the paper's are not in its text.
LENGTHS = np.linspace(10e-3, 50e-3, 17)
THICKNESSES = np.linspace(0.2e-3, 1.0e-3, 17)
WIDTHS = np.linspace(2e-3, 10e-3, 17)
_LIMIT = 1e-5
_RANGES = "The ranges of the paper's axes are not in its text: those drawn here are ours."


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


def _grid(x: Array, y: Array, build: Callable[[float, float], Actuator], tip: str) -> Array:
    """`at_rest` over a grid (x, y)."""
    return at_rest([build(a, b) for a in x.tolist() for b in y.tolist()], tip=tip).reshape(len(x), len(y))


def _relative(values: Array, closed: Array) -> float:
    """Largest relative difference, every design by its own size."""
    return float(np.abs(values / closed - 1).max())


def figure_12(runs: PaperRuns) -> Reproduction:
    y = _grid(LENGTHS, THICKNESSES, lambda a, b: sized(free_length=a, thickness=b), "free")
    closed = (
        formulas.steady_displacement(VOLTAGE, runs.coupling.static, 1.0, 1.0) * (LENGTHS[:, None] / THICKNESSES) ** 2
    )
    of_width = at_rest([sized(width=w) for w in WIDTHS.tolist()])
    width_effect = float(np.ptp(of_width) / of_width.mean())
    figure, ((panel,),) = grid(1, 1, (5.6, 4.2))
    _map(panel, (LENGTHS, THICKNESSES), 1e3 * y, ("free length L$_0$ [mm]", "thickness b [mm]"), "mm")
    figure.suptitle("displacement at rest, 4 V; the dot is the paper's sample", fontsize=10)
    powers = _powers((LENGTHS, THICKNESSES), y)
    steep = float((y / LENGTHS[:, None]).max())
    return Reproduction(
        checks=(
            Check(f"displacement of {y.size} designs by ngspice", "(37)", _relative(y, closed), _LIMIT),
            Check(f"displacement of {len(WIDTHS)} widths", "one another", width_effect, _LIMIT),
        ),
        claims=(
            Claim(
                "the displacement is in proportion to (L₀/b)²",
                bool(np.allclose(powers, (2, -2), atol=_LIMIT)),
                f"powers found: {powers[0]:.5f} of L₀, {powers[1]:.5f} of b. The model assumes a beam that bends "
                f"little; in a corner of this map it would move by {steep:.1f} times its free length",
            ),
            Claim(
                "it does not depend on the width",
                width_effect < _LIMIT,
                f"widths from {1e3 * WIDTHS[0]:g} to {1e3 * WIDTHS[-1]:g} mm differ by {width_effect:.0e}",
            ),
        ),
        unknown=(_RANGES, "K_d was fitted to one strip: no measurement of another size is in the paper."),
        figure=figure,
        files=_DESIGN,
    )


def figure_13(runs: PaperRuns) -> Reproduction:
    static, modulus = runs.coupling.static, PAPER.material.youngs_modulus

    def closed(length: Any, width: Any, thickness: Any) -> Array:
        return np.asarray(3 / 4 * static * modulus * VOLTAGE * thickness * width / length)

    lengths, widths, thicknesses = "free length L$_0$ [mm]", "width w [mm]", "thickness b [mm]"
    panels = (
        (
            (WIDTHS, THICKNESSES),
            (widths, thicknesses),
            _grid(WIDTHS, THICKNESSES, lambda w, b: sized(width=w, thickness=b), "clamped"),
            closed(30e-3, WIDTHS[:, None], THICKNESSES),
            "(a) L$_0$ = 30 mm",
        ),
        (
            (LENGTHS, THICKNESSES),
            (lengths, thicknesses),
            _grid(LENGTHS, THICKNESSES, lambda a, b: sized(free_length=a, thickness=b), "clamped"),
            closed(LENGTHS[:, None], 5e-3, THICKNESSES),
            "(b) w = 5 mm",
        ),
        (
            (LENGTHS, WIDTHS),
            (lengths, widths),
            _grid(LENGTHS, WIDTHS, lambda a, w: sized(free_length=a, width=w), "clamped"),
            closed(LENGTHS[:, None], WIDTHS, 0.5e-3),
            "(c) b = 0.5 mm",
        ),
    )
    figure, panels_of = grid(1, 3, (11.5, 4.2))
    for panel, (axes, names, force, _, title) in zip(panels_of[0], panels, strict=True):
        _map(panel, axes, 1e6 * force, names, "µN")
        panel.set_title(title, fontsize=10)
    figure.suptitle("clamped force at rest, 4 V; the dot is the paper's sample", fontsize=10)
    times = coefficient("force_steady_factor") / (3 / 4 * static * modulus)
    powers = [p for axes, _, force, _, _ in panels for p in _powers(axes, force)]
    count = sum(force.size for _, _, force, _, _ in panels)
    worst = max(_relative(force, expected) for _, _, force, expected, _ in panels)
    return Reproduction(
        checks=(Check(f"force of {count} designs by ngspice", "(39), constant corrected", worst, _LIMIT),),
        claims=(
            Claim(
                "the force is in proportion to b and w, and inversely to L₀",
                bool(np.allclose(powers, (1, 1, -1, 1, -1, 1), atol=_LIMIT)),
                f"powers found: {powers[0]:.5f} of w, {powers[1]:.5f} of b, {powers[2]:.5f} of L₀",
            ),
            Claim("its constant is 0.5515", False, f"every force would be {times:.0f} times as large"),
        ),
        unknown=(_RANGES,),
        figure=figure,
        files=_DESIGN,
    )


def _powers(axes: tuple[Array, Array], values: Array) -> tuple[float, float]:
    """Return the powers p, q of the least-squares law values ~ x^p y^q."""
    x, y = np.meshgrid(*(np.log(a) for a in axes), indexing="ij")
    design = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)])
    p, q, _ = np.linalg.lstsq(design, np.log(values).ravel(), rcond=None)[0]
    return float(p), float(q)


def _map(panel: Axes, axes: tuple[Array, Array], values: Array, names: tuple[str, str], unit: str) -> None:
    """Draw filled contours of ``values`` (x, y), spaced evenly in the logarithm, each line with its number."""
    panel.grid(visible=False)
    x, y = (1e3 * a for a in axes)
    low, high = np.log10(values.min()), np.log10(values.max())
    panel.contourf(x, y, values.T, levels=np.logspace(low, high, 25), norm="log", cmap="Blues")
    lines = panel.contour(x, y, values.T, levels=_round_levels(values), colors="black", linewidths=0.8)
    panel.clabel(lines, fmt=lambda v: f"{v:g} {unit}", fontsize=8)
    panel.plot(*_sample(names), "o", color="#d1601f", markersize=6)
    panel.set_xlabel(names[0])
    panel.set_ylabel(names[1])


def _sample(names: tuple[str, str]) -> tuple[float, float]:
    """Return the coordinates [mm] of the paper's sample in a map."""
    g = PAPER.geometry
    sizes = {"free": g.free_length, "width": g.width, "thickness": g.thickness}
    x, y = (1e3 * sizes[name.split()[0]] for name in names)
    return x, y


def _round_levels(values: Array) -> list[float]:
    """1, 2, 5 times powers of ten within ``values``."""
    decades = range(int(np.floor(np.log10(values.min()))), int(np.ceil(np.log10(values.max()))) + 1)
    return [k * 10.0**d for d in decades for k in (1, 2, 5) if values.min() < k * 10.0**d < values.max()]
