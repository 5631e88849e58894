"""Sweeps that version 0.1.0 wrote are read, and its interrupted ones resumed."""

import gzip
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command import Run

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")
from ilg_circuit import __version__
from ilg_circuit.provenance import digest
from ilg_circuit.report.sweep import dataset_figure
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import save_actuator
from ilg_circuit.study.dataset import read_sweep

KEPT = Path(__file__).parents[1] / "data_0_1_0"
#: The sweep that both are of; it was interrupted after 16 of its 32 designs.
SWEEP = (
    "sweep", "strip.toml", "--vary", "emission_voltage=5V:10V", "--vary", "thickness=0.3mm:1mm", "--random", "32",
    "--seed", "3", "--drive", "step:1V", "--duration", "20s", "--beam", "static", "--accuracy", "1e-4",
    "--outputs", "displacement_final,relative_deflection", "--jobs", "1", "--out", "sweep.nc",
)  # fmt: skip


@pytest.fixture
def old(tmp_path: Path) -> Path:
    path = tmp_path / "old.nc"
    path.write_bytes(gzip.decompress((KEPT / "sweep.nc.gz").read_bytes()))
    return path


def test_a_sweep_of_0_1_0_is_read_and_drawn(old: Path) -> None:
    with read_sweep(old) as data:
        assert data.attrs["source"] == "ilg_circuit 0.1.0"
        assert data.sizes == {"design": 32}
        assert np.isfinite(data.displacement_final.values).all()
        assert len(dataset_figure(data, ("displacement_final",)).axes) == 2


def test_an_interrupted_sweep_of_0_1_0_is_resumed(run: Run, old: Path, tmp_path: Path) -> None:
    shutil.copytree(KEPT / "sweep.nc.part", tmp_path / "sweep.nc.part")
    save_actuator(PAPER, tmp_path / "strip.toml")
    done = run(*SWEEP)
    assert done.code == 0, done.err
    assert "16 of them by an earlier run" in done.out
    assert not (tmp_path / "sweep.nc.part").exists()
    with read_sweep(old) as before, read_sweep(tmp_path / "sweep.nc") as after:
        for name in ("displacement_final", "relative_deflection", "thickness", "emission_voltage"):
            assert after[name].values == pytest.approx(before[name].values, rel=1e-7)
        provenance = json.loads(after.attrs["provenance"])
    assert provenance["version"] == __version__
    assert provenance["seed"] == 3
    assert provenance["inputs"] == {"strip.toml": digest(tmp_path / "strip.toml")}
