"""Intervals as a user asks for them: --intervals, in the table, the JSON and the report; and their coverage."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import Run
from kinds import data, write

from ilg_circuit.errors import InputError
from ilg_circuit.fit.estimate import Estimate
from ilg_circuit.identification import identify
from ilg_circuit.report.estimates import interval_text
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

pytestmark = pytest.mark.usefixtures("drafts")
NAMES = ("dc_resistance", "dynamic_resistance", "capacitance")
RC = ("--model", "rc", "--engine", "exact", "--onset", "first-level")
KINDS = ("step", "spectrum", "several")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", ["covariance", "bootstrap", "profile"])
def test_the_method_asked_for_is_in_table_json_and_report(method: str, kind: str, run: Run, tmp_path: Path) -> None:
    check_method(method, write(kind, tmp_path), run)


def test_an_autoregression_is_in_table_json_and_report(run: Run, tmp_path: Path) -> None:
    check_method("autoregression", write("step", tmp_path), run)


def test_a_markov_chain_is_in_table_json_and_report(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("emcee")
    check_method("mcmc", write("spectrum", tmp_path), run)


def check_method(method: str, files: list[str], run: Run) -> None:
    asked = () if method == "covariance" else ("--intervals", method)  # the default
    done = run("identify", *files, *RC, *asked, "--json", "fit.json", "--report", "fit.html")
    assert done.code == 0, done.err
    words = {
        "autoregression": "an autoregression of the residuals",
        "bootstrap": "block bootstrap",
        "profile": "profile likelihood",
        "mcmc": "Markov chain",
    }
    assert method not in words or words[method] in done.out
    fit = json.loads(Path("fit.json").read_text())
    truth = lumped_elements(PAPER).port
    for name in NAMES:
        entry = fit["parameters"][name]
        assert entry["method"] == method
        low, high = entry["ci95" if method == "covariance" else f"ci95_{method}"]
        assert low < entry["value"] < high
        assert low - (high - low) < getattr(truth, name) < high + (high - low)
        # white residuals: all methods agree
        assert high - low == pytest.approx(entry["ci95"][1] - entry["ci95"][0], rel=0.25)
        assert ("ci95_profile" in entry) == (method == "profile")
    assert (f"({method})" in Path("fit.html").read_text(encoding="utf-8")) == (method in words)
    if method in ("profile", "mcmc"):
        assert all(
            part["method"] == method for part in fit["statistics"]["intervals"].values() if isinstance(part, dict)
        )


@pytest.mark.parametrize("kind", KINDS)
def test_an_unknown_method(kind: str) -> None:
    with pytest.raises(InputError, match="covariance, bootstrap, profile, mcmc"):
        identify(data(kind), model="rc", intervals="guess")


@pytest.mark.parametrize(
    ("ends", "text"),
    [((1.0, float("inf")), "1 ohm or more"), ((0.0, 2.0), "2 ohm or less"), ((0.0, float("inf")), "no limits")],
)
def test_open_ends_are_told_in_words(ends: tuple[float, float], text: str) -> None:
    p = Estimate(1.5, "ohm", 0.5, (1.0, 2.0), ci95_profile=ends, method="profile")
    assert interval_text(p) == text
    assert json.loads(json.dumps(p.to_dict(), allow_nan=False))["ci95_profile"][0] == ends[0]


@pytest.mark.parametrize("ends", [(1.0, 2.0), (1.0, float("inf")), (0.0, 2.0)])
def test_an_interval_is_read_from_a_fit_as_it_was_written(ends: tuple[float, float]) -> None:
    p = Estimate(1.5, "ohm", 0.5, ends, ci95_profile=ends, method="profile")
    assert Estimate.from_dict(json.loads(json.dumps(p.to_dict()))) == p
