"""What counts as agreement, as a contradiction of the paper, and as failure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.reproduce import Check, Claim, Item, Outcome, Reproduction, Row
from ilg_circuit.reproduce.published import Published

NUMBER = Published("table", "force", "F", "(39)", "uN", "184", "0.1751", "mm read as m")
ITEM = Item("EC-X", "title", "", "F = m a", (), lambda runs: Reproduction())


def status(**made: Any) -> str:
    return Outcome(ITEM, Reproduction(**made)).status


@given(st.floats(-0.9, 0.9))
def test_the_digits_given_decide(share: float) -> None:
    """Within half of the last digit a number agrees, beyond it it does not; a wider margin can be allowed."""
    row = Row(NUMBER, 0.1751 + share * 1e-4)
    assert row.agrees == (abs(share) <= 0.5)
    assert replace(row, allowed=1e-4).agrees
    assert row.difference == pytest.approx(share * 1e-4 / 0.1751, abs=1e-12)


def test_a_number_that_nothing_recomputes_is_not_judged() -> None:
    row = Row(replace(NUMBER, recomputed=""), 5.0)
    assert row.agrees
    assert not row.contradicts
    assert row.difference is None


def test_a_zero_is_compared_absolutely() -> None:
    assert Row(replace(NUMBER, recomputed="0"), 0.25).difference == 0.25


@pytest.mark.parametrize(
    ("printed", "recomputed", "contradicts"),
    [
        ("0.3499", "0.3500", True),
        ("0.006", "0.0060", False),
        ("3.9805", "3.980", False),
        ("", "1", False),
        ("1", "", False),
    ],
)
def test_printed_against_recomputed(printed: str, recomputed: str, contradicts: bool) -> None:
    assert Row(replace(NUMBER, printed=printed, recomputed=recomputed), 1.0).contradicts == contradicts


def test_statuses() -> None:
    right, wrong = Row(replace(NUMBER, printed="0.1751"), 0.1751), Row(NUMBER, 0.18)
    assert status() == "agrees"
    assert status(rows=(right,), checks=(Check("a", "b", 1e-7, 1e-6),)) == "agrees"
    assert status(rows=(Row(NUMBER, 0.1751),)) == "differs"
    assert status(claims=(Claim("it reaches any place", False, "no"),)) == "differs"
    assert status(claims=(Claim("it reaches any place", None, "which?"),)) == "agrees"
    assert status(rows=(wrong,)) == "fails"
    assert status(checks=(Check("a", "b", 1e-5, 1e-6),)) == "fails"
    assert status(checks=(Check("a", "b", float("nan"), 1e-6),)) == "fails"
    assert Outcome(ITEM, None, "no ngspice").status == "fails"


def test_agreement_in_words() -> None:
    checks = (Check("near", "x", 1e-9, 1e-6), Check("current", "(30)", 5e-7, 1e-6))
    claims = (Claim("so", False, ""), Claim("so too", True, ""))
    right, wrong = Row(NUMBER, 0.1751), Row(NUMBER, 0.2)
    assert Outcome(ITEM, Reproduction((right,), checks, claims)).agreement == (
        "agrees with the corrected equation; the printed force is off by a factor of 1.05e+03, 1 of 2 claims does not "
        "hold; 1 of 1 numbers to the digits given; current: 5.0e-07 from (30)"
    )
    assert Outcome(ITEM, Reproduction((right, wrong), checks)).agreement == (
        "our force is off by +14 %; 1 of 2 numbers to the digits given; current: 5.0e-07 from (30)"
    )
    assert Outcome(ITEM, None, "no ngspice").agreement == "not made: no ngspice"


@pytest.mark.parametrize(
    ("printed", "recomputed", "ours", "outcome", "verdict"),
    [
        ("0.1751", "0.1751", 0.1751, "agrees", "agrees with the printed value"),
        ("0.20", "0.1751", 0.1751, "differs",
         "agrees with the corrected equation; the printed value is off by +14 %"),
        ("0.17510", "0.17511", 0.17511, "differs",
         "agrees with the corrected equation; the printed value is off by -5.7e-05"),
        ("0.20", "0.1751", 0.20, "fails", "our value is off by +14 %"),
        ("0.20", "0.1751", float("nan"), "fails", "our value is off by an unknown amount"),
        ("0.20", "", 0.20, "unchecked", "nothing to compare with"),
    ],
)  # fmt: skip
def test_whose_error_it_is(printed: str, recomputed: str, ours: float, outcome: str, verdict: str) -> None:
    row = Row(replace(NUMBER, printed=printed, recomputed=recomputed), ours)
    assert (row.outcome, row.verdict) == (outcome, verdict)
    assert (row.to_dict()["outcome"], row.to_dict()["verdict"]) == (outcome, verdict)


def test_json_has_no_nan() -> None:
    assert Row(NUMBER, float("nan")).to_dict()["ours"] is None
    assert not Row(NUMBER, float("nan")).agrees
