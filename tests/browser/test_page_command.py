"""The command ``page``, and the script that fetches what a page carries."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from command import Run, assert_one_line

from ilg_circuit.browser import assets as carried
from ilg_circuit.browser.page import page_drive
from ilg_circuit.browser.sliders import shown_unit
from ilg_circuit.errors import InputError

SCRIPT = Path(__file__).parents[2] / "scripts" / "get_page_assets.py"


@pytest.mark.usefixtures("assets")
def test_a_page_is_written_and_says_where_it_comes_from(run: Run) -> None:
    done = run("page", "paper", "--out", "strip.html")
    assert done.code == 0, done.err
    assert done.out == "wrote strip.html\n"
    text = Path("strip.html").read_text(encoding="utf-8")
    assert "call: ilg-circuit page paper --out strip.html" in text
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert_one_line(run("page", "paper", "--drive", "ramp:1V/s", "--out", "other.html"), "step, square, sine, triangle")
    assert_one_line(run("page", "paper", "--drive", "square:4V,1s", "--out", "other.html"), "give --duration 20s")
    assert not Path("other.html").exists()


def test_without_what_npm_fetches_one_line_says_what_to_do(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(carried, "FOLDER", tmp_path)
    assert_one_line(run("page", "paper", "--out", "strip.html"), "scripts/get_page_assets.py", "install npm")
    assert not Path("strip.html").exists()


@pytest.mark.parametrize(
    ("text", "kind", "periods"),
    [
        ("step:4V", "step", 0),
        ("sine:2V,0.1Hz", "sine", 6),
        ("square:-1V..2V,30s,0.3", "square", 2),
        ("triangle:4V,6s", "triangle", 10),
    ],
)
def test_drives_of_a_page(text: str, kind: str, periods: float) -> None:
    made = page_drive(text, 60.0)
    assert made.kind == kind
    assert made.periods == pytest.approx(periods)


@pytest.mark.parametrize("text", ["chirp:1V,1Hz..2Hz", "file:x.csv", "step", "square:4V", "sine:1V,1kHz"])
def test_drives_that_a_page_has_not(text: str) -> None:
    with pytest.raises(InputError):
        page_drive(text, 60.0)


def test_units_read_well() -> None:
    assert shown_unit(7600.0, "Pa") == ("kPa", 1e3)
    assert shown_unit(1250.0, "kg/m^3") == ("kg/m³", 1.0)


def test_what_npm_gives_is_checked_before_it_is_opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    script = runpy.run_path(str(SCRIPT))
    fetched, missing = script["fetched"], script["Missing"]

    def gives(*_: Any, **__: Any) -> SimpleNamespace:
        (tmp_path / "other.tgz").write_bytes(b"another")
        return SimpleNamespace(stdout="other.tgz\n")

    monkeypatch.setattr("subprocess.run", gives)
    with pytest.raises(missing, match="another one than expected"):
        fetched("npm", "uplot@1.6.32", "sha512-x", tmp_path)
    monkeypatch.setattr("shutil.which", lambda _: None)
    monkeypatch.setitem(script["get"].__globals__, "STAMP", tmp_path / "none")
    with pytest.raises(missing, match="no npm"):
        script["get"]()
