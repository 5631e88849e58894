"""The files of a sweep: one process at a time, the same bits whatever interrupts it, netCDF or CSV."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

pytest.importorskip("h5netcdf", reason="netCDF files are an extra")

from ilg_circuit.files import locked
from ilg_circuit.study.dataset import read_sweep

GRID = ("sweep", "paper", "--vary", "thickness=0.3mm:1mm:3", "--vary", "orientation=weightless,horizontal")
RUN = ("--drive", "step:1V", "--duration", "10s", "--engine", "exact", "--jobs", "1")


def test_two_processes_do_not_write_one_file(run: Run) -> None:
    Path("link.nc").symlink_to("s.nc")
    with locked(Path("s.nc.part/lock"), "taken"):
        for name in ("s.nc", "link.nc", "../" + Path.cwd().name + "/s.nc"):
            done = run(*GRID, *RUN, "--out", name)
            assert_one_line(done, f"another sweep is being written to '{name}'; wait until it is done, or choose")
        assert [path.name for path in Path("s.nc.part").iterdir()] == ["lock"]
        assert run(*GRID, *RUN, "--out", "other.nc").code == 0
    Path("s.nc.part/lock").touch()  # of a process that was killed
    assert run(*GRID, *RUN, "--out", "link.nc").code == 0
    assert sorted(path.name for path in Path().iterdir()) == ["link.nc", "other.nc", "s.nc"]
    assert Path("link.nc").is_symlink()


def test_a_table_of_designs(run: Run) -> None:
    assert run(*GRID, *RUN, "--outputs", "displacement_final,overshoot", "--out", "s.nc").code == 0
    done = run(*GRID, *RUN, "--outputs", "displacement_final,overshoot", "--out", "s.csv", "--plot", "s.png")
    assert done.code == 0
    header, *rows = [line.split(",") for line in Path("s.csv").read_text().splitlines()]
    assert header == ["thickness_m", "orientation", "displacement_final_m", "overshoot", "error", "failure"]
    assert [row[1] for row in rows] == ["weightless", "horizontal"] * 3
    with read_sweep("s.nc") as data:
        assert [float(row[0]) for row in rows] == np.repeat(data.thickness.values, 2).tolist()
        assert [float(row[2]) for row in rows] == data.displacement_final.values.ravel().tolist()
    assert sorted(path.name for path in Path().iterdir()) == ["s.csv", "s.nc", "s.png"]
    refused = run(*GRID, *RUN, "--waveforms", "current", "--out", "w.csv")
    assert_one_line(refused, "without room for waveforms; end its name in .nc")


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="this platform has no such signals")
def test_whatever_happens_to_its_process_the_bits_are_the_same(run: Run, tmp_path: Path) -> None:
    """Stopped and continued, ended, interrupted and killed, one after the other, each time in the middle."""
    command = [
        "sweep", "paper", "--vary", "emission_voltage=5V:10V", "--random", "96",
        "--drive", "step:1V", "--duration", "20s", "--beam", "static", "--accuracy", "1e-4", "--jobs", "1",
    ]  # fmt: skip
    assert run(*command, "--out", "whole.nc").code == 0
    parts = tmp_path / "s.nc.part"
    for number in (signal.SIGSTOP, signal.SIGTERM, signal.SIGKILL):
        done = len(list(parts.glob("*/0*.npz")))
        program = subprocess.Popen(
            [sys.executable, "-m", "ilg_circuit", *command, "--out", "s.nc"],
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        while len(list(parts.glob("*/0*.npz"))) <= done and program.poll() is None:
            time.sleep(0.01)
        assert program.poll() is None, "it was done before it could be disturbed"
        program.send_signal(number)
        if number == signal.SIGSTOP:
            time.sleep(0.1)
            program.send_signal(signal.SIGCONT)
            program.send_signal(signal.SIGINT)
        _, told = program.communicate(timeout=30)
        code = {signal.SIGSTOP: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}[number]
        assert program.returncode == code
        assert told.count("ilg-circuit: ") == (code > 0), told
        assert "Traceback" not in told
    finished = len(list(parts.glob("*/0*.npz")))
    assert 3 <= finished < 6
    assert f"{16 * finished} of them by an earlier run" in run(*command, "--out", "s.nc").out
    with read_sweep("whole.nc") as whole, read_sweep("s.nc") as disturbed:
        assert whole.load().equals(disturbed.load())
    assert not parts.exists()
    assert os.listdir(tmp_path) in (["whole.nc", "s.nc"], ["s.nc", "whole.nc"])
