"""Methods common to all results: console text, notebook HTML, plots and files, made from the result's presenter.

A presenter is a module with ``headline(result)`` (a line), ``facts(result)`` (names and values, the most telling
first), ``panels(result)`` (name -> function that draws a panel on given axes and returns these; the most telling
first), ``summary(result)`` and ``figure(result)``, which draws by the same functions.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import IlgError, InputError, first_line, unknown_name
from ..files import require_writable, write_csv, write_json
from ..result import Result
from . import axes, look
from .page import Listing, Page, Section, picture, png, write_page
from .tables import aligned

#: Most lines of a result in a console, and most characters of one.
_LINES, _WIDTH = 10, 118
#: Suffixes of pictures; panels that may be drawn on one axes or on a pair.
_DRAWN, _PAIRS = (".png", ".pdf", ".svg"), ("bode",)
#: Size [inch], resolution [dpi] and largest data URI of the picture in a notebook; a larger picture is left out.
_SMALL, _SHARPNESS, _LONGEST = (5.4, 3.3), 88, 98_000


def brief(result: Result) -> str:
    """Return class, headline and facts in at most ten lines."""
    facts, more = _facts(result)
    lines = [f"{type(result).__name__}: {_line(_presenter(result).headline(result))}"]
    lines += aligned([(_line(name), _line(value)) for name, value in facts], "<<", indent="  ")
    return "\n".join(_cut(line) for line in [*lines, *([f"  {more}"] if more else [])])


def html(result: Result) -> str:
    """Return headline, facts, and the main panel as a small picture, as HTML that needs nothing else."""
    facts, more = _facts(result)
    rows = "".join(
        f'<tr><td style="text-align:left">{escape(_line(name))}</td>'
        f'<td style="text-align:left">{escape(_line(value))}</td></tr>'
        for name, value in [*facts, *([(more, "")] if more else [])]
    )
    name, headline = type(result).__name__, escape(_line(_presenter(result).headline(result)))
    return f"<div><b>{name}</b>: {headline}<table>{rows}</table>{_thumbnail(result)}</div>"


def _facts(result: Result) -> tuple[list[tuple[str, str]], str]:
    """Return the facts that fit, and a note on how many facts and warnings are left out."""
    facts = list(_presenter(result).facts(result))
    warnings, room = len(getattr(result, "warnings", ())), _LINES - 2
    left = len(facts) - room
    notes = [f"{left} more"] if left > 0 else []
    notes += [f"{warnings} warning{'s' * (warnings > 1)}: see .warnings"] if warnings else []
    return facts[:room], "; ".join(notes)


def _cut(line: str) -> str:
    return line if len(line) <= _WIDTH else f"{line[: _WIDTH - 3]}..."


def _line(text: str) -> str:
    return " ".join(str(text).split())


def _thumbnail(result: Result) -> str:
    try:
        figure = axes.blank(_SMALL, _SHARPNESS)
        panel = figure.subplots()
        axes.plain(panel)
        _main(result)(panel)
    except IlgError:  # nothing to draw
        return ""
    image = png(figure, _SHARPNESS)
    about = escape(f"picture of the {type(result).__name__}")
    return f'<img alt="{about}" src="data:image/png;base64,{image}">' if len(image) < _LONGEST else ""


def plot(result: Result, ax: Any, what: Any, look_now: look.Look, style: Mapping[str, Any]) -> Any:
    """Draw the whole picture through pyplot, or panels: see `Result.plot`."""
    names = [what] if isinstance(what, str) else [*what]
    with look.look(look_now):
        if ax is None and len(names) == 1 and not names[0] and not style:
            with axes.through_pyplot():
                figure = _presenter(result).figure(result)
                look.finish(figure, axes.COLOURS)
                return _one_or_array(figure.axes)
        if ax is None:
            with axes.through_pyplot():
                figure = axes.blank((6.4, 4.0 if len(names) == 1 else 2.4 * len(names)))
                places = list(np.ravel(figure.subplots(len(names), 1)))
                for place in places:
                    axes.plain(place)
                drawn = _on(result, places if len(places) > 1 else places[0], names, style)
                look.finish(figure, axes.COLOURS)
                return drawn
        from matplotlib.axes import Axes

        if np.size(ax) == 0 or not all(isinstance(panel, Axes) for panel in np.ravel(ax)):
            raise InputError(f"ax is {type(ax).__name__}; give matplotlib axes, such as those of plt.subplots()")
        if look_now.width is not None:
            raise InputError(
                "size is for a figure of its own; leave ax out, or give the size to plt.subplots(figsize=)"
            )
        return _on(result, ax, names, style)


def _on(result: Result, ax: Any, names: Sequence[str], style: Mapping[str, Any]) -> Any:
    """Draw the named panels on axes, one on each; without names, the first panels in the picture's order."""
    places = list(np.ravel(np.array(ax, dtype=object)))
    if len(names) == 1 and (len(places) == 1 or names[0] in _PAIRS):
        return _drawn(_main(result, names[0]), places[0] if len(places) == 1 else ax, style)
    known = list(_presenter(result).panels(result))
    chosen = [name for name in known if name not in _PAIRS] if [*names] == [""] else names
    if len(places) > len(chosen) or ([*names] != [""] and len(places) != len(chosen)):
        raise InputError(f"ax has {len(places)} axes for the panels {', '.join(chosen)}; give one for each")
    return np.array(
        [_drawn(_main(result, name), place, style) for place, name in zip(places, chosen, strict=False)], dtype=object
    )


