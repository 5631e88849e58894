"""Counts, seeds and quantities have limits, stated in one line before any work."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import SIMULATE, Run, assert_one_line

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import dumps

SWEEP = ("sweep", "paper", "--drive", "step:4V", "--duration", "10s", "--out", "s.nc")
LONG = "9" * 5000
WRONG = {
    "seed below zero": (*SWEEP, "--vary", "thickness=0.2mm:1mm", "--random", "4", "--seed", "-1"),
    "seed of a design": ("design", "paper", "--drive", "step:4V", "--duration", "10s", "--seed", "-1"),
    "seed of a search": ("arm", "--duration", "1s", "--out", "a.nc", "--seed", LONG),
    "many designs": (*SWEEP, "--vary", "thickness=0.2mm:1mm:10000000000"),
    "very many designs": (*SWEEP, "--vary", f"thickness=0.2mm:1mm:{LONG}"),
    "a name too long for a file": ("sweep", "x" * 3000, *SWEEP[2:], "--vary", "thickness=0.2mm:1mm:2"),
    "many random designs": (*SWEEP, "--vary", "thickness=0.2mm:1mm", "--random", "10000000000"),
    "many samples": (*SIMULATE, "--samples", "10000000000"),
    "long number of samples": (*SIMULATE, "--samples", LONG),
    "long voltage": ("simulate", "paper", "--drive", f"step:{LONG}V", "--duration", "1s"),
    "many neurons": ("cpg", "--neurons", LONG[:4000], "--duration", "1s"),
    "many segments": ("arm", "--duration", "1s", "--out", "a.nc", "--segments", "1000000000"),
    "many points": ("impedance", "paper", "--from", "1Hz", "--to", "2Hz", "--points", LONG[:4000]),
    "accuracy": (*SIMULATE, "--accuracy", "1e-300"),
    "number": ("cpg", "--duration", "1s", "--tonic", "1e308"),
    "not a number": ("cpg", "--duration", "1s", "--tonic", "nan"),
    "frequency": ("simulate", "paper", "--drive", "sine:1V,5e-324Hz", "--duration", "1s"),
    "band": ("impedance", "paper", "--from", "5e-324Hz", "--to", "1Hz"),
    "duration": ("simulate", "paper", "--drive", "step:1V", "--duration", "1e300s"),
    "step": (*SIMULATE, "--step", "1e-320s"),
    "voltage": ("simulate", "paper", "--drive", "step:1e300V", "--duration", "1s"),
    "load": (*SIMULATE, "--load", "mass=1e300kg"),
    "blanks": ("design", "paper", "--drive", "step:4V", "--duration", "10s", "--require", "a>=1" + " " * 60_000 + "x"),
    "blanks in a quantity": ("simulate", "paper", "--drive", "step:1" + " " * 60_000 + "V", "--duration", "1s"),
}


@pytest.mark.parametrize("arguments", WRONG.values(), ids=WRONG)
def test_limits(run: Run, arguments: tuple[str, ...]) -> None:
    done = run(*arguments)
    assert_one_line(done)
    assert len(done.err) < 2100


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("thickness", "1e-300 mm"),
        ("length", "1e300 m"),
        ("natural_frequency", "1e308 rad/s"),
        ("youngs_modulus", "1e30 Pa"),
        ("permittivity", "1e-300 F/m"),
        ("dc_resistivity", "1e-320 ohm m"),
        ("gain", "1e300 m/(V s)"),
    ],
)
def test_a_strips_quantities_have_a_plausible_size(run: Run, key: str, value: str) -> None:
    lines = dumps(PAPER).splitlines()
    text = "\n".join(f'{key} = "{value}"' if line.startswith(f"{key} =") else line for line in lines)
    Path("strip.toml").write_text(text, encoding="utf-8")
    assert_one_line(run("show", "strip.toml"), key, "give a size from", " to ")
