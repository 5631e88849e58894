"""How soon a strip's page has its pictures, in a headless chromium: the first, and those after a slider.

The first is counted from the opening of the file; a draft comes first, and the picture within 1e-5 after it. The
slider's are the medians and the slowest of several, from its movement.

python benchmarks/strip_page.py
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import ilg_circuit as ilg
from ilg_circuit.strip.actuator import PAPER, Actuator

MOVES = (10, -10, 20, -30, 40, 5, -60)


def strips() -> dict[str, tuple[Actuator, str]]:
    """Strips with their drives: the paper's, and the one whose circuit is the largest."""
    from ilg_circuit.strip.models import electrical_model

    values = [600.0, 15.0, 12.0, 0.3, 0.8, 60.0, 20.0, 0.46, 0.02]
    model = electrical_model("randles+inductance")
    heavy = Actuator.from_port(PAPER.geometry, model.port(values), base=PAPER.material, coupling=PAPER.coupling)
    return {
        "paper, step": (PAPER, "step:4V"),
        "paper, square": (PAPER, "square:-2V..2V,60s"),
        model.name: (heavy, "step:4V"),
    }


def browser() -> Any:
    """Chromium without a window."""
    from selenium.webdriver import Chrome, ChromeOptions
    from selenium.webdriver.chrome.service import Service

    options = ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1300,1000"):
        options.add_argument(argument)
    return Chrome(options=options, service=Service(shutil.which("chromedriver")))


def main() -> None:
    """Print the times."""
    driver = browser()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name, (strip, drive) in strips().items():
                path = ilg.page(strip, Path(folder) / "strip.html", drive, "300 s")
                driver.get(path.as_uri())
                fine = _fine(driver, 0.0)
                first, size = driver.execute_script("return strip.shown"), path.stat().st_size / 1e6
                drafts, fines = zip(*(_move(driver, place) for place in MOVES), strict=True)
                print(
                    f"{name}: {size:.2f} MB; first picture {first / 1e3:.2f} s, within 1e-5 {fine:.2f} s; "
                    f"after a slider {median(drafts):.2f} s (slowest {max(drafts):.2f} s), "
                    f"within 1e-5 {median(fines):.2f} s"
                )
    finally:
        driver.quit()


def _fine(driver: Any, begin: float) -> float:
    """Seconds from ``begin`` [ms] to the picture within 1e-5."""
    while driver.execute_script("return document.documentElement.dataset.state") != "fine":
        time.sleep(0.02)
    return (float(driver.execute_script("return strip.drawn")) - begin) / 1e3


def _move(driver: Any, place: int) -> tuple[float, float]:
    """Seconds from a slider's movement to the next picture and to the one within 1e-5."""
    script = (
        "const s = document.getElementById('slider-width'), begin = performance.now(), runs = strip.runs;"
        "const done = arguments[1]; s.value = arguments[0]; s.dispatchEvent(new Event('input'));"
        "(function look() { strip.runs > runs ? done([begin, strip.drawn]) : setTimeout(look, 2); })();"
    )
    begin, drawn = driver.execute_async_script(script, place)
    return (drawn - begin) / 1e3, _fine(driver, begin)


if __name__ == "__main__":
    main()
