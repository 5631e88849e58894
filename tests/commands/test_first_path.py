"""From a CSV file of one's own to a fitted strip, picture, table and report: four commands, and no file is edited."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import Run, columns

from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator


def test_four_commands(run: Run) -> None:
    noise = np.random.default_rng(7)
    time = np.arange(0.0, 150.0, 1.0)
    on, since = time >= 20.5, np.maximum(time - 20.5, 0.0)
    current = np.where(on, 3 / 650 + 3 / 22 * np.exp(-since / 6.5), 0.0) + noise.normal(0, 2e-4, time.size)
    table = np.column_stack([time, 3.0 * on, 1e3 * current])
    header = "time (s),Potential (V),I/mA"
    np.savetxt("step.csv", table, delimiter=",", header=header, comments="", fmt="%.5g")
    commands = (
        "doctor",
        "new strip.toml --length 35mm --free-length 30mm --width 5mm --thickness 0,5mm --youngs-modulus 8kPa",
        "identify step.csv --actuator strip.toml --engine exact --model rc",
        "simulate step.fit/fitted.toml --drive square:-2V..2V,60s --duration 120s --out run.csv --plot run.png",
    )
    for command in commands:
        done = run(*command.split())
        assert done.code == 0, done.err
    made = {path.name for path in Path("step.fit").iterdir()}
    assert made >= {"fitted.toml", "fit.json", "fit.png", "report.html", "parameters.csv"}
    port = lumped_elements(load_actuator("step.fit/fitted.toml")).port
    assert port.dc_resistance == pytest.approx(650, rel=0.03)
    assert port.branches[0][0] == pytest.approx(22, rel=0.03)
    assert load_actuator("step.fit/fitted.toml").name == "strip"
    assert Path("run.png").is_file()
    assert columns(Path("run.csv"))["current_A"].max() == pytest.approx(4 / 22, rel=0.1)
