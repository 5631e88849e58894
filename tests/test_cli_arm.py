"""`ilg-circuit arm`: files, summary, refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ilg_circuit import cli_arm
from ilg_circuit.arm import read_motion
from ilg_circuit.cli import main

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The command in this process, in an empty working directory."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as caught:
            main(["arm", *arguments])
        streams = capsys.readouterr()
        return int(caught.value.code or 0), streams.out, streams.err

    return call


def test_a_strip_moves(run: Run, tmp_path: Path) -> None:
    code, out, err = run("--duration", "0.2s", "--samples", "5", "--out", "motion.nc", "--plot", "arm.png")
    assert (code, err) == (0, "")
    for line in ("beam, 15 segments, 30 mm long: 0.00221 sin(2 pi t/1.03546 s)", "implicit method", "energy balance"):
        assert line in out
    motion = read_motion(tmp_path / "motion.nc")
    assert len(motion.time) == 5
    assert motion.arm.damping == pytest.approx(0.4315, rel=1e-3)
    assert {p.name for p in tmp_path.iterdir()} == {"motion.nc", "arm.png"}


def test_an_octopus_arm(run: Run, tmp_path: Path) -> None:
    options = ("--formulation", "yekutieli", "--segments", "6", "--mounting", "hanging", "--rest-ratio", "0.7")
    code, _, _ = run(*options, "--duration", "0.1s", "--step", "50ms", "--out", "motion.nc", "--animate", "arm.gif")
    assert code == 0
    motion = read_motion(tmp_path / "motion.nc")
    assert motion.arm.muscle.rest_ratio == 0.7
    assert motion.tip[0] == pytest.approx([0.0, -0.24])
    assert (tmp_path / "arm.gif").read_bytes().startswith(b"GIF8")


def test_a_hanging_strip_may_begin_in_equilibrium(run: Run, tmp_path: Path) -> None:
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
        (("--amplitude", "0.7"), "amplitude 0.7 is out of range; give -0.5 to 0.5"),
        (("--amplitude", "nan"), "amplitude nan is out of range"),
        (("--formulation", "yekutieli", "--amplitude", "2"), "give -1 to 1"),
        (("--activation", "wave"), "choose the formulation yekutieli"),
        (("--formulation", "yekutieli", "--activation", "wave", "--amplitude", "0.1"), "the reach has its own levels"),
        (("--period", "0s"), "period 0 s must be more than zero"),
        (("--tolerance", "1"), "tolerance is 1"),
        (("--animate", "arm.avi"), "end its name in .gif or .mp4"),
        (("--plot", "arm.gif"), "end its name in .png, .pdf or .svg"),
        (("--plot", "motion.nc"), "name the same file"),
        (("--out", "nowhere/motion.nc"), "does not exist"),
        (("--actuator", "none.toml"), "none.toml"),
    ],
)
def test_refusals_are_one_line(run: Run, tmp_path: Path, options: tuple[str, ...], hint: str) -> None:
    code, out, err = run("--duration", "0.1s", "--out", "motion.nc", *options)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert hint in err
    assert not list(tmp_path.iterdir())


def test_what_is_missing_is_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli_arm, "find_spec", lambda name: None if name in ("numba", "PIL") else name)
    code, _, err = run("--duration", "0.1s", "--out", "motion.nc")
    assert code == 2
    assert "the arm needs numba, pillow: install with pip install 'ilg-circuit[arm]'" in err
