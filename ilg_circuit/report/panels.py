"""Grids of panels that need no display, the palette of their curves, and logarithmic axes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .axes import BLUE, ORANGE, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (BLUE, ORANGE, "#3a8f4d", "#8b4fa8", "#b0892c", "#3f8f96", "#c2427a", "#444444")


def blank(size: tuple[float, float]) -> Figure:
    """Return an empty figure of ``size`` [inch]."""
    from matplotlib.figure import Figure

    return Figure(figsize=size, dpi=150, layout="constrained")


def grid(rows: int, columns: int, size: tuple[float, float], **shared: Any) -> tuple[Figure, Any]:
    """Return a figure of ``size`` [inch] and its panels (rows, columns)."""
    figure = blank(size)
    panels = figure.subplots(rows, columns, squeeze=False, **shared)
    for panel in panels.flat:
        plain(panel)
    return figure, panels


def tiles(count: int, columns: int, height: float, width: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with ``count`` panels of ``width`` and ``height`` [inch] in rows of ``columns``."""
    rows = -(-count // columns)
    figure, panels = grid(rows, columns, (max(width * columns, 5.5), height * rows + 0.9))
    for panel in panels.flat[count:]:
        panel.set_visible(False)
    return figure, list(panels.flat[:count])


def legend_below(figure: Figure, panels: Iterable[Axes]) -> None:
    """Give a figure one legend below, in two columns, with every label of its ``panels`` once."""
    found = [panel.get_legend_handles_labels() for panel in panels]
    handles = {label: handle for some, labels in found for handle, label in zip(some, labels, strict=True)}
    style: dict[str, Any] = {"ncols": 2, "frameon": False, "fontsize": 8}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", **style)


def axis_label(name: str, unit: str) -> str:
    """Return an axis label: ``name [unit]``, underscores as blanks."""
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")


def wide(values: Any, ratio: float) -> bool:
    """Return True for positive numbers whose largest is more than ``ratio`` times their smallest."""
    numbers = np.asarray(values)
    known = numbers.dtype.kind == "f" and numbers.size > 0
    return bool(known and np.nanmin(numbers) > 0 and np.nanmax(numbers) > ratio * np.nanmin(numbers))


def logarithmic(panel: Axes, name: str) -> None:
    """Make axis ``name`` (x or y) logarithmic, with ticks 0.1, 0.2, 0.5, 1 ... as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis = panel.xaxis if name == "x" else panel.yaxis
    getattr(panel, f"set_{name}scale")("log")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
