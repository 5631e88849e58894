"""What holds for every registered form of drive: its examples are drives, errors and help show them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command import Run

from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import DRIVE_FORMS, FORMS, MOTION_FORMS, Form, parse_drive

DURATION = 60.0


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize(("k", "unit", "column"), [(0, "V", "voltage_V"), (1, "m", "position_mm")])
def test_its_examples_are_drives(form: Form, k: int, unit: str, column: str, run: Run) -> None:
    for name in ("drive.csv", "motion.csv"):
        Path(name).write_text(f"time_s,{column}\n0,1\n1,2\n")
    for example in form.examples[k].replace("[,duty]", ",0.5").split(", "):
        assert example.startswith(f"{form.name}:")
        drive = parse_drive(example, DURATION, unit)
        assert np.isfinite(drive.value(np.linspace(0, DURATION, 7))).all()
        assert drive.largest() > 0


@pytest.mark.parametrize(("unit", "forms"), [("V", DRIVE_FORMS), ("m", MOTION_FORMS)])
def test_errors_name_every_form(unit: str, forms: str) -> None:
    assert all(f"{form.name}:" in forms for form in FORMS)
    with pytest.raises(InputError, match=re.escape(forms)):
        parse_drive("triangle:1V", DURATION, unit)


@pytest.mark.parametrize(
    ("command", "forms"), [("simulate", DRIVE_FORMS), ("sweep", DRIVE_FORMS), ("sense", MOTION_FORMS)]
)
def test_help_names_every_form(command: str, forms: str, run: Run) -> None:
    assert "".join(forms.split()) in "".join(run(command, "--help").out.split())


def test_a_file_s_name_may_hold_commas(run: Run) -> None:
    Path("a, b.csv").write_text("time_s,voltage_V\n0,1\n1,2\n")
    assert parse_drive("file:a, b.csv", DURATION).value([0.0, 0.5]).tolist() == [1.0, 1.5]
