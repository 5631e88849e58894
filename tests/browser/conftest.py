"""A headless browser for the tests of pages, and a strip's page open in it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium import chromium, requested, unavailable

import ilg_circuit as ilg
from ilg_circuit.browser.assets import FOLDER
from ilg_circuit.strip.actuator import Actuator

#: Longest wait for a picture [s], far beyond what one takes.
PATIENCE = 60.0


@pytest.fixture(scope="session")
def assets() -> None:
    """The files that npm fetches are there, or the test is skipped."""
    if not (FOLDER / "made_from.txt").is_file():
        unavailable("the files that a page carries were not fetched (scripts/get_page_assets.py, which needs npm)")


@pytest.fixture(scope="session")
def browser(assets: None) -> Iterator[Any]:
    """Chromium without a window."""
    with chromium() as made:
        yield made


@dataclass(frozen=True)
class Opened:
    """A page in the browser."""

    driver: Any
    path: Path

    def ask(self, script: str, *arguments: Any) -> Any:
        """What a function with this body returns in the page."""
        return self.driver.execute_script(script, *arguments)

    def until(self, condition: str) -> None:
        """Wait for an expression of the page to be true."""
        end = time.monotonic() + PATIENCE
        while not self.ask(f"return Boolean({condition})"):
            assert time.monotonic() < end, f"{condition} never came; the page says: {self.message!r}"
            time.sleep(0.02)

    def settled(self) -> None:
        """Wait for the fine result of the latest wish."""
        self.until("['fine', 'failed'].includes(document.documentElement.dataset.state)")
        assert self.ask("return document.documentElement.dataset.state") == "fine", self.message

    @property
    def message(self) -> str:
        """The one line that the page says to its reader."""
        return str(self.ask("return document.getElementById('message').textContent"))

    def slide(self, name: str, place: int) -> None:
        """Move a slider as a mouse does, to a place from -100 to 100."""
        find = "const slider = document.getElementById(arguments[0]); slider.value = arguments[1];"
        self.ask(f"{find} slider.dispatchEvent(new Event('input'))", f"slider-{name}", place)

    def drop(self, text: str, name: str = "measured.csv") -> None:
        """Drop a file of this text on the page."""
        self.ask(
            "const all = new DataTransfer(); all.items.add(new File([arguments[0]], arguments[1]));"
            "document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: all, bubbles: true, cancelable: true}))",
            text,
            name,
        )

    @property
    def result(self) -> dict[str, np.ndarray]:
        """The latest curves, SI units."""
        script = (
            "const r = strip.state.result; return JSON.stringify(Object.fromEntries(Object.entries(r)"
            ".filter(([, x]) => typeof x !== 'string').map(([name, x]) => [name, Array.from(x)])))"
        )
        return {name: np.array(x) for name, x in json.loads(self.ask(script)).items()}

    def requests(self) -> list[str]:
        """Addresses that were asked for since the last call."""
        return requested(self.driver)


@pytest.fixture
def open_page(browser: Any, tmp_path: Path) -> Callable[..., Opened]:
    """Write the page of a strip and open it from disk."""

    def made(strip: str | Actuator, *arguments: Any, **options: Any) -> Opened:
        path = ilg.page(strip, tmp_path / "strip.html", *arguments, **options)
        browser.get(path.as_uri())
        return Opened(browser, path)

    return made
