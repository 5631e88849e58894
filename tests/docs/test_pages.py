"""README and pages: how long, where links lead, what they quote, and that nothing of the code is missing there."""

from __future__ import annotations

import ast
import json
import re
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
from shown import DOCS, PAGES, README, ROOT, links, name

import ilg_circuit as ilg
from ilg_circuit.commands import COMMANDS
from ilg_circuit.fit.estimate import Estimate

EXAMPLES = sorted(p.stem for p in (ROOT / "examples").glob("*.py"))


def text_of_all() -> str:
    return " ".join(" ".join(page.read_text(encoding="utf-8").split()) for page in PAGES)


def stated() -> list[str]:
    """First arguments of every Figure, and first of the rhythm's rows, in the script of figures that are no times."""
    tree = ast.parse((ROOT / "benchmarks" / "accuracy.py").read_text(encoding="utf-8"))
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "Figure"]
    texts = [c.args[0].value for c in calls if isinstance(c.args[0], ast.Constant)]
    rows = [n.elts[0].value for n in ast.walk(tree) if isinstance(n, ast.Tuple) and isinstance(n.elts[0], ast.Constant)]
    return texts + [row for row in rows if isinstance(row, str)]


def test_the_readme_has_at_most_700_words() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= 700


def test_there_are_figures() -> None:
    assert len(stated()) >= 10


@pytest.mark.parametrize("text", stated())
def test_a_figure_that_is_measured_is_on_a_page(text: str) -> None:
    assert " ".join(text.split()) in text_of_all()


@pytest.mark.parametrize("page", sorted(p.name for p in (ROOT / "benchmarks").glob("*.md")))
def test_a_page_of_results_is_a_page_of_the_documentation(page: str) -> None:
    here = DOCS / "measured" / page.lower()
    assert f"../../benchmarks/{page}\n" in here.read_text(encoding="utf-8")
    assert f"](../measured/{page.lower()})" in (DOCS / "explanation" / "accuracy.md").read_text(encoding="utf-8")


def leads_somewhere(page: Path, link: str) -> bool:
    """Whether a link leads to a file of the repository; a page of the gallery is made of an example."""
    if re.match(r"[a-z]+:", link):
        return link.startswith("https://")
    target, _, anchor = link.partition("#")
    path = (page.parent / target).resolve() if target else page
    if path.parent == DOCS / "gallery":
        return path.stem in (*EXAMPLES, "index")
    if path.parent == DOCS / "pictures" and not path.exists():
        return False
    if anchor and path.suffix == ".md":
        titles = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
        anchors = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
        return anchor in anchors
    return path.exists()


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    assert [link for link in links(page) if not leads_somewhere(page, link)] == []


def test_a_lost_link_is_found() -> None:
    assert not leads_somewhere(README, "docs/nowhere.md")
    assert not leads_somewhere(README, "docs/architecture.md#nowhere")
    assert leads_somewhere(README, "docs/architecture.md#to-add")
    assert len(links(README)) > 15


def test_every_page_is_in_a_table_of_contents() -> None:
    listed = set()
    for page in PAGES:
        for entries in re.findall(r"^```\{toctree\}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S):
            rows = [row for row in entries.split() if not row.startswith(":")]
            listed |= {(page.parent / row).resolve().relative_to(DOCS).as_posix() for row in rows}
    pages = {page.relative_to(DOCS).with_suffix("").as_posix() for page in PAGES if page != README}
    assert pages - listed == {"index"}
    assert listed - pages == {"gallery/index"}


def test_every_example_has_its_place_in_the_gallery() -> None:
    pytest.importorskip("sphinx_gallery", reason="the gallery's order stands beside its scraper")
    order = runpy.run_path(str(DOCS / "_ext" / "gallery.py"))["ORDER"]
    assert sorted(order) == EXAMPLES
    assert len(order) >= 20
    assert f"[{len(order)} examples](examples)" in README.read_text(encoding="utf-8")


def test_drawings_are_those_that_the_script_makes() -> None:
    for file, drawn in runpy.run_path(str(DOCS / "drawings" / "draw.py"))["drawings"]().items():
        assert (DOCS / "drawings" / file).read_text(encoding="utf-8") == drawn, "run python docs/drawings/draw.py"
        assert "<title" in drawn
        assert "<desc" in drawn


def test_every_table_of_the_reference_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx", reason="the reference's directives are Sphinx'")
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    import from_code  # type: ignore[import-not-found]

    try:
        made = {what: make() for what, make in from_code.FromCode.known.items()}
    finally:
        del sys.modules["from_code"]
    assert all(f"ilg_circuit.{public}" in made["front_door"] for public in ilg.__all__ if public != "PAPER")
    assert all(f"ilg_circuit.commands.{command}:{command}" in made["commands"] for command in COMMANDS)
    assert all(f"`{key}`" in made["strip_keys"] for key in ("free_length", "inductance", "interface_time", "gain"))
    assert "Gamry" in made["formats"]
    asked = {word for page in PAGES for word in re.findall(r"\{from-code\} (\w+)", page.read_text(encoding="utf-8"))}
    assert asked == made.keys()


def keys(value: Any) -> set[str]:
    """Every key of an object, names of parameters and of quantities apart."""
    if isinstance(value, list):
        return set().union(*map(keys, value))
    if not isinstance(value, dict):
        return set()
    free = {"parameters", "own", "derived", "values", "correlations", "residual_windows", "figures", "provenance"}
    return set(value).union(*(keys(inner) for outer, inner in value.items() if outer not in free))


def test_every_key_of_fit_json_is_explained(step_fit: Any) -> None:
    known = (DOCS / "reference" / "fit_json.md").read_text(encoding="utf-8")
    words = set(re.findall(r"[a-z_0-9]+", known))
    report = json.loads(json.dumps(step_fit.to_dict(), default=str))
    assert report["schema_version"] == 2
    between = (1.0, 2.0)
    more = {f"ci95_{method}": between for method in ("bootstrap", "profile", "mcmc", "autoregression")}
    whole = Estimate(1.0, "ohm", 0.1, between, "held", bootstrap=0.1, autoregression=0.1, note="a note", **more)
    found = keys(report) | keys(whole.to_dict()) | {"from_s", "to_s"}
    assert found - words == set()
