"""Presents a soft arm: its motion, its coupling to a rhythm, a search for a target."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..arms.coupling import Coupled
from ..arms.reach import Reached
from ..arms.run import ArmResult
from ..arrays import Array
from ..units import format_quantity
from . import motion as motions
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, blank, engineering, heading, scaled
from .look import beside


def summary(result: ArmResult) -> str:
    """Return the motion, the coupling's time scales and the search's result as text."""
    parts = [motions.summary(result.motion)]
    parts += [coupling_table(result.coupled)] if result.coupled else []
    parts += [reach_text(result.reached)] if result.reached else []
    return "\n".join(parts)


def figure(result: ArmResult) -> Figure:
    """Return the picture of the search for a target, or of the motion with snapshots at the paper's times."""
    if result.reached:
        return reach_figure(result.reached)
    return motions.figure(result.motion, _snapshots(result))


def headline(result: ArmResult) -> str:
    """Return one line: the arm, and what moves it."""
    return motions.headline(result.motion)


def facts(result: ArmResult) -> list[tuple[str, str]]:
    """Return whether the target was reached, what the coupling kept of the rhythm, and the motion."""
    rows: list[tuple[str, str]] = []
    if found := result.reached:
        there = "reached" if found.reached else "NOT reached"
        rows.append(
            (f"target {_point(found.target)}", f"{there}, {_length(found.distance)} away at {found.time:.4g} s")
        )
        rows += [(name, f"{value:.4g}") for name, value in found.parameters.items()]
    if result.coupled and result.coupled.scales:
        scale = result.coupled.scales[0]
        kept = f"{scale.kept:.2%} of the ideal strain kept at {scale.period:.4g} s"
        rows.append((f"coupling {result.coupled.mode}", kept))
    return [*rows, *motions.facts(result.motion)]


def panels(result: ArmResult) -> Panels:
    """Return the panels: places visited by a search, the arm, its tip, the tensions of the first segment."""
    of_search = {"visited": partial(_visited, result.reached)} if result.reached else {}
    return {**of_search, **motions.panels(result.motion, _snapshots(result))}


def _snapshots(result: ArmResult) -> list[float]:
    return [result.slower * time for time in motions.SNAPSHOT_TIMES]


def coupling_table(coupled: Coupled) -> str:
    """Return amplitude and phase of the coupling at the rhythm's period and slower ones."""
    if not coupled.scales:
        return f"coupling {coupled.mode}: no period to compare with"
    lines = [
        f"coupling {coupled.mode}: what is left of the ideal strain of {coupled.largest_strain:.3g}",
        f"  {'period':>12}{'amplitude':>12}{'phase':>12}",
    ]
    lines += [f"  {s.period:>10.4g} s{s.kept:>12.2%}{round(s.phase):>8} deg" for s in coupled.scales]
    return "\n".join(lines)


def reach_text(found: Reached) -> str:
    """Return the result of a search, and whether the paper's claim holds for it."""
    there = "reached" if found.reached else "NOT reached"
    within = _length(found.tolerance)
    lines = [
        f"target {_point(found.target)}: {there} within {within}; the tip passes at {_point(found.nearest)}, "
        f"{_length(found.distance)} away, at {found.time:.4g} s"
    ]
    for name, (least, most) in found.bounds.items():
        lines.append(f"  {name:<12}{found.parameters[name]:>9.4g}   from {least:.4g} to {most:.4g}")
    (left, low), (right, high) = found.visited.min(axis=0), found.visited.max(axis=0)
    lines.append(
        f"tips of {len(found.sample)} motions, {found.motion.time[-1]:g} s each: x from {_length(left)} to "
        f"{_length(right)}, y from {_length(low)} to {_length(high)}; within {within} of them lies {found.share:.2%} "
        "of the disc of the arm's length (of this sample; a larger one finds more)"
    )
    if found.failed:
        lines.append(f"{found.failed} motions of the search could not be computed and are left out")
    if found.everywhere:
        return "\n".join([*lines, "the paper's claim, 'can reach any specified position', holds here"])
    but = "this position is reached, but " if found.reached else ""
    lines.append(f"{but}the paper's claim, 'can reach any specified position', does not hold here:")
    return "\n".join([*lines, *(f"- {reason}" for reason in found.reasons)])


def _length(metres: float) -> str:
    return format_quantity(float(metres), "m", 4)


def _point(point: Array) -> str:
    return f"({_length(point[0])}, {_length(point[1])})"


def reach_figure(found: Reached) -> Figure:
    """Return the visited places, the target with its tolerance, and the best motion: the tip's path, the arm."""
    from matplotlib.patches import Circle

    motion = found.motion
    whole = blank((10.0, 4.8), stacked=9.0)
    left, right = whole.subplots(2 // beside(2), beside(2))
    at = int(np.abs(motion.time - found.time).argmin())
    for panel in (left, right):
        _visited(found, panel)
        panel.grid(alpha=0.25, linewidth=0.6)
    scale, _ = engineering(np.array([motion.arm.length]), "m")
    motions.draw_arm(left, scale * motion.positions[at], BLUE, "arm at that time")
    length = scale * motion.arm.length
    left.add_patch(Circle((0.0, 0.0), length, fill=False, edgecolor=GREY, linestyle=":", label="the arm's length"))
    left.plot(*(scale * motion.positions[0, 0]).T, color="black", linewidth=3, solid_capstyle="butt")
    left.set_aspect("equal", adjustable="datalim")
    points = scale * np.concatenate([found.visited, motion.tip])
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 0.06 * np.maximum(high - low, 0.02 * length)
    low, high = low - edge, high + edge
    right.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    right.locator_params(axis="x", nbins=5)
    right.set_title("the places visited; scales of x and y differ", fontsize="small")
    whole.legend(
        *left.get_legend_handles_labels(), loc="outside lower center", fontsize="small", ncols=beside(3), frameon=False
    )
    away, there = format_quantity(found.distance, "m", 3), "reached" if found.reached else "not reached"
    heading(whole, f"{motions.title(motion)}, {found.coupled.mode} coupling: target {there}, {away} left")
    return whole


def _visited(found: Reached, panel: Axes, **style: Any) -> Axes:
    """Draw the visited places, the target with its tolerance, and the tip's path in the best motion."""
    from matplotlib.patches import Circle

    scale, unit = scaled(panel.xaxis, np.array([found.motion.arm.length]), "m")
    panel.plot(*(scale * found.visited).T, ".", color=GREY, markersize=1.0, alpha=0.5, rasterized=True)
    panel.plot([], [], ".", color=GREY, label=f"visited by {len(found.sample)} motions")
    look: dict[str, Any] = {"color": ORANGE, "linewidth": 1.0, "label": "tip's path, best motion"} | style
    panel.plot(*(scale * found.motion.tip).T, **look)
    x, y = scale * found.target
    panel.add_patch(Circle((x, y), scale * found.tolerance, fill=False, edgecolor="black"))
    panel.plot(x, y, "x", color="black", markersize=7, label="target and tolerance")
    panel.plot(*(scale * found.nearest), "o", color=ORANGE, markersize=5, label=f"nearest, {found.time:.3g} s")
    panel.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    return panel
