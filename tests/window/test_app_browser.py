"""The window in a browser: files dropped, a fit seen, sliders moved, two windows at once, no other host asked.

Screenshots are left in the folder that ILG_SCREENSHOTS names, to be looked at.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from chromium import chromium, requested

import ilg_circuit as ilg
from ilg_circuit.browser.sliders import sliders
from ilg_circuit.window.moved import shown, value_at

pytest.importorskip("panel", reason="the extra app is not installed")

#: Difference from the command, relative to the largest value, that is allowed.
CLOSE = 1e-6
#: Longest wait [s], far beyond what anything takes.
PATIENCE = 90.0
#: No name is resolved, and no other address is reached.
ALONE = "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1"

#: Elements in whatever shadow root, and the text that is seen.
HELPERS = """
const deep = (selector, root = document, all = []) => {
  for (const node of root.querySelectorAll("*")) {
    if (node.matches(selector)) all.push(node);
    if (node.shadowRoot) deep(selector, node.shadowRoot, all);
  }
  return all;
};
const text = (node) => node.nodeType === 3 ? node.textContent
  : node.nodeType === 1 && ["STYLE", "SCRIPT"].includes(node.tagName) ? ""
  : node.nodeType === 1 && getComputedStyle(node).display === "none" ? ""
  : [...(node.shadowRoot ? node.shadowRoot.childNodes : []), ...node.childNodes].map(text).join(" ");
"""


class Page:
    """A window in the browser."""

    def __init__(self, driver: Any, address: str) -> None:
        self.driver = driver
        driver.get(address)
        self.handle = driver.current_window_handle
        self.until("Drop CSV")

    def ask(self, script: str, *arguments: Any) -> Any:
        self.driver.switch_to.window(self.handle)
        return self.driver.execute_script(HELPERS + script, *arguments)

    @property
    def text(self) -> str:
        return " ".join(self.ask("return text(document.body)").split())

    def until(self, seen: str) -> None:
        end = time.monotonic() + PATIENCE
        while seen not in self.text:
            assert time.monotonic() < end, f"never saw {seen!r} in {self.text[:2000]}"
            time.sleep(0.05)

    def click(self, selector: str, words: str) -> None:
        nodes = self.ask(
            "return deep(arguments[0]).filter((n) => n.textContent.trim() === arguments[1])", selector, words
        )
        next(node for node in nodes if node.is_displayed()).click()

    def tab(self, words: str) -> None:
        self.click(".bk-tab", words)

    def drop(self, path: Path) -> None:
        """Drop a file on the page, beside its field."""
        self.ask(
            "const all = new DataTransfer(); all.items.add(new File([arguments[0]], arguments[1]));"
            "document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: all, bubbles: true, cancelable: true}))",
            path.read_text(encoding="utf-8"),
            path.name,
        )

    def choose(self, value: str) -> None:
        """Choose from a list as a user does."""
        self.ask(
            "const s = deep('select').find((n) => [...n.options].some((o) => o.value === arguments[0]));"
            "s.value = arguments[0]; s.dispatchEvent(new Event('change', {bubbles: true}))",
            value,
        )

    def slide(self, number: int, *keys: str) -> None:
        """Move a slider by keys."""
        handle = [node for node in self.ask("return deep('.noUi-handle')") if node.is_displayed()][number]
        for key in keys:
            handle.send_keys(key)

    def curve(self, name: str) -> dict[str, np.ndarray]:
        """A source's columns, SI units."""
        script = (
            "const d = Bokeh.documents[0].get_model_by_name(arguments[0]).data;"
            "const all = d instanceof Map ? [...d] : Object.entries(d);"
            "return Object.fromEntries(all.map(([k, v]) => [k, Array.from(v)]))"
        )
        return {key: np.array(values, dtype=float) for key, values in self.ask(script, name).items()}

    def agrees(self, strip: Any) -> None:
        """Wait for the curves that the command gives for a strip, within the bound."""
        run = ilg.simulate(strip, "step:4V", "300 s", engine="exact")
        end = time.monotonic() + PATIENCE
        while True:
            found = self.curve("response_now")
            waves = ("current", "displacement", "charge")
            off = (
                [np.abs(found[name] - run.waveforms[name]).max() / np.abs(run.waveforms[name]).max() for name in waves]
                if len(found["time"]) == len(run.time)
                else [np.inf]
            )
            if max(off) < CLOSE:
                return
            assert time.monotonic() < end, off
            time.sleep(0.1)

    def shot(self, name: str, width: int, height: int) -> None:
        """Leave a screenshot, where one is wanted; nothing may be wider than the screen."""
        self.driver.switch_to.window(self.handle)
        self.driver.set_window_size(width, height)
        time.sleep(0.2)
        assert self.ask("return document.documentElement.scrollWidth <= window.innerWidth + 1"), (name, width)
        if folder := os.environ.get("ILG_SCREENSHOTS"):
            time.sleep(0.5)
            self.driver.save_screenshot(str(Path(folder) / f"{name}_{width}.png"))


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """The address of a served window; the server ends by Ctrl-C as it should."""
    program = subprocess.Popen(
        [sys.executable, "-m", "ilg_circuit", "app", "--no-browser"], stderr=subprocess.PIPE, text=True
    )
    assert program.stderr is not None
    line = program.stderr.readline()
    assert line.startswith("window at http://127.0.0.1:"), line
    try:
        yield line.split()[2].rstrip(";")
        program.send_signal(signal.SIGINT)
        rest = program.stderr.read()
        assert program.wait(10) == 130, rest
        assert rest.strip() == "ilg-circuit: interrupted"  # and no traceback before it
    finally:
        program.kill()
        program.wait()
        program.stderr.close()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium(ALONE, size=(1280, 800)) as made:
        yield made


def test_two_windows_fit_and_move_and_ask_no_other_host(server: str, browser: Any, record: Callable[..., Path]) -> None:
    first = Page(browser, server)
    first.shot("first", 1280, 800)
    first.drop(record())
    first.until("Record : step.csv")
    first.choose("rc")
    first.click("button", "Fit")
    first.until("Fitting:")
    browser.switch_to.new_window("tab")
    second = Page(browser, server)
    second.tab("Strip")
    second.slide(3, *["\ue00f"] * 3)  # page down
    thickness = next(each for each in sliders(ilg.PAPER) if each.name == "thickness")
    moved = ilg.PAPER.with_(thickness=value_at(thickness, -15))
    second.agrees(moved)
    assert shown(thickness, moved.geometry.thickness) in second.ask("return deep('input').map((n) => n.value)")
    first.until("Model rc describes the data")
    assert all(words in first.text for words in ("Residuals of every file", "95 % interval", "no strip given"))
    first.shot("fit", 1280, 800)
    first.shot("fit", 400, 800)
    second.agrees(moved)  # as it was: the other window's fit is not for it
    second.shot("strip", 1280, 800)
    second.shot("strip", 400, 800)
    browser.set_window_size(1280, 800)
    first.tab("Strip")
    first.until("fitted to step.csv")
    second.tab("Measure and fit")
    second.drop(record("again.csv"))
    second.until("Record : again.csv")
    second.choose("mcmc")
    second.click("button", "Fit")
    second.until("Fitting:")
    second.click("button", "Stop")
    second.until("Fitting was stopped")
    hosts = {
        urlsplit(each).hostname
        for each in requested(browser)
        if urlsplit(each).scheme in ("http", "https", "ws", "wss")
    }
    assert hosts == {"127.0.0.1"}
    severe = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert not severe
