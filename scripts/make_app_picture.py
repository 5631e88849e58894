"""Makes the picture of the window, docs/pictures/app.png, by chromium without a screen.

Needs selenium, chromium and its driver, and pillow, all of which the tests need too.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "app.png"
#: Size of the window [px], and colours of the picture: few, so that the file stays small.
_SIZE, _COLOURS = (1280, 860), 200
#: Finds elements in whatever shadow root.
_DEEP = """
const deep = (selector, root = document, all = []) => {
  for (const node of root.querySelectorAll("*")) {
    if (node.matches(selector)) all.push(node);
    if (node.shadowRoot) deep(selector, node.shadowRoot, all);
  }
  return all;
};
return deep(arguments[0]).filter((node) => node.checkVisibility());
"""


def make(path: Path) -> None:
    """Serve a window, move a slider in it, and write what is seen."""
    program = subprocess.Popen(
        [sys.executable, "-m", "ilg_circuit", "app", "--no-browser"], stderr=subprocess.PIPE, text=True
    )
    assert program.stderr is not None
    address = program.stderr.readline().split()[2].rstrip(";")
    driver = _chromium()
    try:
        driver.get(address)
        next(tab for tab in _found(driver, ".bk-tab", 5) if tab.text == "Strip").click()
        thickness = _found(driver, ".noUi-handle", 14)[3]
        for _ in range(5):
            thickness.send_keys("\ue00f")  # page down
        time.sleep(3.0)
        driver.save_screenshot(str(path))
    finally:
        driver.quit()
        program.terminate()
        program.wait()
    image: Any = import_module("PIL.Image")
    with image.open(path) as picture:
        few = picture.convert("RGB").quantize(_COLOURS)
    few.save(path, optimize=True)


def _found(driver: Any, selector: str, count: int) -> list[Any]:
    """Wait for ``count`` elements that can be seen."""
    for _ in range(600):
        found = driver.execute_script(_DEEP, selector)
        if len(found) >= count:
            return list(found)
        time.sleep(0.1)
    raise TimeoutError(f"never saw {count} of {selector}")


def _chromium() -> Any:
    webdriver: Any = import_module("selenium.webdriver")
    service: Any = import_module("selenium.webdriver.chrome.service")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or shutil.which("chromium-browser") or ""
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        f"--window-size={_SIZE[0]},{_SIZE[1]}",
    ):
        options.add_argument(argument)
    return webdriver.Chrome(options=options, service=service.Service(shutil.which("chromedriver")))


if __name__ == "__main__":
    make(PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size // 1000} kB")
