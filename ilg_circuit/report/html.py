"""What the HTML files have in common: one style, pictures inside them, a template beside the module that fills it."""

from __future__ import annotations

import base64
import io
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from .axes import Figure

#: Whose versions a page states.
_PACKAGES = ("ilg-circuit", "PySpice", "numpy", "scipy", "lmfit")


def render(template: Path, content: dict[str, Any]) -> str:
    """The page of a jinja2 ``template``, everything escaped; ``style`` and ``versions`` are added to its content."""
    from jinja2 import Environment

    style = Path(__file__).with_name("html.css").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, trim_blocks=False, keep_trailing_newline=True)
    page = environment.from_string(template.read_text(encoding="utf-8"))
    return page.render({"style": style, "versions": versions()} | content)


def png(figure: Figure, dpi: int = 110) -> str:
    """A picture as base64, for ``src="data:image/png;base64,..."``."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def versions() -> str:
    """Python and the packages that answers depend on."""
    return ", ".join([f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in _PACKAGES)])
