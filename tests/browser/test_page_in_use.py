"""A page in its reader's hands: what it states, the keyboard, files dropped on it, and what it says to wrong ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.strip.actuator import PAPER

CLOSE = 1e-5
TIME = np.round(np.arange(0, 20.01, 0.5), 9)
VOLTS = np.interp(TIME, [0, 5, 12, 20], [0.0, 2.0, -1.0, 1.5])
MEASURED = "time_s,voltage_V,current_mA,displacement_mm,note\n" + "".join(
    f"{t},{v},{1e3 * v / 300:.4f},,x\n" for t, v in zip(TIME, VOLTS, strict=True)
)
DAMAGED = {
    "a word": (MEASURED.replace("\n5.0,", "\n5.0,two"), 'row 12, column voltage_V: "two2.0" is no number'),
    "a row cut off": (MEASURED + "20.5,1", "row 43 has 2 cells, the header 5"),
    "time goes back": (MEASURED + "3,1,1,1,x\n", "time goes back from 20 s to 3 s"),
    "no time": ("voltage_V,current_mA\n1,2\n3,4\n", "it has no column time_s"),
    "an unknown unit": ("time_s,current_furlong\n1,2\n", "its unit is not understood"),
    "nothing but time": ("time_s\n0\n1\n", "no column such as voltage_V"),
    "empty": ("", "it has no rows"),
    "binary": ("PK\x03\x04\x00\x00", "it is no text"),
    "twice": ("time_s,current_A,current_mA\n0,1,2\n1,2,3\n", "two of its columns are a current"),
}


def test_a_page_states_its_agreement_and_asks_no_network(open_page: Callable[..., Any]) -> None:
    opened = open_page("paper", "step:4V", "20 s")
    opened.settled()
    said = opened.ask("return document.getElementById('agreement').textContent")
    found = opened.ask("return strip.state.agreement")
    assert set(found) == {"current", "charge", "displacement", "force", "impedance"}
    assert 0 < max(found.values()) < CLOSE
    assert said.startswith("Agrees with the native run of ilg_circuit")
    assert opened.path.stat().st_size <= 3_000_000
    asked = opened.requests()
    assert any(address.startswith("file:") for address in asked)
    assert all(address.startswith(("file:", "blob:", "data:")) for address in asked), asked
    assert not [entry for entry in opened.driver.get_log("browser") if entry["level"] == "SEVERE"]
    unnamed = opened.ask(
        "return [...document.querySelectorAll('input, button, [tabindex], [role=img]')].filter(e => "
        "!(e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.[0]?.textContent.trim()))"
        ".map(e => e.outerHTML)"
    )
    assert unnamed == []
    text = opened.path.read_text(encoding="utf-8")
    assert "modified BSD" in text
    assert text.count("MIT License") >= 2


def test_the_keyboard_does_what_the_mouse_does(open_page: Callable[..., Any]) -> None:
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    opened = open_page("paper", "step:4V", "20 s")
    agreement = "return document.getElementById('agreement').textContent"
    slider = opened.driver.find_element(By.ID, "slider-width")
    slider.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert opened.ask("return strip.state.values.width") > 0.005
    assert slider.get_attribute("aria-valuetext").endswith("mm")
    slider.send_keys(Keys.END)
    assert "end of its slider (1.25 to 20 mm)" in opened.message
    slider.send_keys(Keys.ARROW_LEFT)
    assert opened.message == ""
    opened.driver.find_element(By.ID, "kind-step").send_keys(Keys.ARROW_RIGHT)
    assert opened.ask("return strip.state.drive.kind") == "square"
    opened.settled()
    assert "is measured with the strip and the drive as they were made" in opened.ask(agreement)
    picture = opened.driver.find_element(By.CSS_SELECTOR, "#plot-current .canvas")
    read = "return document.querySelector('#plot-current output').textContent"
    picture.send_keys(Keys.END)
    last = opened.ask(read)
    picture.send_keys(Keys.PAGE_DOWN)
    assert last.endswith("at 20\N{NO-BREAK SPACE}s")
    assert " at " in opened.ask(read) != last
    # the strip as it was, and a strip that cannot be
    opened.driver.find_element(By.ID, "reset").send_keys(Keys.ENTER)
    assert opened.ask("return strip.state.values.width") == 0.005
    opened.settled()
    assert opened.ask(agreement).startswith("Agrees with the native run")
    opened.slide("free_length", 100)
    assert "cannot exceed the total length" in opened.message
    assert opened.ask("return strip.state.values.free_length") == 0.03


def test_a_measured_file_is_drawn_over_the_model_and_drives_it(open_page: Callable[..., Any]) -> None:
    opened = open_page("paper", "step:4V", "60 s")
    opened.settled()
    for text, hint in DAMAGED.values():
        opened.drop(text)
        opened.until("document.getElementById('message').textContent")
        assert opened.message.startswith("measured.csv: ")
        assert hint in opened.message
        assert "\n" not in opened.message
        opened.ask("document.getElementById('message').textContent = ''")
    assert opened.ask("return strip.state.measured") is None
    opened.drop(MEASURED)
    opened.until("strip.state.measured")
    opened.settled()
    said = opened.ask("return document.getElementById('measured-said').textContent")
    assert "41 rows of voltage, current, displacement" in said
    assert "left out: note" in said
    assert opened.ask("return strip.state.measured.columns.current[10]") == pytest.approx(1e-3 * round(2e3 / 300, 4))
    assert "rms distance of measured" in opened.ask("return document.querySelector('#plot-current output').textContent")
    found = opened.result
    at = np.unique(np.linspace(0, len(found["time"]) - 1, 50).astype(int))
    native = ilg.simulate("paper", (TIME, VOLTS), times=found["time"][at], engine="exact")
    for name in ("voltage", "current", "charge", "displacement"):
        wave = getattr(native, name)
        assert np.abs(found[name][at] - wave).max() < CLOSE * np.abs(wave).max(), name
    # the next file has no voltage: the drive is the one of the beginning
    opened.drop("Time (s);Force (uN)\n0;0,5\n10;1,5\n", "force.csv")
    opened.until("strip.state.measured.columns.force")
    assert opened.ask("return strip.state.measured.columns.force[1]") == pytest.approx(1.5e-6)
    assert opened.ask("return [strip.state.drive.kind, strip.state.drive.duration]") == ["step", 60]


def test_a_strips_name_is_text(open_page: Callable[..., Any]) -> None:
    name = "</script><img src=x onerror=\"document.title='PWN'\"> {{ 7*7 }} $\\foo$"
    opened = open_page(replace(PAPER, name=name), "step:4V", "20 s")
    opened.settled()
    assert opened.ask("return document.querySelector('h1').textContent") == name
    assert opened.ask("return document.images.length") == 0
    assert opened.driver.title == f"{name}: ionic-liquid-gel strip"


def test_what_ngspice_cannot_do_is_said_in_one_line(open_page: Callable[..., Any]) -> None:
    opened = open_page(replace(PAPER, coupling=None), "step:4V", "20 s")
    opened.settled()
    assert opened.ask("return Boolean(document.getElementById('plot-displacement'))") is False
    runs = opened.ask("return strip.runs")
    opened.ask("strip.kept = strip.data.library; strip.data.library = strip.kept.replace('Rdc plus', 'Qdc plus')")
    opened.slide("width", 10)
    opened.until("document.documentElement.dataset.state === 'failed'")
    assert opened.message.startswith("ngspice cannot solve this strip: ")
    assert opened.message.endswith("the picture is that of the last strip that it could solve.")
    assert opened.ask("return strip.runs") == runs
    opened.ask("strip.data.library = strip.kept; Solver.LONGEST = 0")
    opened.slide("width", 20)
    opened.until("document.getElementById('message').textContent.includes('more than')")
    opened.ask("Solver.LONGEST = 15")
    opened.slide("width", 30)
    opened.settled()
    assert opened.message == ""
    assert opened.ask("return strip.state.result.level") == "fine"
