"""`ilg-circuit design` as a user calls it: tables, files, exit codes, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns

from ilg_circuit.strip.actuator import PAPER, Uncertainty
from ilg_circuit.strip.file import load_actuator, save_actuator

pytestmark = pytest.mark.usefixtures("brisk")

RUN = ("--drive", "step:4V", "--duration", "300s", "--beam", "static")
SIZES = ("--vary", "thickness=0.2mm:1mm", "--vary", "free_length=15mm:40mm")
VOLTAGE = ("--vary", "voltage=1V:4V")


def test_a_design_and_its_files(run: Run, tmp_path: Path) -> None:
    asked = ("--require", "displacement_final>=4mm", "--require", "force_blocked>=0.1uN", "--minimise", "energy")
    files = ("--json", "d.json", "--out", "best.toml", "--plot", "d.png")
    done = run("design", "paper", *asked, *SIZES, *VOLTAGE, *RUN, *files)
    assert done.code == 0, done.err
    assert "4 of which agree" in done.out
    assert "force_blocked >= 100 nN" in done.out
    found = json.loads((tmp_path / "d.json").read_text())["design"]
    assert found["feasible"]
    assert all(r["met"] and r["ngspice"] == pytest.approx(r["value"], rel=1e-5) for r in found["requirements"])
    assert {x["what"] for x in found["limits"] if x["binds"]} >= {
        "displacement_final >= 4 mm",
        "force_blocked >= 100 nN",
    }
    strip = load_actuator("best.toml")
    assert strip.geometry.thickness == found["parameters"]["thickness"]["value"]
    assert (tmp_path / "d.png").stat().st_size > 10_000
    again = run("simulate", "best.toml", "--drive", found["drive"], *RUN[2:], "--out", "run.csv")
    assert again.code == 0, again.err
    assert columns(tmp_path / "run.csv")["displacement_m"][-1] >= 4e-3


def test_what_cannot_be_met_is_exit_code_1(run: Run, tmp_path: Path) -> None:
    asked = ("--require", "displacement_final>=4mm", "--require", "energy<=1mJ")
    done = run("design", "paper", *asked, *SIZES, *RUN, "--json", "d.json", "--out", "best.toml", "--plot", "d.png")
    assert done.code == 1
    assert "NO design meets all requirements" in done.out
    assert "without energy <= 1 mJ the others can be met" in done.out
    assert "is out of reach by itself" in done.out
    assert done.err.splitlines()[-1].startswith(
        "ilg-circuit: no design within the ranges meets displacement_final >= 4 mm"
    )
    found = json.loads((tmp_path / "d.json").read_text())["design"]
    assert not found["feasible"]
    assert found["worst_margin"] < 0
    assert not (tmp_path / "best.toml").exists()


def test_a_front(run: Run, tmp_path: Path) -> None:
    asked = ("--pareto", "displacement_final,force_blocked,energy", "--points", "6")
    files = ("--front", "f.csv", "--plot", "f.png", "--json", "f.json")
    done = run("design", "paper", *asked, *SIZES, *VOLTAGE, *RUN, *files)
    assert done.code == 0, done.err
    table = columns(tmp_path / "f.csv")
    assert list(table) == [
        "thickness_m", "free_length_m", "voltage_V", "displacement_final_m", "force_blocked_N", "energy_J",
    ]  # fmt: skip
    assert len(table["energy_J"]) == 6
    found = json.loads((tmp_path / "f.json").read_text())
    assert found["design"] is None
    assert found["front"]["ngspice"]["energy"] == table["energy_J"].tolist()
    assert (tmp_path / "f.png").stat().st_size > 10_000


def test_uncertainty_and_indices(run: Run, tmp_path: Path) -> None:
    fit = Uncertainty("rc", ("coupling_gain",), ((0.03**2,),))
    save_actuator(PAPER.__class__(**{**PAPER.__dict__, "uncertainty": fit}), "fitted.toml")
    asked = ("--require", "displacement_final>=4mm", "--minimise", "voltage", "--confidence", "95%")
    more = ("--sobol", "--sobol-plot", "s.png", "--json", "d.json")
    done = run("design", "fitted.toml", *asked, *VOLTAGE, "--vary", "thickness=0.3mm:0.6mm", *RUN, *more)
    assert done.code == 0, done.err
    assert "coupling_gain (100%)" in done.out
    found = json.loads((tmp_path / "d.json").read_text())
    assert found["design"]["uncertainty"]["all_met"] == pytest.approx(0.95, abs=0.03)
    assert set(found["sobol"]) == {"displacement_final"}
    assert (tmp_path / "s.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "hints"),
    [
        (("--require", "displacment_final>=4mm", *SIZES), ("unknown quantity", "displacement_final")),
        (("--require", "displacement_final>=4V", *SIZES), ("displacement_final>=4V", "does not measure")),
        (("--require", "displacement_final>4mm", *SIZES), ("write it like",)),
        (("--require", "energy<=1J", "--vary", "thickness=1mm:0.2mm"), ("smaller end first",)),
        (("--require", "energy<=1J", "--vary", "thicknes=0.2mm:1mm"), ("unknown parameter", "thickness")),
        (("--require", "energy<=1J", "--vary", "thickness=0.2mm:1mm:20"), ("whole range",)),
        (("--require", "energy<=1J"), ("nothing is left to choose",)),
        (SIZES, ("nothing is asked",)),
        (("--minimise", "energy", "--maximise", "energy", *SIZES), ("give one of them",)),
        (("--pareto", "energy", *SIZES), ("two or three",)),
        (("--pareto", "energy,force_blocked", "--out", "b.toml", *SIZES), ("--out", "--require")),
        (("--minimise", "energy", "--points", "3", *SIZES), ("--points goes with --pareto",)),
        (("--minimise", "energy", "--confidence", "95%", *SIZES), ("--require",)),
        (("--minimise", "energy", "--sensitivity", *SIZES), ("no [uncertainty]",)),
        (("--minimise", "energy", "--plot", "x.gif", *SIZES), (".png",)),
        (("--minimise", "energy", "--json", "a.x", "--out", "a.x", *SIZES), ("same file",)),
        (("--minimise", "energy", "--vary", "period=1s:2s"), ("not part of the drive",)),
    ],
)
def test_refusals(run: Run, arguments: tuple[str, ...], hints: tuple[str, ...]) -> None:
    assert_one_line(run("design", "paper", *arguments, *RUN), *hints)


def test_a_sine_s_drive_is_said_as_it_is_taken(run: Run, tmp_path: Path) -> None:
    asked = ("--require", "displacement_rms>=1mm", "--minimise", "voltage", "--vary", "voltage=1V:4V")
    done = run(
        "design",
        "paper",
        *asked,
        "--drive",
        "sine:2V,0.01Hz",
        "--duration",
        "200s",
        "--beam",
        "static",
        "--json",
        "d.json",
    )
    assert done.code == 0, done.err
    found = json.loads((tmp_path / "d.json").read_text())["design"]
    assert found["drive"] == f"sine:{found['parameters']['voltage']['value']:g}V,0.01Hz"
    assert np.isclose(found["requirements"][0]["ngspice"], 1e-3, rtol=3e-4)
