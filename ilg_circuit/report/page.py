"""A report as one HTML file that needs nothing else: it opens offline, prints, and can be sent to a colleague.

A page is sections, a section is blocks: words, tables, pictures, text to copy. What fits and spectra have to say is
put into these elsewhere; how it looks is here and in the template.
"""

from __future__ import annotations

import base64
import io
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

from ..files import write_text
from ..provenance import Provenance
from .axes import Figure
from .tables import aligned

#: Packages whose versions a page states.
_PACKAGES = ("ilg-circuit", "PySpice", "numpy", "scipy", "lmfit")
#: Resolution [dpi] of a picture: sharp on high-density screens and in print.
SHARPNESS = 170


@dataclass(frozen=True)
class Prose:
    """A paragraph."""

    text: str
    kind: ClassVar[str] = "prose"


@dataclass(frozen=True)
class Grid:
    """A table. Columns in ``words`` (by index) are left-aligned text, the others numbers; ``marked`` rows shaded."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: frozenset[int] = frozenset({0})
    marked: frozenset[int] = frozenset()
    kind: ClassVar[str] = "grid"

    def lines(self, alignment: str) -> list[str]:
        """Return the table for a terminal, its columns aligned as `tables.aligned` says."""
        return aligned([self.header, *self.rows], alignment)


@dataclass(frozen=True)
class Picture:
    """A picture in the page, as base64; ``about`` says what it shows to those who cannot see it."""

    data: str
    about: str
    media: str = "image/png"
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
    """A page: ``facts`` are the main results by name; ``warnings`` follow them."""

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
    return fill(Path(__file__).with_name("page.html.j2"), content)


def picture(figure: Figure, about: str) -> Picture:
    """Return a figure as a block of a page."""
    return Picture(png(figure, SHARPNESS), about)


def embedded(image: bytes, about: str) -> Picture:
    """Return the bytes of a .png file as a block of a page."""
    return Picture(base64.b64encode(image).decode("ascii"), about)


def repetition(command: str, programs: Iterable[str] = ()) -> Section:
    """Return a section with the command that repeats the result, and the versions of packages and ``programs``."""
    return Section("To repeat this", [Listing(command), Prose(", ".join([versions(), *programs, platform.platform()]))])


def fill(template: Path, content: dict[str, Any]) -> str:
    """Return the page of a jinja2 ``template``, autoescaped; ``style`` and ``versions`` are added to the content."""
    from jinja2 import Environment, FileSystemLoader

    here = Path(__file__)
    style = here.with_name("html.css").read_text(encoding="utf-8")
    found = FileSystemLoader([template.parent, here.parent])  # a template may include this room's block.html.j2
    page = Environment(loader=found, autoescape=True, keep_trailing_newline=True).get_template(template.name)
    return page.render({"style": style, "versions": versions()} | content)


def png(figure: Figure, dpi: int = 110) -> str:
    """Return a picture as base64, for ``src="data:image/png;base64,..."``."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def versions() -> str:
    """Return the versions of Python and of the packages that results depend on."""
    return ", ".join([f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in _PACKAGES)])
