"""The papers' tables: read as they are, in their units, with their digits."""

from __future__ import annotations

from pathlib import Path

import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.reproduce import published


@pytest.mark.parametrize(
    ("text", "half"), [("666.667", 5e-4), ("2.4448e-9", 5e-14), ("1.0000", 5e-5), ("-91", 0.5), ("0.0060", 5e-5)]
)
def test_half_a_digit(text: str, half: float) -> None:
    assert published.half_a_digit(text) == pytest.approx(half, rel=1e-12)


@pytest.mark.parametrize(
    ("table", "item", "factor"),
    [
        ("ec_table1", "length", 1e-2),
        ("ec_table1", "thickness", 1e-3),
        ("ec_table2", "permittivity", 1.0),
        ("ec_curves", "force_steady", 1e-6),
        ("ec_curves", "displacement_prefactor", 1e-3),
        ("ec_points", "strain_at_break", 1.0),
        ("cpg_circuit", "circuit_phase_1", 1.0),
    ],
)
def test_units_become_si(table: str, item: str, factor: float) -> None:
    assert published.published(table, item).si_factor == factor


def test_what_is_not_there_is_said() -> None:
    with pytest.raises(InputError, match="has no item 'inductance'"):
        published.published("ec_table1", "inductance")
    with pytest.raises(InputError, match="no finite number"):
        published.half_a_digit("nan")


def test_misprints_name_their_place() -> None:
    rows = published.misprints()
    assert {row.paper for row in rows} == {"EC", "CPG"}
    assert all(row.where and row.printed and row.reason for row in rows)
    places = " ".join(row.where for row in rows)
    for equation in ("(5)", "(11)", "(28)", "(34)", "(36)", "(38)", "Figure 7"):
        assert equation in places


def test_without_the_tables_it_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(published, "__file__", str(tmp_path / "inside" / "published.py"))
    with pytest.raises(InputError, match="install the package again"):
        published.folder()


def test_a_table_with_other_columns_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "odd.csv").write_text("item,value\na,1\n")
    monkeypatch.setattr(published, "folder", lambda: tmp_path)
    with pytest.raises(InputError, match="table 'odd' has the columns"):
        published.table("odd")
