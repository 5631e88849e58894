"""Presents an arm's motion: text, pictures and animations."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arms.motion import Motion
from ..arrays import Array
from ..errors import InputError
from ..units import format_quantity
from .animation import FRAME, MOST_FRAMES, require_animation, write_frames
from .axes import (
    BLUE,
    GREY,
    ORANGE,
    Axes,
    Figure,
    Panels,
    axis_label,
    blank,
    engineering,
    heading,
    legend_above,
    plain,
    scaled,
)
from .look import beside, narrow

#: Times of the snapshots in CPG Fig. 10(c) [s].
SNAPSHOT_TIMES = (0.5, 0.7, 1.0, 1.5)
#: A motion whose extents have a smaller ratio is drawn with different scales along x and y.
_FLAT = 0.25
#: Colours of the first and the last snapshot.
_LIGHT, _DARK = np.array([0.75, 0.87, 0.95]), np.array([0.03, 0.19, 0.42])


def summary(motion: Motion) -> str:
    """Return what the arm is, the tip's displacements, the first segment's tension, and the accuracy as text."""
    lines = [headline(motion), *(f"{name} {value}" for name, value in facts(motion))]
    return "\n".join([*lines, *(f"{e.time:.4g} s: {e.finding}" for e in motion.events if not e.warning)])


def headline(motion: Motion) -> str:
    """Return one line: the arm, and what moves it."""
    return (
        f"{title(motion)}, {format_quantity(motion.arm.length, 'm', 4)} long: {motion.text}, "
        f"{motion.time[-1]:g} s, {len(motion.time)} samples"
    )


def facts(motion: Motion) -> list[tuple[str, str]]:
    """Return the tip's displacements, the first segment's tension, and the accuracy."""
    moved = np.linalg.norm(motion.tip - motion.tip[0], axis=1)
    largest = int(moved.argmax())
    tension = float(np.abs(motion.first_segment_force).max())
    peak, end = (format_quantity(float(moved[k]), "m", 4) for k in (largest, -1))
    return [
        ("tip's largest displacement", f"{peak} at {motion.time[largest]:.4g} s, at the end {end}"),
        ("largest tension in the first segment", format_quantity(tension, "N", 4)),
        _accuracy(motion),
    ]


def _accuracy(motion: Motion) -> tuple[str, str]:
    closed = f"closed to {motion.balance_error:.1e} of its largest term"
    if motion.arm.formulation == "chain":  # it has no cells
        return "energy balance", closed
    return "cells' areas kept to", f"{motion.area_drift:.1e}, energy balance {closed}"


def figure(motion: Motion, snapshots: ArrayLike = SNAPSHOT_TIMES) -> Figure:
    """Return the arm at ``snapshots`` [s] with the tip's path, the tip over time, the first segment's internal force.

    Snapshots after the end of the motion are left out; if none is left, the arm is drawn at its end.
    """
    figure = blank((9.5, 5.6), stacked=9.0)
    if narrow():
        shape, tip, force = figure.subplots(3, 1, height_ratios=[1.9, 1.0, 1.0])
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
        shape, tip, force = (figure.add_subplot(grid[place]) for place in (np.s_[:, 0], np.s_[0, 1], np.s_[1, 1]))
    _shapes(motion, snapshots, shape)
    _tip(motion, tip)
    tip.set_xlabel("")
    _tension(motion, force)
    heading(figure, f"{title(motion)}: {motion.text}")
    return figure


def panels(motion: Motion, snapshots: ArrayLike = SNAPSHOT_TIMES) -> Panels:
    """Return the panels: the arm at ``snapshots`` [s], its tip, the tensions of the first segment."""
    return {
        "shape": partial(_shapes, motion, snapshots),
        "tip": partial(_tip, motion),
        "force": partial(_tension, motion),
    }


def _shapes(motion: Motion, snapshots: ArrayLike, panel: Axes, **style: Any) -> Axes:
    """Draw the arm at ``snapshots`` [s] and the tip's path."""
    scale, unit = scaled(panel.xaxis, motion.positions, "m")
    times, positions = motion.snapshots(snapshots)
    if len(times) == 0:
        times, positions = motion.snapshots([motion.time[-1]])
    draw_arm(panel, scale * motion.positions[0], GREY, "start", dashed=True)
    for k, (time, nodes) in enumerate(zip(times, positions, strict=True)):
        part = (k + 1) / len(times)
        draw_arm(panel, scale * nodes, part * _DARK + (1 - part) * _LIGHT, f"{time:.3g} s")
    look: dict[str, Any] = {"color": ORANGE, "linewidth": 1.0, "label": "tip's path"} | style
    panel.plot(*(scale * motion.tip).T, **look)
    _frame(panel, scale, motion, unit)
    panel.legend(fontsize="small", loc="best", framealpha=0.85)
    return panel


