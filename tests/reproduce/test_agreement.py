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
    made = Reproduction(
        rows=(Row(NUMBER, 0.1751), Row(NUMBER, 0.2)),
        checks=(Check("near", "x", 1e-9, 1e-6), Check("current", "(30)", 5e-7, 1e-6)),
        claims=(Claim("so", False, ""), Claim("so too", True, "")),
    )
    assert Outcome(ITEM, made).agreement == (
        "1 of 2 numbers to the digits given; current: 5.0e-07 from (30); 1 of 2 claims not borne out"
    )
    assert Outcome(ITEM, None, "no ngspice").agreement == "not made: no ngspice"


def test_json_has_no_nan() -> None:
    assert Row(NUMBER, float("nan")).to_dict()["ours"] is None
    assert not Row(NUMBER, float("nan")).agrees
