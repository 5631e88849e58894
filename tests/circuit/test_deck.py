"""Netlists to hand out: they say what they are, and plain ngspice computes from them what this package does."""

from __future__ import annotations

import re
import subprocess
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from spice import NGSPICE, with_ngspice

from ilg_circuit import __version__
from ilg_circuit.circuit import Load, strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.circuit.library import library
from ilg_circuit.circuit.operating_point import with_operating_point
from ilg_circuit.circuit.provenance import LONGEST_STEP
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator

Array = NDArray[np.float64]


def run(text: str, folder: Path) -> dict[str, Array]:
    """Columns of the table that plain ngspice prints for a deck; wide tables come in several parts."""
    (folder / "deck.cir").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(NGSPICE), "-n", "-b", "deck.cir"], cwd=folder, capture_output=True, text=True, timeout=60, check=True
    )
    columns: dict[str, dict[int, float]] = defaultdict(dict)
    names: list[str] = []
    for line in done.stdout.splitlines():
        if line.startswith("Index"):
            names = line.split()[1:]
        elif names and re.match(r"\d+\t", line):
            index, *values = line.split()
            for name, value in zip(names, values, strict=True):
                columns[name][int(index)] = float(value)
    assert columns, done.stdout + done.stderr
    return {name: np.array([column[k] for k in sorted(column)]) for name, column in columns.items()}


def text_of(strip: Actuator, drive: str, duration: float, **how: object) -> str:
    return deck(strip_netlist(strip, **how), parse_drive(drive, duration), duration, strip)


# -- text --------------------------------------------------------------------------------------------------------------


def test_the_header_says_what_it_is() -> None:
    lines = text_of(PAPER, "step:4V", 300.0).splitlines()
    assert lines[0] == "* ILG strip paper, dynamic beam, free tip"
    header = "\n".join(line for line in lines if line.startswith("*"))
    assert f"written by ilg_circuit {__version__}; strip L 35 mm, L0 30 mm, L_F 30 mm, w 5 mm, b 500 um" in header
    assert "1 V = 1 uN, 1 A = 1 mm/s" in header
    assert "drive: step 4 V" in header
    assert "out_current [A], out_charge [C], out_displacement [m]" in header
    assert "ngspice -b" in header
    assert lines[-1] == ".end"


@pytest.mark.parametrize("tip", ["free", "clamped"])
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_every_element_is_in_the_deck(tip: str, beam: str) -> None:
    netlist = strip_netlist(PAPER, tip=tip, beam=beam)
    lines = deck(netlist, parse_drive("step:4V", 300.0), 300.0, PAPER).splitlines()
    for element in with_operating_point(netlist).elements:
        if element.name != "Vdrive":
            line = next(line for line in lines if line.startswith(element.name + " "))
            assert repr(element.value) in line.split()
            assert line.split()[1 : 1 + len(element.nodes)] == list(element.nodes)


@pytest.mark.parametrize("bends", [True, False])
def test_what_another_program_puts_into_inductors_is_told_where_there_are_any(bends: bool) -> None:
    """The beam and its coupling have inductors; the electrical port has none."""
    lines = text_of(PAPER if bends else replace(PAPER, coupling=None), "step:4V", 300.0).splitlines()
    assert any(line.startswith("L") for line in lines) == bends
    assert any("Rser=0" in line for line in lines) == bends


def test_outputs_that_are_always_zero_are_left_out() -> None:
    assert "out_force" not in text_of(PAPER, "step:4V", 300.0)
    clamped = text_of(PAPER, "step:4V", 300.0, tip="clamped")
    assert "out_force" in clamped
    assert "out_displacement" not in clamped


@pytest.mark.parametrize("duration", [1.0, 300.0, 86400.0])
def test_the_transient_covers_the_run(duration: float) -> None:
    tran = next(line for line in text_of(PAPER, "step:4V", duration).splitlines() if line.startswith(".tran"))
    step, end, start, longest, uic = tran.split()[1:]
    assert float(end) == duration
    assert float(start) == 0
    assert 0 < float(longest) <= float(step) < duration
    assert uic == "uic"