def _tip(motion: Motion, panel: Axes, **style: Any) -> Axes:
    """Draw the tip's displacement over time."""
    looks = {"x": {"color": GREY}, "y": {"color": BLUE}}
    return _pair(panel, motion.time, motion.tip - motion.tip[0], ("tip's displacement", "m"), looks, style)


def _tension(motion: Motion, panel: Axes, **style: Any) -> Axes:
    """Draw the tensions along both faces of the first segment over time."""
    looks = {"+normal face": {"color": ORANGE}, "\N{MINUS SIGN}normal face": {"color": BLUE, "linestyle": "--"}}
    return _pair(panel, motion.time, motion.first_segment_force, ("tension in segment 1", "N"), looks, style)


def _pair(
    panel: Axes,
    time: Array,
    waves: Array,
    quantity: tuple[str, str],
    looks: Mapping[str, Mapping[str, str]],
    style: Mapping[str, Any],
) -> Axes:
    """Draw two ``waves`` (t, 2) of a quantity (name, unit); ``looks`` by label."""
    for (label, look), wave in zip(looks.items(), waves.T, strict=True):
        factor, unit = scaled(panel.yaxis, waves, quantity[1])
        drawn: dict[str, Any] = {"linewidth": 1.2, "label": label, **look, **style}
        panel.plot(time, factor * wave, **drawn)
    panel.set(xlabel="time [s]", ylabel=axis_label(quantity[0], unit))
    panel.margins(x=0.01)
    plain(panel)
    legend_above(panel)
    return panel


