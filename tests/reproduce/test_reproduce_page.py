"""The page: complete, self-contained, and honest about what failed."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from ilg_circuit.errors import SolveError
from ilg_circuit.report.axes import new_figure
from ilg_circuit.reproduce import ITEMS, Check, Claim, Item, Outcome, Reproduction, Row, run, write
from ilg_circuit.reproduce.items import rows
from ilg_circuit.reproduce.page import page
from ilg_circuit.reproduce.paper_runs import PaperRuns
from ilg_circuit.reproduce.published import misprints


def drawn(runs: PaperRuns) -> Reproduction:
    figure, (panel,) = new_figure(1, [1.0])
    panel.plot([0, 1], [0, 1])
    return Reproduction(
        rows=rows("ec_curves", {"force_steady": 0.17507e-6, "force_steady_factor": 5.252e-4}),
        checks=(Check("force", "(39)", 2e-7, 1e-5),),
        claims=(Claim("it is <small>", True, "0.175 uN & no more"),),
        unknown=("the ranges",),
        figure=figure,
        files={"strip.toml": "name = 'x'\n"},
    )


def broken(runs: PaperRuns) -> Reproduction:
    raise SolveError("ngspice gave up <here>")


def faulty(runs: PaperRuns) -> Reproduction:
    raise ZeroDivisionError("a fault")


GOOD = Item("EC-G", "good", "Its caption.", "F = ¾ E d(0)", ("ilg-circuit show paper",), drawn)
BAD = replace(GOOD, id="CPG-B", title="bad", make=broken)
FAULTY = replace(GOOD, id="CPG-Z", title="faulty", make=faulty)


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return run([GOOD, BAD, FAULTY])


def test_a_failure_stops_nothing(outcomes: list[Outcome]) -> None:
    assert [outcome.status for outcome in outcomes] == ["differs", "fails", "fails"]
    assert outcomes[1].failure == "ngspice gave up <here>"
    assert outcomes[2].failure == "ZeroDivisionError: a fault"


def test_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    run([BAD, BAD], lambda done, total: told.append((done, total)))
    assert told == [(1, 2), (2, 2)]


def test_it_holds_everything(outcomes: list[Outcome]) -> None:
    text = page(outcomes)
    for part in ("EC-G", "Its caption.", "¾ E d(0)", "ilg-circuit show paper", "0.1751", "0.5515", "2.0e-07"):
        assert part in text, part
    assert "--only CPG-B" in text
    assert "Not made: ngspice gave up &lt;here&gt;" in text
    assert "it is &lt;small&gt;" in text
    assert "the ranges" in text
    for row in misprints():
        assert row.where.split(",")[0] in text


def test_it_needs_nothing_else(outcomes: list[Outcome]) -> None:
    text = page(outcomes)
    sources = re.findall(r'src="([^"]*)"', text)
    assert len(sources) == 1
    head, _, data = sources[0].partition(",")
    assert head == "data:image/png;base64"
    assert base64.b64decode(data).startswith(b"\x89PNG")
    assert not re.search(r"<script|<link|@import|url\(|https?://", text)


def test_every_link_has_its_place(outcomes: list[Outcome]) -> None:
    text = page(outcomes)
    assert set(re.findall(r'href="#([^"]*)"', text)) == set(re.findall(r'<section id="([^"]*)"', text))


def test_what_is_written(outcomes: list[Outcome], tmp_path: Path) -> None:
    (tmp_path / "CPG-B.png").write_text("from a run before")
    written = write(outcomes, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["EC-G.png", "index.html", "reproduce.json", "strip.toml"]
    assert written[-1] == tmp_path / "index.html"
    numbers = json.loads((tmp_path / "reproduce.json").read_text(encoding="utf-8"))
    assert numbers["count"] == {"agrees": 0, "differs": 1, "fails": 2}
    good, bad, _ = numbers["items"]
    assert good["rows"][0]["unit"] == "uN"
    assert good["rows"][0]["ours"] == pytest.approx(0.17507)
    assert good["rows"][1]["printed"] == 0.5515
    assert bad["failure"] == "ngspice gave up <here>"
    assert bad["rows"] == []


def test_ids_are_unique_and_every_item_tells_how_to_repeat_it() -> None:
    ids = [item.id for item in ITEMS]
    assert len(set(ids)) == len(ids)
    figures = {"EC": range(9, 14), "CPG": range(10, 14)}
    assert {f"{paper}-F{n}" for paper, numbers in figures.items() for n in numbers} <= set(ids)
    assert {f"EC-T{n}" for n in (1, 2, 3)} | {f"EC-E{n}" for n in range(35, 40)} <= set(ids)
    assert all(item.commands and item.equation for item in ITEMS)


def test_a_number_off_its_digits_fails() -> None:
    off = Reproduction(rows=rows("ec_curves", {"force_steady": 0.1752e-6}))
    assert Outcome(GOOD, off).status == "fails"
    assert "bad" in page([Outcome(GOOD, off)])
    assert isinstance(off.rows[0], Row)
