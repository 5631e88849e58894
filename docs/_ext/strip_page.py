"""The paper's strip as an interactive page beside the front page, where ngspice for the browser was fetched."""

from __future__ import annotations

from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import ilg_circuit as ilg
from ilg_circuit.browser.assets import FOLDER

NAME = "paper_strip.html"
MISSING = (
    "This build has no interactive page: npm was missing when it was made (install npm, then make setup, make docs)."
)


def there() -> bool:
    """Return True if the files that a page carries were fetched."""
    return (FOLDER / "made_from.txt").is_file()


class StripPage(SphinxDirective):
    """The page in a frame with a link to it alone, or one line that says why it is missing."""

    def run(self) -> list[nodes.Node]:
        if not there():
            return [nodes.paragraph(text=MISSING, classes=["ilg-missing"])]
        frame = (
            f'<iframe class="ilg-strip" src="_static/{NAME}" title="The paper\'s strip: sliders for geometry, material '
            f'and drive, and curves that ngspice computes in this page" loading="lazy"></iframe>\n'
            f'<p><a href="_static/{NAME}">Open the strip in a page of its own</a></p>'
        )
        return [nodes.raw("", frame, format="html")]


def write(app: Sphinx, error: Exception | None) -> None:
    """Write the page into the built pages."""
    if error is None and app.builder.format == "html" and there():
        ilg.page("paper", Path(app.outdir) / "_static" / NAME)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive ``strip-page``."""
    app.add_directive("strip-page", StripPage)
    app.connect("build-finished", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
