"""Colours, units and panels of all pictures, and the one way to write them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..files import replacing, require_writable
from ..provenance import Provenance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PREFIXES = ((1e-15, "f"), (1e-12, "p"), (1e-9, "n"), (1e-6, "u"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
BLUE, ORANGE, GREY = "#1f5fa8", "#d1601f", "#6b6b6b"


def engineering(values: Array, unit: str) -> tuple[float, str]:
    """Return factor and unit that bring ``values`` [``unit``] to numbers of a readable size."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if largest == 0:
        return 1.0, unit
    size, prefix = max((p for p in _PREFIXES if p[0] <= largest * 1.0001), default=_PREFIXES[0])
    return 1 / size, f"{prefix}{unit}".replace("u", "\N{MICRO SIGN}", 1 if prefix == "u" else 0)


def new_figure(rows: int, heights: list[float], width: float = 7.5) -> tuple[Figure, list[Axes]]:
    """Return a figure that needs no display, with ``rows`` panels over one time axis."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 1.0 + sum(heights)), dpi=150, layout="constrained")
    panels: Any = figure.subplots(rows, 1, sharex=True, height_ratios=heights, squeeze=False)
    axes = [panel for row in panels for panel in row]
    for panel in axes:
        plain(panel)
        panel.margins(x=0.01)
    return figure, axes


def plain(panel: Axes) -> None:
    """Give a panel the grid of all pictures, and no frame above and on the right."""
    panel.grid(alpha=0.25, linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def require_picture(path: Path) -> None:
    """Raise InputError for a picture's path that cannot be written, or whose suffix cannot be drawn."""
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"cannot draw '{path}': end its name in .png, .pdf or .svg")
    require_writable(path)


def save(figure: Figure, path: str | Path, provenance: Provenance | None = None) -> None:
    """Write a picture, whole or not at all; the suffix (.png, .pdf, .svg) decides the format.

    The file's metadata hold its ``provenance``. Raises InputError for another suffix or a path that cannot be written.
    """
    target = Path(path)
    require_picture(target)
    suffix = target.suffix[1:].lower()
    with replacing(target) as temporary:
        figure.savefig(temporary, format=suffix, metadata=_metadata(provenance or Provenance(), suffix))


def _metadata(provenance: Provenance, suffix: str) -> dict[str, str]:
    """The keys that a format has for the program and for a description."""
    program, description = {"png": ("Software", "Description"), "pdf": ("Creator", "Subject")}.get(
        suffix, ("Creator", "Description")
    )
    written, *more = provenance.lines()
    return {program: written.removeprefix("written by ")} | ({description: "\n".join(more)} if more else {})
