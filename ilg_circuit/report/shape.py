"""Presents the shape of a strip over time: text, picture, animation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..simulation.shape import Shape
from ..units import format_quantity
from .animation import FRAME, MOST_FRAMES, require_animation, write_frames
from .axes import BLUE, GREY, Axes, Figure, Panels, blank, engineering, heading, legend_above, plain, scaled
from .tables import aligned

#: Strips drawn in one picture; seconds that an animation lasts at most, and frames a second.
_STRIPS, _LASTS, _RATE = 12, 8.0, 20.0
_MECHANICS = {
    "free": "free of weight and load",
    "elastica": "at rest in each instant",
    "arm": "with its inertia",
}
#: Names of colour maps and of the colour of time.
_COLOURS = "viridis"


def summary(shape: Shape) -> str:
    """Return headline and facts as text."""
    return "\n".join([headline(shape), *aligned(facts(shape), "<<", indent="  ")])


def headline(shape: Shape) -> str:
    """Return one line: the strip, its drive, the mechanics, the number of instants."""
    return (
        f"shape of {shape.text}, {_MECHANICS[shape.mechanics]}: {len(shape.time)} instants, {len(shape.s)} places "
        f"along {format_quantity(float(shape.s[-1]), 'm', 4)}"
    )


def facts(shape: Shape) -> list[tuple[str, str]]:
    """Return where the tip is at the end and where it is farthest from the straight strip, and the largest angle."""
    far = int(np.abs(shape.tip[:, 1]).argmax())
    turn = np.unravel_index(int(np.abs(shape.angle).argmax()), shape.angle.shape)
    return [
        ("tip at the end", _place(shape, len(shape.time) - 1)),
        ("tip farthest to a side", f"{_place(shape, far)} at {format_quantity(float(shape.time[far]), 's', 4)}"),
        (
            "largest angle",
            f"{np.degrees(shape.angle[turn]):.4g} deg, {format_quantity(float(shape.s[turn[1]]), 'm', 4)} from the "
            f"clamp at {format_quantity(float(shape.time[turn[0]]), 's', 4)}",
        ),
    ]


def figure(shape: Shape) -> Figure:
    """Return the strip at several instants, to scale and coloured by time, and its tip over time."""
    low, high = _limits(shape, 1.0)
    flat = float((high - low)[1] / (high - low)[0])
    figure = blank((7.5, float(np.clip(2.9 + 6.0 * flat, 3.6, 8.5))), stacked=5.5)
    strips, tip = figure.subplots(2, 1, height_ratios=[max(flat, 0.2), 0.3])
    _strips(shape, strips)
    _tip(shape, tip)
    heading(figure, f"{shape.text}: shape {_MECHANICS[shape.mechanics]}")
    return figure


def panels(shape: Shape) -> Panels:
    """Return the panels: the strip at several instants, its tip over time."""
    return {"shape": partial(_strips, shape), "tip": partial(_tip, shape)}


def animate(shape: Shape, path: str | Path) -> None:
    """Write an animation of the strip, .gif or .mp4: in real time, or faster where that takes more than 8 s.

    Raises InputError for a path that cannot be used.
    """
    target = Path(path)
    require_animation(target)
    duration = float(shape.time[-1] - shape.time[0])
    lasts = min(max(duration, 0.04), _LASTS)
    count = int(np.clip(np.floor(lasts * _RATE) + 1, 1, min(MOST_FRAMES, len(shape.time))))
    frames = np.abs(shape.time - np.linspace(shape.time[0], shape.time[-1], count)[:, None]).argmin(axis=1)
    scale, unit = engineering(shape.s, "m")
    low, high = _limits(shape, scale)
    flat = float((high - low)[1] / (high - low)[0])
    figure = blank((6.0, float(np.clip(1.2 + 5.4 * flat, 2.2, 6.5))), dpi=FRAME, stacked=4.0)
    stage = figure.subplots()
    path_line = stage.plot([], [], color=GREY, linewidth=0.9)[0]
    strip = stage.plot([], [], color=BLUE, linewidth=2.5, solid_capstyle="butt")[0]
    clamp = _frame(stage, shape, scale, unit)
    faster = f", {duration / lasts:.3g} times as fast" if duration > 1.05 * lasts else ""
    title = stage.set_title(f"{shape.text}{faster}: {shape.time[-1]:.5g} s", fontsize="small")

    def draw(frame: int) -> None:
        path_line.set_data(*(scale * shape.tip[: frame + 1]).T)
        strip.set_data(scale * shape.x[frame], scale * shape.y[frame])
        title.set_text(f"{shape.text}{faster}: {shape.time[frame]:.5g} s")

    draw(int(frames[-1]))
    write_frames(figure, target, frames.tolist(), draw, (path_line, strip, clamp, title), max(count - 1, 1) / lasts)


def _strips(shape: Shape, panel: Axes, **style: Any) -> Axes:
    """Draw the strip at several instants, coloured by time, with the tip's path."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale, unit = scaled(panel.xaxis, shape.s, "m")
    colour = ScalarMappable(Normalize(float(shape.time[0]), float(shape.time[-1])), colormaps[_COLOURS].reversed())
    panel.plot(*(scale * shape.tip).T, color=GREY, linewidth=0.8, linestyle=":")
    for k in _instants(shape):
        look: dict[str, Any] = {"color": colour.to_rgba(shape.time[k]), "linewidth": 1.8} | style
        panel.plot(scale * shape.x[k], scale * shape.y[k], **look)
    _frame(panel, shape, scale, unit)
    whole = panel.get_figure(root=True)
    assert whole is not None
    whole.colorbar(colour, ax=panel, label="time [s]", fraction=0.04, pad=0.02)
    return panel


