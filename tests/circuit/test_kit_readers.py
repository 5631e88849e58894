"""The kit as other programs read it: ngspice's LTspice and PSpice modes, gnucap, spicelib's editor, kiutils."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from spice import gnucap, ngspice, with_gnucap, with_ngspice
from test_kit import DECKS, FITTED, LEVEL, STEP, raw

import ilg_circuit as ilg
from ilg_circuit.kits.subcircuit import NAME, PINS
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ilg.kit(FITTED, tmp_path_factory.mktemp("of") / "kit", "step:4V", "10 s")


@with_ngspice
@pytest.mark.parametrize("mode", ["lt", "ps"])
@pytest.mark.parametrize("deck", [deck for deck in DECKS if deck != "monte_carlo"])
def test_ngspices_other_dialects_give_the_same(deck: str, mode: str, folder: Path, tmp_path: Path) -> None:
    for name in (f"{deck}.cir", "strip.lib"):
        shutil.copy(folder / name, tmp_path)
    ngspice(tmp_path, f"{deck}.cir", raw="own.raw")
    (tmp_path / ".spiceinit").write_text(f"set ngbehavior={mode}\n")
    said = ngspice(tmp_path, f"{deck}.cir", raw="other.raw", startup=True)
    assert "No compatibility mode" not in said
    own, other = raw(tmp_path / "own.raw"), raw(tmp_path / "other.raw")
    assert own.keys() == other.keys()
    for name, wave in own.items():
        assert_allclose(other[name], wave, rtol=1e-9, atol=1e-15, err_msg=name)


@with_gnucap
def test_gnucap_agrees_on_op_ac_and_transient(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "strip.lib", tmp_path)
    tables = {}
    for deck in ("op", "ac", "transient"):
        text = (folder / f"{deck}.cir").read_text().replace("method=trap", "method=gear short=1e-7 noincmode")
        (tmp_path / f"{deck}.cir").write_text(text)
        (tables[deck],) = gnucap(tmp_path, f"{deck}.cir")
    assert tables["op"][-1, 1] == pytest.approx(3.9804977, rel=1e-3)
    frequency, real, imaginary = tables["ac"][:, 0], tables["ac"][:, 3], tables["ac"][:, 4]
    expected = impedance(PAPER, frequency, engine="exact").impedance
    assert_allclose(1 / (real + 1j * imaginary), expected, rtol=1e-3)
    rows = tables["transient"][tables["transient"][:, 0] >= 0.099]
    response = simulate(PAPER, STEP, rows[:, 0], engine="exact")
    assert_allclose(rows[:, 1], LEVEL, rtol=1e-6)
    for column, wave in ((2, response.current), (3, 1e3 * response.displacement)):
        assert_allclose(rows[:, column], wave, rtol=0, atol=1e-3 * np.abs(wave).max())


def test_spicelibs_editor_reads_decks_and_symbol(folder: Path, tmp_path: Path) -> None:
    spicelib = pytest.importorskip("spicelib", reason="spicelib is not installed")
    from spicelib.editor.asy_reader import AsyReader

    decks = sorted(folder.glob("*.cir"))
    assert len(decks) == 9
    for deck in decks:
        editor = spicelib.SpiceEditor(deck)
        strips = [name for name in editor.get_components("X") if editor.get_component_value(name) == NAME]
        assert strips, deck.name
        assert len(editor.get_component_nodes(strips[0])) == len(PINS)
    bridge = spicelib.SpiceEditor(folder / "h_bridge.cir")
    bridge.set_parameters(dead=2e-6)
    bridge.save_netlist(tmp_path / "edited.cir")
    assert re.search(r"dead= ?(2u|2e-06) ", (tmp_path / "edited.cir").read_text())
    symbol = AsyReader(folder / f"{NAME}.asy")
    pins = {pin.text: pin for pin in symbol.pins}
    assert list(pins) == [f"PinName={pin};SpiceOrder={k};" for k, pin in enumerate(PINS, 1)]
    assert symbol.attributes["Prefix"] == "X"
    assert symbol.attributes["Value"] == NAME
    assert symbol.attributes["ModelFile"] == "strip.lib"


def test_kiutils_reads_the_symbol(folder: Path) -> None:
    pytest.importorskip("kiutils", reason="kiutils is not installed")
    from kiutils.symbol import SymbolLib

    (symbol,) = SymbolLib.from_file(str(folder / "strip.kicad_sym")).symbols
    assert [(pin.number, pin.name) for unit in symbol.units for pin in unit.pins] == [
        (str(k), pin) for k, pin in enumerate(PINS, 1)
    ]
    said = {item.key: item.value for item in symbol.properties}
    assert said["Sim.Library"] == "strip.lib"
    assert said["Sim.Name"] == NAME
    subcircuit = re.search(r"^\.subckt (\S+) (.*)$", (folder / "strip.lib").read_text(), re.MULTILINE)
    assert subcircuit
    assert said["Sim.Pins"] == " ".join(f"{k}={pin}" for k, pin in enumerate(subcircuit[2].split(), 1))
    ends = {(pin.position.X, pin.position.Y) for unit in symbol.units for pin in unit.pins}
    assert len(ends) == 4
    assert all(x % 1.27 < 1e-9 or 1.27 - x % 1.27 < 1e-9 for end in ends for x in end)  # on KiCad's grid
