"""Colours, units and panels of all pictures, and the one way to write them; `look` says how large they are."""

from __future__ import annotations

import contextlib
import logging
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import Drive
from ..errors import InputError, SolveError, argument, visible
from ..files import replacing, require_writable
from ..provenance import Provenance
from .look import beside, files, finish, narrow, sized

if TYPE_CHECKING:
    import matplotlib.axes
    import matplotlib.figure

#: The types of every picture: matplotlib itself is loaded only where one is drawn.
Axes: TypeAlias = "matplotlib.axes.Axes"
Figure: TypeAlias = "matplotlib.figure.Figure"
#: Panel name -> function that draws the panel on given axes; its keywords style the main curve.
Panels: TypeAlias = Mapping[str, Callable[..., Any]]

_PREFIXES = ((1e-15, "f"), (1e-12, "p"), (1e-9, "n"), (1e-6, "u"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
#: Okabe and Ito's colours: colour-blind readers can tell them apart. Their order alternates in lightness, so that the
#: first ones differ in grey, too. Curves of one panel also differ in line style (`STYLES`).
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#6b6b6b"
#: Axes of designs over more than this ratio are logarithmic.
DECADES = 8.0
#: Colours of the curves of a panel.
COLOURS = (BLUE, ORANGE, "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c7a00")
#: Line styles of these curves, in the same order.
STYLES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (6, 1.5)), (0, (3, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2, 2, 2)))
#: How a fit is drawn.
FIT: dict[str, Any] = {"color": BLUE, "linewidth": 1.5, "label": "fit"}
#: A jump's left limit is drawn this much of the run before it.
ROUNDING = 1e-9
#: Sharpness [points an inch] of a picture on a screen, and of one whose size was given, for print.
_SCREEN, _PRINT = 150, 300
#: Number of points up to which all are drawn, and of cells along and across a panel that hold one each beyond that.
_MOST_POINTS, _CELLS = 50_000, (1500, 200)


#: True while new figures are made through pyplot, which a notebook shows.
_PYPLOT: ContextVar[bool] = ContextVar("pyplot", default=False)
#: Axis -> (SI unit, factor, unit of its numbers), set by the first curve drawn on it.
_SCALES: WeakKeyDictionary[Any, tuple[str, float, str]] = WeakKeyDictionary()