def _tip(shape: Shape, panel: Axes, **style: Any) -> Axes:
    """Draw the tip's way along and across the clamp's direction over time."""
    ways = {"x less length": shape.x[:, -1] - shape.s[-1], "y": shape.y[:, -1]}
    for (label, values), colour in zip(ways.items(), (GREY, BLUE), strict=True):
        factor, unit = scaled(panel.yaxis, np.concatenate([*ways.values()]), "m")
        look: dict[str, Any] = {"color": colour, "linewidth": 1.4, "label": label} | style
        panel.plot(shape.time, factor * values, **look)
    panel.set(xlabel="time [s]", ylabel=f"tip [{unit}]")
    panel.margins(x=0.01)
    plain(panel)
    legend_above(panel)
    return panel


def _instants(shape: Shape) -> NDArray[np.intp]:
    """Return the samples that are drawn: after equal parts of the tip's way, and where the tip is farthest away."""
    way = np.linalg.norm(np.diff(shape.tip, axis=0), axis=1)
    progress = np.append(0.0, np.cumsum(way / max(float(way.sum()), 1e-300)))
    parts = np.linspace(0.0, progress[-1], _STRIPS)
    y = shape.tip[:, 1]
    ends = [0, len(y) - 1, int(y.argmin()), int(y.argmax())]
    return np.unique(np.append(np.searchsorted(progress, parts * (1 - 1e-12)), ends))


def _limits(shape: Shape, scale: float) -> tuple[Array, Array]:
    """Return the corners (2,) of what an axes has to hold: the strip at all times, with a margin."""
    points = scale * np.stack([shape.x, shape.y], axis=-1).reshape(-1, 2)
    points = np.concatenate([points, [[0.0, 0.0]]])
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 0.04 * float((high - low).max())
    return low - edge, high + edge


def _frame(panel: Axes, shape: Shape, scale: float, unit: str) -> Any:
    """Set equal scales and limits that hold the strip at all times; draw the clamp, and return it."""
    low, high = _limits(shape, scale)
    panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    panel.set_aspect("equal", adjustable="box")
    half = 0.03 * float((high - low).max())
    panel.grid(alpha=0.25, linewidth=0.6)
    return panel.plot([0.0, 0.0], [-half, half], color="black", linewidth=3, solid_capstyle="butt")[0]


def _place(shape: Shape, k: int) -> str:
    return f"({', '.join(format_quantity(float(c), 'm', 5) for c in shape.tip[k])})"
