"""A prediction beside the record that drives it: rest, axis and band, on the command line and in the picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from synthetic import drives, record, step

from ilg_circuit.errors import InputError
from ilg_circuit.identification import Identification
from ilg_circuit.identification.comparison import compare
from ilg_circuit.report.response import compared_line
from ilg_circuit.strip.actuator import PAPER

NOISE = 0.003


@pytest.mark.parametrize("name", ["step", "square", "sine"])
@pytest.mark.parametrize("axis", [1.0, -1.0])
def test_the_true_strip_differs_by_the_noise(name: str, axis: float) -> None:
    r = record(
        drives(4.0)[name], 300.0, 301, rest=20, displacement=True, noise=NOISE, rest_position=5e-3, axis=axis, seed=3
    )
    current, displacement = compare(PAPER, r.measurement(), beam="static", engine="exact")
    assert (current.quantity, displacement.quantity) == ("current", "displacement")
    for part in (current, displacement):
        assert part.rms == pytest.approx(NOISE * part.largest, rel=0.25)
        assert part.covered is None
    assert displacement.reversed_axis == (axis < 0)
    assert not displacement.offset
    # a sine leaves its rest at a reading, which is the last one there
    first = 21 if name == "sine" else 20
    assert displacement.time[0] == pytest.approx(r.columns["time"][first])


def test_without_a_rest_the_mean_difference_goes(step_fit: Identification) -> None:
    r = record(step(), 300.0, 301, displacement=True, noise=NOISE, rest_position=5e-3, seed=3)
    displacement = compare(PAPER, r.measurement(), beam="static", engine="exact")[1]
    assert displacement.offset
    assert "no rest was measured" in compared_line(displacement)
    assert displacement.rms == pytest.approx(NOISE * 4.339e-3, rel=0.25)


def test_the_band_and_the_noise_hold_most_samples(step_fit: Identification) -> None:
    square = record(drives(4.0)["square"], 300.0, 301, rest=20, displacement=True, noise=NOISE, seed=9)
    for part in compare(step_fit.actuator, square.measurement(), band=True, beam="static", engine="exact"):
        assert part.stderr is not None
        assert part.covered is not None
        assert part.covered > 0.9
        assert "within the 95% band" in compared_line(part)


def test_a_clamped_tip_has_no_displacement_to_compare() -> None:
    r = record(step(), 300.0, 301, rest=20, displacement=True)
    assert [part.quantity for part in compare(PAPER, r.measurement(), tip="clamped", engine="exact")] == ["current"]


def test_a_run_that_ends_before_the_onset_is_refused() -> None:
    r = record(step(), 300.0, 301, rest=20)
    with pytest.raises(InputError, match=r"begins at 20 s, the run ends at 10 s"):
        compare(PAPER, r.measurement(), until=10.0)


def test_a_record_as_a_drive_is_compared(run: Run) -> None:
    record(step(), 300.0, 301, rest=20, displacement=True, noise=NOISE).write(Path("r.csv"))
    how = ("simulate", "paper", "--drive", "file:r.csv", "--engine", "exact", "--beam", "static")
    outcome = run(*how, "--duration", "320s", "--plot", "r.png")
    assert outcome.code == 0, outcome.err
    assert "r.csv: current differs by" in outcome.out
    assert "r.csv: displacement differs by" in outcome.out
    assert Path("r.png").read_bytes().startswith(b"\x89PNG")
    short = run(*how, "--duration", "10s")
    assert short.code == 0
    assert "warning: not compared with the measurement" in short.err
    Path("u.csv").write_text("time_s,voltage_V\n0,1\n5,2\n")
    assert "differs" not in run("simulate", "paper", "--drive", "file:u.csv", "--duration", "5s").out
    assert_one_line(run("simulate", "paper", "--drive", "file:none.csv", "--duration", "5s"), "cannot read")


def test_lines_name_the_size_of_the_difference() -> None:
    r = record(step(), 300.0, 301, rest=20, noise=0.0)
    (current,) = compare(PAPER, r.measurement(), engine="exact")
    assert current.rms < 1e-6 * current.largest
    assert compared_line(current).startswith("record.csv: current differs by ")
    assert np.isfinite(current.predicted).all()
