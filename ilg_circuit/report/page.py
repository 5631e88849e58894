"""A report as one HTML file that needs nothing else: it opens offline, prints, and can be sent to a colleague.

A page is sections, a section is blocks: words, tables, pictures, text to copy. What fits and spectra have to say is
put into these elsewhere; how it looks is here and in the template.
"""

from __future__ import annotations

import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ..files import write_text
from ..provenance import Provenance
from .axes import Figure
from .html import png, versions
from .html import render as render_template

#: Points an inch of a picture: sharp on screens of twice the usual density, and in print.
_SHARPNESS = 170


@dataclass(frozen=True)
class Prose:
    """A paragraph."""

    text: str
    kind: ClassVar[str] = "prose"


@dataclass(frozen=True)
class Grid:
    """A table. Columns in ``words`` (by index) are text and stand left, the others are numbers; ``marked`` rows."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: frozenset[int] = frozenset({0})
    marked: frozenset[int] = frozenset()
    kind: ClassVar[str] = "grid"


@dataclass(frozen=True)
class Picture:
    """A picture in the page; ``about`` says what it shows to those who cannot see it."""

    png: str
    about: str
    kind: ClassVar[str] = "picture"


@dataclass(frozen=True)
class Listing:
    """Text to be copied as it is."""

    text: str
    kind: ClassVar[str] = "listing"


Block = Prose | Grid | Picture | Listing


@dataclass(frozen=True)
class Section:
    """A heading and what stands beneath it."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Page:
    """``facts`` are the answer in a few names and values; ``warnings`` come right after them."""

    title: str
    headline: str
    facts: Sequence[tuple[str, str]]
    warnings: Sequence[str]
    sections: Sequence[Section]


def write_page(page: Page, path: str | Path, provenance: Provenance | None = None) -> None:
    """Write the page, whole or not at all; its last lines are its ``provenance``."""
    write_text(Path(path), render(page, provenance))


def render(page: Page, provenance: Provenance | None = None) -> str:
    """Return the page's text: pictures are in it, nothing is loaded from elsewhere."""
    content = {"page": page, "provenance": provenance or Provenance()}
    return render_template(Path(__file__).with_name("page.html.j2"), content)


def picture(figure: Figure, about: str) -> Picture:
    """A figure as a block."""
    return Picture(png(figure, _SHARPNESS), about)


def repetition(command: str, programs: Iterable[str] = ()) -> Section:
    """The command that makes this again, and with what; ``programs`` besides Python's packages, with versions."""
    return Section("To repeat this", [Listing(command), Prose(", ".join([versions(), *programs, platform.platform()]))])
