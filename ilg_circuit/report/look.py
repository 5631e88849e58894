"""How large pictures are and how they look: ``--size``, ``--style`` and ``size=``, ``style=``, decided in one place.

Within `look` figures are made of the size that was asked for, with text that is legible there, and are drawn and
written with the settings of a style file. Fonts in files are TrueType, and text in SVG is text.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError, visible
from ..units import parse

if TYPE_CHECKING:
    import matplotlib.figure

_INCH = 0.0254
#: Smallest and largest side [m] of a picture, and largest ratio of its sides.
_LEAST, _MOST, _LONGEST = 0.02, 1.2, 8.0
#: Below this width [inch] panels stand one above the other, as in a column of a paper.
_NARROW = 4.6
#: Size of text [pt] in a picture of its own size, the least size in a smaller one, and the width [inch] down to which
#: it shrinks with the picture. "small", the smallest text that is used, is 0.833 of it: more than 6 pt.
_TEXT, _LEAST_TEXT, _WIDE = 10.0, 7.5, 7.5
#: What a style file must not change: they belong to windows and to the machine.
_NOT_STYLE = ("backend", "interactive", "toolbar", "timezone", "webagg.", "savefig.directory", "figure.max_open")
#: What all files have: TrueType fonts, which publishers ask for, not Type 3; text in SVG stays text.
_FILES = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}


@dataclass(frozen=True)
class Look:
    """Width and height [inch] of a picture, None for its own, and the settings of a style file."""

    width: float | None = None
    height: float | None = None
    settings: tuple[tuple[str, Any], ...] = ()

    @property
    def text(self) -> float:
        """Return the base size of text [pt]."""
        return _TEXT if self.width is None else min(max(_TEXT * self.width / _WIDE, _LEAST_TEXT), _TEXT)

    @property
    def narrow(self) -> bool:
        """True for a picture as wide as one column of a paper."""
        return self.width is not None and self.width < _NARROW


#: Every picture in its own size and style.
OWN = Look()
_LOOK: ContextVar[Look] = ContextVar("look", default=OWN)


def narrow() -> bool:
    """Return True where panels should stand one above the other."""
    return _LOOK.get().narrow


def beside(count: int) -> int:
    """Return how many of ``count`` panels stand side by side."""
    return 1 if narrow() else count


def sized(own: tuple[float, float], *, stacked: float | None = None) -> tuple[float, float]:
    """Return the size [inch] of a figure whose ``own`` size is known.

    A width alone scales the height, too, but not below the share that text shrinks to. ``stacked`` is the own height
    where panels stand one above the other.
    """
    now = _LOOK.get()
    if now.width is None:
        return own
    if now.height is not None:
        return now.width, now.height
    tall = stacked if now.narrow and stacked is not None else own[1]
    return now.width, min(tall * max(now.width / own[0], now.text / _TEXT), _MOST / _INCH)


def size_of(given: str | tuple[str | float, ...] | float | None, what: str = "size") -> tuple[float, float | None]:
    """Return width and height [inch] of "85mm", "85mm,60mm" or numbers [m]; the height is None where not given.

    Raises InputError where it is no size of a picture.
    """
    parts = given.split(",") if isinstance(given, str) else [*given] if isinstance(given, tuple | list) else [given]
    if len(parts) not in (1, 2):
        raise InputError(f"{what} '{visible(str(given))}': give a width, or width and height, such as 85mm,60mm")
    sides = []
    for part in parts:
        if isinstance(part, str):
            side = parse(part.strip(), "m", what)
        elif isinstance(part, int | float) and not isinstance(part, bool):
            side = float(part)
        else:
            raise InputError(f"{what} is {type(part).__name__}; give a text such as 85mm or 85mm,60mm")
        if not _LEAST <= side <= _MOST:
            raise InputError(f"{what} '{visible(str(part))}': a picture's side is from 20 mm to 1200 mm, such as 85mm")
        sides.append(side / _INCH)
    if max(sides) > _LONGEST * min(sides):
        raise InputError(f"{what} '{visible(str(given))}': one side is more than {_LONGEST:g} times the other")
    return sides[0], sides[1] if len(sides) == 2 else None


def style_of(path: str | Path, what: str = "style") -> dict[str, Any]:
    """Return the settings of a matplotlib style file, less those that belong to a machine.

    Raises InputError for a file that cannot be read or is no style file.
    """
    from matplotlib import rc_params_from_file

    name = visible(str(path))
    if not Path(path).is_file():
        raise InputError(f"{what}: there is no file '{name}'; give a matplotlib style file (name.mplstyle)")
    noted = _Noted()
    logger = logging.getLogger("matplotlib")
    before = logger.propagate, logger.level, logger.handlers[:]
    logger.propagate, logger.handlers[:] = False, [noted]
    logger.setLevel(logging.WARNING)
    try:
        settings = dict(rc_params_from_file(str(path), fail_on_error=True, use_default_template=False))
    except (OSError, UnicodeDecodeError, ValueError, KeyError, TypeError) as error:
        noted.lines.append(str(error))
        settings = {}
    finally:
        logger.propagate, logger.handlers[:] = before[0], before[2]
        logger.setLevel(before[1])
    if noted.lines or not settings:
        why = visible(" ".join(noted.lines[0].split())[:120]) if noted.lines else "it has no settings"
        raise InputError(f"{what}: '{name}' is no matplotlib style file: {why}; give lines such as font.size: 8")
    return {key: value for key, value in settings.items() if not key.startswith(_NOT_STYLE)}


class _Noted(logging.Handler):
    """Keeps what matplotlib says of a style file."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


