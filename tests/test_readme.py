"""What the README states is what the benchmarks measure: their figures quote it to the letter."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def stated() -> list[str]:
    """First arguments of every Figure, and first of the rhythm's rows, in the script of figures that are no times."""
    tree = ast.parse((ROOT / "benchmarks" / "accuracy.py").read_text(encoding="utf-8"))
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "Figure"]
    texts = [c.args[0].value for c in calls if isinstance(c.args[0], ast.Constant)]
    rows = [n.elts[0].value for n in ast.walk(tree) if isinstance(n, ast.Tuple) and isinstance(n.elts[0], ast.Constant)]
    return texts + [row for row in rows if isinstance(row, str)]


def test_there_are_figures() -> None:
    assert len(stated()) >= 10


@pytest.mark.parametrize("text", stated())
def test_a_figure_that_is_measured_is_in_the_readme(text: str) -> None:
    assert " ".join(text.split()) in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


@pytest.mark.parametrize("page", sorted(p.name for p in (ROOT / "benchmarks").glob("*.md")))
def test_a_page_of_results_is_linked(page: str) -> None:
    assert f"](benchmarks/{page})" in (ROOT / "README.md").read_text(encoding="utf-8")
