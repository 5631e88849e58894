"""What a data file does not tell of itself, said on the command line: the same options wherever data are read."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

import pytest
from command import Run, assert_one_line

STEP = "".join(
    f"{k},{4 * (k > 3)},{(k > 3) * (0.0066 + 0.2 * math.exp(-k / 9)):.6g},{math.sin(k / 4):.6g}\n" for k in range(60)
)
SPECTRUM = [(f, 20 + 600 / (1 + 2j * math.pi * f * 10)) for f in (10 ** (k / 5 - 3) for k in range(20))]
SWEEP = "".join(f"{f:.6g},{z.real + 0.01 * math.sin(9 * k):.6g},{z.imag:.6g}\n" for k, (f, z) in enumerate(SPECTRUM))
PULL = "".join(f"{k / 20},{k * 0.0185:.6g}\n" for k in range(30))

pytestmark = pytest.mark.usefixtures("drafts")
RUNS = {
    "identify": ("f,Zreal,Zimag\n" + SWEEP, ("identify", "data.csv", "--model", "rc")),
    "drive": (
        "Clock,Bias,signal,x\n" + STEP,
        ("simulate", "paper", "--drive", "file:data.csv", "--duration", "9s", "--samples", "5", "--engine", "exact"),
    ),
    "motion": (
        "Clock,a,signal,tip\n" + STEP,
        ("sense", "paper", "--motion", "file:data.csv", "--duration", "9s", "--samples", "5", "--engine", "exact"),
    ),
    "ogden": ("eps,sigma\n" + PULL, ("ogden", "--uniaxial", "data.csv", "--terms", "1")),
}


@pytest.mark.parametrize("name", RUNS)
def test_the_options_that_a_refusal_shows_work_when_pasted(name: str, run: Run, tmp_path: Path) -> None:
    text, command = RUNS[name]
    Path("data.csv").write_text(text)
    refused = run(*command)
    assert_one_line(refused, "if so: --")
    done = run(*command, *shlex.split(refused.err.partition("if so: ")[2]))
    assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--columns", "voltage=none"], "there is no column 'none'"),
        (["--columns", "volts=Bias"], "quantities are time, voltage"),
        (["--units", "time"], "write it like voltage=mV"),
        (["--part", "2"], "no part 2; it holds 1 measurement"),
        (["--part", "0"], "part is 0; count from 1"),
        (["--cycle", "1"], "no column of cycles"),
    ],
)
def test_what_cannot_be_said_is_one_line(options: list[str], said: str, run: Run, tmp_path: Path) -> None:
    Path("data.csv").write_text("time_s,voltage_V,current_A,displacement_mm\n" + STEP)
    assert_one_line(run("identify", "data.csv", *options), said)


def test_sizes_of_a_specimen_on_the_command_line(run: Run, tmp_path: Path) -> None:
    Path("pull.csv").write_text("extension_mm,force_N\n" + "".join(f"{2 * k},{k * 0.0185:.6g}\n" for k in range(30)))
    assert_one_line(run("ogden", "--uniaxial", "pull.csv"), "--length 20mm")
    assert_one_line(run("ogden", "--uniaxial", "pull.csv", "--length", "40mm"), "--section 10mm^2")
    assert_one_line(run("ogden", "--uniaxial", "pull.csv", "--length", "40"), "has no unit")
    done = run("ogden", "--uniaxial", "pull.csv", "--length", "40mm", "--section", "5mm^2", "--terms", "1")
    assert done.code == 0, done.err