def engineering(values: Array, unit: str) -> tuple[float, str]:
    """Return the factor and the unit (with a prefix) that give ``values`` [``unit``] a readable size."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if largest == 0:
        return 1.0, unit
    size, prefix = max((p for p in _PREFIXES if p[0] <= largest * 1.0001), default=_PREFIXES[0])
    return 1 / size, f"{prefix}{unit}".replace("u", "\N{MICRO SIGN}", 1 if prefix == "u" else 0)


def scaled(axis: Any, values: Array, unit: str) -> tuple[float, str]:
    """Return `engineering` of ``values``; on an ``axis`` with a curve, the factor and unit of that curve."""
    known = _SCALES.get(axis)
    if known is None or known[0] != unit or not axis.axes.has_data():
        known = _SCALES[axis] = (unit, *engineering(values, unit))
    return known[1:]


def curve(panel: Axes, x: Array, values: Array, name: str, unit: str, **style: Any) -> float:
    """Draw ``values`` [``unit``] over ``x``, name the axis, and return the factor by which they are drawn."""
    factor, label = scaled(panel.yaxis, values, unit)
    look: dict[str, Any] = {"color": BLUE, "linewidth": 1.4} | style
    panel.plot(x, factor * values, **look)
    panel.set_ylabel(axis_label(name, label))
    return factor


@contextmanager
def through_pyplot() -> Iterator[None]:
    """Make new figures through pyplot within the block; close those that an exception leaves unfinished."""
    from matplotlib import pyplot

    before, token = set(pyplot.get_fignums()), _PYPLOT.set(True)
    try:
        yield
    except BaseException:
        for number in set(pyplot.get_fignums()) - before:
            pyplot.close(number)
        raise
    finally:
        _PYPLOT.reset(token)


def blank(size: tuple[float, float], dpi: int = _SCREEN, *, stacked: float | None = None) -> Figure:
    """Return an empty figure of ``size`` [inch]: one that needs no display, or pyplot's within `through_pyplot`.

    Another size that was asked for counts; ``stacked`` is the height where panels stand one above the other.
    """
    now = sized(size, stacked=stacked)
    how: dict[str, Any] = {"figsize": now, "layout": "constrained"}
    if now != size:
        dpi = max(dpi, _PRINT)
    if _PYPLOT.get():
        from matplotlib import pyplot

        return pyplot.figure(FigureClass=_figure_class(), **how)
    figure: Figure = _figure_class()(dpi=dpi, **how)
    return figure


def as_written(words: Any) -> None:
    """Show a text without formulas, and its control characters as text."""
    words.set_parse_math(False)
    words.set_usetex(False)
    words.set_text("\n".join(map(visible, words.get_text().split("\n"))))


@lru_cache(maxsize=1)
def _figure_class() -> Any:
    """Return the class of all figures, which draws text as it is written.

    Otherwise matplotlib would read dollar signs and backslashes in names as formulas, and warn of missing glyphs.
    """
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from matplotlib.ticker import LogFormatter

    class WordsFigure(Figure):
        _aligned: Any = ()

        def align_ylabels(self, axs: Any = None) -> None:
            # after the layout, whose margins hold the label that is farthest out: before it every axis would measure
            # the ticks of all others
            self._aligned = [*self._aligned, axs]

        def draw(self, renderer: Any) -> None:
            axes = [axis for panel in self.axes for axis in (panel.xaxis, panel.yaxis)]
            powers = [axis for axis in axes if isinstance(axis.get_major_formatter(), LogFormatter)]
            ticks = (tick for axis in powers for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()))
            formulas = {label for tick in ticks for label in (tick.label1, tick.label2)}
            for words in set(self.findobj(Text)) - formulas:
                as_written(words)
            saving = self.canvas.is_saving()
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
                warnings.filterwarnings("error" if saving else "ignore", "constrained_layout not applied", UserWarning)
                engine = self.get_layout_engine()
                try:
                    if engine and self.axes and saving and "open_group" in vars(renderer):
                        # before it saves, matplotlib draws once with a renderer that draws nothing, for the layout
                        with contextlib.suppress(ValueError):
                            engine.execute(self)
                        self._align()
                    else:
                        self._align()
                        super().draw(renderer)
                except UserWarning as collapsed:
                    width, height = 25.4 * self.get_size_inches()
                    raise SolveError(
                        f"a picture of {width:.3g} mm x {height:.3g} mm is too small for its panels; give it a larger "
                        f"{argument('size')}"
                    ) from collapsed

        def _align(self) -> None:
            for axs in self._aligned:
                super().align_ylabels(axs)
            self._aligned = ()

    return WordsFigure


def load_plainly() -> None:
    """Import matplotlib for a command, ignoring any matplotlibrc, style, backend or configuration folder."""
    if "matplotlib" in sys.modules:
        return
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it would tell of a home that cannot be written
    os.environ.pop("MPLBACKEND", None)
    os.environ["MATPLOTLIBRC"] = os.devnull
    # a matplotlibrc in the working folder would take precedence over MATPLOTLIBRC
    with contextlib.chdir(Path(__file__).parent) if Path("matplotlibrc").exists() else contextlib.nullcontext():
        import matplotlib  # noqa: F401 - it reads its settings as it is imported


def grid(rows: int, columns: int, size: tuple[float, float], **shared: Any) -> tuple[Figure, Any]:
    """Return a figure of ``size`` [inch] and its panels (rows, columns)."""
    figure = blank(size)
    panels = figure.subplots(rows, columns, squeeze=False, **shared)
    for panel in panels.flat:
        plain(panel)
    return figure, panels


def new_figure(rows: int, heights: list[float]) -> tuple[Figure, list[Axes]]:
    """Return a figure that needs no display, with ``rows`` panels over one time axis."""
    figure, panels = grid(rows, 1, (7.5, 1.0 + sum(heights)), sharex=True, height_ratios=heights)
    for panel in panels.flat:
        panel.margins(x=0.01)
    return figure, list(panels.flat)


def tiles(count: int, columns: int, height: float, width: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with ``count`` panels of ``width`` and ``height`` [inch] in rows of at most ``columns``."""
    columns = beside(columns)
    rows = -(-count // columns)
    figure, panels = grid(rows, columns, (max(width * columns, 5.5), height * rows + 0.9))
    for panel in panels.flat[count:]:
        panel.set_visible(False)
    return figure, list(panels.flat[:count])


def plain(panel: Axes) -> None:
    """Draw the common grid on a panel, and hide its upper and right frame."""
    panel.grid(alpha=0.25, linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def legend_above(panel: Axes) -> None:
    """Place the legend above the panel, where it hides nothing."""
    panel.legend(
        fontsize="small", frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2 if narrow() else 6,
        handlelength=1.8,
        columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def legend_below(figure: Figure, panels: Iterable[Axes], columns: int | None = None) -> None:
    """Draw one legend below a figure, with each label of its ``panels`` once."""
    found = [panel.get_legend_handles_labels() for panel in panels]
    handles = {label: handle for some, labels in found for handle, label in zip(some, labels, strict=True)}
    style: dict[str, Any] = {"ncols": columns or beside(2), "frameon": False, "fontsize": "small"}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", **style)


def heading(figure: Figure, text: str) -> None:
    """Write a heading over a figure, in as many lines as it needs."""
    figure.suptitle(_wrapped(text, figure.get_figwidth(), "medium"), fontsize="medium")


def caption(panel: Axes, text: str) -> None:
    """Write a caption over a panel, in as many lines as it needs."""
    spec, figure = panel.get_gridspec(), panel.get_figure(root=True)
    assert figure is not None
    width = figure.get_figwidth() / (spec.ncols if spec else 1) - 0.4
    panel.set_title(_wrapped(text, width, "small"), fontsize="small", loc="left")


def _wrapped(text: str, width: float, size: str) -> str:
    from matplotlib.font_manager import FontProperties

    # a text in two parts is broken between them
    letters = width * 72 / (0.58 * float(FontProperties(size=size).get_size_in_points()))
    most = max(int(letters), 20)
    parts = [text] if len(text) <= most else re.split(r"(?<=[:;]) ", text)
    lines = [line for part in parts for line in wrap(part, most, break_long_words=False, break_on_hyphens=False)]
    return "\n".join(lines)


def jumps_of(drive: Drive, time: Array) -> Array:
    """Return the times [s] at which a drive jumps within ``time``, its end included."""
    jumps = drive.jumps(float(time[-1]) * (1 + ROUNDING))
    return np.minimum(jumps[jumps > time[0]], time[-1])


def drive_points(drive: Drive, time: Array) -> tuple[Array, Array]:
    """Return a drive at ``time`` [s], with the values on both sides of each jump, so that jumps are vertical."""
    jumps = jumps_of(drive, time)
    times = np.unique(np.concatenate([time, np.maximum(jumps - ROUNDING * time[-1], time[0]), jumps]))
    return times, drive.value(times)


def with_jumps(time: Array, values: Array, jumps: Array) -> tuple[Array, Array]:
    """Return a curve with two points at each of the ``jumps`` [s]: the values on both sides, so that it is vertical.

    Samples are right limits. The left limit goes on from the samples before the jump, the right one from those after.
    """
    ends = np.searchsorted(time, jumps - ROUNDING * time[-1]).tolist()
    pieces = [slice(a, b) for a, b in zip([0, *ends], [*ends, len(time)], strict=True)]
    x, y = [time[pieces[0]]], [values[pieces[0]]]
    for at, before, after in zip(jumps.tolist(), pieces, pieces[1:], strict=False):
        for piece, first in ((before, -2), (after, 0)):
            if time[piece].size:
                x.append(np.array([at]))
                y.append(np.array([_continued(time[piece], values[piece], at, first)]))
        x.append(time[after])
        y.append(values[after])
    return np.concatenate(x), np.concatenate(y)


def _continued(time: Array, values: Array, at: float, first: int) -> float:
    """Return the line through two samples (``first`` and the next one) at a time; the value of a single sample."""
    if len(time) < 2:
        return float(values[0])
    (t0, t1), (y0, y1) = time[first:][:2], values[first:][:2]
    return float(y0 + (y1 - y0) / (t1 - t0) * (at - t0))


def distinct(x: Array, y: Array, *, logarithmic: bool = False) -> NDArray[np.intp]:
    """Return the rows, in order, of points (n,) of a panel that do not hide each other: all but those of long records.

    One point is drawn in each of so many cells that their width is less than a marker's; on a ``logarithmic`` axis
    points at or below 0 are not seen.
    """
    if len(x) <= _MOST_POINTS:
        return np.arange(len(x))
    seen = np.flatnonzero(x > 0) if logarithmic else np.arange(len(x))
    places = (np.log(x[seen]) if logarithmic else x[seen], y[seen])
    cells = np.zeros(len(seen), dtype=np.intp)
    for values, count in zip(places, _CELLS, strict=True):
        low, span = float(values.min()), float(np.ptp(values)) or 1.0
        cells = cells * count + np.minimum((count / span * (values - low)).astype(np.intp), count - 1)
    return seen[np.sort(np.unique(cells, return_index=True)[1])]


def axis_label(name: str, unit: str) -> str:
    """Return an axis label: ``name [unit]``, underscores as blanks."""
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")


def wide(values: Any, ratio: float) -> bool:
    """Return True for positive numbers whose largest is more than ``ratio`` times their smallest."""
    numbers = np.asarray(values)
    known = numbers.dtype.kind == "f" and numbers.size > 0
    return bool(known and np.nanmin(numbers) > 0 and np.nanmax(numbers) > ratio * np.nanmin(numbers))


def round_levels(values: Array) -> Array:
    """Return contour levels for positive values over decades: 1, 2 and 5 of each decade."""
    decades = np.arange(np.floor(np.log10(values.min())), np.log10(values.max()) + 1)
    levels = np.outer(10.0**decades, [1, 2, 5]).ravel()
    return np.asarray(levels[(levels > values.min()) & (levels < values.max())])


def logarithmic(panel: Axes, name: str) -> None:
    """Make axis ``name`` (x or y) logarithmic; label its ticks 0.1, 0.2, 0.5, 1 ... as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis = panel.xaxis if name == "x" else panel.yaxis
    getattr(panel, f"set_{name}scale")("log")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def require_picture(path: Path) -> None:
    """Raise InputError for a picture's path that cannot be written, or whose suffix cannot be drawn."""
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"cannot draw '{path}': end its name in .png, .pdf or .svg")
    require_writable(path)


def save(figure: Figure, path: str | Path, provenance: Provenance | None = None) -> None:
    """Write a picture, whole or not at all; the suffix (.png, .pdf, .svg) decides the format.

    The file's metadata hold its ``provenance``. Raises InputError for another suffix or a path that cannot be written,
    SolveError for a size that leaves no room for the panels.
    """
    target = Path(path)
    require_picture(target)
    picture = rendered(figure, target.suffix[1:].lower(), provenance)
    with replacing(target) as temporary:
        temporary.write_bytes(picture)


def rendered(
    figure: Figure, suffix: str = "png", provenance: Provenance | None = None, dpi: float | str = "figure"
) -> bytes:
    """Return the picture as the bytes of a file of that format."""
    picture = BytesIO()  # matplotlib leaves files open that it could not write
    with files():
        finish(figure, COLOURS)
        figure.savefig(picture, format=suffix, metadata=_metadata(provenance or Provenance(), suffix), dpi=dpi)
    return picture.getvalue()


def _metadata(provenance: Provenance, suffix: str) -> dict[str, str]:
    """Return the metadata under the keys that the format has for the program and the description."""
    program = "Software" if suffix == "png" else "Creator"
    description = "Subject" if suffix == "pdf" else "Description"
    written, *more = provenance.lines()
    return {program: written.removeprefix("written by ")} | ({description: "\n".join(more)} if more else {})
