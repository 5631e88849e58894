"""The files of other projects that a page carries, fetched by npm when the package was built."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path

from ..errors import MissingLibraryError

FOLDER = Path(__file__).with_name("assets")


@dataclass(frozen=True)
class Assets:
    """ngspice as gzipped WebAssembly in base64, its loader, uPlot with its style, and the ``licences`` of all."""

    program: str
    loader: str
    plot: str
    plot_style: str
    licences: str


def assets() -> Assets:
    """Return them. Raises MissingLibraryError where they were not fetched: it says what to do."""
    try:
        return Assets(
            program=base64.b64encode((FOLDER / "ngspice.wasm.gz").read_bytes()).decode("ascii"),
            loader=_text("ngspice.js"),
            plot=_text("uplot.js"),
            plot_style=_text("uplot.css"),
            licences=_text("licences.txt"),
        )
    except OSError:
        raise MissingLibraryError(
            "a page needs ngspice for the browser, which this installation lacks; in a checkout, install npm (Debian, "
            "Ubuntu: apt-get install npm) and run python scripts/get_page_assets.py; or install a wheel, which has it"
        ) from None


def _text(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
