"""The commands that read the port: impedance, sense, and simulate with every model; and how they refuse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from every_model import MODELS, strip_of

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import dumps


def test_impedance_writes_the_contract(run: Run) -> None:
    done = run("impedance", "paper", "--from", "1mHz", "--to", "10Hz", "--points", "9", "--check", "--out", "z.csv")
    assert done.code == 0, done.err
    table = columns(Path("z.csv"))
    assert list(table) == ["frequency_Hz", "re_ohm", "im_ohm"]
    s = 2j * np.pi * table["frequency_Hz"]
    expected = 1 / (0.006 / 4 + 1 / (4 / 0.2058 + 1 / (0.35 * s)))
    assert table["re_ohm"] + 1j * table["im_ohm"] == pytest.approx(expected, rel=1e-8)
    assert "exact engine" in done.out
    assert "closed form" in done.out


@pytest.mark.parametrize("terminals", ["open", "short"])
def test_sense_writes_its_columns(run: Run, terminals: str) -> None:
    more = ("--terminals", terminals, "--samples", "7", "--out", "s.csv", "--plot", "s.png")
    done = run("sense", "paper", "--motion", "step:1mm", "--duration", "60s", *more)
    assert done.code == 0, done.err
    table = columns(Path("s.csv"))
    assert list(table) == ["time_s", "displacement_m", "voltage_V", "current_A", "force_N", "charge_C"]
    assert (table["displacement_m"] == 1e-3).all()
    assert table["voltage_V"].any() == (terminals == "open")
    assert Path("s.png").stat().st_size > 1000


@pytest.mark.parametrize("model", MODELS)
def test_simulate_every_model(run: Run, model: str) -> None:
    small = {"band": (1e-3, 10.0), "sections": 8} if model.startswith(("warburg", "cpe")) else {}
    Path("a.toml").write_text(dumps(strip_of(model, **small)))
    done = run("simulate", "a.toml", "--drive", "step:2V", "--duration", "30s", "--samples", "16", "--out", "r.csv")
    assert done.code == 0, done.err
    assert columns(Path("r.csv"))["charge_C"][-1] > 0


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ('diffusion_time = "5 s"\nladder_sections = 0.0', "material.ladder_sections is 0"),
        ("cpe_exponent = 1.0", "cpe_exponent is 1; it must be less than 1"),
        ('diffusion_time = "5 s"\ncpe_exponent = 0.5', "more than one ion path"),
        ('diffusion_time = "-5 s"', "it must be more than zero"),
    ],
)
def test_files_that_are_refused(run: Run, line: str, hint: str) -> None:
    Path("bad.toml").write_text(dumps(PAPER).replace("[material]", f"[material]\n{line}"))
    assert_one_line(run("impedance", "bad.toml", "--out", "z.csv"), hint, "bad.toml")
    assert not Path("z.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("impedance", "paper", "--from", "0Hz"), "above zero"),
        (("impedance", "paper", "--from", "1Hz", "--to", "1mHz"), "the lower one first"),
        (("impedance", "paper", "--points", "1"), "give 2 to 100000"),
        (("impedance", "paper", "--bias", "nan V"), "--bias"),
        (("impedance", "paper", "--bias", "1mm"), "does not measure"),
        (("impedance", "narrow.toml"), "beyond the ladder's band"),
        (("impedance", "paper", "--load", "mass=-1g"), "must be zero or more"),
        (("sense", "paper", "--motion", "step:1V", "--duration", "1s"), "does not measure"),
        (("sense", "deaf.toml", "--motion", "step:1mm", "--duration", "1s"), "it cannot sense"),
        (("identify", "d.csv", "--model", "rc9"), "rc9"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(run: Run, arguments: tuple[str, ...], hint: str) -> None:
    Path("narrow.toml").write_text(dumps(strip_of("warburg", band=(1e-2, 10.0))))
    Path("deaf.toml").write_text(dumps(strip_of("rc")).split("[coupling]")[0])
    rows = "".join(f"{t},1,{np.exp(-t) + 0.1}\n" for t in range(20))
    Path("d.csv").write_text("time_s,voltage_V,current_A\n" + rows)
    assert_one_line(run(*arguments, "--out", "out"), hint)
    assert not Path("out").exists()
