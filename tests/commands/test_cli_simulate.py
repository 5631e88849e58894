"""The command simulate: its contract, options, drives, files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from command import SIMULATE, Run, assert_one_line, columns

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import dumps, save_actuator


def test_simulate_writes_the_contract(run: Run) -> None:
    done = run(*SIMULATE, "--out", "run.csv")
    assert done.code == 0
    table = columns(Path("run.csv"))
    assert list(table) == ["time_s", "voltage_V", "current_A", "displacement_m", "force_N", "charge_C"]
    assert len(table["time_s"]) == 601
    assert table["time_s"][-1] == 100.0
    assert table["current_A"][0] == pytest.approx(0.2118, rel=1e-7)
    assert table["displacement_m"].max() == pytest.approx(4.34e-3, rel=1e-3)
    assert "solved by ngspice, estimated error" in done.out
    assert "displacement" in done.out


def test_simulate_warns_on_stderr(run: Run) -> None:
    done = run("simulate", "paper", "--drive", "step:5V", "--duration", "100s")
    assert done.code == 0
    assert all(line.startswith("warning: ") for line in done.err.splitlines())
    assert "electrochemical window" in done.err


@pytest.mark.parametrize(
    "options",
    [
        ("--tip", "clamped"),
        ("--beam", "static"),
        ("--engine", "exact"),
        ("--load", "mass=1g,stiffness=1mN/m,damping=1uN*s/m"),
        ("--load", "stiffness=1mN/m"),
        ("--samples", "11"),
        ("--step", "10s"),
        ("--accuracy", "1e-5"),
        ("--with-energy",),
        ("--check",),
        ("--check", "--beam", "static"),
    ],
    ids=" ".join,
)
def test_simulate_options(run: Run, options: tuple[str, ...]) -> None:
    done = run(*SIMULATE, *options, "--out", "run.csv")
    assert done.code == 0, done.err
    table = columns(Path("run.csv"))
    assert ("energy_J" in table) == ("--with-energy" in options)
    assert len(table["time_s"]) == (11 if {"--samples", "--step"} & set(options) else 601)
    assert ("largest difference / maximum" in done.out) == ("--check" in options)
    if "clamped" in options:
        assert not table["displacement_m"].any()
        assert table["force_N"][-1] == pytest.approx(0.1751e-6, rel=0.02)


@pytest.mark.parametrize(
    "drive",
    ["step:4V", "square:4V,30s", "square:-4V..4V,30s,0.25", "sine:2V,0.1Hz", "ramp:1V/min", "file:drive.csv"],
)
def test_simulate_every_drive(run: Run, drive: str) -> None:
    Path("drive.csv").write_text("time_s,voltage_V\n0,0\n10,1\n20,1\n30,-1\n")
    done = run(
        "simulate", "paper", "--drive", drive, "--duration", "60s", "--samples", "61", "--check", "--out", "run.csv"
    )
    assert done.code == 0, done.err
    assert columns(Path("run.csv"))["time_s"][-1] == 60.0


def test_the_beam_is_the_one_that_the_coupling_was_fitted_with(run: Run) -> None:
    assert PAPER.coupling is not None
    fitted = replace(PAPER, coupling=replace(PAPER.coupling, beam="static"))
    save_actuator(fitted, "fitted.toml")
    drive = ("--drive", "step:1V", "--duration", "10s")
    assert "static beam" in run("simulate", "fitted.toml", *drive).out
    assert "dynamic beam" in run("simulate", "fitted.toml", *drive, "--beam", "dynamic").out
    assert (
        "dynamic beam" in run("simulate", "fitted.toml", *drive, "--load", "mass=1mg").out
    )  # which moves with the tip
    assert "dynamic beam" in run("simulate", "paper", *drive).out
    text = Path("fitted.toml").read_text(encoding="utf-8")
    Path("odd.toml").write_text(text.replace('"static"', '"stiff"'), encoding="utf-8")
    assert_one_line(run("show", "odd.toml"), "coupling.beam is 'stiff'; choose one of dynamic, static")


def test_simulate_draws(run: Run) -> None:
    assert run(*SIMULATE, "--samples", "31", "--plot", "run.png").code == 0
    assert Path("run.png").read_bytes().startswith(b"\x89PNG")


def test_simulate_without_out_only_prints(run: Run, tmp_path: Path) -> None:
    assert run(*SIMULATE, "--samples", "31").code == 0
    assert list(tmp_path.iterdir()) == []


def test_simulate_a_file(run: Run) -> None:
    Path("strip.toml").write_text(dumps(PAPER))
    run("simulate", "strip.toml", *SIMULATE[2:], "--out", "a.csv")
    run(*SIMULATE, "--out", "b.csv")
    assert Path("a.csv").read_text() == Path("b.csv").read_text()


def test_simulate_without_coupling_leaves_blanks(run: Run) -> None:
    text = dumps(PAPER)
    Path("strip.toml").write_text(text[: text.index("[coupling]")])
    done = run("simulate", "strip.toml", *SIMULATE[2:], "--samples", "3", "--out", "run.csv")
    assert done.code == 0
    assert [row.split(",")[3:5] for row in Path("run.csv").read_text().splitlines()[1:]] == [["", ""]] * 3


def test_an_old_result_is_replaced_whole(run: Run) -> None:
    Path("run.csv").write_text("old\n" * 10000)
    assert run(*SIMULATE, "--samples", "3", "--out", "run.csv").code == 0
    assert len(Path("run.csv").read_text().splitlines()) == 4


def test_json_is_alone_on_stdout_beside_a_check(run: Run) -> None:
    done = run(
        "simulate", "paper", "--drive", "step:4V", "--duration", "20s", "--samples", "5", "--check", "--json", "-"
    )
    assert done.code == 0, done.err
    assert json.loads(done.out)["provenance"]
    assert "largest difference / maximum" in done.err


def test_a_run_that_ends_on_an_edge_passes_its_own_check(run: Run) -> None:
    done = run(
        "simulate", "paper", "--drive", "square:4V,30s", "--duration", "45s", "--samples", "91", "--check"
    )  # fmt: skip
    assert done.code == 0, done.err