def _main(result: Result, what: str = "") -> Callable[..., Any]:
    panels: axes.Panels = _presenter(result).panels(result)
    if not panels:
        raise InputError(f"there is nothing to draw of this {type(result).__name__}")
    if what and what not in panels:
        raise unknown_name("panel", what, panels)
    return panels[what or next(iter(panels))]


def _drawn(draw: Callable[..., Any], ax: Any, style: Mapping[str, Any]) -> Any:
    try:
        return _one_or_array(draw(ax, **style))
    except (AttributeError, TypeError) as error:
        if not style:
            raise
        raise InputError(f"cannot draw with {', '.join(style)}: {first_line(error)}") from None


def _one_or_array(found: Any) -> Any:
    panels = np.ravel(np.array(found, dtype=object))
    return panels[0] if len(panels) == 1 else panels


def page(result: Result) -> Page:
    """Return the presenter's page; without one, a page with the picture and the summary."""
    module = _presenter(result)
    if hasattr(module, "page"):
        return module.page(result)
    sections = [Section("Summary", [Listing(result.summary())])]
    with suppress(InputError):  # nothing to draw
        sections.insert(0, Section("Picture", [picture(result.figure(), module.headline(result))]))
    warnings = getattr(result, "warnings", ())
    return Page(type(result).__name__, module.headline(result), module.facts(result)[: _LINES - 2], warnings, sections)


def save(result: Result, path: str | Path, look_now: look.Look = look.OWN) -> None:
    """Write the result in the format given by the suffix of ``path``: see `Result.save`."""
    target = Path(path)
    presenter = _presenter(result)
    if hasattr(presenter, "save_folder") and (str(path).endswith(("/", os.sep, ".fit")) or target.is_dir()):
        with look.look(look_now):
            presenter.save_folder(result, target)
        return
    if look_now != look.OWN and target.suffix.lower() not in _DRAWN:
        raise InputError(f"size and style are for pictures, and '{path}' is none; end its name in {', '.join(_DRAWN)}")

    def write_picture(place: Path) -> None:
        with look.look(look_now):
            axes.save(result.figure(), place, result.provenance)

    writers: dict[str, Callable[[Path], object]] = {
        ".csv": lambda place: write_csv(place, result.columns()),
        ".json": lambda place: write_json(place, result.to_dict() | {"provenance": result.provenance.to_dict()}),
        **dict.fromkeys(_DRAWN, write_picture),
        ".html": lambda place: write_page(result.page(), place, result.provenance),
        ".nc": result.write_netcdf,
    }
    if hasattr(result, "write_strip"):
        writers[".toml"] = result.write_strip
    if target.suffix.lower() not in writers:
        *most, last = writers
        name = type(result).__name__
        raise InputError(f"cannot save '{path}': end its name in {', '.join(most)} or {last}, which a {name} can be")
    require_writable(target)
    writers[target.suffix.lower()](target)


def _presenter(result: Result) -> Any:
    return import_module(f"{__package__}.{result.presenter}")
