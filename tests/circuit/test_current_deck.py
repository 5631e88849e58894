"""A strip under a source of current in plain ``ngspice -b``: the deck, and the library in one of a user's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from spice import ngspice, with_ngspice

import ilg_circuit as ilg


@with_ngspice
def test_deck_and_library_with_a_source_of_current(tmp_path: Path) -> None:
    """Plain ``ngspice -b``: the deck, and an I source from ground into the library's plus pin, make 4.809428 V."""
    ilg.netlist("paper", "current:10mA", "300 s").save(tmp_path / "deck.cir")
    ilg.library("paper").save(tmp_path / "strip.lib")
    measured = ".meas tran u find v(plus) at=300\n"
    (tmp_path / "own.cir").write_text(
        "strip under a current\n.include strip.lib\nIdrive 0 plus PWL(0 0 1u 10m)\nXstrip plus 0 0 ilg_strip\n"
        f".options reltol=1e-7 trtol=1 abstol=1e-12\n.tran 0.5 300 0 0.5 uic\n{measured}.end\n"
    )
    text = (tmp_path / "deck.cir").read_text().replace(".end\n", ".meas tran u find v(drive) at=300\n.end\n")
    (tmp_path / "deck.cir").write_text(text)
    for name in ("own.cir", "deck.cir"):
        printed = ngspice(tmp_path, name)
        line = next(x for x in printed.splitlines() if x.startswith("u "))
        assert float(line.split("=")[1].split()[0]) == pytest.approx(4.809428, rel=1e-6)
