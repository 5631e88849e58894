"""What is handed out of a strip with segments: its deck and its subcircuit, run by ngspice as a user runs them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from spice import ngspice, table, with_ngspice

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.response import Response
from ilg_circuit.strip.actuator import PAPER, Actuator, Electrodes

FOUR = replace(PAPER, electrodes=Electrodes(0.25, 0.25, segments_1=4, segments_2=4, cells=8))
DRIVES = {1: "step:4V", 2: "step:-4V", 3: "sine:3V,50mHz", 4: "open"}


def written(text: str, folder: Path, columns: str) -> dict[str, np.ndarray]:
    """What a deck's transient gives, as ngspice writes it."""
    settings = "set numdgt=12\nset wr_singlescale\nset wr_vecnames"
    control = f".control\n{settings}\nrun\nwrdata run.txt {columns}\nquit 0\n.endc\n.end"
    (folder / "run.cir").write_text(text.replace("\n.end\n", f"\n{control}\n"), encoding="utf-8")
    ngspice(folder, "run.cir")
    return table(folder / "run.txt")


@with_ngspice
@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_deck_agrees_with_simulate(beam: str, tmp_path: Path) -> None:
    names = {"v(out_displacement)": "displacement", "v(out_current)": "current", "v(out_i1)": "current_1"}
    names |= {"v(out_i3)": "current_3", "v(out_k2)": "1", "v(out_k6)": "5"}
    deck = ilg.netlist(FOUR, DRIVES, "20 s", beam=beam)
    found = written(deck, tmp_path, " ".join(names))
    some = np.unique(np.linspace(0, len(found["time"]) - 1, 80).astype(int))
    run = ilg.simulate(FOUR, DRIVES, times=found["time"][some], beam=beam, engine="exact")
    for column, name in names.items():
        expected = values(run, name)
        assert np.abs(found[column][some] - expected).max() <= 1e-6 * np.abs(expected).max(), column


def values(run: Response, name: str) -> np.ndarray:
    if name.isdigit():
        assert run.curvatures is not None
        return run.curvatures.values[:, int(name)]
    return run.segments[name] if name in run.segments else run.waveforms[name]


def instance(strip: Actuator, sources: list[str], end: str) -> str:
    library = ilg.library(strip)
    pins = re.search(r"\.subckt ilg_strip_\d+ (.*)", library)
    assert pins is not None
    return "\n".join(["four segments", library, f"X1 {pins[1]} ilg_strip_4", *sources, end, ".end\n"])


@with_ngspice
def test_subcircuit_has_pins_curvatures_and_the_free_end(tmp_path: Path) -> None:
    """Four segments at +4, -4, +4, -4 V without sheet resistance, at rest: the tip of four arcs."""
    sheets = replace(FOUR.electrodes, sheet_resistance_1=0.0, sheet_resistance_2=0.0)
    sources = [f"V{k} p{k} m{k} {4 * (-1) ** (k + 1)}\nR{k} m{k} 0 1" for k in (1, 2, 3, 4)]
    end = ".control\nset numdgt=12\nop\nprint v(x1.x) v(x1.y) v(x1.angle) v(x1.k1) v(x1.k8)\nquit 0\n.endc"
    (tmp_path / "op.cir").write_text(instance(replace(FOUR, electrodes=sheets), sources, end), encoding="utf-8")
    told = ngspice(tmp_path, "op.cir")
    x, y, angle, first, last = (float(number) for number in re.findall(r"v\(x1\.\w+\) = (\S+)", told))
    assert (x, y) == (pytest.approx(29.97800, abs=6e-6), pytest.approx(0.99476, abs=6e-6))
    assert abs(angle) < 1e-9
    assert first == pytest.approx(-last, rel=1e-9)
    assert first == pytest.approx(2 * 2.2113870e-3 / 0.5e-3, rel=1e-6)


@with_ngspice
def test_subcircuit_in_a_transient(tmp_path: Path) -> None:
    sources = [
        "V1 p1 m1 4",
        "V2 p2 m2 -4",
        "V3 p3 m3 SIN(0 3 50m)",
        "Vg1 m1 0 0",
        "Vg2 m2 0 0",
        "Vg3 m3 0 0",
        "Vg4 m4 0 0",
    ]
    options = ".options reltol=1e-8 trtol=1 abstol=1e-12 vntol=1e-10 chgtol=1e-4 method=trap"
    text = instance(FOUR, sources, f"{options}\n.tran 2e-8 20 0 4m uic")
    found = written(text, tmp_path, "v(x1.k3) v(x1.angle) v(x1.x) v(x1.y) i(v1)")
    some = np.unique(np.linspace(0, len(found["time"]) - 1, 60).astype(int))
    run = ilg.simulate(FOUR, DRIVES, times=found["time"][some], beam="static", engine="exact")
    curvatures = run.curvatures
    assert curvatures is not None
    after = np.cumsum(curvatures.values * curvatures.lengths, axis=1)
    middle, half = after - curvatures.values * curvatures.lengths / 2, curvatures.values * curvatures.lengths / 2
    steps = 1e3 * curvatures.lengths * np.sinc(half / np.pi)
    expected = {
        "v(x1.k3)": curvatures.values[:, 2],
        "v(x1.angle)": after[:, -1],
        "v(x1.x)": (steps * np.cos(middle)).sum(axis=1),
        "v(x1.y)": (steps * np.sin(middle)).sum(axis=1),
        "i(v1)": -run.segments["current_1"],
    }
    for column, wave in expected.items():
        assert np.abs(found[column][some] - wave)[1:].max() <= 1e-6 * np.abs(wave).max(), column


def test_subcircuit_of_foils_that_are_cut_differently() -> None:
    strip = replace(PAPER, electrodes=Electrodes(0.25, 0.25, segments_1=3, cells=6, lead_resistance=0.5))
    text = ilg.library(strip, "gripper")
    assert ".subckt gripper p1 m1 p2 p3\n" in text
    assert "voltage" not in ilg.library(replace(strip, coupling=None)).split(".subckt")[1]


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match="without the beam's mass"):
        ilg.library(FOUR, beam="dynamic")
    with pytest.raises(InputError, match="use letters"):
        ilg.library(FOUR, "4 segments")
    for call in (ilg.subcircuit, lambda s: ilg.kit(s, "kit"), lambda s: ilg.page(s, "page.html")):
        with pytest.raises(InputError, match=r"has \[electrodes\], and .* one lump"):
            call(FOUR)
