"""The examples run as scripts and notebooks; netlists of the paper's strip are those that the package writes today."""

from __future__ import annotations

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

jupytext = pytest.importorskip("jupytext", reason="notebooks are made with jupytext")
pytest.importorskip("nbclient", reason="notebooks are run with nbclient")

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
NETLISTS = runpy.run_path(str(ROOT / "netlists" / "generate.py"))["texts"]()
#: What an example needs besides the package.
NEEDS = {"sweep_strips": "loky", "soft_arm": "numba", "fit_a_dataframe": "pandas"}


def needing(script: Path) -> None:
    if script.stem in NEEDS:
        pytest.importorskip(NEEDS[script.stem], reason="an extra of the package")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_example_runs(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    needing(script)
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script))
    pyplot.close("all")
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_an_example_imports_the_front_door_alone(script: Path) -> None:
    imported = [
        node for node in ast.walk(ast.parse(script.read_text())) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    ours = [ast.unparse(node) for node in imported if "ilg_circuit" in ast.unparse(node)]
    assert ours == ["import ilg_circuit as ilg"]


def test_notebooks_run(tmp_path: Path) -> None:
    for module in NEEDS.values():
        pytest.importorskip(module, reason="an extra of the package")
    books = [str(script.parent / "notebooks" / f"{script.stem}.ipynb") for script in SCRIPTS]
    command = [sys.executable, str(Path(__file__).with_name("run_notebooks.py")), str(tmp_path), *books]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.stdout.split() == [script.stem for script in SCRIPTS], done.stderr


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_its_notebook_has_the_same_cells(script: Path) -> None:
    made = runpy.run_path(str(ROOT / "scripts" / "make_notebooks.py"))["notebook"](script)
    kept = jupytext.read(script.parent / "notebooks" / f"{script.stem}.ipynb")
    assert [c.source for c in kept.cells] == [c.source for c in made.cells], "run python scripts/make_notebooks.py"


def test_no_notebook_is_left_over() -> None:
    assert {p.stem for p in (ROOT / "examples" / "notebooks").glob("*.ipynb")} == {p.stem for p in SCRIPTS}


@pytest.mark.parametrize("name", sorted(NETLISTS))
def test_netlist_is_current(name: str) -> None:
    assert (ROOT / "netlists" / name).read_text(encoding="utf-8") == NETLISTS[name], "run python netlists/generate.py"


def test_no_netlist_is_left_over() -> None:
    assert {p.name for p in (ROOT / "netlists").glob("paper_*")} == set(NETLISTS)