@pytest.mark.parametrize(("frequency", "longest"), [(0.1, 0.01 / (0.2 * np.pi)), (1e-5, 300.0 * LONGEST_STEP)])
def test_a_sine_is_stepped_hundreds_of_times_a_cycle(frequency: float, longest: float) -> None:
    """A hundredth of a radian at most; slow ones as any other run."""
    tran = next(line for line in text_of(PAPER, f"sine:2V,{frequency}Hz", 300.0).splitlines() if line[:5] == ".tran")
    assert float(tran.split()[4]) == pytest.approx(longest, rel=2e-3)


def test_long_waveforms_are_folded() -> None:
    times = np.arange(500) * 0.1
    drive = PiecewiseLinear(times, np.sin(times), "measured")
    lines = deck(strip_netlist(PAPER), drive, 50.0, PAPER).splitlines()
    assert max(map(len, lines)) <= 120
    unfolded = "\n".join(lines).replace("\n+ ", " ")
    assert drive.spice(50.0) in unfolded


@pytest.mark.parametrize("name", ["x\n.control\nshell true\n.endc", "x\r.end", "\N{GREEK SMALL LETTER MU}"])
def test_a_name_cannot_smuggle_lines_into_a_deck(name: str) -> None:
    clean, odd = (text_of(replace(PAPER, name=n), "step:4V", 300.0) for n in ("x", name))
    assert len(odd.splitlines()) == len(clean.splitlines())
    clean, odd = (library(replace(PAPER, name=n)) for n in ("x", name))
    assert len(odd.splitlines()) == len(clean.splitlines())


# -- what plain ngspice makes of it ------------------------------------------------------------------------------------

CASES = {
    "step": ("paper", "step:4V", 100.0, {}),
    "clamped": ("paper", "step:4V", 100.0, {"tip": "clamped"}),
    "static": ("paper", "step:-2V", 100.0, {"beam": "static"}),
    "static clamped": ("paper", "step:2V", 100.0, {"beam": "static", "tip": "clamped"}),
    "square": ("paper", "square:-4V..4V,30s", 80.0, {}),
    "square to an edge": ("paper", "square:4V,30s", 45.0, {}),
    "sine": ("paper", "sine:2V,0.1Hz", 30.0, {}),
    "ramp": ("paper", "ramp:40mV/s", 100.0, {}),
    "electrodes": ("electrodes", "step:4V", 60.0, {}),
    "two branches": ("rc2", "step:4V", 60.0, {}),
    "no coupling": ("no coupling", "step:4V", 60.0, {}),
    "load": ("paper", "step:4V", 60.0, {"load": Load(mass=2e-5, stiffness=3e-5, damping=1e-5)}),
}


@with_ngspice
@pytest.mark.parametrize(("which", "drive", "duration", "how"), CASES.values(), ids=CASES)
def test_plain_ngspice_agrees(
    strips: dict[str, Actuator], tmp_path: Path, which: str, drive: str, duration: float, how: dict[str, object]
) -> None:
    printed = run(text_of(strips[which], drive, duration, **how), tmp_path)
    time = printed.pop("time")
    assert time[-1] == pytest.approx(duration)
    time, first = np.unique(np.minimum(time, duration), return_index=True)
    response = simulate(strips[which], parse_drive(drive, duration), time, engine="exact", **how)
    # samples within a rise are neither before nor after the jump; times are printed to seven digits
    edges = parse_drive(drive, duration).breakpoints(2 * duration)
    clear = np.abs(time[:, None] - edges).min(axis=1, initial=np.inf) > 1e-4
    waveforms = [name for name in printed if name.startswith("v(out_")]
    assert len(waveforms) == len([o for o in response.netlist.outputs if np.abs(getattr(response, o.name)).max()])
    for column in waveforms:
        # ngspice cuts long names off in its table
        start = column.removeprefix("v(out_").removesuffix(")")
        name = next(o.name for o in response.netlist.outputs if o.name.startswith(start))
        expected, found = getattr(response, name), printed[column][first]
        scale = np.abs(expected).max()
        assert found[clear] == pytest.approx(expected[clear], abs=1e-5 * scale), name


