"""A fitted strip through every way in: command, Python, library and deck have its own beam, and the same answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from every_model import strip_of
from numpy.testing import assert_allclose
from spice import ngspice, table, with_ngspice

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.file import load_actuator, save_actuator

DURATION = 10.0
DRIVE = "square:-2V..2V,5s"
#: Electrical models of fits; as `identify` writes them, d(s) with the tip's whole motion in it.
FITTED = ("rc", "rc2", "warburg", "rc+sinh", "rc2+growing+sinh")


def fitted(model: str) -> Actuator:
    assert PAPER.coupling
    strip = strip_of(model, 2.0, band=(1e-2, 100.0))
    return replace(strip, coupling=replace(PAPER.coupling, beam="static"))


@with_ngspice
@pytest.mark.parametrize("beam", ["its own", "dynamic"])
@pytest.mark.parametrize("model", FITTED)
def test_all_ways_agree(model: str, beam: str, tmp_path: Path, run: Run) -> None:
    if beam != "its own" and model not in ("rc", "rc2+growing+sinh"):
        return  # the beam does not know the electrical side
    save_actuator(fitted(model), Path("fitted.toml"))
    how = () if beam == "its own" else ("--beam", beam)
    driven = ("--drive", DRIVE, "--duration", f"{DURATION}s")
    assert run("netlist", "fitted.toml", "--out", "strip.lib", *how).code == 0
    assert run("netlist", "fitted.toml", *driven, "--out", "deck.cir", *how).code == 0
    strip = load_actuator("fitted.toml")
    engine = "exact" if strip.material.model.linear else "ngspice"
    options = ".options reltol=1e-8 trtol=1 abstol=1e-12 vntol=1e-10 chgtol=1e-4 method=trap"
    tran = f".tran {1e-9 * DURATION!r} {DURATION!r} 0 {2e-4 * DURATION!r} uic"
    record = [".control", "run", "set numdgt=15 wr_singlescale wr_vecnames"]
    source = PiecewiseLinear.square(-2.0, 2.0, 5.0, DURATION)
    Path("user.cir").write_text("\n".join([
        "* the library", ".include strip.lib", f"V1 plus 0 {source.spice(DURATION)}", "X1 plus 0 tip ilg_strip",
        "Vtip tip 0 0", "Fway 0 way Vtip 1", "Cway way 0 1 ic=0", "Vfirst first 0 PWL(0 0 1e-8 0 20 0)", options, tran,
        *record, "wrdata user.txt i(v1) v(way)", "quit 0", ".endc", ".end", ""]))  # fmt: skip
    text = "\n".join(line for line in Path("deck.cir").read_text().splitlines() if line[:6] not in (".print", ".end"))
    record_deck = [*record, "wrdata deck.txt v(out_current) v(out_displacement)", "quit 0", ".endc", ".end", ""]
    Path("deck.cir").write_text("\n".join([text, *record_deck]))
    python = None if beam == "its own" else beam
    for file, columns, scale in (
        ("user", ("i(v1)", "v(way)"), (-1.0, 1e-3)),
        ("deck", ("v(out_current)", "v(out_displacement)"), (1.0, 1.0)),
    ):
        ngspice(tmp_path, f"{file}.cir")
        found = table(Path(f"{file}.txt"))
        at = np.unique(np.linspace(0, len(found["time"]) - 1, 60).astype(int))
        edges = np.arange(0.0, DURATION + 1, 2.5)
        at = at[np.abs(found["time"][at][:, None] - edges).min(axis=1) > 1e-4]
        response = simulate(strip, source, found["time"][at], beam=python, engine=engine)
        for column, factor, wave in zip(columns, scale, (response.current, response.displacement), strict=True):
            largest = np.abs(wave).max()
            assert_allclose(factor * found[column][at], wave, rtol=0, atol=1e-6 * largest, err_msg=f"{file} {column}")
    assert (
        run("simulate", "fitted.toml", *driven, "--samples", "41", "--engine", engine, "--out", "run.csv", *how).code
        == 0
    )
    written = np.genfromtxt("run.csv", delimiter=",", names=True)
    response = simulate(strip, source, written["time_s"], beam=python, engine=engine)
    assert_allclose(written["displacement_m"], response.displacement, rtol=0, atol=1e-6 * response.displacement.max())
    other = simulate(strip, source, written["time_s"], beam="dynamic" if python is None else "static", engine=engine)
    assert np.abs(other.displacement - response.displacement).max() > 1e-2 * response.displacement.max()


def test_a_library_leaves_tip_and_load_to_its_user(run: Run) -> None:
    for more in (("--tip", "clamped"), ("--load", "mass=1mg")):
        assert_one_line(run("netlist", "paper", "--out", "x.lib", *more), "leave out --tip and --load")
