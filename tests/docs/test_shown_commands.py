"""Every command and every line of Python that a page shows is run, in the order of the page, in a folder of its own."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest
from command import Run
from given_files import MAKERS
from shown import PAGES, README, ROOT, Block, blocks, given, name

from ilg_circuit.browser.assets import FOLDER
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator, loads

#: What a page needs besides the package.
NEEDS = {"arm": "numba", "shape": "numba", "sweep": "loky"}
SHOWING = [page for page in PAGES if any(block.language in ("bash", "python") for block in blocks(page))]
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]


def follow(line: str, run: Run) -> None:
    """Run one line of a shell; of what is no command of ours check what it names."""
    program, *arguments = shlex.split(line, comments=True) or ["#"]
    match program:
        case "ilg-circuit":
            done = run(*arguments)
            assert done.code == 0, f"{line}\n{done.err}{done.out}"
        case "make":
            assert set(arguments) <= TARGETS
        case "pip":
            extra = re.fullmatch(r"ilg-circuit\[(\w+)\]", arguments[1])
            assert extra is not None
            assert extra[1] in EXTRAS
        case _:
            assert program in ("git", "cd", "source", "#"), line


def work_through(block: Block, run: Run, space: dict[str, object]) -> None:
    match block.language:
        case "bash":
            for line in block.lines:
                follow(line, run)
        case "python":
            exec(compile(block.code, "page", "exec"), space)
        case "toml" if block.file == "pyproject.toml":
            tomllib.loads(block.code)
        case "toml":
            Path(block.file).write_text(block.code)
            loads(block.code)
        case "text" if block.file:
            Path(block.file).write_text(block.code)


@pytest.mark.parametrize("page", SHOWING, ids=name)
def test_what_a_page_shows_runs(page: Path, run: Run, brisk: None, drafts: None) -> None:
    if page.stem in NEEDS:
        pytest.importorskip(NEEDS[page.stem], reason="an extra of the package")
    if page.stem == "strip_page" and not (FOLDER / "made_from.txt").is_file():
        pytest.skip("the files that a page carries were not fetched (scripts/get_page_assets.py, which needs npm)")
    from matplotlib import pyplot

    for file in given(page):
        MAKERS[file](Path(file))
    space: dict[str, object] = {}
    for block in blocks(page):
        work_through(block, run, space)
    pyplot.close("all")
    if page == README:
        check_the_first_fit()


def check_the_first_fit() -> None:
    """From a CSV file to a fitted strip, picture, table and report: the README's path ends where it says."""
    made = {path.name for path in Path("step.fit").iterdir()}
    assert made >= {"fitted.toml", "fit.json", "fit.png", "report.html", "parameters.csv"}
    fitted = load_actuator("step.fit/fitted.toml")
    port, truth = (lumped_elements(strip).port for strip in (fitted, PAPER))
    assert fitted.name == "strip"
    assert port.dc_resistance == pytest.approx(truth.dc_resistance, rel=0.03)
    assert port.branches[0] == pytest.approx(truth.branches[0], rel=0.03)
    assert Path("run.png").is_file()
    assert "ilg_strip" in Path("strip.lib").read_text()


def test_blocks_are_found() -> None:
    assert len(SHOWING) > 15
    commands = [line for page in SHOWING for block in blocks(page) if block.language == "bash" for line in block.lines]
    assert len([line for line in commands if line.startswith("ilg-circuit")]) > 40


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_command_stands_in_a_block_that_is_run(page: Path) -> None:
    """Blocks of no language, or indented ones, would not be run; a text that shows a cluster's job is the exception."""
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"^ {4}ilg-circuit", re.sub(r"\\\n.*", "", text), re.MULTILINE)
    for code in re.findall(r"^```(?:sh|shell|console)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        assert not code.startswith("ilg-circuit")
