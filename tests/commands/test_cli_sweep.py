"""`ilg-circuit sweep` as a user meets it."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")
from ilg_circuit import __version__
from ilg_circuit.study.dataset import read_sweep

STEP = ("--drive", "step:4V", "--duration", "300s", "--engine", "exact", "--out", "s.nc")


def test_a_grid(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["ilg-circuit", "sweep", "paper"])
    done = run("sweep", "paper", "--vary", "thickness=0.4mm:0.8mm:5", "--vary", "free_length=20mm,30mm", *STEP)
    assert done.code == 0, done.err
    assert "10 of 10 designs solved into s.nc" in done.out
    row = next(line for line in done.out.splitlines() if line.startswith("displacement_final"))
    assert "thickness 800 um, free_length 20 mm" in row
    assert "6.2195 mm" in row  # 3.9805 mm (0.5/0.4)^2
    assert "0.2" in done.err  # 6.2195 mm of 30 mm
    with read_sweep("s.nc") as data:
        assert data.sizes == {"thickness": 5, "free_length": 2}
        call = data.attrs["command"]
        assert call.startswith("ilg-circuit sweep paper --vary thickness=0.4mm:0.8mm:5 --vary free_length=20mm,30mm ")
        assert json.loads(data.attrs["provenance"]) == {"version": __version__, "call": call}


def test_random_designs_with_failures_a_picture_and_waveforms(run: Run) -> None:
    options = ("--random", "12", "--method", "sobol", "--seed", "5", "--waveforms", "displacement", "--samples", "11")
    done = run(
        "sweep", "paper", "--vary", "length=20mm:40mm", "--vary", "width=1mm:9mm", *options, *STEP, "--plot", "s.png"
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "failed, with their reasons in the variable 'failure'" in done.out
    assert Path("s.png").stat().st_size > 10_000
    with read_sweep("s.nc") as data:
        assert data.displacement.shape == (12, 11)
        assert ((data.failure != "") == (data.length < 30e-3)).all()
        solved = data.isel(design=np.flatnonzero(data.failure.values == ""))
        assert solved.displacement[:, -1].values == pytest.approx(solved.displacement_final.values, rel=1e-7)


@pytest.mark.parametrize(
    "varied",
    [
        ("thickness=0.4mm:0.8mm:5",),
        ("thickness=0.2mm:1mm:7", "free_length=10mm:40mm:7"),
        ("thickness=0.2mm:1mm:7", "free_length=10mm:40mm:8", "width=2mm,4mm,6mm"),
        ("orientation=weightless,horizontal", "voltage=1V,2V"),
    ],
)
def test_pictures_of_grids(run: Run, varied: tuple[str, ...]) -> None:
    options = [part for text in varied for part in ("--vary", text)]
    done = run("sweep", "paper", *options, *STEP, "--plot", "s.png", "--plot-outputs", "displacement_final,energy")
    assert done.code == 0, done.err
    assert Path("s.png").stat().st_size > 10_000


def test_designs_of_a_file(run: Run) -> None:
    Path("designs.csv").write_text("thickness_mm,voltage_V\n0.5,4\n,4\n0.25,1\n")
    done = run(
        "sweep", "paper", "--designs", "designs.csv", "--outputs", "displacement_final", "--beam", "static", *STEP
    )
    assert done.code == 0, done.err
    assert "1 x thickness is nan; give a finite value" in done.out
    assert "3.9805 mm  all alike" in done.out  # half the thickness at a quarter of the voltage


THICK = ("--vary", "thickness=1mm,2mm")


@pytest.mark.parametrize(
    ("options", "hints"),
    [
        ((), ("say what to vary",)),
        (("--vary", "thikness=1mm,2mm"), ("perhaps thickness",)),
        (("--vary", "thickness=1,2"), ("has no unit",)),
        ((*THICK, "--outputs", "displacement"), ("choose from displacement_final",)),
        ((*THICK, "--seed", "1"), ("--seed belongs to --random",)),
        ((*THICK, "--samples", "7"), ("--waveforms",)),
        ((*THICK, "--designs", "x.csv"), ("leave out --vary",)),
        ((*THICK, "--plot", "s.txt"), ("end its name in .png",)),
        ((*THICK, "--plot", "s.nc"), ("--out and --plot name the same file",)),
        ((*THICK, "--plot-outputs", "energy"), ("--plot",)),
        ((*THICK, "--plot", "s.png", "--plot-outputs", "enrgy"), ("'enrgy' is not among",)),
        ((*THICK, "--accuracy", "1"), ("between 1e-11 and 1e-2",)),
        ((*THICK, "--jobs", "0"), ("give 1 to 1024",)),
        ((*THICK, "--jobs", "2", "--cluster", "local:2"), ("give one of",)),
    ],
)
def test_wrong_input_is_one_line(run: Run, options: tuple[str, ...], hints: tuple[str, ...]) -> None:
    assert_one_line(run("sweep", "paper", *options, *STEP), *hints)
    assert not Path("s.nc").exists()
    assert not Path("s.nc.part").exists()


def test_when_every_design_fails(run: Run) -> None:
    refused = run("sweep", "paper", "--vary", "length=10mm,20mm", *STEP)
    assert_one_line(refused, "all 2 designs failed", "longer than geometry.length", code=1)