def animate(
    motion: Motion,
    path: str | Path,
    *,
    frames_per_second: float = 25.0,
    portrait: tuple[Array, Array] | None = None,
    portrait_labels: tuple[str, str] = ("y_1", "y_2"),
) -> None:
    """Write an animation in real time, .gif or .mp4; ``portrait`` adds a side panel.

    ``portrait``: two arrays (t,) at the motion's times, such as two neurons' outputs, drawn as a phase portrait whose
    point moves with the arm. At most `MOST_FRAMES` frames: a longer motion has fewer a second. Raises InputError for a
    path or a portrait that cannot be used.
    """
    target = Path(path)
    require_animation(target)
    if portrait is not None and any(np.shape(values) != motion.time.shape for values in portrait):
        raise InputError(f"portrait: give two arrays of {len(motion.time)} values, one for each sample")
    duration = float(motion.time[-1] - motion.time[0])
    count = int(np.clip(np.floor(duration * frames_per_second) + 1, 2, MOST_FRAMES))
    times = np.linspace(motion.time[0], motion.time[-1], count)
    frames = np.abs(motion.time - times[:, None]).argmin(axis=1)
    count_of = 1 if portrait is None else 2
    figure = blank((2.8 * (count_of + 1), 4.2), dpi=FRAME, stacked=4.2 * count_of)
    columns = beside(count_of)
    stage, *sides = figure.subplots(count_of // columns, columns, squeeze=False).flat
    scale, unit = engineering(motion.positions, "m")
    path_line = stage.plot([], [], color=ORANGE, linewidth=0.9)[0]
    body = stage.fill([0, 0, 0], [0, 0, 0], facecolor="#9ecae1", edgecolor=BLUE, linewidth=1.2)[0]
    rods = stage.plot([], [], color=BLUE, linewidth=0.5)[0]
    before = _frame(stage, scale, motion, unit)
    heading = stage.set_title("", fontsize="medium")
    moving: list[Any] = [path_line, body, rods, *before, heading]
    if portrait is not None:
        (side,) = sides
        side.plot(*portrait, color=GREY, linewidth=0.9)
        point = side.plot([], [], "o", color=ORANGE, markersize=6)[0]
        moving.append(point)
        side.set(xlabel=portrait_labels[0], ylabel=portrait_labels[1])
        side.grid(alpha=0.25, linewidth=0.6)
    heading.set_text(title(motion))

    def draw(frame: int) -> None:
        nodes = scale * motion.positions[frame]
        path_line.set_data(*(scale * motion.tip[: frame + 1]).T)
        body.set_xy(_outline(nodes))
        rods.set_data(*_rods(nodes))
        heading.set_text(f"{title(motion)}, {motion.time[frame]:.2f} s")
        if portrait is not None:
            point.set_data([portrait[0][frame]], [portrait[1][frame]])

    write_frames(figure, target, frames.tolist(), draw, moving, (count - 1) / duration)


def title(motion: Motion) -> str:
    return f"{motion.arm.formulation}, {motion.arm.segments} segments"


def _outline(nodes: Array) -> Array:
    """The arm's outline (2 n + 2, 2)."""
    return np.concatenate([nodes[:, 0], nodes[::-1, 1]])


def _rods(nodes: Array) -> Array:
    """All rods as one broken line (2, 3 (n + 1))."""
    gaps = np.full((len(nodes), 1, 2), np.nan)
    return np.concatenate([nodes, gaps], axis=1).reshape(-1, 2).T


def draw_arm(axes: Axes, nodes: Array, colour: Any, label: str, *, dashed: bool = False) -> None:
    from matplotlib.colors import to_rgb

    face, style = ("none", ":") if dashed else ((*to_rgb(colour), 0.35), "-")
    axes.fill(*_outline(nodes).T, facecolor=face, edgecolor=colour, linewidth=1.0, linestyle=style, label=label)


def _frame(axes: Axes, scale: float, motion: Motion, unit: str) -> list[Any]:
    """Set limits that hold the whole motion, equal scales unless it is flat; draw clamp and plane, and return them."""
    points = scale * motion.positions.reshape(-1, 2)
    low, high = points.min(axis=0), points.max(axis=0)
    centre, extent = (low + high) / 2, np.maximum(high - low, 1e-9)
    flat = extent.min() < _FLAT * extent.max()
    half = 0.55 * extent if flat else np.maximum(extent.max() * np.array([0.55, 0.42]), 0.55 * extent)
    low, high = centre - half, centre + half
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    if flat:
        axes.text(
            0.98, 0.02, "scales of x and y differ", transform=axes.transAxes, ha="right", fontsize="small", color=GREY
        )
    else:
        axes.set_aspect("equal", adjustable="box")
    clamp = scale * motion.positions[0, 0]
    middle = clamp.mean(axis=0)
    reach = (clamp[0] - clamp[1]) * (1.0 if flat else max(1.0, 0.06 * half.max() / np.ptp(clamp, axis=0).max()))
    before: list[Any] = axes.plot(
        *np.stack([middle - reach, middle + reach]).T, color="black", linewidth=3, solid_capstyle="butt"
    )
    plane = motion.arm.plane
    if plane is not None:
        point, along = scale * np.array(plane.point), np.array([-plane.normal[1], plane.normal[0]])
        before.append(axes.axline(tuple(point), tuple(point + along), color=GREY, linewidth=1.5))
    axes.grid(alpha=0.25, linewidth=0.6)
    return before
