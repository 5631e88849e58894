"""`ilg-circuit arm`: files, summary, refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command import Run
from PIL import Image

from ilg_circuit import extras
from ilg_circuit.arms import reach, read_motion
from ilg_circuit.oscillators.network import ring, unit
from ilg_circuit.oscillators.run import run as run_network

Arm = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(run: Run) -> Arm:
    """The command ``arm``: exit code, stdout, stderr."""

    def call(*arguments: str) -> tuple[int, str, str]:
        done = run("arm", *arguments)
        return done.code, done.out, done.err

    return call


def test_a_strip_moves(run: Arm, tmp_path: Path) -> None:
    options = ("--activation", "sine", "--duration", "0.2s", "--samples", "5")
    code, out, err = run(*options, "--out", "motion.nc", "--plot", "arm.png")
    assert (code, err) == (0, "")
    for line in ("beam, 15 segments, 30 mm long: 0.00221 sin(2 pi t/1.03546 s)", "implicit method", "energy balance"):
        assert line in out
    assert "coupling" not in out
    motion = read_motion(tmp_path / "motion.nc")
    assert len(motion.time) == 5
    assert motion.arm.damping == pytest.approx(0.4315, rel=1e-3)
    assert motion.signals == {}
    assert {p.name for p in tmp_path.iterdir()} == {"motion.nc", "arm.png"}


def test_a_rhythm_drives_the_arm_unless_told_otherwise(run: Arm, tmp_path: Path) -> None:
    code, out, err = run("--segments", "3", "--duration", "4.2s", "--out", "motion.nc")
    assert (code, err) == (0, "")
    assert "beam, 3 segments, 30 mm long: ideal coupling to 1 unit(s), 4.2 s" in out
    assert "100.00%       0 deg" in out
    motion = read_motion(tmp_path / "motion.nc")
    period = motion.time[-1] - np.array([0.0, 1.0354632])
    last, before = (np.interp(t, motion.time, motion.signals["outputs"][:, 0]) for t in period)
    assert last == pytest.approx(before, abs=2e-3)
    assert np.abs(motion.signals["voltages"]).max() == 4.0


def test_an_animation_shows_the_rhythm(run: Arm, tmp_path: Path) -> None:
    options = ("--segments", "2", "--duration", "0.3s", "--samples", "7", "--out", "motion.nc")
    assert run(*options, "--animate", "arm.gif")[0] == 0
    with Image.open(tmp_path / "arm.gif") as image:
        assert image.size == (840, 420)  # with the phase portrait beside the arm


@pytest.mark.parametrize("extra", [(), ("--neurons-in-circuit",)])
def test_through_the_circuit(run: Arm, tmp_path: Path, extra: tuple[str, ...]) -> None:
    options = ("--segments", "3", "--rhythm", "chain", "--coupling", "circuit", "--voltage", "3V", "--slower", "2")
    code, out, err = run(*options, *extra, "--duration", "3s", "--samples", "31", "--out", "motion.nc")
    assert code == 0
    assert "coupling circuit: what is left of the ideal strain of 0.00166" in out
    assert "2.071 s       0.88%     -92 deg" in out
    assert "the circuit keeps 0.88% of the ideal amplitude at the rhythm's 2.071 s (below 70%)" in err
    motion = read_motion(tmp_path / "motion.nc")
    assert np.abs(motion.signals["voltages"]).max() <= 3.0
    assert np.abs(motion.signals["charges"][-1]).min() > 0
    assert np.abs(motion.activations).max() < 0.03 * 0.00166
    assert np.ptp(motion.signals["voltages"], axis=1).max() > 0.5  # a unit for each segment


def test_a_reference_keeps_the_strength_of_another_rhythm(run: Arm, tmp_path: Path) -> None:
    """By its own amplitude any rhythm strains alike; by a given one a weaker, slower rhythm strains less."""
    options = ("--segments", "2", "--duration", "3s", "--samples", "61", "--rise-time", "0.4s", "--adaptation", "4")
    largest = []
    for extra in ((), ("--reference", "0.462008")):
        assert run(*options, *extra, "--out", "motion.nc")[0] == 0
        largest.append(np.abs(read_motion(tmp_path / "motion.nc").activations).max())
    amplitude = run_network(unit(rise_time=0.4, adaptation=4.0), [1.0]).amplitude
    assert largest[1] / largest[0] == pytest.approx(amplitude / 0.462008, rel=1e-6)


@pytest.mark.parametrize("rhythm", ["unit", "ring", "one-way-ring"])
def test_rhythms(run: Arm, tmp_path: Path, rhythm: str) -> None:
    options = ("--rhythm", rhythm, "--inhibition", "3", "--tonic", "2", "--segments", "2")
    assert run(*options, "--duration", "1s", "--samples", "11", "--out", "motion.nc")[0] == 0
    outputs = read_motion(tmp_path / "motion.nc").signals["outputs"]
    network = {"unit": unit(3.0, tonic=2.0), "ring": ring(3, 3.0, tonic=2.0)}.get(
        rhythm, ring(3, 3.0, one_way=True, tonic=2.0)
    )
    assert outputs[:, 1] == pytest.approx(run_network(network, np.linspace(0, 1, 11)).unit_outputs[:, 0], abs=1e-4)


def test_snapshots_keep_pace_with_the_rhythm(run: Arm, tmp_path: Path) -> None:
    import matplotlib

    options = ("--segments", "2", "--slower", "4", "--duration", "4.2s", "--samples", "43", "--out", "motion.nc")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        assert run(*options, "--plot", "arm.svg")[0] == 0
    text = (tmp_path / "arm.svg").read_text(encoding="utf-8")
    assert all(f">{label} s<" in text for label in ("2", "2.8", "4"))
    assert ">0.5 s<" not in text


def test_a_search_for_a_place(run: Arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("SAMPLE", 8), ("_STARTS", 1), ("_LOCAL", 8)):
        monkeypatch.setattr(reach, name, value)
    options = ("--segments", "4", "--duration", "3s", "--samples", "31", "--out", "motion.nc", "--plot", "reach.png")
    code, out, _ = run(*options, "--reach", "20mm,-8mm", "--within", "0.5mm")
    assert code == 0  # a target out of reach is a result
    assert "target (20 mm, -8 mm): NOT reached within 500 um; the tip passes at (29." in out
    assert "the paper's claim, 'can reach any specified position', does not hold here:" in out
    motion = read_motion(tmp_path / "motion.nc")
    assert len(motion.time) == 31
    assert motion.tip[:, 1].min() < -1e-3  # towards the target
    assert (tmp_path / "reach.png").read_bytes().startswith(b"\x89PNG")
    code, out, _ = run(*options, "--reach", "29.99mm, 0.1mm", "--seed", "3")
    assert code == 0
    assert "target (29.99 mm, 100 um): reached within 300 um" in out


def test_an_octopus_arm(run: Arm, tmp_path: Path) -> None:
    options = ("--formulation", "yekutieli", "--segments", "6", "--mounting", "hanging", "--rest-ratio", "0.7")
    code, _, _ = run(*options, "--duration", "0.1s", "--step", "50ms", "--out", "motion.nc", "--animate", "arm.gif")
    assert code == 0
    motion = read_motion(tmp_path / "motion.nc")
    assert motion.arm.muscle.rest_ratio == 0.7
    assert motion.tip[0] == pytest.approx([0.0, -0.24])
    assert (tmp_path / "arm.gif").read_bytes().startswith(b"GIF8")


def test_a_hanging_strip_may_begin_in_equilibrium(run: Arm, tmp_path: Path) -> None:
    code, _, _ = run("--mounting", "hanging", "--settled", "--duration", "0.1s", "--samples", "3", "--out", "motion.nc")
    assert code == 0
    motion = read_motion(tmp_path / "motion.nc")
    assert motion.tip[0, 1] == pytest.approx(-30.73e-3, abs=2e-5)
    assert motion.tip[-1, 1] == pytest.approx(motion.tip[0, 1], abs=1e-7)


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        (("--segments", "0"), "arm.segments is 0"),
        (("--duration", "-1s"), "must be more than zero"),
        (("--duration", "nan"), "not a number with a unit"),
        (("--formulation", "yekutieli", "--rest-ratio", "1.2"), "muscle.rest_ratio is 1.2"),
        (("--rest-ratio", "0.5"), "the beam formulation has none"),
        (("--activation", "sine", "--amplitude", "0.7"), "amplitude 0.7 is out of range; give -0.5 to 0.5"),
        (("--activation", "sine", "--amplitude", "nan"), "is not a number; write it like"),
        (("--formulation", "yekutieli", "--activation", "sine", "--amplitude", "2"), "give -1 to 1"),
        (("--activation", "wave"), "choose the formulation yekutieli"),
        (("--formulation", "yekutieli", "--activation", "wave", "--amplitude", "0.1"), "the wave has its own levels"),
        (("--period", "0s", "--activation", "sine"), "period 0 s must be more than zero"),
        (("--tolerance", "1"), "tolerance is 1"),
        (("--amplitude", "0.1"), "--amplitude belongs to a sine"),
        (("--activation", "sine", "--coupling", "circuit"), "--coupling circuit goes with --activation cpg"),
        (("--activation", "sine", "--tonic", "2"), "--tonic belongs to --activation cpg"),
        (("--activation", "sine", "--rise-time", "0.1s"), "--rise-time belongs to --activation cpg"),
        (("--rise-time", "0.1"), "'0.1' has no unit"),
        (("--reference", "0"), "reference 0 must be more than zero"),
        (("--reach", "29mm,1mm", "--reference", "1"), "leave out --reference"),
        (("--activation", "wave", "--neurons-in-circuit"), "--neurons-in-circuit belongs to --activation cpg"),
        (("--neurons-in-circuit",), "no circuit to put the neurons in"),
        (("--voltage", "4"), "'4' has no unit"),
        (("--voltage", "0V"), "voltage 0 V must be more than zero"),
        (("--slower", "0"), "0 times slower"),
        (("--slower", "nan"), "is not a number; write it like"),
        (("--inhibition", "nan"), "is not a number; write it like"),
        (("--tonic", "inf"), "is not a number; write it like"),
        (("--reach", "20mm"), "is not a place; write x,y with units"),
        (("--reach", "20mm,8mm,1mm"), "is not a place; write x,y with units"),
        (("--reach", "20mm,"), "--reach y: '' is not a number with a unit"),
        (("--reach", "20,8"), "--reach x: '20' has no unit"),
        (("--reach", "nan,8mm"), "--reach x: 'nan' is not a number with a unit"),
        (("--reach", "20mm,8V"), "--reach y: unit 'V' does not measure this quantity"),
        (("--reach", "20mm,8mm", "--within", "0mm"), "tolerance 0 m must be more than zero"),
        (("--reach", "20mm,8mm", "--tonic", "1"), "leave out --tonic"),
        (("--reach", "20mm,8mm", "--slower", "2"), "leave out --slower"),
        (("--reach", "20mm,8mm", "--neurons-in-circuit"), "leave out --neurons-in-circuit"),
        (("--reach", "20mm,8mm", "--amplitude", "0.1"), "--amplitude belongs to a sine"),
        (("--reach", "20mm,8mm", "--activation", "sine"), "it does not go with --activation sine"),
        (("--reach", "20mm,8mm", "--method", "explicit"), "leave out --method and --tolerance"),
        (("--reach", "20mm,8mm", "--seed", "-1"), "give a whole number from 0 to 2^63 - 1"),
        (("--within", "1mm"), "--within goes with --reach"),
        (("--animate", "arm.avi"), "end its name in .gif or .mp4"),
        (("--plot", "arm.gif"), "end its name in .png, .pdf or .svg"),
        (("--plot", "motion.nc"), "name the same file"),
        (("--out", "nowhere/motion.nc"), "does not exist"),
        (("--actuator", "none.toml"), "none.toml"),
    ],
)
def test_refusals_are_one_line(run: Arm, tmp_path: Path, options: tuple[str, ...], hint: str) -> None:
    code, out, err = run("--duration", "0.1s", "--out", "motion.nc", *options)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert hint in err
    assert not list(tmp_path.iterdir())


def test_what_is_missing_is_named(run: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name in ("numba", "PIL") else name)
    code, _, err = run("--duration", "0.1s", "--out", "motion.nc")
    assert code == 2
    assert "the arm needs numba, pillow: install with pip install 'ilg-circuit[arm]'" in err
