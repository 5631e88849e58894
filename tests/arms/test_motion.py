"""Motions: what they tell, their files, pictures and animations."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ilg_circuit.arms import OCTOPUS, Motion, Plane, passive, read_motion, simulate, sine, strip_arm
from ilg_circuit.arms.motion import VARIABLES
from ilg_circuit.errors import InputError
from ilg_circuit.report import animation
from ilg_circuit.report import motion as motion_report
from ilg_circuit.report.axes import save


@pytest.fixture(scope="module")
def motion() -> Motion:
    arm = replace(strip_arm(segments=6), plane=Plane((0.0, -0.01), (0.0, 1.0), 1.0), curvature=(1.0,) * 6)
    return simulate(arm, sine(arm, 2e-3, 0.5, 1.0), np.linspace(0, 1.0, 21))


def test_what_a_motion_tells(motion: Motion) -> None:
    assert motion.centreline.shape == (21, 7, 2)
    assert motion.tip == pytest.approx(motion.positions[:, -1].mean(axis=1))
    assert motion.first_segment_force.shape == (21, 2)
    times, nodes = motion.snapshots([0.5, 0.72, 3.0])
    assert times == pytest.approx([0.5, 0.7])
    assert nodes[0] == pytest.approx(motion.positions[10])
    # an eigenstrain pulls at the face that it shortens as long as the arm has not followed
    assert motion.first_segment_force[2, 0] > 0 > motion.first_segment_force[2, 1]


def test_a_file_gives_back_the_motion(motion: Motion, tmp_path: Path) -> None:
    motion.write_netcdf(tmp_path / "motion.nc")
    again = read_motion(tmp_path / "motion.nc")
    assert again.arm == motion.arm
    assert (again.method, again.text, again.events) == (motion.method, motion.text, motion.events)
    for name in (*VARIABLES, "time"):
        assert np.array_equal(getattr(again, name), getattr(motion, name)), name
    assert len(list(tmp_path.iterdir())) == 1


def test_a_file_of_an_octopus(tmp_path: Path) -> None:
    motion = simulate(OCTOPUS, passive(OCTOPUS), [0.01])
    motion.write_netcdf(tmp_path / "motion.nc")
    assert read_motion(tmp_path / "motion.nc").arm == OCTOPUS


def test_the_file_has_units(motion: Motion) -> None:
    data = motion.to_xarray()
    assert data["positions"].dims == ("time", "rod", "side", "axis")
    assert data["pressures"].attrs["units"] == "Pa"
    assert data["energies"].sel(energy="shear").shape == (21,)
    assert data["positions"].sel(side="+normal", axis="y").isel(rod=-1).shape == (21,)


def test_files_that_are_no_motions(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_motion(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("no netCDF at all")
    with pytest.raises(InputError, match="as a motion"):
        read_motion(tmp_path / "text.nc")


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_pictures(motion: Motion, tmp_path: Path, suffix: str) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save(motion_report.figure(motion), tmp_path / f"arm{suffix}")
    assert len(list(tmp_path.iterdir())) == 1
    if suffix == ".svg":
        text = (tmp_path / "arm.svg").read_text(encoding="utf-8")
        for label in (
            "x [mm]",
            "y [mm]",
            "tension in segment 1 [",
            "time [s]",
            "0.7 s",
            "tip",
            "scales of x and y differ",
        ):
            assert label in text
        assert "1.5 s" not in text  # the motion ends before


def test_a_short_motion_is_drawn_at_its_end(tmp_path: Path) -> None:
    arm = strip_arm(segments=2)
    save(motion_report.figure(simulate(arm, passive(arm), [0.0, 0.1])), tmp_path / "arm.png")


def test_an_animation_with_a_phase_portrait(motion: Motion, tmp_path: Path) -> None:
    portrait = (np.cos(motion.time), np.sin(motion.time))
    motion_report.animate(motion, tmp_path / "arm.gif", frames_per_second=10, portrait=portrait)
    with Image.open(tmp_path / "arm.gif") as image:
        assert image.n_frames == 11
        assert image.info["duration"] == 100
        assert image.size == (840, 420)
    assert len(list(tmp_path.iterdir())) == 1


def test_animations_that_cannot_be_made(motion: Motion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"end its name in \.gif or \.mp4"):
        motion_report.animate(motion, tmp_path / "arm.png")
    monkeypatch.setattr(animation.shutil, "which", lambda name: None)
    with pytest.raises(InputError, match="no ffmpeg here"):
        motion_report.animate(motion, tmp_path / "arm.mp4")
    with pytest.raises(InputError, match="two arrays of 21 values"):
        motion_report.animate(motion, tmp_path / "arm.gif", portrait=(np.zeros(3), np.zeros(3)))
    assert not list(tmp_path.iterdir())


KEPT = Path(__file__).parents[1] / "data_0_1_0"


@pytest.mark.parametrize(("name", "segments", "events"), [("motion", 2, 3), ("motion_events", 12, 4)])
def test_motions_of_0_1_0_are_read(tmp_path: Path, name: str, segments: int, events: int) -> None:
    (tmp_path / "old.nc").write_bytes(gzip.decompress((KEPT / f"{name}.nc.gz").read_bytes()))
    old = read_motion(tmp_path / "old.nc")
    assert (old.arm.segments, len(old.time), len(old.events)) == (segments, 5, events)
    assert old.provenance.version == "0.1.0"
    assert all(event.finding.code == "arm-recorded" for event in old.events)
    crossing = ("the arm crosses itself at segment 3; self-contact is not modelled (at 1 s)",)
    assert old.warnings == (crossing if name == "motion_events" else ())
    assert f"{segments} segments" in old.summary()
    old.write_netcdf(tmp_path / "again.nc")
    again = read_motion(tmp_path / "again.nc")
    assert (again.warnings, again.events) == (old.warnings, old.events)
    assert (again.positions == old.positions).all()
    assert again.signals.keys() == old.signals.keys()
    assert bool(again.signals) == (name == "motion")