def chosen(size: Any = None, style: str | Path | None = None, whats: tuple[str, str] = ("size", "style")) -> Look:
    """Return the look of a ``size`` and a ``style`` file, either of them None. Raises InputError as these do."""
    settings = {} if style is None else style_of(style, whats[1])
    width, height = (None, None) if size is None else size_of(size, whats[0])
    if width is None and "figure.figsize" in settings:
        width, height = settings["figure.figsize"]
    return Look(width, height, tuple(settings.items()))


@contextmanager
def look(now: Look) -> Iterator[None]:
    """Within the block figures are made, drawn and written in this look."""
    from matplotlib import rc_context

    base: dict[Any, Any] = {"font.size": now.text} if now.width is not None else {}
    if now.text < _TEXT:
        base |= dict.fromkeys(("xtick.labelsize", "ytick.labelsize"), "small")
    token = _LOOK.set(now)
    try:
        with rc_context(base | dict(now.settings)):
            yield
    finally:
        _LOOK.reset(token)


@contextmanager
def files() -> Iterator[None]:
    """Within the block pictures are written with TrueType fonts, whatever the settings of the process say."""
    from matplotlib import rc_context

    settings: dict[Any, Any] = dict(_FILES)
    with rc_context(settings):
        yield


def finish(figure: matplotlib.figure.Figure, palette: tuple[str, ...]) -> None:
    """Give lines and marks the thickness of a narrow picture, and the colours and widths that the style file names.

    ``palette`` are the colours that the picture was drawn with, in the order in which the style's replace them.
    """
    now = _LOOK.get()
    settings = dict(now.settings)
    factor = settings["lines.linewidth"] / 1.5 if "lines.linewidth" in settings else now.text / _TEXT
    cycle = settings["axes.prop_cycle"].by_key().get("color", []) if "axes.prop_cycle" in settings else []
    if factor == 1.0 and not cycle:
        return
    from matplotlib.collections import Collection
    from matplotlib.colors import to_rgba
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    new = {to_rgba(old)[:3]: to_rgba(cycle[k % len(cycle)])[:3] for k, old in enumerate(palette) if cycle}

    def replaced(colour: Any) -> Any:
        if isinstance(colour, str) and colour in ("none", "auto"):
            return colour
        rgba = to_rgba(colour)
        return (*new.get(rgba[:3], rgba[:3]), rgba[3])

    for artist in figure.findobj(lambda a: isinstance(a, Line2D | Collection | Patch)):
        if isinstance(artist, Line2D):
            artist.set_linewidth(artist.get_linewidth() * factor)
            artist.set_markersize(artist.get_markersize() * factor**0.5)
            for part in ("color", "markerfacecolor", "markeredgecolor"):
                getattr(artist, f"set_{part}")(replaced(getattr(artist, f"get_{part}")()))
        elif isinstance(artist, Patch):
            artist.set(facecolor=replaced(artist.get_facecolor()), edgecolor=replaced(artist.get_edgecolor()))
        elif isinstance(artist, Collection) and artist.get_array() is None:
            artist.set(
                facecolor=[replaced(c) for c in artist.get_facecolor()],
                edgecolor=[replaced(c) for c in artist.get_edgecolor()],
            )