@with_ngspice
@pytest.mark.parametrize("drive", ["square:1V,1us", "square:4V,30s,1e-8"])
def test_drives_faster_than_a_rise_still_run(tmp_path: Path, drive: str) -> None:
    duration = 5e-6 if "us" in drive else 90.0
    printed = run(text_of(PAPER, drive, duration), tmp_path)
    assert printed["time"][-1] == pytest.approx(duration)


# -- the subcircuit ----------------------------------------------------------------------------------------------------


def test_library_pins() -> None:
    text = library(PAPER)
    assert ".subckt ilg_strip plus minus tip\n" in text
    assert text.rstrip().endswith(".ends ilg_strip")
    assert ".subckt gel plus minus tip\n" in library(PAPER, "gel")
    assert ".subckt ilg_strip plus minus\n" in library(replace(PAPER, coupling=None))


@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2", "undamped", "no coupling"])
def test_library_has_no_source_of_its_own(strips: dict[str, Actuator], which: str) -> None:
    text = library(strips[which])
    assert "Vdrive" not in text
    assert "PWL" not in text


TIPS = {
    "free": ("Vtip tip 0 0", {}),
    "clamped": ("Rtip tip 0 1e12", {"tip": "clamped"}),
    "spring": ("Ctip tip 0 33.333333333 ic=0", {"load": Load(stiffness=3e-5)}),
    "mass": ("Ltip tip 0 0.02 ic=0", {"load": Load(mass=2e-5)}),
    "dashpot": ("Rtip tip 0 0.01", {"load": Load(damping=1e-5)}),
}


@with_ngspice
@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2"])
@pytest.mark.parametrize(("load", "how"), TIPS.values(), ids=TIPS)
def test_the_subcircuit_behaves_like_the_strip(
    strips: dict[str, Actuator], tmp_path: Path, which: str, load: str, how: dict[str, object]
) -> None:
    (tmp_path / "strip.lib").write_text(library(strips[which]))
    # the strip hangs between two supplies, so that nothing in it may lean on ground
    lines = [
        "a user's circuit",
        ".include strip.lib",
        "Vplus plus 0 3",
        "Vminus minus 0 -1",
        "X1 plus minus tip ilg_strip",
        load,
        "Hcurrent current 0 Vplus -1",
        ".options reltol=1e-6 trtol=1 abstol=1e-9 chgtol=1e-6",
        ".tran 0.1 60 0 0.005 uic",
        ".print tran v(current) v(tip)",
        ".end",
    ]
    printed = run("\n".join(lines) + "\n", tmp_path)
    response = simulate(strips[which], parse_drive("step:4V", 60.0), printed["time"], engine="exact", **how)
    assert printed["v(current)"] == pytest.approx(response.current, abs=1e-5 * response.current.max())
    force = printed["v(tip)"] * 1e-6
    largest = np.abs(response.force).max()
    assert force == pytest.approx(response.force, abs=1e-5 * largest if largest else 1e-15)


@with_ngspice
def test_an_open_tip_is_a_clamped_one(tmp_path: Path) -> None:
    (tmp_path / "strip.lib").write_text(library(PAPER))
    lines = [
        "a user's circuit",
        ".include strip.lib",
        "Vplus plus 0 4",
        "X1 plus 0 tip ilg_strip",
        ".options reltol=1e-6 trtol=1 abstol=1e-9 chgtol=1e-6",
        ".tran 0.1 60 0 0.005 uic",
        ".print tran v(tip)",
        ".end",
    ]
    printed = run("\n".join(lines) + "\n", tmp_path)
    response = simulate(PAPER, parse_drive("step:4V", 60.0), printed["time"], engine="exact", tip="clamped")
    assert printed["v(tip)"] * 1e-6 == pytest.approx(response.force, abs=1e-4 * response.force.max())
