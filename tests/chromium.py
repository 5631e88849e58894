"""Chromium without a window, for tests of pages and of the app; all that it asks of any network is in its log."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import pytest

#: Set where a browser must be there: a test that would be skipped fails.
REQUIRED = "ILG_REQUIRE_BROWSER"


def unavailable(why: str) -> NoReturn:
    if os.environ.get(REQUIRED):
        pytest.fail(f"{why}, and {REQUIRED} is set")
    pytest.skip(why)


@contextmanager
def chromium(*arguments: str, size: tuple[int, int] = (1300, 1000)) -> Iterator[Any]:
    """A driver of Chromium; the test is skipped where there is none."""
    try:
        from selenium.webdriver import Chrome, ChromeOptions
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        unavailable("selenium is not installed")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    if program is None or driver is None:
        unavailable("chromium or its chromedriver is not installed (Debian: chromium, chromium-driver)")
    options = ChromeOptions()
    options.binary_location = program
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    usual = (
        "--headless=new",
        "--disable-dev-shm-usage",
        f"--window-size={size[0]},{size[1]}",
        *["--no-sandbox"] * root,
    )
    for argument in (*usual, *arguments):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    made = Chrome(options=options, service=Service(driver))
    try:
        yield made
    finally:
        made.quit()


def requested(driver: Any) -> list[str]:
    """Addresses that were asked for since the last call, WebSockets among them."""
    events = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    found = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
    return found + [e["params"]["url"] for e in events if e["method"] == "Network.webSocketCreated"]
