"""The examples run as scripts and notebooks; netlists of the paper's strip are those that the package writes today."""

from __future__ import annotations

import ast
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("sphinx_gallery", reason="notebooks are made with sphinx-gallery")
pytest.importorskip("nbclient", reason="notebooks are run with nbclient")

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
MAKER = runpy.run_path(str(ROOT / "scripts" / "make_notebooks.py"))
NETLISTS = runpy.run_path(str(ROOT / "netlists" / "generate.py"))["texts"]()
#: What an example needs besides the package.
NEEDS = {
    "sweep_strips": "loky",
    "map_of_a_sweep": "loky",
    "soft_arm": "numba",
    "fit_a_dataframe": "pandas",
    "profile_and_mcmc": "emcee",
    "follow_a_path": "clarabel",
}
#: Notebooks that are run; the cells of the others are those of their scripts, which are run.
BOOKS = ("load_a_strip", "parameters_and_errors")


def needing(script: Path) -> None:
    if script.stem in NEEDS:
        pytest.importorskip(NEEDS[script.stem], reason="an extra of the package")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_example_runs(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, brisk: None) -> None:
    needing(script)
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script))
    drawn = pyplot.get_fignums()
    pyplot.close("all")
    assert drawn


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_an_example_imports_the_front_door_alone(script: Path) -> None:
    imported = [
        node for node in ast.walk(ast.parse(script.read_text())) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    ours = [ast.unparse(node) for node in imported if "ilg_circuit" in ast.unparse(node)]
    assert ours == ["import ilg_circuit as ilg"]


def test_notebooks_run(tmp_path: Path) -> None:
    books = [str(ROOT / "examples" / "notebooks" / f"{name}.ipynb") for name in BOOKS]
    command = [sys.executable, str(Path(__file__).with_name("run_notebooks.py")), str(tmp_path), *books]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.stdout.split() == list(BOOKS), done.stderr


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_its_notebook_has_the_same_cells(script: Path) -> None:
    kept = (script.parent / "notebooks" / f"{script.stem}.ipynb").read_text(encoding="utf-8")
    assert kept == MAKER["text"](script), "run python scripts/make_notebooks.py"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_an_example_tells_what_it_is_and_what_its_pictures_show(script: Path) -> None:
    code = script.read_text(encoding="utf-8")
    title, rule, _, prose = (ast.get_docstring(ast.parse(code)) or "").split("\n", 3)
    assert len(rule) == len(title)
    assert prose.strip()
    cells = [cell for cell in code.split("\n# %%") if ".plot(" in cell or ".subplots(" in cell]
    assert cells
    for cell in cells:
        assert len(re.findall(r'^# sphinx_gallery_alt = "[^"]{30,}"$', cell, re.MULTILINE)) == 1, cell


def test_no_notebook_is_left_over() -> None:
    assert {p.stem for p in (ROOT / "examples" / "notebooks").glob("*.ipynb")} == {p.stem for p in SCRIPTS}


@pytest.mark.parametrize("name", sorted(NETLISTS))
def test_netlist_is_current(name: str) -> None:
    assert (ROOT / "netlists" / name).read_text(encoding="utf-8") == NETLISTS[name], "run python netlists/generate.py"


def test_no_netlist_is_left_over() -> None:
    assert {p.name for p in (ROOT / "netlists").glob("paper_*")} == set(NETLISTS)
